//! The cost of every pair by the `volume` metric. Twin: `shaders/volume_costs.wgsl`, line for line.
//!
//! # Reference
//! \[LT98\] section 4: with n = (p1−p0)×(p2−p0) and d = n·p0 over the faces of both stars, the placement minimizes
//! Σ(n·x − d)²/|n| subject to (Σn)·x = Σd, which keeps the volume. Departs: a face counts by its area times the squared
//! distance to its plane, not by the square of its volume, in which large faces drown small ones; one regularized solve
//! instead of a choice of independent constraints; a pair at a border drops the volume constraint and adds the border
//! term of its ends.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::pair_quadric::{
    CONSTANTS, Freedom, NO_WEIGHT, PairQuadric, cost_key, end_matrices, half_exponent, pair_cost, scale_down, scale_up,
    stays,
};
use super::pairs::{NO_FACE, half_edge_ends};
use super::rows::{BORDER, BorderSum, Edge, Face, Normal, Position, VolumeSum};
use super::split::CHUNK;
use super::volume_sums::border_term;
use super::warm::warm_up;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch, params};
use crate::math::Vec3;
use crate::math::exact::{Sym3, add3, dot3, mul, outer, scale3, sub3, sym_add, sym_scale, trace};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

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
    /// Writes P keys: the costs' bits, which order as the costs do.
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
pub struct Pair {
    pu: Position,
    pw: Position,
    sum_u: VolumeSum,
    sum_w: VolumeSum,
    left: Normal,
    right: Normal,
}

/// 32-bit scalars of a [`Pair`].
const PAIR_WORDS: usize = size_of::<Pair>() / 4;
const SUM_WORDS: usize = size_of::<VolumeSum>() / 4;
/// Beyond a border.
static NO_NORMAL: Normal = Normal { x: 0.0, y: 0.0, z: 0.0, root: 0.0 };

/// The same of a pair with an end on the border, and of the border.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct BorderPair {
    pair: Pair,
    first: BorderSum,
    second: BorderSum,
    /// [`NO_FACE`] where the pair lies along the border.
    across: u32,
}

/// 32-bit scalars of a [`BorderPair`], and of a row of its border.
const BORDER_PAIR_WORDS: usize = size_of::<BorderPair>() / 4;
const BORDER_WORDS: usize = size_of::<BorderSum>() / 4;

/// Scratch of [`VolumeRows::keys`].
#[derive(Debug, Default)]
pub struct VolumeBlock {
    pairs: Columns<Pair, PAIR_WORDS>,
    border_pairs: Columns<BorderPair, BORDER_PAIR_WORDS>,
    /// Which pairs have an end on the border; longer than there are.
    on_border: Vec<u32>,
}

impl Pair {
    fn is_on_border(&self) -> bool {
        (self.pu.flags | self.pw.flags) & BORDER != 0
    }
}

/// What pairs are costed from, on the host.
#[derive(Debug, Clone, Copy)]
pub struct VolumeRows<'a> {
    positions: &'a [Position],
    faces: &'a [Face],
    normals: &'a [Normal],
    sums: &'a [VolumeSum],
    borders: &'a [BorderSum],
    params: Params,
}

impl<'a> VolumeRows<'a> {
    /// In these buffers of the host.
    pub fn on_host(
        positions: &'a Buffer<Position>,
        faces: &'a Buffer<Face>,
        normals: &'a Buffer<Normal>,
        sums: &'a Buffer<VolumeSum>,
        borders: &'a Buffer<BorderSum>,
        params: Params,
    ) -> Self {
        let (positions, faces, normals) = (positions.host(), faces.host(), normals.host());
        Self { positions, faces, normals, sums: sums.host(), borders: borders.host(), params }
    }

    /// Reads the rows of consecutive vertices once, and those of faces near them.
    pub fn warm_up(&self, vertices: Range<usize>, faces: Range<usize>) {
        warm_up(&self.positions[vertices.clone()]);
        warm_up(&self.sums[vertices]);
        warm_up(&self.faces[faces.clone()]);
        warm_up(&self.normals[faces]);
    }

    /// The key of two vertices that no edge joins.
    pub fn key_apart(&self, [u, w]: [u32; 2]) -> u32 {
        let (pu, pw) = (self.positions[u as usize], self.positions[w as usize]);
        let pair = Pair { pu, pw, sum_u: self.sums[u as usize], sum_w: self.sums[w as usize], ..Pair::default() };
        if !pair.is_on_border() {
            return pair.compute(self.params);
        }
        let (first, second) = (self.borders[u as usize], self.borders[w as usize]);
        let ends = with_border(ends_of(&pair), first, second, Sym3::default(), self.params.border_weight);
        ends_key(ends, &pair, self.params)
    }

