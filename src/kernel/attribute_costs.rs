//! The cost of every pair by the `volume` metric and the attributes. Twin: `shaders/attribute_costs.wgsl`, line for line.
//!
//! # Reference
//! \[HO99\], per current face: with the gradient g of an attribute, its number s at the new vertex and e what the face has at
//! the pair's midpoint, Σ |n| (g·x + e − s)², least where s is the weighted mean of g·x + e. Departs: memoryless as the
//! geometry is, so that a wedge's own place and numbers make its terms zero, and sums a wedge make a pair cost O(1).
//! About the midpoint, with half the difference q of the ends' numbers: e = g·h − q on the faces of the first end and
//! q − g·h on those of the second. The faces that both share, where e is 0, count twice: their gradients need not be read.

use rayon::prelude::*;

use super::attribute_lanes::{Accumulate, Begin, Block, Finish, HEAD_WORDS, Head, NUMBER_WORDS, Numbers, STATE_WORDS};
use super::attribute_terms::{
    Joint, ends_half_exponent, freedom, joint_cost, side_weights, term_of, with_side, with_term,
};
use super::pair_quadric::{CONSTANTS, NO_WEIGHT, cost_key, scale_down};
use super::pairs::{NO_FACE, half_edge_ends};
use super::rows::{AttributeSum, BORDER, BorderSum, Edge, Face, Normal, Position, Slope, VolumeSum};
use super::split::CHUNK;
use super::volume_costs::{Params as Policies, VOLUME_REGULARIZATION, volume_ends, with_border};
use super::volume_sums::border_term;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch, params};
use crate::math::Vec3;
use crate::math::exact::{Sym3, mul, scale3, sub3, sym_add, trace};
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
    /// A sum for each wedge.
    pub wedge_sums: &'a Buffer<AttributeSum>,
    /// `costed` numbers for each wedge, with the sums of |n| g.
    pub slopes: &'a Buffer<Slope>,
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
    wedge_sums: &'a [AttributeSum],
    slopes: &'a [Slope],
    params: Params,
}

/// The buffers that [`AttributeRows`] reads beside those of the `volume` metric.
#[derive(Debug, Clone, Copy)]
pub struct WedgeBuffers<'a> {
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// A sum for each wedge.
    pub wedge_sums: &'a Buffer<AttributeSum>,
    /// `costed` numbers for each wedge, with the sums of |n| g.
    pub slopes: &'a Buffer<Slope>,
    /// Numbers of a wedge.
    pub costed: usize,
}

/// A pair: its ends, the faces that both share, and the wedges of the ends in the first of them and in the second.
#[derive(Debug, Clone, Copy)]
struct Located {
    ends: [u32; 2],
    left: u32,
    right: u32,
    own: [u32; 2],
    other: [u32; 2],
}

