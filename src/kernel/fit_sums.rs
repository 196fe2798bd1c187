//! What the samples ask of every face of the result, and their squared distances. Twin: `shaders/fit_sums.wgsl`, line
//! for line.
//!
//! Samples of the original pull the nearest point of their face; points of the face are pulled to the nearest point of
//! their face of the original. Heights are along the face's normal alone: with a share of the distance along the face,
//! samples hold the vertices where they are and a sweep gains less (4 % instead of 5.5 %).
//!
//! # Reference
//! \[HDD93\]: the vertices that fit the samples best with the points they project to held. Departs: in both
//! directions, and to planes instead of points.

use rayon::prelude::*;

use super::fit_points::{CONSTANTS, FACE_POINTS, LEAST_COMPONENT, NO_NORMAL, face_point, with_point};
use super::nearest::{APART, NO_FACE};
use super::nearest_point::{nearest_weights, point_at};
use super::rows::{Face, FaceFit, Position};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, cross3, divide, dot3, flush, flush3, root, scale3, sub3};

/// One invocation a face of the result.
pub struct FitSums<'a> {
    /// V positions of the result.
    pub positions: &'a Buffer<Position>,
    /// Its F faces.
    pub faces: &'a Buffer<Face>,
    /// F weights of a face's own points.
    pub face_weights: &'a Buffer<f32>,
    /// V + 1 starts into `samples`.
    pub sample_starts: &'a Buffer<u32>,
    /// Points of the original and their weights.
    pub samples: &'a Buffer<[f32; 4]>,
    /// The face nearest to every sample.
    pub nearest_faces: &'a Buffer<u32>,
    /// Positions of the original.
    pub original_positions: &'a Buffer<Position>,
    /// Its faces.
    pub original_faces: &'a Buffer<Face>,
    /// The faces of the original nearest to the points of every face.
    pub opposite_faces: &'a Buffer<u32>,
    /// F.
    pub face_count: u32,
    /// Writes F sums.
    pub sums: &'a mut Buffer<FaceFit>,
}

/// The corners of a triangle about `point`.
#[inline(always)]
fn about(point: Vec3, [a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    [a, b, c].map(|corner| flush3(sub3(corner, point), LEAST_FACTOR))
}

/// No sums yet, and the unit normal; none for a face without area.
#[inline(always)]
fn empty_fit([a, b, c]: [Vec3; 3]) -> FaceFit {
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    let mut unit = Vec3::ZERO;
    if n_sq > NO_NORMAL {
        unit = flush3(scale3(n, divide(1.0, root(n_sq))), LEAST_COMPONENT);
    }
    FaceFit { nx: unit.x, ny: unit.y, nz: unit.z, ..FaceFit::default() }
}

impl FitSums<'_> {
    #[inline(always)]
    fn with_samples(&self, corner: u32, face: u32, corners: [Vec3; 3], before: FaceFit) -> FaceFit {
        let (starts, samples) = (self.sample_starts.host(), self.samples.host());
        let mut fit = before;
        for i in starts[corner as usize]..starts[corner as usize + 1] {
            let nearest = self.nearest_faces.host()[i as usize];
            if nearest & !APART == face {
                let [x, y, z, weight] = samples[i as usize];
                let [a, b, c] = about(Vec3::new(x, y, z), corners);
                let weights = nearest_weights(a, b, c);
                let away = scale3(point_at(weights, a, b, c), -1.0);
                let with_sample = with_point(fit, weights, away, weight);
                if nearest == face {
                    fit = with_sample;
                } else {
                    fit.error = with_sample.error;
                }
            }
        }
        fit
    }

    #[inline(always)]
    fn fit_sum(&self, face: u32) -> FaceFit {
        let row = self.faces.host()[face as usize];
        let corners = row.corners().map(|v| self.positions.host()[v as usize].xyz());
        let mut fit = empty_fit(corners);
        fit = self.with_samples(row.a, face, corners, fit);
        fit = self.with_samples(row.b, face, corners, fit);
        fit = self.with_samples(row.c, face, corners, fit);
        for k in 0..FACE_POINTS {
            let opposite = self.opposite_faces.host()[(FACE_POINTS * face + k) as usize];
            if opposite != NO_FACE {
                let weights = face_point(k);
                let point = point_at(weights, corners[0], corners[1], corners[2]);
                let original = self.original_faces.host()[opposite as usize].corners();
                let [a, b, c] = about(point, original.map(|v| self.original_positions.host()[v as usize].xyz()));
                let away = point_at(nearest_weights(a, b, c), a, b, c);
                fit = with_point(fit, weights, away, self.face_weights.host()[face as usize]);
            }
        }
        FaceFit {
            aa: flush(fit.aa, LEAST_FACTOR),
            ab: flush(fit.ab, LEAST_FACTOR),
            ac: flush(fit.ac, LEAST_FACTOR),
            bb: flush(fit.bb, LEAST_FACTOR),
            bc: flush(fit.bc, LEAST_FACTOR),
            cc: flush(fit.cc, LEAST_FACTOR),
            a: flush(fit.a, LEAST_FACTOR),
            b: flush(fit.b, LEAST_FACTOR),
            c: flush(fit.c, LEAST_FACTOR),
            ..fit
        }
    }
}

impl Kernel for FitSums<'_> {
    const NAME: &'static str = "fit_sums";
    const SOURCE: &'static str = include_str!("../../shaders/fit_sums.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/fit_points.wgsl"),
        include_str!("../../shaders/shared/nearest_point.wgsl"),
    ];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("face_weights", Access::Read, self.face_weights),
            Binding::new("sample_starts", Access::Read, self.sample_starts),
            Binding::new("samples", Access::Read, self.samples),
            Binding::new("nearest_faces", Access::Read, self.nearest_faces),
            Binding::new("original_positions", Access::Read, self.original_positions),
            Binding::new("original_faces", Access::Read, self.original_faces),
            Binding::new("opposite_faces", Access::Read, self.opposite_faces),
            Binding::new("sums", Access::Write, self.sums),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let sums: Vec<FaceFit> =
            (0..self.face_count).into_par_iter().with_min_len(CHUNK / 64).map(|face| self.fit_sum(face)).collect();
        self.sums.host_mut()[..sums.len()].copy_from_slice(&sums);
    }
}
