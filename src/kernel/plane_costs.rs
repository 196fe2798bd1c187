//! The cost of every pair by the `plane` metric. Twin: `shaders/plane_costs.wgsl`, line for line.
//!
//! # Reference
//! \[GH97\] section 3: the sum of both ends' quadrics at its least point. Departs: both are moved to the pair's
//! midpoint first, where single precision suffices, and the solve is regularized towards it.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::pair_quadric::{
    CONSTANTS, Freedom, NO_WEIGHT, PairQuadric, cost_key, half_exponent, pair_cost, scale_down, scale_up, scaled, stays,
};
use super::pairs::half_edge_ends;
use super::plane_quadric::{moved, sum_moved};
use super::rows::{Edge, Face, PlaneQuadric, Position};
use super::split::CHUNK;
use super::warm::warm_up;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{mul, scale3, sub3, trace};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// Pull to the midpoint. Accumulated quadrics weigh large flats against small faces at their corners: with 1e-4 corners
/// drift (fandisk at 1 %: 1.4 times the error).
pub const PLANE_REGULARIZATION: f32 = 1e-6;

/// One invocation a pair.
pub struct PlaneCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// P pairs.
    pub pairs: &'a Buffer<Edge>,
    /// P.
    pub pair_count: u32,
    /// Where placements may be: one of the constants of [`super::pair_quadric`].
    pub placement: u32,
    /// Writes P keys: the costs' bits, which order as the costs do.
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        placement: u32,
        regularization: f32,
    }
}

impl Params {
    /// For these policies.
    pub fn new(placement: u32) -> Self {
        Self { placement, regularization: PLANE_REGULARIZATION }
    }
}

/// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
#[inline(always)]
fn plane_cost(first: PlaneQuadric, second: PlaneQuadric, h: Vec3, freedom: Freedom) -> f32 {
    let both = sum_moved(moved(first, h), moved(second, scale3(h, -1.0)));
    let q = PairQuadric { a: both.a, b: scale3(both.b, -1.0), c: both.c, n: Vec3::ZERO, d: 0.0 };
    let t = trace(q.a);
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let cost = pair_cost(scaled(q, scale_down(half)), h, freedom);
    mul(mul(cost, scale_up(half)), scale_up(half))
}

/// What the key of a pair is computed from.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Pair {
    pu: Position,
    pw: Position,
    first: PlaneQuadric,
    second: PlaneQuadric,
}

/// 32-bit scalars of a [`Pair`].
const PAIR_WORDS: usize = size_of::<Pair>() / 4;
const QUADRIC_WORDS: usize = size_of::<PlaneQuadric>() / 4;

/// Scratch of [`PlaneRows::keys`].
pub type PlaneBlock = Columns<Pair, PAIR_WORDS>;

/// What pairs are costed from, on the host.
#[derive(Debug, Clone, Copy)]
pub struct PlaneRows<'a> {
    positions: &'a [Position],
    faces: &'a [Face],
    quadrics: &'a [PlaneQuadric],
    params: Params,
}

impl<'a> PlaneRows<'a> {
    /// In these buffers of the host.
    pub fn on_host(
        positions: &'a Buffer<Position>,
        faces: &'a Buffer<Face>,
        quadrics: &'a Buffer<PlaneQuadric>,
        params: Params,
    ) -> Self {
        Self { positions: positions.host(), faces: faces.host(), quadrics: quadrics.host(), params }
    }

    /// Reads the rows of consecutive vertices once, and those of faces near them.
    pub fn warm_up(&self, vertices: Range<usize>, faces: Range<usize>) {
        warm_up(&self.positions[vertices.clone()]);
        warm_up(&self.quadrics[vertices]);
        warm_up(&self.faces[faces]);
    }

    /// The key of two vertices that no edge joins.
    pub fn key_apart(&self, [u, w]: [u32; 2]) -> u32 {
        let [u, w] = [u as usize, w as usize];
        let (pu, pw) = (self.positions[u], self.positions[w]);
        Pair { pu, pw, first: self.quadrics[u], second: self.quadrics[w] }.compute(self.params)
    }

    /// Writes the keys of `pairs`.
    pub fn keys(&self, pairs: &[Edge], block: &mut PlaneBlock, keys: &mut [u32]) {
        for (pairs, keys) in pairs.chunks(LANES).zip(keys.chunks_mut(LANES)) {
            lanes::compute(0, (self, pairs), self.params, block, keys);
        }
    }
}

/// The key of a pair.
#[inline(always)]
fn plane_key(pair: &Pair, params: Params) -> u32 {
    let h = scale3(sub3(pair.pw.xyz(), pair.pu.xyz()), 0.5);
    let freedom = Freedom {
        first_locked: stays(pair.pu.flags, pair.pw.flags),
        second_locked: stays(pair.pw.flags, pair.pu.flags),
        placement: params.placement,
        regularization: params.regularization,
    };
    cost_key(plane_cost(pair.first, pair.second, h, freedom))
}

impl Lane for Pair {
    type Source<'a> = (&'a PlaneRows<'a>, &'a [Edge]);
    type Params = Params;
    type Output = u32;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (rows, pairs): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let ends = indices.map(|index| half_edge_ends(pairs[index].half_edge, rows.faces).map(|end| end as usize));
        lanes.put::<_, 4>(ends.map(|[u, _]| &rows.positions[u]));
        lanes.put::<_, 4>(ends.map(|[_, w]| &rows.positions[w]));
        lanes.put::<_, QUADRIC_WORDS>(ends.map(|[u, _]| &rows.quadrics[u]));
        lanes.put::<_, QUADRIC_WORDS>(ends.map(|[_, w]| &rows.quadrics[w]));
    }

    #[inline(always)]
    fn compute(self, params: Params) -> u32 {
        plane_key(&self, params)
    }
}

impl Kernel for PlaneCosts<'_> {
    const NAME: &'static str = "plane_costs";
    const SOURCE: &'static str = include_str!("../../shaders/plane_costs.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/half_edges.wgsl"),
        include_str!("../../shaders/shared/pair_quadric.wgsl"),
        include_str!("../../shaders/shared/plane_quadric.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params::new(self.placement)
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.pair_count
    }

    fn run_cpu(&mut self) {
        let rows = PlaneRows::on_host(self.positions, self.faces, self.quadrics, self.params());
        let pairs = &self.pairs.host()[..self.pair_count as usize];
        let keys = &mut self.keys.host_mut()[..pairs.len()];
        pairs.par_chunks(CHUNK).zip(keys.par_chunks_mut(CHUNK)).for_each_init(
            PlaneBlock::new,
            |block, (pairs, keys)| {
                rows.keys(pairs, block, keys);
            },
        );
    }
}
