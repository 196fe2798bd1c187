//! What the attributes on a side of a pair cost, in double precision: sums over its faces, many numbers at a time.
//!
//! Numbers of a row stand side by side, so that a vector holds those of one corner; nothing is added across a vector before
//! the end. Lanes past the numbers that are summed hold anything and are never read.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use multiversion::multiversion;

use crate::kernel::attribute_spreads::MOST_COSTED;
use crate::math::DVec3;
use crate::math::lanes::{NUMBERS, Numbers};

use super::face_terms::{FaceTerm, FaceTerms};
use super::placement::Quadric;
use super::sides::CornerFace;
use super::wedges::WedgeNumbers;

/// Blocks of so many for all that decide.
const BLOCKS: usize = MOST_COSTED / NUMBERS;

/// At most so many numbers are summed in half of the lanes: a texture's, or a normal's.
const FEW_LANES: usize = NUMBERS / 2;

type Lanes = Numbers<f64>;

/// How far a number of a row may be off where it is put together from others, of itself: some units in the last place.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Some numbers of a side about the middle of the pair.
#[derive(Debug, Clone, Copy, Default)]
struct Terms {
    /// Half the difference of the ends' numbers, and their mean.
    half: Lanes,
    mean: Lanes,
    /// Σ |n| g and Σ |n| e, of numbers less the mean.
    g: [Lanes; 3],
    e: Lanes,
    /// The least and the greatest of the corners.
    low: Numbers<f32>,
    high: Numbers<f32>,
}

/// Sums of |n| (g·x + e)², a number to a lane.
#[derive(Debug, Clone, Copy)]
struct QuadricLanes<const COUNT: usize> {
    /// The upper half of Σ |n| g gᵀ, row by row; Σ |n| g e; Σ |n| e².
    columns: [[f64; COUNT]; 10],
}

impl<const COUNT: usize> QuadricLanes<COUNT> {
    const ZERO: Self = Self { columns: [[0.0; COUNT]; 10] };

    #[inline(always)]
    fn add(&mut self, lane: usize, [x, y, z]: [f64; 3], [wx, wy, wz]: [f64; 3], e: f64, we: f64) {
        let terms = [wx * x, wx * y, wx * z, wy * y, wy * z, wz * z, wx * e, wy * e, wz * e, we * e];
        for (column, term) in self.columns.iter_mut().zip(terms) {
            column[lane] += term;
        }
    }

    /// The first lanes.
    #[inline(always)]
    fn first<const FIRST: usize>(&self) -> QuadricLanes<FIRST> {
        let mut first = QuadricLanes::ZERO;
        for (column, own) in first.columns.iter_mut().zip(&self.columns) {
            column.copy_from_slice(&own[..FIRST]);
        }
        first
    }

    /// Replaces the first lanes.
    #[inline(always)]
    fn set_first<const FIRST: usize>(&mut self, first: &QuadricLanes<FIRST>) {
        for (column, own) in first.columns.iter().zip(&mut self.columns) {
            own[..FIRST].copy_from_slice(column);
        }
    }

    /// Adds the sums of the first `lanes` lanes to a quadric, in their order.
    fn add_to(&self, quadric: &mut Quadric, lanes: usize) {
        let sum = |column: &[f64; COUNT]| column[..lanes].iter().sum::<f64>();
        let [xx, xy, xz, yy, yz, zz, x, y, z, c] = self.columns.each_ref().map(sum);
        quadric.add_sums([xx, xy, xz, yy, yz, zz], DVec3::new(x, y, z), c);
    }
}

/// What the numbers of all sides of a pair cost, before the lanes are added up.
#[derive(Debug)]
pub struct CostSums {
    /// As long as the new wedges have the means.
    means: [QuadricLanes<NUMBERS>; BLOCKS],
    /// What the best numbers save.
    saved: [QuadricLanes<NUMBERS>; BLOCKS],
}

impl Default for CostSums {
    fn default() -> Self {
        Self { means: [QuadricLanes::ZERO; BLOCKS], saved: [QuadricLanes::ZERO; BLOCKS] }
    }
}

impl CostSums {
    /// Forgets all sides, for so many numbers that decide.
    pub fn begin(&mut self, costed: usize) {
        let blocks = costed.div_ceil(NUMBERS);
        self.means[..blocks].fill(QuadricLanes::ZERO);
        self.saved[..blocks].fill(QuadricLanes::ZERO);
    }

