//! What the costs of the `volume` metric are computed from on the host: rows gathered into lanes, those at a border in lanes of
//! their own.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::pair_quadric::NO_KEY;
use super::pairs::{NO_FACE, half_edge_ends};
use super::rows::{BORDER, BorderSum, Edge, Face, Normal, Position, VolumeSum};
use super::volume_costs::{BorderPair, Pair, Params, is_across};
use super::warm::warm_up;
use crate::backend::Buffer;
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// 32-bit scalars of a [`Pair`].
const PAIR_WORDS: usize = size_of::<Pair>() / 4;
const SUM_WORDS: usize = size_of::<VolumeSum>() / 4;
/// 32-bit scalars of a [`BorderPair`], and of a row of its border.
const BORDER_PAIR_WORDS: usize = size_of::<BorderPair>() / 4;
const BORDER_WORDS: usize = size_of::<BorderSum>() / 4;

/// Beyond a border.
static NO_NORMAL: Normal = Normal { x: 0.0, y: 0.0, z: 0.0, root: 0.0 };

/// Where more than one pair in so many was on the border, the next are sorted out before they are costed. Of scans and CAD parts one in
/// twenty is, of strips and leaves most; no other share was tried.
const MANY: usize = 4;

/// Scratch of [`VolumeRows::keys`].
#[derive(Debug, Default)]
pub struct VolumeBlock {
    pairs: Columns<Pair, PAIR_WORDS>,
    border_pairs: Columns<BorderPair, BORDER_PAIR_WORDS>,
    /// Which pairs have an end on the border; longer than there are.
    on_border: Vec<u32>,
    /// Which of the others are costed after these, where many are on the border; likewise.
    off_border: Vec<u32>,
    numbered: Columns<NumberedPair, PAIR_WORDS>,
}

/// A [`Pair`] among some by their numbers.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct NumberedPair(Pair);

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
        if pair.is_on_border() {
            let borders = [u, w].map(|vertex| self.borders[vertex as usize]);
            return pair.key_apart(borders, self.params);
        }
        pair.key(self.params)
    }

    /// Writes the keys of `pairs`.
    pub fn keys(&self, pairs: &[Edge], block: &mut VolumeBlock, keys: &mut [u32]) {
        let VolumeBlock { pairs: block, border_pairs, on_border, off_border, numbered } = block;
        let chunks = (0..pairs.len()).step_by(LANES).zip(keys.chunks_mut(LANES));
        if self.borders.len() <= 1 {
            chunks.for_each(|(first, keys)| lanes::compute(first, (self, pairs), self.params, block, keys));
            return;
        }
        for numbers in [&mut *on_border, &mut *off_border] {
            numbers.resize(numbers.len().max(pairs.len()), 0);
        }
        let (mut on, mut off, mut are_many) = (0, 0, false);
        for (first, keys) in chunks {
            let before = on;
            // Written whether it is one or not: a branch would be misjudged along every border.
            if are_many {
                for (number, pair) in (first..).zip(&pairs[first..first + keys.len()]) {
                    let [at_u, at_w] = self.flags(pair);
                    let is_on_border = (at_u | at_w) & BORDER != 0;
                    (on_border[on], off_border[off]) = (number as u32, number as u32);
                    (on, off) = (on + usize::from(is_on_border), off + usize::from(!is_on_border));
                }
            } else {
                lanes::compute(first, (self, pairs), self.params, block, keys);
                for lane in 0..keys.len() {
                    on_border[on] = (first + lane) as u32;
                    on += usize::from(block.get(lane).is_on_border());
                }
            }
            // What is next to them is on it, too, for the most part: then only those off it are costed as such.
            are_many = MANY * (on - before) > keys.len();
        }
        let on = self.leave_out_across(&mut on_border[..on], pairs, keys);
        self.write_keys(&on_border[..on], pairs, border_pairs, keys);
        self.write_keys(&off_border[..off], pairs, numbered, keys);
    }

    /// The flags of the ends of a pair.
    #[inline(always)]
    fn flags(&self, pair: &Edge) -> [u32; 2] {
        half_edge_ends(pair.half_edge, self.faces).map(|v| self.positions[v as usize].flags)
    }

    /// Moves to the front the numbers of those pairs that do not run across the surface; the others get no key. Returns how many.
    fn leave_out_across(&self, numbers: &mut [u32], pairs: &[Edge], keys: &mut [u32]) -> usize {
        let mut left = 0;
        for i in 0..numbers.len() {
            let number = numbers[i];
            let pair = &pairs[number as usize];
            let [at_u, at_w] = self.flags(pair);
            let is_across = is_across(at_u, at_w, pair.across);
            // Those that have one are costed next.
            keys[number as usize] = NO_KEY;
            numbers[left] = number;
            left += usize::from(!is_across);
        }
        left
    }

    /// Writes the keys of those of `pairs` that have these numbers.
    fn write_keys<T, const WORDS: usize>(
        &self,
        numbers: &[u32],
        pairs: &[Edge],
        block: &mut Columns<T, WORDS>,
        keys: &mut [u32],
    ) where
        T: for<'s> Lane<Source<'s> = (&'s VolumeRows<'s>, &'s [Edge], &'s [u32]), Params = Params, Output = u32>,
    {
        for numbers in numbers.chunks(LANES) {
            let mut own = [0; LANES];
            lanes::compute(0, (self, pairs, numbers), self.params, block, &mut own[..numbers.len()]);
            numbers.iter().zip(own).for_each(|(&number, key)| keys[number as usize] = key);
        }
    }
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

    #[inline(always)]
    fn compute(self, params: Params) -> u32 {
        self.key(params)
    }
}

