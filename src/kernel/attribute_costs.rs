//! The cost of every pair by the `volume` metric and the attributes. Twin: `shaders/attribute_costs.wgsl`, line for line.
//!
//! # Reference
//! \[HO99\], per current face: with the gradient g of an attribute, its number s at the new vertex and e what the face has at
//! the pair's midpoint, Σ |n| (g·x + e − s)², least where s is the weighted mean of g·x + e. Departs: memoryless as the
//! geometry is, so that a wedge's own place and numbers make its terms zero, and sums a wedge make a pair cost O(1).
//! About the midpoint, with half the difference q of the ends' numbers: e = g·h − q on the faces of the first end,
//! q − g·h on those of the second, and 0 on those that they share.

use rayon::prelude::*;

use super::attribute_lanes::{
    Accumulate, Begin, Block, Finish, HEAD_WORDS, Head, NUMBER_WORDS, Numbers, Places, STATE_WORDS,
};
use super::attribute_terms::{
    Joint, Term, ends_half_exponent, freedom, joint_cost, side_weights, with_side, with_term,
};
use super::pair_quadric::{CONSTANTS, NO_WEIGHT, cost_key, scale_down};
use super::pairs::{NO_FACE, half_edge_corners};
use super::rows::{AttributeSum, BORDER, BorderSum, Edge, Face, Gradient, Normal, Position, VolumeSum};
use super::split::CHUNK;
use super::volume_costs::{Params as Policies, VOLUME_REGULARIZATION, volume_ends, with_border};
use super::volume_sums::border_term;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch, params};
use crate::math::Vec3;
use crate::math::exact::{Sym3, mul, scale3, sub, sub3, sym_add, trace};
use crate::math::lanes::{self, Columns, LANES};

/// Most numbers of a wedge that decide.
pub const MOST_COSTED: usize = 16;
/// One invocation a pair.
pub struct AttributeCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// V sums of the metric.
    pub sums: &'a Buffer<VolumeSum>,
    /// V border terms where the mesh has a border.
    pub borders: &'a Buffer<BorderSum>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// `costed` numbers for each wedge.
    pub values: &'a Buffer<f32>,
    /// `costed` gradients for each face.
    pub gradients: &'a Buffer<Gradient>,
    /// A sum for each wedge.
    pub wedge_sums: &'a Buffer<AttributeSum>,
    /// `costed` sums of |n| g for each wedge.
    pub slopes: &'a Buffer<Gradient>,
    /// P pairs.
    pub pairs: &'a Buffer<Edge>,
    /// P.
    pub pair_count: u32,
    /// Weight of the border term against the volume term, times |a−b|².
    pub border_weight: f32,
    /// Where placements may be: one of the constants of [`super::pair_quadric`].
    pub placement: u32,
    /// Numbers of a wedge.
    pub costed: u32,
    /// Writes P keys: the costs' bits, which order as the costs do.
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        pub(super) placement: u32,
        border_weight: f32,
        pub(super) regularization: f32,
        costed: u32,
    }
}
/// What pairs are costed from, on the host.
#[derive(Debug, Clone, Copy)]
pub struct AttributeRows<'a> {
    positions: &'a [Position],
    faces: &'a [Face],
    normals: &'a [Normal],
    sums: &'a [VolumeSum],
    borders: &'a [BorderSum],
    corners: &'a [Face],
    values: &'a [f32],
    gradients: &'a [Gradient],
    wedge_sums: &'a [AttributeSum],
    slopes: &'a [Gradient],
    params: Params,
}

/// The buffers that [`AttributeRows`] reads beside those of the `volume` metric.
#[derive(Debug, Clone, Copy)]
pub struct WedgeBuffers<'a> {
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// `costed` numbers for each wedge.
    pub values: &'a Buffer<f32>,
    /// `costed` gradients for each face.
    pub gradients: &'a Buffer<Gradient>,
    /// A sum for each wedge.
    pub wedge_sums: &'a Buffer<AttributeSum>,
    /// `costed` sums of |n| g for each wedge.
    pub slopes: &'a Buffer<Gradient>,
    /// Numbers of a wedge.
    pub costed: usize,
}

/// The wedges at both ends of a pair on one of its sides, and the faces there that both share.
#[derive(Debug, Clone, Copy)]
struct PairSide {
    first: u32,
    second: u32,
    left: u32,
    right: u32,
}

impl<'a> AttributeRows<'a> {
    /// In these buffers of the host.
    pub fn on_host(
        positions: &'a Buffer<Position>,
        faces: &'a Buffer<Face>,
        normals: &'a Buffer<Normal>,
        sums: &'a Buffer<VolumeSum>,
        borders: &'a Buffer<BorderSum>,
        wedges: WedgeBuffers<'a>,
        policies: Policies,
    ) -> Self {
        Self {
            positions: positions.host(),
            faces: faces.host(),
            normals: normals.host(),
            sums: sums.host(),
            borders: borders.host(),
            corners: wedges.corners.host(),
            values: wedges.values.host(),
            gradients: wedges.gradients.host(),
            wedge_sums: wedges.wedge_sums.host(),
            slopes: wedges.slopes.host(),
            params: Params::new(policies, wedges.costed as u32),
        }
    }