    /// Writes the keys of `pairs`.
    pub fn keys(&self, pairs: &[Edge], block: &mut VolumeBlock, keys: &mut [u32]) {
        let VolumeBlock { pairs: block, border_pairs, on_border } = block;
        let has_border = self.borders.len() > 1;
        if has_border {
            on_border.resize(on_border.len().max(pairs.len()), 0);
        }
        let mut count = 0;
        for (first, keys) in (0..pairs.len()).step_by(LANES).zip(keys.chunks_mut(LANES)) {
            lanes::compute(first, (self, pairs), self.params, block, keys);
            if has_border {
                for lane in 0..keys.len() {
                    // Written whether it is one or not: a branch would be misjudged along every border.
                    on_border[count] = (first + lane) as u32;
                    count += usize::from(block.get(lane).is_on_border());
                }
            }
        }
        for numbers in on_border[..count].chunks(LANES) {
            let mut own = [0; LANES];
            lanes::compute(0, (self, pairs, numbers), self.params, border_pairs, &mut own[..numbers.len()]);
            numbers.iter().zip(own).for_each(|(&number, key)| keys[number as usize] = key);
        }
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

impl Lane for Pair {
    type Source<'a> = (&'a VolumeRows<'a>, &'a [Edge]);
    type Params = Params;
    type Output = u32;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (rows, pairs): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let VolumeRows { positions, normals, sums, .. } = *rows;
        let pairs = indices.map(|index| &pairs[index]);
        let ends = pairs.map(|pair| half_edge_ends(pair.half_edge, rows.faces).map(|end| end as usize));
        let right = |pair: &Edge| if pair.across == NO_FACE { &NO_NORMAL } else { &normals[pair.across as usize] };
        lanes.put::<_, 4>(ends.map(|[u, _]| &positions[u]));
        lanes.put::<_, 4>(ends.map(|[_, w]| &positions[w]));
        lanes.put::<_, SUM_WORDS>(ends.map(|[u, _]| &sums[u]));
        lanes.put::<_, SUM_WORDS>(ends.map(|[_, w]| &sums[w]));
        lanes.put::<_, 4>(pairs.map(|pair| &normals[pair.half_edge as usize / 3]));
        lanes.put::<_, 4>(pairs.map(right));
    }

    /// The key of a pair off the border.
    #[inline(always)]
    fn compute(self, params: Params) -> u32 {
        ends_key(ends_of(&self), &self, params)
    }
}

