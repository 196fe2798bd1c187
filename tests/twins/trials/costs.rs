//! A round's pairs, sums and costs.

use coarsen::Result;
use coarsen::backend::{Buffer, Queue};
use coarsen::kernel::count_pairs::CountPairs;
use coarsen::kernel::face_normals::FaceNormals;
use coarsen::kernel::gather_pairs::GatherPairs;
use coarsen::kernel::pair_quadric::{ANYWHERE, AT_ENDS, AT_THREE};
use coarsen::kernel::pairs::{PAIR_BLOCK, half_edge_corners};
use coarsen::kernel::plane_costs::PlaneCosts;
use coarsen::kernel::plane_sums::PlaneSums;
use coarsen::kernel::rows::{CORNER, Face, HUB, LOCKED, Position, SEAM};
use coarsen::kernel::triangle_costs::TriangleCosts;
use coarsen::kernel::volume_costs::{BORDER_FACTOR, VolumeCosts};
use coarsen::kernel::volume_sums::VolumeSums;

use super::inputs::{Round, flip, rounds, scanned};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 8] = [
    Trial { name: "count_pairs", run: count_pairs },
    Trial { name: "gather_pairs", run: gather_pairs },
    Trial { name: "face_normals", run: face_normals },
    Trial { name: "volume_sums", run: volume_sums },
    Trial { name: "volume_costs", run: volume_costs },
    Trial { name: "plane_sums", run: plane_sums },
    Trial { name: "plane_costs", run: plane_costs },
    Trial { name: "triangle_costs", run: triangle_costs },
];

/// The live mesh on a queue's device.
struct Mesh {
    positions: Buffer<Position>,
    faces: Buffer<Face>,
    ring_starts: Buffer<u32>,
    ring_faces: Buffer<u32>,
}

impl Mesh {
    fn new(queue: &mut Queue, round: &Round, positions: Vec<Position>) -> Result<Self> {
        Ok(Self {
            positions: queue.buffer_from(positions)?,
            faces: queue.buffer_from(round.faces.clone())?,
            ring_starts: queue.buffer_from(round.ring_starts.clone())?,
            ring_faces: queue.buffer_from(round.ring_faces.clone())?,
        })
    }
}

/// The positions; perturbed, both ends of a pair are locked.
fn with_a_lock(round: &Round, perturbed: bool) -> Vec<Position> {
    let mut positions = round.positions.clone();
    let ends = round.pairs.iter().map(|pair| half_edge_corners(pair.half_edge, &round.faces));
    let locked = |vertex: u32| round.positions[vertex as usize].flags & LOCKED != 0;
    if let Some([_, free, _]) = ends.into_iter().find(|&[u, w, _]| perturbed && locked(u) && !locked(w)) {
        positions[free as usize].flags ^= LOCKED;
    }
    positions
}

/// The positions; perturbed, one bit of a coordinate is another.
fn with_a_shift(round: &Round, perturbed: bool) -> Vec<Position> {
    let mut positions = round.positions.clone();
    flip(&mut positions[round.faces[0].a as usize].x, perturbed);
    positions
}

/// How many pairs the vertices of every block list.
fn pair_counts(round: &Round) -> Vec<u32> {
    let mut counts = vec![0; round.positions.len().div_ceil(PAIR_BLOCK as usize)];
    for pair in &round.pairs {
        let [u, w, _] = half_edge_corners(pair.half_edge, &round.faces);
        counts[(u.min(w) / PAIR_BLOCK) as usize] += 1;
    }
    counts
}

fn count_pairs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mesh = Mesh::new(queue, round, with_a_lock(round, perturbed))?;
        let Mesh { positions, faces, ring_starts, ring_faces } = &mesh;
        let vertex_count = round.positions.len() as u32;
        let (special, face_count) = (round.special(), round.faces.len() as u32);
        // It adds to what is there.
        let counts = &mut queue.buffer_from((0..pair_counts(round).len() as u32).collect())?;
        seen.run(
            queue,
            CountPairs { positions, faces, ring_starts, ring_faces, vertex_count, special, face_count, counts },
        )?;
        seen.output(queue, "counts", counts)?;
    }
    Ok(())
}

fn gather_pairs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mesh = Mesh::new(queue, round, with_a_lock(round, perturbed))?;
        let Mesh { positions, faces, ring_starts, ring_faces } = &mesh;
        let vertex_count = round.positions.len() as u32;
        let starts = &queue.buffer_from(scanned(&pair_counts(round)))?;
        let (special, pairs) = (round.special(), &mut queue.buffer(round.pairs.len())?);
        seen.run(
            queue,
            GatherPairs { positions, faces, ring_starts, ring_faces, vertex_count, special, starts, pairs },
        )?;
        seen.output(queue, "pairs", pairs)?;
    }
    Ok(())
}

fn face_normals(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mesh = Mesh::new(queue, round, with_a_shift(round, perturbed))?;
        let face_count = round.faces.len() as u32;
        let normals = &mut queue.buffer(round.faces.len())?;
        seen.run(queue, FaceNormals { positions: &mesh.positions, faces: &mesh.faces, face_count, normals })?;
        seen.output(queue, "normals", normals)?;
    }
    Ok(())
}