    /// The ends of a half-edge, and their wedges in its face.
    #[inline(always)]
    fn ends(&self, half_edge: u32) -> ([u32; 2], [u32; 2]) {
        let [u, w, _] = half_edge_corners(half_edge, self.faces);
        let [a, b, _] = half_edge_corners(half_edge, self.corners);
        ([u, w], [a, b])
    }

    /// The wedges of both ends in another face.
    #[inline(always)]
    fn wedges_in(&self, f: u32, [u, w]: [u32; 2]) -> [u32; 2] {
        let (face, corners) = (self.faces[f as usize].corners(), self.corners[f as usize].corners());
        let at = |v: u32| {
            if face[1] == v {
                corners[1]
            } else if face[2] == v {
                corners[2]
            } else {
                corners[0]
            }
        };
        [at(u), at(w)]
    }

    /// A function that writes the keys of pairs, for one thread.
    pub fn costing(&self) -> impl FnMut(&[Edge], &mut [u32]) + Send {
        let rows = *self;
        let mut block = Box::new(Block::new());
        move |pairs: &[Edge], keys: &mut [u32]| {
            for (pairs, keys) in pairs.chunks(LANES).zip(keys.chunks_mut(LANES)) {
                rows.keys_of(pairs, &mut block);
                for (lane, (&pair, key)) in pairs.iter().zip(keys).enumerate() {
                    *key = if rows.is_special(pair) { rows.key(pair) } else { block.keys.get(lane) };
                }
            }
        }
    }

    /// The keys of at most as many pairs as there are lanes, off borders and seams.
    fn keys_of(&self, pairs: &[Edge], block: &mut Block) {
        let Block { heads, numbers, states: [state, next], keys } = block;
        let (mut state, mut next) = (state, next);
        let mut places = [Places::default(); LANES];
        for (lane, &pair) in pairs.iter().enumerate() {
            heads.set(lane, self.head(pair));
            places[lane] = self.places(pair);
        }
        lanes::pass::<Begin, HEAD_WORDS, 0, STATE_WORDS>(heads, &Columns::new(), (), state);
        for j in 0..self.params.costed {
            places[..pairs.len()].iter().enumerate().for_each(|(lane, at)| numbers.set(lane, self.numbers(at, j)));
            lanes::pass::<Accumulate, NUMBER_WORDS, STATE_WORDS, STATE_WORDS>(numbers, state, (), next);
            (state, next) = (next, state);
        }
        lanes::pass::<Finish, HEAD_WORDS, STATE_WORDS, 1>(heads, state, self.params, keys);
    }

    #[inline(always)]
    fn head(&self, Edge { half_edge, across }: Edge) -> Head {
        let ([u, w], [a, b]) = self.ends(half_edge);
        Head {
            pu: self.positions[u as usize],
            pw: self.positions[w as usize],
            sum_u: self.sums[u as usize],
            sum_w: self.sums[w as usize],
            left: self.normals[(half_edge / 3) as usize],
            right: self.normal(across),
            first: self.wedge_sums[a as usize],
            second: self.wedge_sums[b as usize],
        }
    }

    /// Where the numbers of a pair begin.
    #[inline(always)]
    fn places(&self, Edge { half_edge, across }: Edge) -> Places {
        let (_, [a, b]) = self.ends(half_edge);
        let costed = self.params.costed;
        let right = (across != NO_FACE).then(|| (across * costed) as usize);
        Places {
            first: (a * costed) as usize,
            second: (b * costed) as usize,
            left: (half_edge / 3 * costed) as usize,
            right,
        }
    }

    #[inline(always)]
    fn numbers(&self, at: &Places, j: u32) -> Numbers {
        let j = j as usize;
        Numbers {
            first: self.slopes[at.first + j],
            second: self.slopes[at.second + j],
            left: self.gradients[at.left + j],
            right: at.right.map_or(Gradient::default(), |right| self.gradients[right + j]),
            at_first: self.values[at.first + j],
            at_second: self.values[at.second + j],
        }
    }

    /// Whether a pair lies on a border or along a seam.
    #[inline(always)]
    fn is_special(&self, Edge { half_edge, across }: Edge) -> bool {
        let ([u, w], wedges) = self.ends(half_edge);
        let flags = self.positions[u as usize].flags | self.positions[w as usize].flags;
        flags & BORDER != 0 || (across != NO_FACE && self.wedges_in(across, [u, w]) != wedges)
    }

    /// The key of any pair.
    pub fn key(&self, Edge { half_edge, across }: Edge) -> u32 {
        let ([u, w], [first, second]) = self.ends(half_edge);
        let f = half_edge / 3;
        if across == NO_FACE {
            let e = sub3(self.positions[w as usize].xyz(), self.positions[u as usize].xyz());
            let side = PairSide { first, second, left: f, right: NO_FACE };
            return self.key_of([u, w], border_term(e), side, None);
        }
        let other = self.wedges_in(across, [u, w]);
        if other == [first, second] {
            return self.key_of([u, w], Sym3::default(), PairSide { first, second, left: f, right: across }, None);
        }
        let left = PairSide { first, second, left: f, right: NO_FACE };
        let right = PairSide { first: other[0], second: other[1], left: NO_FACE, right: across };
        self.key_of([u, w], Sym3::default(), left, Some(right))
    }

