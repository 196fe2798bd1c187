//! Vertex clustering as tests run it, and what every result must satisfy, by the definitions.

use std::collections::{BTreeMap, BTreeSet};

use coarsen::backend::Device;
use coarsen::cluster::{Options, Representative};
use coarsen::math::DVec3;
use coarsen::mesh::{SAMPLES, sample};
use coarsen::simplify::MOVED;
use coarsen::{Budget, Mesh, Method, Outcome, Result, simplify};

use super::engine::cpu;
use super::shapes::{bumpy, sphere};

/// Every representative.
pub const ALL: [Representative; 3] = [Representative::Quadric, Representative::Mean, Representative::Input];

/// Clusters.
pub fn run(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Result<Outcome> {
    simplify(mesh, &Method::Cluster(options.clone()), &budget, device, None)
}

/// Options with this representative and the grid from the budget.
pub fn with(representative: Representative) -> Options {
    Options { representative, ..Options::default() }
}

/// Clusters on a grid of this many cells.
pub fn on_grid(mesh: &Mesh, cells: u32, representative: Representative) -> Outcome {
    let options = Options { grid: Some(cells), representative, ..Options::default() };
    run(&cpu(1), mesh, &options, Budget::default()).expect("a valid mesh and grid")
}

/// The cells of a result, found without the library: about the lowest corner of the vertices that faces use.
pub struct Cells {
    low: DVec3,
    pub side: f64,
}

impl Cells {
    pub fn new(input: &Mesh, outcome: &Outcome) -> Self {
        let corners = || input.faces.iter().flatten().map(|&v| input.positions[v as usize]);
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        Self { low, side: outcome.cell_size.expect("the side of a cell") }
    }

    pub fn of(&self, p: DVec3) -> [i64; 3] {
        // Halves: the difference of two finite numbers may not be.
        (((p * 0.5 - self.low * 0.5) / self.side) * 2.0).floor().to_array().map(|at| at as i64)
    }

    /// Whether `p` lies in the closed cell, but for the rounding of a coordinate.
    pub fn hold(&self, cell: [i64; 3], p: DVec3) -> bool {
        let at = (p * 0.5 - self.low * 0.5) / self.side * 2.0;
        let slack = 1e-15 * (p.abs().max_element().max(self.low.abs().max_element()) / self.side) + 1e-12;
        at.to_array().into_iter().zip(cell).all(|(at, cell)| {
            let cell = cell as f64;
            at >= cell - slack && at <= cell + 1.0 + slack
        })
    }
}

/// What must hold of any result.
pub fn assert_clustered(name: &str, input: &Mesh, outcome: &Outcome) {
    let mesh = &outcome.mesh;
    mesh.check().unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(mesh.positions.len(), outcome.vertex_origin.len(), "{name}");
    assert_eq!(mesh.colors.is_some(), input.colors.is_some(), "{name}");
    assert!(!mesh.faces.is_empty() && outcome.rounds.is_empty(), "{name}");
    assert!(outcome.error_estimate >= 0.0 && outcome.error_estimate.is_finite(), "{name}: {}", outcome.error_estimate);
    for (p, &origin) in mesh.positions.iter().zip(&outcome.vertex_origin) {
        assert!(origin == MOVED || input.positions[origin as usize] == *p, "{name}: {p} does not come from {origin}");
    }
    let used: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    assert_eq!(used.len(), mesh.positions.len(), "{name}: vertices without a face");
    let sets: BTreeSet<[u32; 3]> = mesh.faces.iter().map(sorted).collect();
    assert!(sets.iter().all(|[a, b, c]| a < b && b < c), "{name}: a face with a repeated corner");
    assert_eq!(sets.len(), mesh.faces.len(), "{name}: faces on the same three cells");

    // It lies in a cell that has vertices, and none of them is farther than the diagonal.
    let cells = Cells::new(input, outcome);
    let diagonal = 3_f64.sqrt() * cells.side * (1.0 + 1e-9);
    let members = input.faces.iter().flatten().map(|&v| input.positions[v as usize]);
    let by_cell: BTreeMap<[i64; 3], DVec3> = members.map(|p| (cells.of(p), p)).collect();
    for &p in &mesh.positions {
        let at = cells.of(p);
        // One on a side of its cell may be counted to the next one.
        let near = (0..27).map(|i| [at[0] + i / 9 - 1, at[1] + i / 3 % 3 - 1, at[2] + i % 3 - 1]);
        let mut own = near.filter(|&cell| cells.hold(cell, p)).filter_map(|cell| by_cell.get(&cell));
        let member = own.next().unwrap_or_else(|| panic!("{name}: {p} lies in a cell without vertices, {at:?}"));
        let way = ((*member * 0.5 - p * 0.5) / diagonal).length() * 2.0;
        assert!(way <= 1.0, "{name}: {p} is {way} diagonals away");
    }
}

fn sorted(face: &[u32; 3]) -> [u32; 3] {
    let mut face = *face;
    face.sort_unstable();
    face
}

/// Closed, open, many parts, soups, broken; at most a few thousand faces.
pub fn meshes() -> Vec<(String, Mesh)> {
    let mut all: Vec<(String, Mesh)> =
        SAMPLES.iter().map(|&(name, ..)| (name.into(), sample(name, Some(6000)).expect("a sample"))).collect();
    let mut add = |name: &str, mesh: Mesh| all.push((name.into(), mesh));
    add("sphere", sphere(5));
    add("soup", soup(&bumpy(sphere(4), 0.1)));
    add("far away", moved(&bumpy(sphere(4), 0.1), |p| p * 1e-3 + 1e5));
    add("tiny", moved(&bumpy(sphere(4), 0.1), |p| p * 1e-200));
    add("huge", moved(&bumpy(sphere(4), 0.1), |p| p * 1e307));
    add("thin", moved(&bumpy(sphere(4), 0.1), |p| p * DVec3::new(1.0, 0.6, 0.3)));
    let mut turned = bumpy(sphere(4), 0.1);
    turned.faces.iter_mut().step_by(3).for_each(|face| face.swap(0, 1));
    add("turned", turned);
    let mut broken = sample("part", Some(3000)).expect("a sample");
    let count = broken.positions.len() as u32;
    broken
        .faces
        .iter_mut()
        .enumerate()
        .filter(|(f, _)| f % 13 == 0)
        .for_each(|(f, face)| face[1] = f as u32 * 7 % count);
    broken.faces.extend((0..50).map(|f| [f, f, f + 1]));
    broken.positions.push(DVec3::splat(1e9));
    add("broken", broken);
    all
}

/// The faces each with corners of its own.
pub fn soup(mesh: &Mesh) -> Mesh {
    let corners = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    Mesh::new(corners, (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect())
}

/// The mesh with every position changed.
pub fn moved(mesh: &Mesh, by: impl Fn(DVec3) -> DVec3) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| by(p)).collect(), ..mesh.clone() }
}