impl Located {
    /// Whether it lies along a seam.
    fn tears(&self) -> bool {
        self.own != self.other
    }
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
            wedge_sums: wedges.wedge_sums.host(),
            slopes: wedges.slopes.host(),
            params: Params::new(policies, wedges.costed as u32),
        }
    }

    #[inline(always)]
    fn located(&self, Edge { half_edge, across }: Edge) -> Located {
        let ends = half_edge_ends(half_edge, self.faces);
        let own = half_edge_ends(half_edge, self.corners);
        let other = if across == NO_FACE { own } else { self.wedges_in(across, ends) };
        Located { ends, left: half_edge / 3, right: across, own, other }
    }

    /// The wedges of both ends in a face.
    #[inline(always)]
    fn wedges_in(&self, f: u32, ends: [u32; 2]) -> [u32; 2] {
        let (face, corners) = (self.faces[f as usize], self.corners[f as usize]);
        ends.map(|v| {
            let at = if face.c == v { corners.c } else { corners.a };
            if face.b == v { corners.b } else { at }
        })
    }

    /// A function that writes the keys of pairs, for one thread.
    pub fn costing(&self) -> impl FnMut(&[Edge], &mut [u32]) + Send {
        let rows = *self;
        let mut block = Box::new(Block::new());
        move |pairs: &[Edge], keys: &mut [u32]| {
            for (pairs, keys) in pairs.chunks(LANES).zip(keys.chunks_mut(LANES)) {
                rows.write_keys(pairs, &mut block, keys);
            }
        }
    }

    /// The keys of at most as many pairs as there are lanes: those off borders and seams together, then the others.
    fn write_keys(&self, pairs: &[Edge], block: &mut Block, out: &mut [u32]) {
        let Block { heads, numbers, states: [state, next], keys } = block;
        let (mut state, mut next) = (state, next);
        let mut starts = [[0; 2]; LANES];
        for ((lane, &pair), starts) in pairs.iter().enumerate().zip(&mut starts) {
            let located = self.located(pair);
            *starts = located.own.map(|wedge| (wedge * self.params.costed) as usize);
            heads.set(lane, self.head(located));
        }
        lanes::pass::<Begin, HEAD_WORDS, 0, STATE_WORDS>(heads, &Columns::new(), (), state);
        for j in 0..self.params.costed as usize {
            for (lane, starts) in starts[..pairs.len()].iter().enumerate() {
                let [first, second] = starts.map(|start| self.slopes[start + j]);
                numbers.set(lane, Numbers { first, second });
            }
            lanes::pass::<Accumulate, NUMBER_WORDS, STATE_WORDS, STATE_WORDS>(numbers, state, (), next);
            (state, next) = (next, state);
        }
        lanes::pass::<Finish, HEAD_WORDS, STATE_WORDS, 1>(heads, state, self.params, keys);
        for (lane, (&pair, key)) in pairs.iter().zip(out).enumerate() {
            let located = self.located(pair);
            *key = if self.is_special(located) { self.key_of(located) } else { keys.get(lane) };
        }
    }

    #[inline(always)]
    fn head(&self, Located { ends: [u, w], left, right, own: [first, second], .. }: Located) -> Head {
        Head {
            pu: self.positions[u as usize],
            pw: self.positions[w as usize],
            sum_u: self.sums[u as usize],
            sum_w: self.sums[w as usize],
            left: self.normals[left as usize],
            right: self.normal(right),
            first: self.wedge_sums[first as usize],
            second: self.wedge_sums[second as usize],
        }
    }

    /// Whether a pair lies at a border or along a seam.
    #[inline(always)]
    fn is_special(&self, located: Located) -> bool {
        let [u, w] = located.ends.map(|v| self.positions[v as usize].flags);
        (u | w) & BORDER != 0 || located.tears()
    }

    /// The key of any pair.
    pub fn key(&self, pair: Edge) -> u32 {
        self.key_of(self.located(pair))
    }

    fn normal(&self, f: u32) -> Normal {
        if f == NO_FACE { Normal::default() } else { self.normals[f as usize] }
    }

    fn key_of(&self, located: Located) -> u32 {
        let Located { ends: [u, w], left, right, own, other } = located;
        let (pu, pw) = (self.positions[u as usize], self.positions[w as usize]);
        let (sum_u, sum_w) = (self.sums[u as usize], self.sums[w as usize]);
        let mut ends = volume_ends(sum_u, sum_w, self.normal(left), self.normal(right));
        if (pu.flags | pw.flags) & BORDER != 0 {
            let is_on_border = right == NO_FACE;
            let border = if is_on_border { border_term(sub3(pw.xyz(), pu.xyz())) } else { Sym3::default() };
            let (first, second) = (self.borders[u as usize], self.borders[w as usize]);
            ends = with_border(ends, first, second, border, self.params.border_weight);
        }
        let sums = |[first, second]: [u32; 2]| (self.wedge_sums[first as usize], self.wedge_sums[second as usize]);
        let (first, second) = sums(own);
        ends = with_side(ends, first, second);
        if located.tears() {
            let (first, second) = sums(other);
            ends = with_side(ends, first, second);
        }
        if trace(sym_add(ends.first, ends.second)) <= NO_WEIGHT {
            return 0;
        }
        let h = scale3(sub3(pw.xyz(), pu.xyz()), 0.5);
        let half = ends_half_exponent(ends);
        let mut joint = self.with_terms(Joint::default(), own, half, h);
        if located.tears() {
            joint = self.with_terms(joint, other, half, h);
        }
        cost_key(joint_cost(ends, joint, half, h, freedom(pu.flags, pw.flags, self.params)))
    }

    /// Adds the terms of a side, whose wedges at both ends these are.
    fn with_terms(&self, joint: Joint, [first, second]: [u32; 2], half: u32, h: Vec3) -> Joint {
        let s = scale_down(half);
        let s_sq = mul(s, s);
        let weight = |wedge: u32| mul(self.wedge_sums[wedge as usize].weight, s_sq);
        let weights = side_weights(weight(first), weight(second));
        let costed = self.params.costed as usize;
        let slopes = |wedge: u32| &self.slopes[wedge as usize * costed..][..costed];
        let numbers = slopes(first).iter().zip(slopes(second));
        numbers.fold(joint, |joint, (&a, &b)| with_term(joint, term_of(a, b, s_sq), weights, h))
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
        let Self { positions, faces, normals, sums, borders, corners, wedge_sums, slopes, costed, .. } = *self;
        let wedges = WedgeBuffers { corners, wedge_sums, slopes, costed: costed as usize };
        let rows = AttributeRows::on_host(positions, faces, normals, sums, borders, wedges, policies);
        let pairs = &self.pairs.host()[..self.pair_count as usize];
        let keys = &mut self.keys.host_mut()[..pairs.len()];
        let blocks = pairs.par_chunks(CHUNK).zip(keys.par_chunks_mut(CHUNK));
        blocks.for_each_init(|| rows.costing(), |keys_of, (pairs, keys)| keys_of(pairs, keys));
    }
}