    /// Adds to quadrics what so many numbers cost with the means, and what the best ones save.
    pub fn add_to(&self, costed: usize, quadric: &mut Quadric, saved: &mut Quadric) {
        for (lanes, quadric) in [(&self.means, quadric), (&self.saved, saved)] {
            for (block, lanes) in lanes.iter().enumerate().take(costed.div_ceil(NUMBERS)) {
                lanes.add_to(quadric, (costed - block * NUMBERS).min(NUMBERS));
            }
        }
    }
}

/// The faces of a side.
#[derive(Debug, Clone, Copy)]
pub struct OwnFaces<'a> {
    /// Those around the pair.
    pub faces: &'a [CornerFace],
    pub terms: &'a FaceTerms,
    /// Which of them are the side's.
    pub own: &'a [u32],
    pub numbers: WedgeNumbers<'a>,
}

/// Sums over the faces of a side.
#[derive(Debug, Clone, Copy, Default)]
pub struct SideSums {
    /// Σ |n|.
    pub weight: f64,
    terms: [Terms; BLOCKS],
}

impl SideSums {
    /// Forgets all faces, for these wedges of two ends, of which so many numbers count.
    pub fn begin(&mut self, numbers: WedgeNumbers<'_>, wedges: [u32; 2], summed: usize) {
        self.weight = 0.0;
        for (block, terms) in self.terms.iter_mut().enumerate().take(summed.div_ceil(NUMBERS)) {
            let [first, second] = wedges.map(|wedge| numbers.at::<NUMBERS>(wedge, block * NUMBERS));
            let (mut low, mut high, mut half, mut mean) = (first, first, [0.0; NUMBERS], [0.0; NUMBERS]);
            for lane in 0..NUMBERS {
                low[lane] = if second[lane] < low[lane] { second[lane] } else { low[lane] };
                high[lane] = if second[lane] > high[lane] { second[lane] } else { high[lane] };
                let (a, b) = (f64::from(first[lane]), f64::from(second[lane]));
                (half[lane], mean[lane]) = ((b - a) * 0.5, (a + b) * 0.5);
            }
            *terms = Terms { half, mean, low, high, ..Terms::default() };
        }
    }

    /// Adds the faces of the side, once after [`begin`](Self::begin) with as many `summed`; and to `costs` what their first
    /// `costed` numbers cost.
    pub fn add_faces(&mut self, faces: OwnFaces<'_>, [costed, summed]: [usize; 2], costs: &mut CostSums) {
        for (block, terms) in self.terms.iter_mut().enumerate().take(costed.div_ceil(NUMBERS)) {
            let (first, costs) = (block * NUMBERS, [&mut costs.means[block], &mut costs.saved[block]]);
            self.weight = match summed - first {
                ..=FEW_LANES => add_faces::<FEW_LANES>(faces, first, terms, costs),
                _ => add_faces::<NUMBERS>(faces, first, terms, costs),
            };
        }
    }

    /// Half the difference of the ends' numbers, their mean, Σ |n| g and Σ |n| e of each number.
    fn numbers(&self, count: usize) -> impl Iterator<Item = (f64, f64, DVec3, f64)> {
        (0..count).map(|i| {
            let (terms, lane) = (&self.terms[i / NUMBERS], i % NUMBERS);
            let [x, y, z] = &terms.g;
            (terms.half[lane], terms.mean[lane], DVec3::new(x[lane], y[lane], z[lane]), terms.e[lane])
        })
    }

    /// What the numbers of an end cost at its place `x` more than the means; `sign` is −1 for the first.
    pub fn at_end(&self, costed: usize, x: DVec3, sign: f64) -> f64 {
        let value = |(half, _, g, e): (f64, f64, DVec3, f64)| {
            let s = sign * half;
            s * (s * self.weight - 2.0 * (g.dot(x) + e))
        };
        self.numbers(costed).map(value).sum()
    }

    /// What the best numbers at a place cost more than the means.
    pub fn at_best(&self, costed: usize, x: DVec3) -> f64 {
        let inverse = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        self.numbers(costed).map(|(_, _, g, e)| -(g.dot(x) + e) * (g.dot(x) + e) * inverse).sum()
    }

    /// What the rounding of rows may cost: nothing that is linear is so to the last bit.
    pub fn rounding(&self, costed: usize) -> f64 {
        let square = |(half, mean, ..): (f64, f64, DVec3, f64)| half * half + mean * mean;
        ROUNDING * ROUNDING * self.weight * self.numbers(costed).map(square).sum::<f64>()
    }

