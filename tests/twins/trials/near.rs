//! The vertices near each, of parts in heaps, on lattices and far apart.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::near_vertices::{MOST_COMPARED, NEAREST, NearVertices, cell_of};
use coarsen::kernel::rows::{BORDER, Position, Site};

use super::inputs::Random;
use super::{Seen, Trial};

pub const TRIALS: [Trial; 1] = [Trial { name: "near_vertices", run: near_vertices }];

/// Vertices and how far they look.
struct Case {
    name: &'static str,
    positions: Vec<Position>,
    /// Vertices a component.
    part: u32,
    per_unit: f32,
    reach: f32,
}

fn cases() -> Vec<Case> {
    let mut random = Random::new();
    let mut heap = |count: usize, side: f32| -> Vec<Position> {
        let mut vertex = |i: usize| Position {
            x: side * random.centered(),
            y: side * random.centered(),
            z: 0.1 * side * random.centered(),
            flags: if i.is_multiple_of(3) { BORDER } else { 0 },
        };
        (0..count).map(&mut vertex).collect()
    };
    let (sparse, dense, crowd) = (heap(1000, 30.0), heap(800, 4.0), heap(MOST_COMPARED as usize + 500, 0.5));
    let specks = heap(300, 1e-30);
    let lattice =
        |i: u32| Position { x: (i % 10) as f32 - 5.0, y: (i / 10 % 10) as f32 - 5.0, z: (i / 100) as f32, flags: 0 };
    let far = |i: u32| Position { x: (i as f32 - 100.0) * 3e35, y: -1e-40, z: i as f32, flags: BORDER };
    vec![
        Case { name: "sparse", positions: sparse, part: 7, per_unit: 0.5, reach: 2.0 },
        Case { name: "dense", positions: dense, part: 100, per_unit: 1.0, reach: 0.9 },
        Case { name: "crowd", positions: crowd, part: 50, per_unit: 0.0625, reach: 10.0 },
        Case { name: "specks", positions: specks, part: 3, per_unit: 16.0, reach: 0.05 },
        Case { name: "lattice", positions: (0..1000).map(lattice).collect(), part: 2, per_unit: 0.5, reach: 1.5 },
        Case { name: "far", positions: (0..200).map(far).collect(), part: 9, per_unit: 0.25, reach: 3.0 },
    ]
}

fn near_vertices(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for case in cases() {
        let Case { name, positions, part, per_unit, reach } = case;
        seen.input(name);
        let cell = |v: u32| {
            let Site { x, y, z } = cell_of(positions[v as usize], per_unit);
            [x, y, z]
        };
        let count = positions.len() as u32;
        let mut members: Vec<u32> = (0..count).collect();
        members.sort_by_key(|&v| (cell(v), v));
        let mut cells: Vec<[u32; 3]> = members.iter().map(|&v| cell(v)).collect();
        cells.dedup();
        let starts = cells.iter().map(|at| members.partition_point(|&v| cell(v) < *at) as u32).chain([count]);
        let cell_starts = queue.buffer_from(starts.collect())?;
        let cell_count = cells.len() as u32;
        let cells = queue.buffer_from(cells.into_iter().map(|[x, y, z]| Site { x, y, z }).collect())?;
        let members = queue.buffer_from(members)?;
        // One vertex of a case belongs to another part.
        let odd = perturbed && name == "dense";
        let component = |v: u32| if odd && v == 1 { count } else { v / part };
        let components = queue.buffer_from((0..count).map(component).collect())?;
        let positions = queue.buffer_from(positions)?;
        let mut near = queue.buffer((NEAREST * count) as usize)?;
        seen.run(
            queue,
            NearVertices {
                positions: &positions,
                components: &components,
                cells: &cells,
                cell_count,
                cell_starts: &cell_starts,
                members: &members,
                vertex_count: count,
                per_unit,
                reach_sq: reach * reach,
                near: &mut near,
            },
        )?;
        seen.output(queue, "near", &near)?;
    }
    Ok(())
}