    fn normal(&self, f: u32) -> Normal {
        if f == NO_FACE { Normal::default() } else { self.normals[f as usize] }
    }

    fn key_of(&self, [u, w]: [u32; 2], border: Sym3, side: PairSide, other: Option<PairSide>) -> u32 {
        let (pu, pw) = (self.positions[u as usize], self.positions[w as usize]);
        let left = self.normal(side.left);
        let right = self.normal(other.map_or(side.right, |other| other.right));
        let mut ends = volume_ends(self.sums[u as usize], self.sums[w as usize], left, right);
        if (pu.flags | pw.flags) & BORDER != 0 {
            let (first, second) = (self.borders[u as usize], self.borders[w as usize]);
            ends = with_border(ends, first, second, border, self.params.border_weight);
        }
        let sum = |wedge: u32| self.wedge_sums[wedge as usize];
        ends = with_side(ends, sum(side.first), sum(side.second));
        if let Some(other) = other {
            ends = with_side(ends, sum(other.first), sum(other.second));
        }
        if trace(sym_add(ends.first, ends.second)) <= NO_WEIGHT {
            return 0;
        }
        let h = scale3(sub3(pw.xyz(), pu.xyz()), 0.5);
        let half = ends_half_exponent(ends);
        let mut joint = self.with_terms(Joint::default(), side, half, h);
        if let Some(other) = other {
            joint = self.with_terms(joint, other, half, h);
        }
        cost_key(joint_cost(ends, joint, half, h, freedom(pu.flags, pw.flags, self.params)))
    }

    /// Adds the terms of a side.
    fn with_terms(&self, joint: Joint, side: PairSide, half: u32, h: Vec3) -> Joint {
        let s = scale_down(half);
        let s_sq = mul(s, s);
        let left_root = mul(self.normal(side.left).root, s);
        let right_root = mul(self.normal(side.right).root, s);
        let weight = |wedge: u32| mul(self.wedge_sums[wedge as usize].weight, s_sq);
        let weights = side_weights(weight(side.first), weight(side.second), left_root, right_root);
        let costed = self.params.costed;
        let slope = |wedge: u32, j: u32| self.slopes[(wedge * costed + j) as usize].xyz();
        let value = |wedge: u32, j: u32| self.values[(wedge * costed + j) as usize];
        let gradient = |f: u32, j: u32| {
            if f == NO_FACE { Vec3::ZERO } else { self.gradients[(f * costed + j) as usize].xyz() }
        };
        let mut joint = joint;
        for j in 0..costed {
            let term = Term {
                first: scale3(slope(side.first, j), s_sq),
                second: scale3(slope(side.second, j), s_sq),
                left: scale3(gradient(side.left, j), s),
                right: scale3(gradient(side.right, j), s),
                left_root,
                right_root,
                half: mul(sub(value(side.second, j), value(side.first, j)), 0.5),
            };
            joint = with_term(joint, term, weights, h);
        }
        joint
    }
}

impl Params {
    fn new(policies: Policies, costed: u32) -> Self {
        let Policies { placement, border_weight, .. } = policies;
        Self { placement, border_weight, regularization: VOLUME_REGULARIZATION, costed }
    }
}

impl Kernel for AttributeCosts<'_> {
    const NAME: &'static str = "attribute_costs";
    const SOURCE: &'static str = include_str!("../../shaders/attribute_costs.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/attribute_terms.wgsl"),
        include_str!("../../shaders/shared/border_term.wgsl"),
        include_str!("../../shaders/shared/half_edges.wgsl"),
        include_str!("../../shaders/shared/pair_quadric.wgsl"),
        include_str!("../../shaders/shared/volume_ends.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params::new(Policies::new(self.placement, self.border_weight), self.costed)
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
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("values", Access::Read, self.values),
            Binding::new("gradients", Access::Read, self.gradients),
            Binding::new("wedge_sums", Access::Read, self.wedge_sums),
            Binding::new("slopes", Access::Read, self.slopes),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.pair_count
    }

    fn run_cpu(&mut self) {
        let policies = Policies::new(self.placement, self.border_weight);
        let Self { positions, faces, normals, sums, borders, corners, values, gradients, wedge_sums, slopes, .. } =
            *self;
        let wedges = WedgeBuffers { corners, values, gradients, wedge_sums, slopes, costed: self.costed as usize };
        let rows = AttributeRows::on_host(positions, faces, normals, sums, borders, wedges, policies);
        let pairs = &self.pairs.host()[..self.pair_count as usize];
        let keys = &mut self.keys.host_mut()[..pairs.len()];
        let blocks = pairs.par_chunks(CHUNK).zip(keys.par_chunks_mut(CHUNK));
        blocks.for_each_init(|| rows.costing(), |keys_of, (pairs, keys)| keys_of(pairs, keys));
    }
}