impl Lane for NumberedPair {
    /// With the numbers of some pairs.
    type Source<'a> = (&'a VolumeRows<'a>, &'a [Edge], &'a [u32]);
    type Params = Params;
    type Output = u32;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (rows, pairs, numbers): Self::Source<'_>, lanes: &mut Quad<'_>) {
        Pair::gather(indices.map(|index| numbers[index] as usize), (rows, pairs), lanes);
    }

    #[inline(always)]
    fn compute(self, params: Params) -> u32 {
        self.0.key(params)
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
        self.key(params)
    }
}

#[cfg(test)]
mod tests {
    use super::super::rows::LOCKED;
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
        // Stretches of a few blocks: next to none on the border, all of every fourth island and none of another, as few again.
        let flags = |i: u32| match (i / 4, i / 4 % 4) {
            (60..120, 0) => BORDER,
            (60..120, 1) => 0,
            (60..120, _) => i & (BORDER | LOCKED),
            (17 | 40 | 155 | 171, _) => BORDER,
            _ => 0,
        };
        let position =
            |i| Position { x: hostile(3 * i), y: hostile(3 * i + 1), z: hostile(3 * i + 2), flags: flags(i) };
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
            let params = Params::new(placement, 9.0);
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
                let (mut on_border, mut across_it) = (0, 0);
                for (&Edge { half_edge, across }, key) in pairs.iter().zip(keys) {
                    let [u, w] = half_edge_ends(half_edge, faces);
                    let pair = pair_between(half_edge / 3, across, [u, w], &rows);
                    let (first, second) = (borders[u as usize], borders[w as usize]);
                    let is_across = is_across(pair.pu.flags, pair.pw.flags, across);
                    on_border += usize::from(pair.is_on_border());
                    across_it += usize::from(is_across);
                    let expected = match pair.is_on_border() {
                        true if is_across => NO_KEY,
                        true => BorderPair { pair, first, second, across }.compute(params),
                        false => pair.compute(params),
                    };
                    assert_eq!(key, expected, "{half_edge}");
                }
                let are_some = len < 1_000 || (on_border > len / 8 && on_border < len / 2 && across_it > len / 40);
                assert!(are_some, "{on_border} and {across_it} of {len}");
            }
        }
    }
}