    /// A number brought to those of the corners, or no farther off than `past` of their range.
    pub fn held(&self, number: usize, x: f32, past: f32) -> f32 {
        let (terms, lane) = (&self.terms[number / NUMBERS], number % NUMBERS);
        let (low, high) = (terms.low[lane], terms.high[lane]);
        // A range may be infinite.
        let past = if past > 0.0 { (high - low) * past } else { 0.0 };
        let (low, high) = ((low - past).max(f32::MIN), (high + past).min(f32::MAX));
        let x = if x >= low { x } else { low };
        if x <= high { x } else { high }
    }

    /// Writes the best numbers at a place: those that are summed, as many as there is room for.
    pub fn write_least(&self, x: DVec3, summed: &mut [f32]) {
        let inverse = if self.weight > 0.0 { 1.0 / self.weight } else { 0.0 };
        for (Terms { mean, g, e, .. }, out) in self.terms.iter().zip(summed.chunks_mut(NUMBERS)) {
            let mut least = [0.0; NUMBERS];
            for lane in 0..NUMBERS {
                let slope = g[0][lane] * x.x + g[1][lane] * x.y + g[2][lane] * x.z;
                least[lane] = (mean[lane] + (slope + e[lane]) * inverse) as f32;
            }
            out.copy_from_slice(&least[..out.len()]);
        }
    }
}

/// Adds a side's own faces to the terms of so many numbers from `first` on, and returns their weight; and what they cost with the
/// means and what the best numbers save to sums.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn add_faces<const COUNT: usize>(
    faces: OwnFaces<'_>,
    first: usize,
    terms: &mut Terms,
    [means, saved]: [&mut QuadricLanes<NUMBERS>; 2],
) -> f64 {
    // Apart from what is in memory, so that registers hold them.
    let (mut g_sum, mut e_sum, mut own) = ([[0.0; COUNT]; 3], [0.0; COUNT], means.first::<COUNT>());
    let (mut mean, mut low, mut high) = ([0.0; COUNT], [0.0; COUNT], [0.0; COUNT]);
    mean.copy_from_slice(&terms.mean[..COUNT]);
    low.copy_from_slice(&terms.low[..COUNT]);
    high.copy_from_slice(&terms.high[..COUNT]);
    let mut total = 0.0;
    for &number in faces.own {
        let [a, b, c] = faces.faces[number as usize].wedges;
        let (v0, v1, v2): ([f32; COUNT], [f32; COUNT], [f32; COUNT]) =
            (faces.numbers.at(a, first), faces.numbers.at(b, first), faces.numbers.at(c, first));
        let FaceTerm { c1, c2, c1_at, c2_at, weight, offset } = faces.terms.get(number as usize);
        total += weight;
        for lane in 0..COUNT {
            // The first corner has the wedge of an end.
            let least = if v1[lane] < v2[lane] { v1[lane] } else { v2[lane] };
            let most = if v1[lane] > v2[lane] { v1[lane] } else { v2[lane] };
            low[lane] = if least < low[lane] { least } else { low[lane] };
            high[lane] = if most > high[lane] { most } else { high[lane] };
        }
        for lane in 0..COUNT {
            let at = f64::from(v0[lane]);
            let (d1, d2) = (f64::from(v1[lane]) - at, f64::from(v2[lane]) - at);
            let g = [c1.x * d1 + c2.x * d2, c1.y * d1 + c2.y * d2, c1.z * d1 + c2.z * d2];
            let e = (at - c1_at * d1 - c2_at * d2 - mean[lane]) * offset;
            let (weighted, we) = ([g[0] * weight, g[1] * weight, g[2] * weight], e * weight);
            g_sum[0][lane] += weighted[0];
            g_sum[1][lane] += weighted[1];
            g_sum[2][lane] += weighted[2];
            e_sum[lane] += we;
            own.add(lane, g, weighted, e, we);
        }
    }
    means.set_first(&own);
    if total > 0.0 {
        // The square of the weighted mean of all faces' functions.
        let (inverse, mut own) = (1.0 / total, saved.first::<COUNT>());
        for lane in 0..COUNT {
            let sums = [g_sum[0][lane], g_sum[1][lane], g_sum[2][lane]];
            let g = [sums[0] * inverse, sums[1] * inverse, sums[2] * inverse];
            own.add(lane, g, sums, e_sum[lane] * inverse, e_sum[lane]);
        }
        saved.set_first(&own);
    }
    for (own, sum) in terms.g.iter_mut().zip(&g_sum) {
        own[..COUNT].copy_from_slice(sum);
    }
    terms.e[..COUNT].copy_from_slice(&e_sum);
    terms.low[..COUNT].copy_from_slice(&low);
    terms.high[..COUNT].copy_from_slice(&high);
    total
}

