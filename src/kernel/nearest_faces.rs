//! The face of the result nearest to every sample of the original. Twin: `shaders/nearest_faces.wgsl`, line for line.

use rayon::prelude::*;

use super::nearest::{APART, CONSTANTS, FAR, NO_FACE, Nearest, nearer_around, nearest_from};
use super::rows::{Face, Position};
use super::split::{CHUNK, split_at_bounds};
use super::stars::{Stars, has};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;

/// One invocation a vertex of the result.
pub struct NearestFaces<'a> {
    /// V positions of the result.
    pub positions: &'a Buffer<Position>,
    /// Its F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V + 1 starts into `samples`: those that became each vertex.
    pub sample_starts: &'a Buffer<u32>,
    /// Points of the original and their weights.
    pub samples: &'a Buffer<[f32; 4]>,
    /// V.
    pub vertex_count: u32,
    /// Writes one face around its vertex a sample, [`APART`] where another is nearer, as for one in a hundred.
    pub nearest_faces: &'a mut Buffer<u32>,
}

/// The face nearest to a sample that became `vertex`; where that is not around the vertex, the nearest that is, [`APART`].
#[inline(always)]
fn nearest_face(vertex: u32, sample: [f32; 4], stars: &Stars<'_>) -> u32 {
    let point = Vec3::new(sample[0], sample[1], sample[2]);
    let nearest = nearest_from(vertex, point, stars);
    if nearest.face == NO_FACE || has(stars.faces[nearest.face as usize], vertex) {
        return nearest.face;
    }
    let none = Nearest { face: NO_FACE, weights: Vec3::ZERO, distance_sq: FAR };
    nearer_around(vertex, point, none, stars).face | APART
}

impl Kernel for NearestFaces<'_> {
    const NAME: &'static str = "nearest_faces";
    const SOURCE: &'static str = include_str!("../../shaders/nearest_faces.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/nearest_point.wgsl"), include_str!("../../shaders/shared/nearest.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("sample_starts", Access::Read, self.sample_starts),
            Binding::new("samples", Access::Read, self.samples),
            Binding::new("nearest_faces", Access::Write, self.nearest_faces),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let (starts, samples) = (self.sample_starts.host(), self.samples.host());
        let count = self.vertex_count as usize;
        let firsts: Vec<usize> = (0..count).step_by(CHUNK / 16).chain([count]).collect();
        let bounds: Vec<u32> = firsts.iter().map(|&vertex| starts[vertex]).collect();
        let pieces = split_at_bounds(self.nearest_faces.host_mut(), &bounds);
        pieces.into_par_iter().zip(firsts.par_windows(2)).for_each(|(piece, span)| {
            let base = starts[span[0]];
            for vertex in span[0]..span[1] {
                for i in starts[vertex]..starts[vertex + 1] {
                    piece[(i - base) as usize] = nearest_face(vertex as u32, samples[i as usize], &stars);
                }
            }
        });
    }
}