fn volume_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut normals = round.normals.clone();
        flip(&mut normals[0].x, perturbed);
        let mesh = Mesh::new(queue, round, round.positions.clone())?;
        let Mesh { positions, faces, ring_starts, ring_faces } = &mesh;
        let normals = &queue.buffer_from(normals)?;
        let vertex_count = round.positions.len() as u32;
        let sums = &mut queue.buffer(round.positions.len())?;
        let borders = &mut queue.buffer(round.border_sums.len())?;
        seen.run(
            queue,
            VolumeSums { positions, faces, ring_starts, ring_faces, normals, vertex_count, sums, borders },
        )?;
        seen.output(queue, "sums", sums)?;
        seen.output(queue, "borders", borders)?;
    }
    Ok(())
}

/// The positions of a round, every fifth on a seam and every third of these where seams meet.
fn on_seams(round: &Round) -> Vec<Position> {
    let flags = |vertex: usize| match (vertex.is_multiple_of(5), vertex.is_multiple_of(3)) {
        (true, true) => SEAM | CORNER,
        (true, false) => SEAM,
        _ => 0,
    };
    let with_flags =
        |(vertex, position): (usize, &Position)| Position { flags: position.flags | flags(vertex), ..*position };
    round.positions.iter().enumerate().map(with_flags).collect()
}

fn volume_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut sums = round.volume_sums.clone();
        let positions = on_seams(round);
        // Where no end is held, the place depends on its sums and not only the cost.
        let is_free = |vertex: &u32| positions[*vertex as usize].flags == 0;
        let mut ends = round.pairs.iter().map(|pair| half_edge_corners(pair.half_edge, &round.faces));
        let first = ends.clone().next();
        let [end, ..] = ends.find(|[u, w, _]| [u, w].into_iter().all(is_free)).or(first).expect("a pair");
        flip(&mut sums[end as usize].zz, perturbed);
        let mesh = Mesh::new(queue, round, positions)?;
        let Mesh { positions, faces, .. } = &mesh;
        let normals = &queue.buffer_from(round.normals.clone())?;
        let sums = &queue.buffer_from(sums)?;
        let borders = &queue.buffer_from(round.border_sums.clone())?;
        let pairs = &queue.buffer_from(round.pairs.clone())?;
        let pair_count = round.pairs.len() as u32;
        for placement in 0..4 {
            let keys = &mut queue.buffer(round.pairs.len())?;
            seen.run(
                queue,
                VolumeCosts {
                    positions,
                    faces,
                    normals,
                    sums,
                    borders,
                    pairs,
                    pair_count,
                    border_weight: BORDER_FACTOR,
                    placement,
                    keys,
                },
            )?;
            seen.output(queue, "keys", keys)?;
        }
    }
    Ok(())
}

fn plane_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut normals = round.normals.clone();
        flip(&mut normals[0].x, perturbed);
        let mesh = Mesh::new(queue, round, round.positions.clone())?;
        let Mesh { positions, faces, ring_starts, ring_faces } = &mesh;
        let normals = &queue.buffer_from(normals)?;
        let vertex_count = round.positions.len() as u32;
        let border_weight = 0.7;
        for by_area in [1, 0] {
            let quadrics = &mut queue.buffer(round.positions.len())?;
            seen.run(
                queue,
                PlaneSums {
                    positions,
                    faces,
                    ring_starts,
                    ring_faces,
                    normals,
                    vertex_count,
                    border_weight,
                    by_area,
                    quadrics,
                },
            )?;
            seen.output(queue, "quadrics", quadrics)?;
        }
    }
    Ok(())
}

fn plane_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut quadrics = round.quadrics.clone();
        let [end, ..] = half_edge_corners(round.pairs[0].half_edge, &round.faces);
        flip(&mut quadrics[end as usize].c, perturbed);
        let positions = &queue.buffer_from(round.positions.clone())?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let quadrics = &queue.buffer_from(quadrics)?;
        let pairs = &queue.buffer_from(round.pairs.clone())?;
        let pair_count = round.pairs.len() as u32;
        for placement in 0..4 {
            let keys = &mut queue.buffer(round.pairs.len())?;
            seen.run(queue, PlaneCosts { positions, faces, quadrics, pairs, pair_count, placement, keys })?;
            seen.output(queue, "keys", keys)?;
        }
    }
    Ok(())
}

fn triangle_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut quadrics = round.quadrics.clone();
        let is_free = |v: u32| round.positions[v as usize].flags & (LOCKED | HUB) == 0;
        let free = round.faces.iter().find(|face| face.is_live() && face.corners().into_iter().all(is_free));
        let corner = free.map_or(0, |face| face.a as usize);
        flip(&mut quadrics[corner].c, perturbed);
        let positions = &queue.buffer_from(round.positions.clone())?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let quadrics = &queue.buffer_from(quadrics)?;
        let face_count = round.faces.len() as u32;
        for placement in [ANYWHERE, AT_THREE, AT_ENDS] {
            let triangles = &mut queue.buffer(round.faces.len())?;
            let keys = &mut queue.buffer(round.faces.len())?;
            seen.run(queue, TriangleCosts { positions, faces, quadrics, face_count, placement, triangles, keys })?;
            seen.output(queue, "triangles", triangles)?;
            seen.output(queue, "keys", keys)?;
        }
    }
    Ok(())
}
