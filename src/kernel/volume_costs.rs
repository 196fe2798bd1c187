//! The cost of every pair by the `volume` metric. Twin: `shaders/volume_costs.wgsl`, line for line.
//!
//! # Reference
//! \[LT98\] section 4: with n = (p1−p0)×(p2−p0) and d = n·p0 over the faces of both stars, the placement minimizes
//! Σ(n·x − d)² subject to (Σn)·x = Σd, which keeps the volume. Departs: Σ(n·x − d)²/|n|, in which a face counts by its area times the
//! squared distance to its plane, not by the square of its volume, where large faces drown small ones; one regularized solve
//! instead of a choice of independent constraints; a pair at a border drops the volume constraint and adds the border
//! term of its ends.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::pair_quadric::{
    CONSTANTS, Freedom, NO_WEIGHT, PairQuadric, cost_key, end_matrices, half_exponent, pair_cost, scale_down, scale_up,
    stays,
};
use super::pairs::NO_FACE;
use super::rows::{BORDER, BorderSum, Edge, Face, JOINED, LOCKED, Normal, Position, VolumeSum};
use super::split::CHUNK;
use super::volume_rows::{VolumeBlock, VolumeRows};
use super::volume_sums::border_term;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch, params};
use crate::math::Vec3;
use crate::math::exact::{Sym3, add3, dot3, mul, outer, scale3, sub3, sym_add, sym_scale, trace};

/// Border against surface: squared distances times |e|² against squared distances times twice the area. Half of it lets
/// rims retreat (the maximum grows), twice costs 1 % of accuracy on open surfaces.
pub const BORDER_FACTOR: f32 = 4.0;

/// Pull to the midpoint: the sums are of current faces alone, nearly flat in a smooth region. 1e-4 costs 2 to 3 % of
/// accuracy over eleven models, 1e-3 another 2 %; below 1e-6 the rounding of single precision moves the vertex.
pub const VOLUME_REGULARIZATION: f32 = 1e-5;

/// One invocation a pair.
pub struct VolumeCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// V sums.
    pub sums: &'a Buffer<VolumeSum>,
    /// V border terms where the mesh has a border.
    pub borders: &'a Buffer<BorderSum>,
    /// P pairs.
    pub pairs: &'a Buffer<Edge>,
    /// P.
    pub pair_count: u32,
    /// Weight of the border term against the volume term, times |a−b|².
    pub border_weight: f32,
    /// Where placements may be: one of the constants of [`super::pair_quadric`].
    pub placement: u32,
    /// Writes P keys: the costs' bits, which order as the costs do, or [`NO_KEY`](super::pair_quadric::NO_KEY).
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        pub(super) placement: u32,
        pub(super) border_weight: f32,
        regularization: f32,
    }
}

impl Params {
    /// For these policies.
    pub fn new(placement: u32, border_weight: f32) -> Self {
        Self { placement, border_weight, regularization: VOLUME_REGULARIZATION }
    }
}

/// What both ends and the shared faces sum to. In WGSL: `shaders/shared/volume_ends.wgsl`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    pub first: Sym3,
    pub second: Sym3,
    pub mutual: Sym3,
    pub first_normal: Vec3,
    pub second_normal: Vec3,
    pub mutual_normal: Vec3,
}

/// What two ends and the faces that they share sum to.
#[inline(always)]
pub(super) fn volume_ends(first: VolumeSum, second: VolumeSum, left: Normal, right: Normal) -> Ends {
    Ends {
        first: first.matrix(),
        second: second.matrix(),
        mutual: sym_add(outer(left.weighted()), outer(right.weighted())),
        first_normal: first.normal(),
        second_normal: second.normal(),
        mutual_normal: add3(left.doubled_area(), right.doubled_area()),
    }
}

/// Adds the border terms and drops the volume constraint.
#[inline(always)]
pub(super) fn with_border(ends: Ends, first: BorderSum, second: BorderSum, mutual: Sym3, weight: f32) -> Ends {
    Ends {
        first: sym_add(ends.first, sym_scale(first.matrix(), weight)),
        second: sym_add(ends.second, sym_scale(second.matrix(), weight)),
        mutual: sym_add(ends.mutual, sym_scale(mutual, weight)),
        first_normal: Vec3::ZERO,
        second_normal: Vec3::ZERO,
        mutual_normal: Vec3::ZERO,
    }
}

/// The quadric of a pair from −h to h, times `scale`.
#[inline(always)]
pub(super) fn ends_quadric(ends: Ends, scale: f32, h: Vec3) -> PairQuadric {
    let first = sym_scale(ends.first, scale);
    let second = sym_scale(ends.second, scale);
    let mutual = sym_scale(ends.mutual, scale);
    let mut q = end_matrices(first, second, mutual, h);
    q.n = scale3(sub3(add3(ends.first_normal, ends.second_normal), ends.mutual_normal), scale);
    q.d = dot3(scale3(sub3(ends.second_normal, ends.first_normal), scale), h);
    q
}

/// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
#[inline(always)]
fn volume_cost(ends: Ends, h: Vec3, freedom: Freedom) -> f32 {
    let t = trace(sym_add(ends.first, ends.second));
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let cost = pair_cost(ends_quadric(ends, s_sq, h), h, freedom);
    mul(mul(cost, scale_up(half)), scale_up(half))
}

/// What the key of a pair is computed from, off the border.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub(super) struct Pair {
    pub(super) pu: Position,
    pub(super) pw: Position,
    pub(super) sum_u: VolumeSum,
    pub(super) sum_w: VolumeSum,
    pub(super) left: Normal,
    pub(super) right: Normal,
}

/// The same of a pair with an end on the border, and of the border.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub(super) struct BorderPair {
    pub(super) pair: Pair,
    pub(super) first: BorderSum,
    pub(super) second: BorderSum,
    /// [`NO_FACE`] where the pair lies along the border.
    pub(super) across: u32,
}

impl Pair {
    /// Whether it has an end on the border.
    pub(super) fn is_on_border(&self) -> bool {
        (self.pu.flags | self.pw.flags) & BORDER != 0
    }

    /// Its key, off the border.
    #[inline(always)]
    pub(super) fn key(&self, params: Params) -> u32 {
        ends_key(ends_of(self), self, params)
    }

    /// Its key with an end on the border and without an edge.
    pub(super) fn key_apart(&self, [first, second]: [BorderSum; 2], params: Params) -> u32 {
        ends_key(with_border(ends_of(self), first, second, Sym3::default(), params.border_weight), self, params)
    }
}

impl BorderPair {
    /// Its key, if it does not run [across](is_across).
    #[inline(always)]
    pub(super) fn key(&self, params: Params) -> u32 {
        let Self { pair, first, second, across } = *self;
        let term = border_term(sub3(pair.pw.xyz(), pair.pu.xyz()));
        let mutual = if across == NO_FACE { term } else { Sym3::default() };
        ends_key(with_border(ends_of(&pair), first, second, mutual, params.border_weight), &pair, params)
    }
}

/// What the ends of a pair sum to.
#[inline(always)]
fn ends_of(pair: &Pair) -> Ends {
    volume_ends(pair.sum_u, pair.sum_w, pair.left, pair.right)
}

/// The key of a pair whose ends sum to `ends`.
#[inline(always)]
fn ends_key(ends: Ends, pair: &Pair, params: Params) -> u32 {
    let h = scale3(sub3(pair.pw.xyz(), pair.pu.xyz()), 0.5);
    let freedom = Freedom {
        first_locked: stays(pair.pu.flags, pair.pw.flags),
        second_locked: stays(pair.pw.flags, pair.pu.flags),
        placement: params.placement,
        regularization: params.regularization,
    };
    cost_key(volume_cost(ends, h, freedom))
}

/// Whether a pair of ends with these flags runs across the surface from border to border: contracting it would pinch the surface, which the
/// link condition forbids. Behind a locked end a border may hide; where parts met the condition may not be asked.
#[inline(always)]
pub(super) fn is_across(first: u32, second: u32, across: u32) -> bool {
    let joins_borders = ((first & BORDER != 0) & (second & (BORDER | LOCKED) != 0))
        | ((second & BORDER != 0) & (first & (BORDER | LOCKED) != 0));
    (across != NO_FACE) & joins_borders & ((first | second) & JOINED == 0)
}

impl Kernel for VolumeCosts<'_> {
    const NAME: &'static str = "volume_costs";
    const SOURCE: &'static str = include_str!("../../shaders/volume_costs.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/border_term.wgsl"),
        include_str!("../../shaders/shared/half_edges.wgsl"),
        include_str!("../../shaders/shared/pair_quadric.wgsl"),
        include_str!("../../shaders/shared/volume_ends.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params::new(self.placement, self.border_weight)
    }

    fn switches(&self) -> Vec<Switch> {
        vec![("HAS_BORDER", self.borders.len() > 1)]
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("normals", Access::Read, self.normals),
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
        let Self { positions, faces, normals, sums, borders, .. } = self;
        let rows = VolumeRows::on_host(positions, faces, normals, sums, borders, params);
        let pairs = &self.pairs.host()[..self.pair_count as usize];
        let keys = &mut self.keys.host_mut()[..pairs.len()];
        pairs.par_chunks(CHUNK).zip(keys.par_chunks_mut(CHUNK)).for_each_init(
            VolumeBlock::default,
            |block, (pairs, keys)| {
                rows.keys(pairs, block, keys);
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_runs_from_border_to_border_is_told_by_flags_and_faces() {
        let (b, l, j) = (BORDER, LOCKED, JOINED);
        for (flags, is) in [
            ([0, 0], false),
            ([b, 0], false),
            ([l, 0], false),
            ([l, l], false),
            ([b, b], true),
            ([b, l], true),
            ([l, b], true),
            ([b | l, b], true),
            ([b | j, b], false),
            ([b, l | j], false),
        ] {
            assert_eq!(
                [is_across(flags[0], flags[1], 7), is_across(flags[0], flags[1], NO_FACE)],
                [is, false],
                "{flags:?}"
            );
        }
    }
}
