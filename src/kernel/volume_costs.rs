//! The cost of every pair by the `volume` metric. Twin: `shaders/volume_costs.wgsl`, line for line.
//!
//! # Reference
//! \[LT98\] section 4: with n = (p1−p0)×(p2−p0) and d = n·p0 over the faces of both stars, the placement minimizes
//! Σ(n·x − d)² subject to (Σn)·x = Σd, which keeps the volume. Departs: one regularized solve instead of a choice of
//! independent constraints; a pair at a border drops the volume constraint and adds the border term of its ends.

use rayon::prelude::*;

use super::pair_quadric::{
    CONSTANTS, Freedom, NO_AREA, cost_key, end_matrices, half_exponent, pair_cost, scale_down, scale_up,
};
use super::pairs::{NO_VERTEX, half_edge_corners, opposite};
use super::rows::{BORDER, BorderSum, Face, LOCKED, Position, VolumeSum};
use super::split::CHUNK;
use super::stars::Stars;
use super::volume_sums::border_term;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, Sym3, add3, cross3, dot3, flush3, mul, outer, scale3, sub3, sym_add, sym_scale, trace,
};

/// Border against volume: the paper's volume term counts 1/18, its border term 1/2.
pub const BORDER_FACTOR: f32 = 9.0;

/// Pull to the midpoint: the sums are of current faces alone, nearly flat in a smooth region. 1e-4 costs 2 to 3 % of
/// accuracy over eleven models, 1e-3 another 2 %; below 1e-6 the rounding of single precision moves the vertex.
pub const VOLUME_REGULARIZATION: f32 = 1e-5;

/// One invocation a pair.
pub struct VolumeCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V sums.
    pub sums: &'a Buffer<VolumeSum>,
    /// V border terms where the mesh has a border.
    pub borders: &'a Buffer<BorderSum>,
    /// P half-edges that own a pair.
    pub pairs: &'a Buffer<u32>,
    /// P.
    pub pair_count: u32,
    /// Weight of the border term against the volume term, times |a−b|².
    pub border_weight: f32,
    /// Whether only the two ends may be the placement.
    pub at_endpoints: bool,
    /// Writes P keys: the costs' bits, which order as the costs do.
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        at_endpoints: u32,
        border_weight: f32,
        regularization: f32,
    }
}

/// What both ends and the shared faces sum to.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    first: Sym3,
    second: Sym3,
    mutual: Sym3,
    first_normal: Vec3,
    second_normal: Vec3,
    mutual_normal: Vec3,
}

/// Adds the border terms, weighted by the pair's length, and drops the volume constraint.
#[inline(always)]
fn with_border(ends: Ends, first: BorderSum, second: BorderSum, mutual: Sym3, weight: f32) -> Ends {
    Ends {
        first: sym_add(ends.first, sym_scale(first.matrix(), weight)),
        second: sym_add(ends.second, sym_scale(second.matrix(), weight)),
        mutual: sym_add(ends.mutual, sym_scale(mutual, weight)),
        first_normal: Vec3::ZERO,
        second_normal: Vec3::ZERO,
        mutual_normal: Vec3::ZERO,
    }
}

/// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
#[inline(always)]
fn volume_cost(ends: Ends, h: Vec3, freedom: Freedom) -> f32 {
    let t = trace(sym_add(ends.first, ends.second));
    if t <= NO_AREA {
        return 0.0;
    }
    let half = half_exponent(t);
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let first = sym_scale(ends.first, s_sq);
    let second = sym_scale(ends.second, s_sq);
    let mutual = sym_scale(ends.mutual, s_sq);
    let mut q = end_matrices(first, second, mutual, h);
    q.n = scale3(sub3(add3(ends.first_normal, ends.second_normal), ends.mutual_normal), s);
    q.d = dot3(scale3(sub3(ends.second_normal, ends.first_normal), s), h);
    let cost = pair_cost(q, h, freedom);
    mul(mul(cost, scale_up(half)), scale_up(half))
}

/// The key of the pair of the half-edge from `u` to `w` in the face whose third corner is `l`.
#[inline(always)]
fn volume_key(
    [u, w, l]: [u32; 3],
    stars: &Stars<'_>,
    sums: &[VolumeSum],
    borders: &[BorderSum],
    params: Params,
) -> u32 {
    let r = opposite(w, u, u, stars);
    let (pu, pw) = (stars.positions[u as usize], stars.positions[w as usize]);
    let a = pu.xyz();
    let e = sub3(pw.xyz(), a);
    let h = scale3(e, 0.5);
    let left = flush3(cross3(e, sub3(stars.positions[l as usize].xyz(), a)), LEAST_FACTOR);
    let mut mutual = outer(left);
    let mut mutual_normal = left;
    if r != NO_VERTEX {
        let right = flush3(cross3(sub3(stars.positions[r as usize].xyz(), a), e), LEAST_FACTOR);
        mutual = sym_add(mutual, outer(right));
        mutual_normal = add3(mutual_normal, right);
    }
    let (sum_u, sum_w) = (sums[u as usize], sums[w as usize]);
    let mut ends = Ends {
        first: sum_u.matrix(),
        second: sum_w.matrix(),
        mutual,
        first_normal: sum_u.normal(),
        second_normal: sum_w.normal(),
        mutual_normal,
    };
    if (pu.flags | pw.flags) & BORDER != 0 {
        let on_border = if r == NO_VERTEX { border_term(e) } else { Sym3::default() };
        let weight = mul(params.border_weight, dot3(e, e));
        ends = with_border(ends, borders[u as usize], borders[w as usize], on_border, weight);
    }
    let freedom = Freedom {
        first_locked: pu.flags & LOCKED != 0,
        second_locked: pw.flags & LOCKED != 0,
        at_endpoints: params.at_endpoints != 0,
        regularization: params.regularization,
    };
    cost_key(volume_cost(ends, h, freedom))
}

impl Kernel for VolumeCosts<'_> {
    const NAME: &'static str = "volume_costs";
    const SOURCE: &'static str = include_str!("../../shaders/volume_costs.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/stars.wgsl"),
        include_str!("../../shaders/shared/border_term.wgsl"),
        include_str!("../../shaders/shared/half_edges.wgsl"),
        include_str!("../../shaders/shared/pairs.wgsl"),
        include_str!("../../shaders/shared/pair_quadric.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params {
            at_endpoints: u32::from(self.at_endpoints),
            border_weight: self.border_weight,
            regularization: VOLUME_REGULARIZATION,
        }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("sums", Access::Read, self.sums),
            Binding::new("borders", Access::Read, self.borders),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.pair_count
    }

    fn run_cpu(&mut self) {
        let params = self.params();
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let (sums, borders, pairs) = (self.sums.host(), self.borders.host(), self.pairs.host());
        let keys = &mut self.keys.host_mut()[..self.pair_count as usize];
        keys.par_iter_mut().zip(pairs).with_min_len(CHUNK).for_each(|(key, &pair)| {
            *key = volume_key(half_edge_corners(pair, stars.faces), &stars, sums, borders, params);
        });
    }
}
