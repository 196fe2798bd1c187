//! The meshes, in the form each contender takes.

use coarsen::Mesh;
use coarsen::mesh::sample;

/// One size of the statue.
pub struct Case {
    /// Its size in words.
    pub name: &'static str,
    /// Positions and faces.
    pub mesh: Mesh,
    /// The positions in single precision.
    pub points: Vec<[f32; 3]>,
}

impl Case {
    /// The statue of `faces` faces, called `name`.
    pub fn new((name, faces): (&'static str, usize)) -> Self {
        let Mesh { positions, faces, .. } = sample("statue", Some(faces)).expect("a size that samples have");
        Self::of(name, Mesh::new(positions, faces))
    }

    /// `mesh`, called `name`.
    pub fn of(name: &'static str, mesh: Mesh) -> Self {
        let points = mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        Self { name, mesh, points }
    }

    /// The faces that `percent` of them are.
    pub fn target(&self, percent: usize) -> usize {
        self.mesh.faces.len() * percent / 100
    }
}

/// Names and sizes, ascending, each about ten times the one before.
pub fn sizes() -> Vec<(&'static str, usize)> {
    let mut sizes = vec![("100k", 100_000), ("1m", 1_000_000)];
    if std::env::var("COARSEN_BENCH_LARGE").is_ok_and(|value| value == "1") {
        sizes.push(("10m", 10_000_000));
    }
    sizes
}