impl Lane for BorderPair {
    /// With the numbers of the pairs that have an end on the border.
    type Source<'a> = (&'a VolumeRows<'a>, &'a [Edge], &'a [u32]);
    type Params = Params;
    type Output = u32;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (rows, pairs, numbers): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let indices = indices.map(|index| numbers[index] as usize);
        Pair::gather(indices, (rows, pairs), lanes);
        let pairs = indices.map(|index| &pairs[index]);
        let ends = pairs.map(|pair| half_edge_ends(pair.half_edge, rows.faces).map(|end| end as usize));
        lanes.put::<_, BORDER_WORDS>(ends.map(|[u, _]| &rows.borders[u]));
        lanes.put::<_, BORDER_WORDS>(ends.map(|[_, w]| &rows.borders[w]));
        lanes.put::<_, 1>(pairs.map(|pair| &pair.across));
    }

    #[inline(always)]
    fn compute(self, params: Params) -> u32 {
        let Self { pair, first, second, across } = self;
        let term = border_term(sub3(pair.pw.xyz(), pair.pu.xyz()));
        let mutual = if across == NO_FACE { term } else { Sym3::default() };
        ends_key(with_border(ends_of(&pair), first, second, mutual, params.border_weight), &pair, params)
    }
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

    /// The pair of the half-edge from `u` to `w` between the faces `f` and `g`: what [`Pair::gather`] puts into a lane.
    fn pair_between(f: u32, g: u32, [u, w]: [u32; 2], rows: &VolumeRows<'_>) -> Pair {
        Pair {
            pu: rows.positions[u as usize],
            pw: rows.positions[w as usize],
            sum_u: rows.sums[u as usize],
            sum_w: rows.sums[w as usize],
            left: rows.normals[f as usize],
            right: if g == NO_FACE { NO_NORMAL } else { rows.normals[g as usize] },
        }
    }

    /// Magnitudes from underflow to the greatest that sums leave finite, of either sign.
    fn hostile(i: u32) -> f32 {
        let mixed = i.wrapping_mul(0x9e37_79b9) ^ (i << 7);
        let magnitude = [0.0, 1e-40, 1e-30, 1e-19, 1e-9, 1e-3, 1.0, 1.7, 1e3, 1e9][(mixed >> 8) as usize % 10];
        if mixed & 1 == 0 { magnitude } else { -magnitude }
    }

    #[test]
    fn lanes_have_the_bits_of_scalar_calls() {
        // Islands of two faces: one edge of each has a face across, the others have none.
        let islands = 200_u32;
        let position = |i| Position { x: hostile(3 * i), y: hostile(3 * i + 1), z: hostile(3 * i + 2), flags: i & 3 };
        let positions: Vec<Position> = (0..4 * islands).map(position).collect();
        let island = |i| [Face { a: 4 * i, b: 4 * i + 1, c: 4 * i + 2 }, Face { a: 4 * i, b: 4 * i + 2, c: 4 * i + 3 }];
        let faces: Vec<Face> = (0..islands).flat_map(island).collect();
        let normal = |i| Normal { x: hostile(i), y: hostile(7 * i), z: hostile(11 * i + 5), root: hostile(i).abs() };
        let normals: Vec<Normal> = (0..2 * islands).map(normal).collect();
        let sum = |i: u32| VolumeSum {
            xx: hostile(i).abs(),
            yy: 1.0,
            zz: 0.5,
            xy: 0.1,
            nx: hostile(5 * i),
            ..VolumeSum::default()
        };
        let sums: Vec<VolumeSum> = (0..4 * islands).map(sum).collect();
        let across = |i: u32| if i % 3 == 2 { (i / 3) ^ 1 } else { NO_FACE };
        let pairs: Vec<Edge> = (0..6 * islands).map(|i| Edge { half_edge: i, across: across(i) }).collect();
        let mut block = VolumeBlock::default();
        for placement in 0..4 {
            let params = Params { placement, border_weight: 9.0, regularization: VOLUME_REGULARIZATION };
            let (positions, faces, normals, sums) = (&positions[..], &faces[..], &normals[..], &sums[..]);
            let rows = VolumeRows { positions, faces, normals, sums, borders: &[], params };
            let source = (&rows, &pairs[..]);
            for len in [1, 2, 3, 4, 5, 6, 7, LANES] {
                for first in (0..pairs.len() - len).step_by(len) {
                    let mut keys = vec![0; len];
                    lanes::compute(first, source, params, &mut block.pairs, &mut keys);
                    let scalar = |&Edge { half_edge, across }: &Edge| {
                        pair_between(half_edge / 3, across, half_edge_ends(half_edge, faces), &rows).compute(params)
                    };
                    let scalar: Vec<u32> = pairs[first..first + len].iter().map(scalar).collect();
                    assert_eq!(keys, scalar, "from pair {first} on");
                }
            }
            // At a border, and away from it: as many as fill blocks of either, and a part of one.
            let border =
                |i: u32| BorderSum { xx: hostile(3 * i).abs(), xy: hostile(i), zz: 2.0, ..BorderSum::default() };
            let borders: Vec<BorderSum> = (0..4 * islands).map(border).collect();
            let rows = VolumeRows { borders: &borders, ..rows };
            for len in [1, LANES, 1_000, pairs.len()] {
                let mut keys = vec![0; len];
                rows.keys(&pairs[..len], &mut block, &mut keys);
                let mut on_border = 0;
                for (&Edge { half_edge, across }, key) in pairs.iter().zip(keys) {
                    let [u, w] = half_edge_ends(half_edge, faces);
                    let pair = pair_between(half_edge / 3, across, [u, w], &rows);
                    let (first, second) = (borders[u as usize], borders[w as usize]);
                    on_border += usize::from(pair.is_on_border());
                    let expected = match pair.is_on_border() {
                        true => BorderPair { pair, first, second, across }.compute(params),
                        false => pair.compute(params),
                    };
                    assert_eq!(key, expected, "{half_edge}");
                }
                assert!(len < LANES || (on_border > len / 4 && on_border < len), "{on_border} of {len}");
            }
        }
    }
}
