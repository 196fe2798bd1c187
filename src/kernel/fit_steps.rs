//! One step of every vertex of the result towards the least of the fit's sums. Twin: `shaders/fit_steps.wgsl`, line for
//! line.
//!
//! All vertices step at once, each as if its neighbors asked for the same step: every sample's weights of the corners sum
//! to one, so no step overshoots. Steps are taken from a point ahead of the last one, in its direction
//! \[Nes83\].

use rayon::prelude::*;

use super::pair_quadric::{CONSTANTS, NO_WEIGHT, PairQuadric, half_exponent, least, scale_down, scaled};
use super::rows::{BORDER, Face, FaceFit, HUB, LOCKED, Position, SEAM};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, Sym3, add, add3, dot3, flush, flush3, mul, outer, scale3, sub, sub3, sym_add, sym_scale, trace,
};

/// Holds a vertex where nothing pulls it, as a share of the pulls elsewhere: along a flat or a crease.
pub const FIT_REGULARIZATION: f32 = 1e-3;

/// One invocation a vertex of the result.
pub struct FitSteps<'a> {
    /// V positions, for their flags: a vertex that is locked, on a border or a hub stays.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F sums.
    pub sums: &'a Buffer<FaceFit>,
    /// V offsets to step from; the last component is unused.
    pub ahead: &'a Buffer<[f32; 4]>,
    /// V.
    pub vertex_count: u32,
    /// How far the next step starts ahead, in units of this one.
    pub momentum: f32,
    /// Updates V offsets from the positions.
    pub offsets: &'a mut Buffer<[f32; 4]>,
    /// Writes V offsets to step from next.
    pub next_ahead: &'a mut Buffer<[f32; 4]>,
}

params! {
    /// The uniform block.
    pub struct Params {
        momentum: f32,
        regularization: f32,
    }
}

fn xyz([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

impl FitSteps<'_> {
    /// The offset of a vertex after its step from `ahead`.
    #[inline(always)]
    fn stepped(&self, vertex: u32, regularization: f32) -> Vec3 {
        let ahead = self.ahead.host();
        let start = xyz(ahead[vertex as usize]);
        let mut matrix = Sym3::default();
        let mut pull = Vec3::ZERO;
        let (starts, rings) = (self.ring_starts.host(), self.ring_faces.host());
        for i in starts[vertex as usize]..starts[vertex as usize + 1] {
            let f = rings[i as usize];
            let face = self.faces.host()[f as usize];
            let fit = self.sums.host()[f as usize];
            let n = fit.normal();
            // The vertex's row of the face's sums.
            let mut row = Vec3::new(fit.ac, fit.bc, fit.cc);
            let mut height = fit.c;
            if face.a == vertex {
                row = Vec3::new(fit.aa, fit.ab, fit.ac);
                height = fit.a;
            } else if face.b == vertex {
                row = Vec3::new(fit.ab, fit.bb, fit.bc);
                height = fit.b;
            }
            let risen = flush3(
                Vec3::new(
                    dot3(n, xyz(ahead[face.a as usize])),
                    dot3(n, xyz(ahead[face.b as usize])),
                    dot3(n, xyz(ahead[face.c as usize])),
                ),
                LEAST_FACTOR,
            );
            let left = flush(sub(height, dot3(row, risen)), LEAST_FACTOR);
            let weight = flush(add(add(row.x, row.y), row.z), LEAST_FACTOR);
            matrix = sym_add(matrix, sym_scale(outer(n), weight));
            pull = add3(pull, scale3(n, left));
        }
        let t = trace(matrix);
        if t <= NO_WEIGHT {
            return start;
        }
        // Held to where the vertex was, not to where the step starts.
        let held = flush3(scale3(start, flush(mul(regularization, t), LEAST_FACTOR)), LEAST_FACTOR);
        let q = PairQuadric { a: matrix, b: sub3(pull, held), c: 0.0, n: Vec3::ZERO, d: 0.0 };
        let step = least(scaled(q, scale_down(half_exponent(t))), regularization);
        flush3(add3(start, step), LEAST_FACTOR)
    }
}

impl Kernel for FitSteps<'_> {
    const NAME: &'static str = "fit_steps";
    const SOURCE: &'static str = include_str!("../../shaders/fit_steps.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/pair_quadric.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params { momentum: self.momentum, regularization: FIT_REGULARIZATION }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("sums", Access::Read, self.sums),
            Binding::new("ahead", Access::Read, self.ahead),
            Binding::new("offsets", Access::Write, self.offsets),
            Binding::new("next_ahead", Access::Write, self.next_ahead),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let Params { momentum, regularization } = self.params();
        let positions = &self.positions.host()[..self.vertex_count as usize];
        let steps = positions.par_iter().zip(self.offsets.host()).enumerate().with_min_len(CHUNK / 16);
        let rows: Vec<[Vec3; 2]> = steps
            .map(|(vertex, (position, &before))| {
                if position.flags & (BORDER | LOCKED | SEAM | HUB) != 0 {
                    return [Vec3::ZERO; 2];
                }
                let offset = self.stepped(vertex as u32, regularization);
                let beyond = scale3(flush3(sub3(offset, xyz(before)), LEAST_FACTOR), momentum);
                [offset, flush3(add3(offset, beyond), LEAST_FACTOR)]
            })
            .collect();
        let outputs = self.offsets.host_mut().iter_mut().zip(self.next_ahead.host_mut());
        for ([offset, next], (offset_out, next_out)) in rows.into_iter().zip(outputs) {
            *offset_out = [offset.x, offset.y, offset.z, 0.0];
            *next_out = [next.x, next.y, next.z, 0.0];
        }
    }
}