#[cfg(test)]
mod tests {
    use super::super::quads::Quads;
    use super::*;

    /// Half a pair.
    const H: DVec3 = DVec3::X;

    /// Two faces at its first end, the second of which has the other end, with two numbers that are linear over both.
    fn corners() -> [[DVec3; 3]; 2] {
        let [a, b, c, d] = [[-1.0, 0.0], [1.0, 0.0], [0.5, 2.0], [0.0, -1.5]].map(|[x, y]| DVec3::new(x, y, 0.0));
        [[a, b, c], [a, d, b]]
    }

    fn row(p: DVec3) -> [f32; 2] {
        [(2.0 * p.x - p.y + 3.0) as f32, (0.25 * p.y) as f32]
    }

    /// The faces, whose corners have a wedge each, of rows that are so long.
    struct Around {
        terms: FaceTerms,
        faces: [CornerFace; 2],
        rows: Vec<f32>,
        width: usize,
    }

    impl Around {
        fn new(width: usize) -> Self {
            let mut terms = FaceTerms::default();
            terms.find(&Quads::of(&corners().map(|[_, p1, p2]| ([p1, p2], -1.0)), H), H, 2);
            let face = |corners: [u32; 3]| CornerFace { end: 0, corners, wedges: corners, dies: false };
            let mut rows = Vec::new();
            for p in corners().concat() {
                rows.extend(row(p));
                rows.resize(rows.len() + width - 2, f32::NAN);
            }
            Self { terms, faces: [face([0, 1, 2]), face([3, 4, 5])], rows, width }
        }

        fn numbers(&self) -> WedgeNumbers<'_> {
            WedgeNumbers::new(&self.rows, 0, self.width)
        }

        fn own<'a>(&'a self, own: &'a [u32]) -> OwnFaces<'a> {
            OwnFaces { faces: &self.faces, terms: &self.terms, own, numbers: self.numbers() }
        }

        /// The sums before any face, of the first two rows.
        fn between(&self, summed: usize) -> SideSums {
            let mut sums = SideSums::default();
            sums.begin(self.numbers(), [0, 1], summed);
            sums
        }

