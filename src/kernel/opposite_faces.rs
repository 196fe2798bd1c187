//! The face of the original nearest to every point of the result's faces. Twin: `shaders/opposite_faces.wgsl`, line for
//! line.

use rayon::prelude::*;

use super::fit_points::{CONSTANTS, FACE_POINTS, face_point};
use super::nearest::{FAR, NO_FACE, nearest_from};
use super::nearest_point::point_at;
use super::rows::{Face, Position};
use super::split::CHUNK;
use super::stars::Stars;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, dot3, flush3, sub3};

/// One invocation a face of the result.
pub struct OppositeFaces<'a> {
    /// Positions of the original.
    pub positions: &'a Buffer<Position>,
    /// Its faces.
    pub faces: &'a Buffer<Face>,
    /// Starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex of the original, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V + 1 starts into `samples`.
    pub sample_starts: &'a Buffer<u32>,
    /// Vertices of the original with their weights.
    pub samples: &'a Buffer<[f32; 4]>,
    /// Their numbers in the original.
    pub sample_vertices: &'a Buffer<u32>,
    /// V positions of the result.
    pub own_positions: &'a Buffer<Position>,
    /// Its F faces.
    pub own_faces: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes [`FACE_POINTS`] faces of the original a face of the result.
    pub opposite_faces: &'a mut Buffer<u32>,
}

/// The samples that became a vertex.
#[derive(Clone, Copy)]
struct Samples<'a> {
    starts: &'a [u32],
    points: &'a [[f32; 4]],
    vertices: &'a [u32],
}

/// A sample and its squared distance.
#[derive(Clone, Copy)]
struct NearSample {
    sample: u32,
    distance_sq: f32,
}

#[inline(always)]
fn nearer_sample(corner: u32, point: Vec3, best: NearSample, samples: Samples<'_>) -> NearSample {
    let mut near = best;
    for i in samples.starts[corner as usize]..samples.starts[corner as usize + 1] {
        let [x, y, z, _] = samples.points[i as usize];
        let away = flush3(sub3(Vec3::new(x, y, z), point), LEAST_FACTOR);
        let distance_sq = dot3(away, away);
        if distance_sq < near.distance_sq {
            near = NearSample { sample: i, distance_sq };
        }
    }
    near
}

/// The face of the original nearest to point `k` of a face, from the nearest sample that became one of its corners.
#[inline(always)]
fn opposite_face(face: Face, k: u32, samples: Samples<'_>, own_positions: &[Position], original: &Stars<'_>) -> u32 {
    let corner = |v: u32| own_positions[v as usize].xyz();
    let point = point_at(face_point(k), corner(face.a), corner(face.b), corner(face.c));
    let mut near = NearSample { sample: NO_FACE, distance_sq: FAR };
    near = nearer_sample(face.a, point, near, samples);
    near = nearer_sample(face.b, point, near, samples);
    near = nearer_sample(face.c, point, near, samples);
    if near.sample == NO_FACE {
        return NO_FACE;
    }
    nearest_from(samples.vertices[near.sample as usize], point, original).face
}

impl Kernel for OppositeFaces<'_> {
    const NAME: &'static str = "opposite_faces";
    const SOURCE: &'static str = include_str!("../../shaders/opposite_faces.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/nearest_point.wgsl"),
        include_str!("../../shaders/shared/nearest.wgsl"),
        include_str!("../../shaders/shared/fit_points.wgsl"),
    ];
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
            Binding::new("sample_vertices", Access::Read, self.sample_vertices),
            Binding::new("own_positions", Access::Read, self.own_positions),
            Binding::new("own_faces", Access::Read, self.own_faces),
            Binding::new("opposite_faces", Access::Write, self.opposite_faces),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let original = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let samples = Samples {
            starts: self.sample_starts.host(),
            points: self.samples.host(),
            vertices: self.sample_vertices.host(),
        };
        let (positions, faces) = (self.own_positions.host(), &self.own_faces.host()[..self.face_count as usize]);
        let rows = self.opposite_faces.host_mut().par_chunks_mut(FACE_POINTS as usize).zip(faces);
        rows.with_min_len(CHUNK / 64).for_each(|(row, &face)| {
            for (k, opposite) in (0..).zip(row) {
                *opposite = opposite_face(face, k, samples, positions, &original);
            }
        });
    }
}
