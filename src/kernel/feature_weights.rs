//! What every vertex counts by its feature degree. Twin: `shaders/feature_weights.wgsl`, line for line.
//!
//! # Reference
//! \[Yang13\]: the entropy of the curvatures about a vertex, over that of equal shares, is low where the curvature
//! changes strongly. Departs: a floor below which curvatures drown, since the shares alone know no scale and would take
//! the noise on a flat for features.

use rayon::prelude::*;

use super::rows::{BORDER, FLAGS, Face, HUB, LOCKED, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST, add, divide, log2, mul, sub};

/// One invocation a vertex.
pub struct FeatureWeights<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V mean curvatures.
    pub curvatures: &'a Buffer<f32>,
    /// Their sum.
    pub curvature_sum: &'a Buffer<f32>,
    /// V.
    pub vertex_count: u32,
    /// From the degree to the weight.
    pub params: Params,
    /// Writes V weights.
    pub weights: &'a mut Buffer<f32>,
}

params! {
    /// The uniform block: the weight is max(`base` + `slope` · degree, `least`).
    pub struct Params {
        /// The floor of the curvatures as a share of their sum.
        pub floor_share: f32,
        /// Taken for the sum where that is less.
        pub least_sum: f32,
        /// Whether a degree counts by how far its own curvature is above the floor.
        pub gated: u32,
        /// At degree 0.
        pub base: f32,
        /// From degree 0 to degree 1.
        pub slope: f32,
        /// The least weight.
        pub least: f32,
        /// Of vertices that stay: locked ones and hubs.
        pub of_fixed: f32,
    }
}

/// The live mesh and the curvatures of its vertices.
#[derive(Debug, Clone, Copy)]
struct Curved<'a> {
    stars: Stars<'a>,
    curvatures: &'a [f32],
    curvature_sum: f32,
}

/// The curvature of a vertex above the floor that noise drowns in.
#[inline(always)]
fn lifted(vertex: u32, floor: f32, curved: &Curved<'_>) -> f32 {
    add(curved.curvatures[vertex as usize], floor)
}

/// The neighbor before the first face of an open fan, which no face here has as its next corner; else the vertex itself.
#[inline(always)]
fn last_neighbor(vertex: u32, stars: &Stars<'_>) -> u32 {
    let ring = stars.ring(vertex);
    for &f in ring {
        let candidate = spoke(stars.faces[f as usize], vertex).last;
        let mut is_next = false;
        for &g in ring {
            is_next = is_next || spoke(stars.faces[g as usize], vertex).next == candidate;
        }
        if !is_next {
            return candidate;
        }
    }
    vertex
}

/// One less the entropy of the shares of the curvature about a vertex, over the entropy of equal shares.
#[inline(always)]
fn feature_degree(vertex: u32, floor: f32, curved: &Curved<'_>) -> f32 {
    let stars = &curved.stars;
    let own = lifted(vertex, floor, curved);
    let mut greatest = own;
    let ring = stars.ring(vertex);
    for &f in ring {
        let next = spoke(stars.faces[f as usize], vertex).next;
        greatest = greatest.max(lifted(next, floor, curved));
    }
    let mut last = vertex;
    if stars.positions[vertex as usize].flags & BORDER != 0 {
        last = last_neighbor(vertex, stars);
        greatest = greatest.max(lifted(last, floor, curved));
    }
    if greatest < LEAST {
        return 0.0;
    }

    // With rᵢ = kᵢ/max k the entropy is log Σr − Σ r log r / Σr: without any error for equal shares.
    let r = divide(own, greatest);
    let mut sum = r;
    let mut logs = mul(r, log2(r));
    let mut count = 1.0;
    for &f in ring {
        let next = spoke(stars.faces[f as usize], vertex).next;
        let r = divide(lifted(next, floor, curved), greatest);
        sum = add(sum, r);
        logs = add(logs, mul(r, log2(r)));
        count = add(count, 1.0);
    }
    if last != vertex {
        let r = divide(lifted(last, floor, curved), greatest);
        sum = add(sum, r);
        logs = add(logs, mul(r, log2(r)));
        count = add(count, 1.0);
    }
    let entropy = sub(log2(sum), divide(logs, sum));
    sub(1.0, divide(entropy, log2(count))).max(0.0)
}

#[inline(always)]
fn feature_weight(vertex: u32, curved: &Curved<'_>, params: Params) -> f32 {
    if curved.stars.positions[vertex as usize].flags & (LOCKED | HUB) != 0 {
        return params.of_fixed;
    }
    let floor = mul(params.floor_share, curved.curvature_sum.max(params.least_sum));
    let mut degree = feature_degree(vertex, floor, curved);
    if params.gated != 0 {
        let own = curved.curvatures[vertex as usize];
        degree = mul(degree, divide(own, add(own, floor)));
    }
    add(params.base, mul(params.slope, degree)).max(params.least)
}

impl Kernel for FeatureWeights<'_> {
    const NAME: &'static str = "feature_weights";
    const SOURCE: &'static str = include_str!("../../shaders/feature_weights.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;

    fn params(&self) -> Params {
        self.params
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("curvatures", Access::Read, self.curvatures),
            Binding::new("curvature_sum", Access::Read, self.curvature_sum),
            Binding::new("weights", Access::Write, self.weights),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let curvature_sum = self.curvature_sum.host().first().copied().unwrap_or(0.0);
        let curved = Curved { stars, curvatures: self.curvatures.host(), curvature_sum };
        let params = self.params;
        let weights = &mut self.weights.host_mut()[..self.vertex_count as usize];
        weights.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(vertex, weight)| {
            *weight = feature_weight(vertex as u32, &curved, params);
        });
    }
}