        /// What two numbers of both faces cost with the means, and what the best ones save.
        fn costs(&self, sums: &mut SideSums) -> (Quadric, Quadric) {
            let (mut costs, mut quadric, mut saved) = (CostSums::default(), Quadric::default(), Quadric::default());
            sums.add_faces(self.own(&[0, 1]), [2; 2], &mut costs);
            costs.add_to(2, &mut quadric, &mut saved);
            (quadric, saved)
        }
    }

    #[test]
    fn linear_numbers_cost_nothing_where_they_are_best() {
        let around = Around::new(2);
        let mut sums = around.between(2);
        let (cost, saved) = around.costs(&mut sums);
        assert!((sums.weight - (4.0 + 3.0)).abs() < 1e-12);
        let x = DVec3::new(0.3, -0.2, 0.0);
        let mut least = [0.0; 2];
        sums.write_least(x, &mut least);
        assert!(least.iter().zip(row(x)).all(|(a, b)| (a - b).abs() < 1e-6), "{least:?}");
        let at = cost.minus(&saved).value(x);
        assert!(at.abs() < 1e-12 && cost.value(x) > 1.0, "{at}");
        // An end has its own numbers, which are those of the function there: nothing to pay.
        let end = corners()[0][1];
        assert!((cost.value(end) + sums.at_end(2, end, 1.0)).abs() < 1e-12);
    }

    /// Sides of one face each cost together what one of both does with the same means, whatever was summed before.
    #[test]
    fn sides_add_up_and_pairs_do_not() {
        let (wide, around) = (Around::new(12), Around::new(2));
        let mut costs = CostSums::default();
        wide.between(12).add_faces(wide.own(&[0, 1]), [12; 2], &mut costs);
        let (mut parts, mut saved) = (Quadric::default(), Quadric::default());
        costs.begin(2);
        for own in [0, 1] {
            around.between(2).add_faces(around.own(&[own]), [2; 2], &mut costs);
        }
        costs.add_to(2, &mut parts, &mut saved);
        let (whole, _) = around.costs(&mut around.between(2));
        let x = DVec3::new(0.3, -0.2, 0.0);
        assert!((parts.value(x) - whole.value(x)).abs() < 1e-12 && whole.value(x) > 1.0);
        // Each has the numbers of its own face.
        assert!(parts.minus(&saved).value(x).abs() < 1e-12);
    }

    /// Numbers that are linear but for their last bits cost less than what is allowed for these, and others cost more.
    #[test]
    fn rounding_is_allowed_for_and_little_else() {
        for (offset, bits) in [(1e3, 1), (1e3, 4000), (0.0, 1)] {
            let mut around = Around::new(2);
            around.rows.iter_mut().for_each(|number| *number += offset);
            around.rows[4] = f32::from_bits(around.rows[4].to_bits() + bits);
            let mut sums = around.between(2);
            let (cost, saved) = around.costs(&mut sums);
            let at = cost.minus(&saved).value(DVec3::new(0.3, -0.2, 0.0));
            let (allowed, is_rounding) = (sums.rounding(2), bits == 1);
            assert_eq!(at <= allowed, is_rounding, "{offset}: {at:e} of {allowed:e}");
        }
    }

    #[test]
    fn each_number_of_any_block_is_best_where_it_is_linear() {
        let width = 12;
        let mut around = Around::new(width);
        // Number i of a corner is i times what the first two are linear in.
        let points = corners().concat();
        around.rows = points.iter().flat_map(|p| (0..width).map(|i| row(*p)[i % 2] * i as f32)).collect();
        let mut sums = around.between(width);
        sums.add_faces(around.own(&[0, 1]), [width; 2], &mut CostSums::default());
        let x = DVec3::new(0.3, -0.2, 0.0);
        for summed in [1, 8, 9, 11, 12] {
            let mut least = vec![0.0; summed];
            sums.write_least(x, &mut least);
            let error = |(i, &number): (usize, &f32)| (number - row(x)[i % 2] * i as f32).abs();
            assert!(least.iter().enumerate().map(error).all(|error| error < 1e-4), "{least:?}");
        }
    }

    #[test]
    fn what_follows_the_numbers_does_not_count() {
        // In half of the lanes, and in all of them.
        for count in [2, FEW_LANES, FEW_LANES + 1, NUMBERS - 1] {
            let costs = [count, count + 3].map(|width| {
                let mut around = Around::new(width);
                let numbers = |p: &DVec3| (0..count).map(|i| row(*p)[i % 2] * (i + 1) as f32).collect::<Vec<_>>();
                let rows = corners().concat();
                around.rows =
                    rows.iter().flat_map(|p| numbers(p).into_iter().chain(vec![f32::NAN; width - count])).collect();
                let (mut costs, mut quadric, mut saved) = (CostSums::default(), Quadric::default(), Quadric::default());
                around.between(count).add_faces(around.own(&[0, 1]), [count; 2], &mut costs);
                costs.add_to(count, &mut quadric, &mut saved);
                (quadric, saved)
            });
            assert_eq!(costs[0], costs[1], "{count}");
            assert!(costs[0].0.value(DVec3::Y) > 1.0);
        }
    }

    #[test]
    fn each_number_of_any_block_is_held() {
        let rows: Vec<f32> = (0..3).flat_map(|r| (0..12).map(move |i| (i * (r + 1)) as f32)).collect();
        let mut sums = SideSums::default();
        sums.begin(WedgeNumbers::new(&rows, 0, 12), [0, 2], 12);
        let held = |x: f32, past: f32| (0..12).map(|i| sums.held(i, x, past)).collect::<Vec<_>>();
        let times = |by: f32| (0..12).map(|i| i as f32 * by).collect::<Vec<_>>();
        assert_eq!((held(100.0, 0.0), held(-100.0, 0.0)), (times(3.0), times(1.0)));
        // And within half of their range beside them.
        assert_eq!((held(100.0, 0.5), held(-100.0, 0.5)), (times(4.0), times(0.0)));
        assert_eq!(sums.held(8, 17.0, 0.0), 17.0);
        // A zero keeps its sign.
        assert!(sums.held(0, -0.0, 0.0).is_sign_negative() && sums.held(0, 0.0, 0.0).is_sign_positive());
    }

    #[test]
    fn numbers_of_the_faces_hold_too_whatever_their_range() {
        let mut around = Around::new(2);
        (around.rows[4], around.rows[10]) = (f32::MAX, f32::MIN);
        let mut sums = around.between(2);
        assert!(sums.held(0, 1e30, 0.0) < 1e30);
        sums.add_faces(around.own(&[0, 1]), [2; 2], &mut CostSums::default());
        assert_eq!([0.0, 0.5].map(|past| sums.held(0, 1e30, past)), [1e30; 2]);
        let wild = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        assert_eq!(wild.map(|x| sums.held(0, x, 0.5)), [f32::MAX, f32::MIN, f32::MIN]);
    }
}
