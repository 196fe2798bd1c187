//! What the attributes on a side of a pair cost: sums over its faces, many numbers at a time.
//!
//! Numbers of a row stand side by side, so that a vector holds those of one corner; nothing is added across a vector before
//! the end. Lanes past the numbers that are summed hold anything and are never read.
//!
//! In single precision, as the rows are: functions of faces are summed less that of one of them, so that what agrees in all
//! cancels out before it is squared, and sums lose no more than rows do. That is so unless this face is a thousand times smaller
//! than all of them together: the larger of the first and the last is taken, of which one at least has an area on most sides.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use multiversion::multiversion;

use crate::math::DVec3;
use crate::math::lanes::NUMBERS;

use super::cost_lanes::{BLOCKS, CostSums, Lanes, PAST_SINGLE, QuadricLanes};
use super::face_terms::{FaceTerm, FaceTerms};
use super::hold::{Past, held};
use super::sides::CornerFace;
use super::wedges::WedgeNumbers;

/// At most so many numbers are summed in half of the lanes: a texture's, or a normal's.
const FEW_LANES: usize = NUMBERS / 2;

/// Faces that weigh less together have no mean: its inverse would be past single precision.
const LEAST_WEIGHT: f64 = f32::MIN_POSITIVE as f64;

/// How far a number of a row may be off where it is put together from others, of itself: some units in the last place.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Some numbers of a side about the middle of the pair.
#[derive(Debug, Clone, Copy, Default)]
struct Terms {
    /// Those of both ends.
    ends: [Lanes; 2],
    /// Σ |n| g and Σ |n| e, of numbers less the means of the ends'.
    g: [Lanes; 3],
    e: Lanes,
    /// The least and the greatest of the corners.
    low: Lanes,
    high: Lanes,
}

impl Terms {
    /// Half the difference of the ends' numbers.
    #[inline(always)]
    fn half(&self, lane: usize) -> f32 {
        self.ends[1][lane] * 0.5 - self.ends[0][lane] * 0.5
    }

    /// Of a number half the difference of the ends', Σ |n| g and Σ |n| e.
    fn number(&self, lane: usize) -> (f64, DVec3, f64) {
        let [x, y, z] = self.g.map(|along| f64::from(along[lane]));
        (f64::from(self.half(lane)), DVec3::new(x, y, z), f64::from(self.e[lane]))
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

impl OwnFaces<'_> {
    /// The larger of the side's first face and its last, which has both ends where one does; none of no faces.
    #[inline(always)]
    fn base(&self) -> Option<usize> {
        let [first, last] = [*self.own.first()?, *self.own.last()?].map(|number| number as usize);
        let is_larger = self.terms.get(first).weight > self.terms.get(last).weight;
        Some(if is_larger { first } else { last })
    }
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
            let ends = wedges.map(|wedge| numbers.at::<NUMBERS>(wedge, block * NUMBERS));
            let (mut low, mut high) = (ends[0], ends[0]);
            for lane in 0..NUMBERS {
                low[lane] = if ends[1][lane] < low[lane] { ends[1][lane] } else { low[lane] };
                high[lane] = if ends[1][lane] > high[lane] { ends[1][lane] } else { high[lane] };
            }
            *terms = Terms { ends, low, high, ..Terms::default() };
        }
    }

    /// Adds the faces of the side, once after [`begin`](Self::begin) with as many `summed`; and to `costs` what their first
    /// `costed` numbers cost.
    pub fn add_faces(&mut self, faces: OwnFaces<'_>, [costed, summed]: [usize; 2], costs: &mut CostSums) {
        for (block, terms) in self.terms.iter_mut().enumerate().take(costed.div_ceil(NUMBERS)) {
            let (first, least) = (block * NUMBERS, &mut costs.least[block]);
            let weight = match summed - first {
                ..=FEW_LANES => add_faces::<FEW_LANES>(faces, first, terms, least),
                _ => add_faces::<NUMBERS>(faces, first, terms, least),
            };
            self.weight = f64::from(weight);
        }
    }

    /// Of each number half the difference of the ends', Σ |n| g and Σ |n| e.
    fn numbers(&self, count: usize) -> impl Iterator<Item = (f64, DVec3, f64)> {
        (0..count).map(|i| self.terms[i / NUMBERS].number(i % NUMBERS))
    }

    fn inverse_weight(&self) -> f64 {
        if self.weight >= LEAST_WEIGHT { 1.0 / self.weight } else { 0.0 }
    }

    /// What the numbers of an end cost at its place `x` more than the best; `sign` is −1 for the first.
    pub fn at_end(&self, costed: usize, x: DVec3, sign: f64) -> f64 {
        let inverse = self.inverse_weight();
        let off = |(half, g, e): (f64, DVec3, f64)| sign * half - (g.dot(x) + e) * inverse;
        let cost = self.weight * self.numbers(costed).map(off).map(|off| off * off).sum::<f64>();
        if cost.is_finite() { cost } else { PAST_SINGLE }
    }

    /// What the rounding of rows may cost: nothing that is linear is so to the last bit.
    pub fn rounding(&self, costed: usize) -> f64 {
        let square = |i: usize| {
            let (terms, lane) = (&self.terms[i / NUMBERS], i % NUMBERS);
            let [first, second] = terms.ends.map(|end| f64::from(end[lane]));
            first * first + second * second
        };
        ROUNDING * ROUNDING * self.weight * (0..costed).map(square).sum::<f64>() * 0.5
    }

    /// Writes the best numbers at a place: those that are summed, as many as there is room for. They are brought to those of the
    /// corners, or no farther off than `past` of their range.
    pub fn write_least(&self, x: DVec3, past: Past<'_>, summed: &mut [f32]) {
        let (inverse, x) = (self.inverse_weight() as f32, x.as_vec3());
        for ((terms, numbers), own) in self.terms.iter().zip(past.of).zip(summed.chunks_mut(NUMBERS)) {
            let Terms { ends, g, e, low, high } = terms;
            let mut least = [0.0; NUMBERS];
            for lane in 0..NUMBERS {
                let slope = g[0][lane] * x.x + g[1][lane] * x.y + g[2][lane] * x.z;
                let best = ends[0][lane] + (terms.half(lane) + (slope + e[lane]) * inverse);
                least[lane] = held(best, [low[lane], high[lane]], numbers[lane] * past.times + past.plus);
            }
            own.copy_from_slice(&least[..own.len()]);
        }
    }
}

/// Adds a side's own faces to the terms of so many numbers from `first` on, and returns their weight; and to sums what they cost
/// where they are best.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn add_faces<const COUNT: usize>(
    faces: OwnFaces<'_>,
    first: usize,
    terms: &mut Terms,
    least: &mut QuadricLanes<NUMBERS>,
) -> f32 {
    let Some(base) = faces.base() else { return 0.0 };
    // Apart from what is in memory, so that registers hold them.
    let (mut own, mut g_sum, mut e_sum) = (QuadricLanes::<COUNT>::ZERO, [[0.0; COUNT]; 3], [0.0; COUNT]);
    let (mut half, mut low, mut high) = ([0.0; COUNT], [0.0; COUNT], [0.0; COUNT]);
    half.iter_mut().enumerate().for_each(|(lane, half)| *half = terms.half(lane));
    low.copy_from_slice(&terms.low[..COUNT]);
    high.copy_from_slice(&terms.high[..COUNT]);
    let (base_g, base_e, _) = function_of::<COUNT>(faces, base, first, terms, &half);
    let mut total = 0.0;
    for &number in faces.own {
        let (g, e, [v1, v2]) = function_of::<COUNT>(faces, number as usize, first, terms, &half);
        let weight = faces.terms.get(number as usize).weight;
        total += weight;
        for lane in 0..COUNT {
            // The first corner has the wedge of an end.
            let least = if v1[lane] < v2[lane] { v1[lane] } else { v2[lane] };
            let most = if v1[lane] > v2[lane] { v1[lane] } else { v2[lane] };
            low[lane] = if least < low[lane] { least } else { low[lane] };
            high[lane] = if most > high[lane] { most } else { high[lane] };
        }
        for lane in 0..COUNT {
            let g = [g[0][lane] - base_g[0][lane], g[1][lane] - base_g[1][lane], g[2][lane] - base_g[2][lane]];
            let e = e[lane] - base_e[lane];
            let (weighted, we) = ([g[0] * weight, g[1] * weight, g[2] * weight], e * weight);
            g_sum[0][lane] += weighted[0];
            g_sum[1][lane] += weighted[1];
            g_sum[2][lane] += weighted[2];
            e_sum[lane] += we;
            own.add(lane, g, e, weighted, we);
        }
    }
    // The best numbers are the weighted means of all faces': they save the square of what these are off the base.
    let inverse = if f64::from(total) >= LEAST_WEIGHT { 1.0 / total } else { 0.0 };
    for lane in 0..COUNT {
        let sums = [g_sum[0][lane], g_sum[1][lane], g_sum[2][lane]];
        let saved = [sums[0] * -inverse, sums[1] * -inverse, sums[2] * -inverse];
        own.add(lane, sums, e_sum[lane], saved, e_sum[lane] * -inverse);
    }
    own.add_to_first(least);
    for lane in 0..COUNT {
        for axis in 0..3 {
            terms.g[axis][lane] = g_sum[axis][lane] + base_g[axis][lane] * total;
        }
        terms.e[lane] = e_sum[lane] + base_e[lane] * total;
    }
    terms.low[..COUNT].copy_from_slice(&low);
    terms.high[..COUNT].copy_from_slice(&high);
    total
}

/// The gradients of a face, its numbers at the middle less the means of the ends', and those of its corners after the first.
#[inline(always)]
fn function_of<const COUNT: usize>(
    faces: OwnFaces<'_>,
    number: usize,
    first: usize,
    terms: &Terms,
    half: &[f32; COUNT],
) -> ([[f32; COUNT]; 3], [f32; COUNT], [[f32; COUNT]; 2]) {
    let CornerFace { wedges: [_, b, c], end, .. } = faces.faces[number];
    let (v0, v1, v2): (&Lanes, [f32; COUNT], [f32; COUNT]) =
        (&terms.ends[usize::from(end != 0)], faces.numbers.at(b, first), faces.numbers.at(c, first));
    let FaceTerm { c1, c2, c1_at, c2_at, side, .. } = faces.terms.get(number);
    let (mut g, mut e) = ([[0.0; COUNT]; 3], [0.0; COUNT]);
    for lane in 0..COUNT {
        let (d1, d2) = (v1[lane] - v0[lane], v2[lane] - v0[lane]);
        g[0][lane] = c1.x * d1 + c2.x * d2;
        g[1][lane] = c1.y * d1 + c2.y * d2;
        g[2][lane] = c1.z * d1 + c2.z * d2;
        e[lane] = side * half[lane] - c1_at * d1 - c2_at * d2;
    }
    (g, e, [v1, v2])
}

#[cfg(test)]
mod tests {
    use super::super::placement::Quadric;
    use super::super::quads::Quads;
    use super::*;

    /// Half a pair.
    const H: DVec3 = DVec3::X;

    /// As far off as they are.
    const ANYWHERE: Past<'_> = Past { of: &[[0.0; NUMBERS]; BLOCKS], times: 0.0, plus: f32::INFINITY };

    /// A number held by those that were summed.
    fn held_by(sums: &SideSums, number: usize, x: f32, past: f32) -> f32 {
        let (terms, lane) = (&sums.terms[number / NUMBERS], number % NUMBERS);
        held(x, [terms.low[lane], terms.high[lane]], past)
    }

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

        /// What two numbers of both faces cost where they are best.
        fn least(&self, sums: &mut SideSums) -> Quadric {
            let (mut costs, mut quadric) = (CostSums::default(), Quadric::default());
            sums.add_faces(self.own(&[0, 1]), [2; 2], &mut costs);
            costs.add_to(2, &mut quadric);
            quadric
        }
    }

    #[test]
    fn linear_numbers_cost_nothing_where_they_are_best() {
        let around = Around::new(2);
        let mut sums = around.between(2);
        let cost = around.least(&mut sums);
        assert!((sums.weight - (4.0 + 3.0)).abs() < 1e-12);
        let x = DVec3::new(0.3, -0.2, 0.0);
        let mut least = [0.0; 2];
        sums.write_least(x, ANYWHERE, &mut least);
        assert!(least.iter().zip(row(x)).all(|(a, b)| (a - b).abs() < 1e-6), "{least:?}");
        assert!(cost.value(x).abs() < 1e-12, "{}", cost.value(x));
        // An end has its own numbers, which are those of the function there: nothing to pay. Elsewhere they are off.
        let end = corners()[0][1];
        assert!((cost.value(end) + sums.at_end(2, end, 1.0)).abs() < 1e-11);
        let off = row(end).map(f64::from).iter().zip(row(x)).map(|(a, b)| (a - f64::from(b)).powi(2)).sum::<f64>();
        assert!((sums.at_end(2, x, 1.0) - 7.0 * off).abs() < 1e-5 && off > 1.0);
    }

    /// Sums over many numbers at a time are what one number after the other costs, by the definition, in double precision.
    #[test]
    fn what_is_best_costs_what_it_is_off_every_face() {
        let mut around = Around::new(2);
        // Bent along the edge that both have.
        (around.rows[4], around.rows[11]) = (7.5, -2.25);
        let mut sums = around.between(2);
        let cost = around.least(&mut sums);
        let x = DVec3::new(0.3, -0.2, 0.125);
        let mut best = [0.0; 2];
        sums.write_least(x, ANYWHERE, &mut best);
        let mut expected = 0.0;
        for (f, corners) in corners().into_iter().enumerate() {
            let [e1, e2] = [corners[1] - corners[0], corners[2] - corners[0]];
            let n = e1.cross(e2);
            for (i, &best) in best.iter().enumerate() {
                let [v0, v1, v2] = [0, 1, 2].map(|k| f64::from(around.rows[6 * f + 2 * k + i]));
                let g = (e2.cross(n) * (v1 - v0) + n.cross(e1) * (v2 - v0)) / n.length_squared();
                expected += n.length() * (v0 + g.dot(x - corners[0]) - f64::from(best)).powi(2);
            }
        }
        assert!(expected > 1.0 && (cost.value(x) - expected).abs() < 1e-5 * expected, "{} {expected}", cost.value(x));
    }

    /// Sides of one face each have the numbers of their own, and cost nothing, whatever was summed before.
    #[test]
    fn sides_add_up_and_faces_of_one_do_not() {
        let (wide, mut around) = (Around::new(12), Around::new(2));
        around.rows[4] = 7.5;
        let mut costs = CostSums::default();
        wide.between(12).add_faces(wide.own(&[0, 1]), [12; 2], &mut costs);
        costs.begin(2);
        for own in [0, 1] {
            around.between(2).add_faces(around.own(&[own]), [2; 2], &mut costs);
        }
        let mut parts = Quadric::default();
        costs.add_to(2, &mut parts);
        let x = DVec3::new(0.3, 1.0, 0.0);
        assert!(parts.value(x).abs() < 1e-12 && around.least(&mut around.between(2)).value(x) > 1.0);
        // The same side twice costs twice as much.
        costs.begin(2);
        for _ in 0..2 {
            around.between(2).add_faces(around.own(&[0, 1]), [2; 2], &mut costs);
        }
        let mut twice = Quadric::default();
        costs.add_to(2, &mut twice);
        let once = around.least(&mut around.between(2)).value(x);
        assert!((twice.value(x) - 2.0 * once).abs() < 1e-6 * once);
    }

    /// Numbers that are linear but for their last bits cost less than what is allowed for these, and others cost more.
    #[test]
    fn rounding_is_allowed_for_and_little_else() {
        for (offset, bits) in [(1e3, 1), (1e3, 4000), (0.0, 1)] {
            let mut around = Around::new(2);
            around.rows.iter_mut().for_each(|number| *number += offset);
            around.rows[4] = f32::from_bits(around.rows[4].to_bits() + bits);
            let mut sums = around.between(2);
            let at = around.least(&mut sums).value(DVec3::new(0.3, -0.2, 0.0));
            let (allowed, is_rounding) = (sums.rounding(2), bits == 1);
            assert_eq!(at <= allowed, is_rounding, "{offset}: {at:e} of {allowed:e}");
        }
    }

    /// Numbers too far apart to be squared are dear, everywhere and at an end, and never none.
    #[test]
    fn what_is_past_single_precision_is_dear() {
        let mut around = Around::new(2);
        (around.rows[4], around.rows[10]) = (1e30, -1e30);
        let mut sums = around.between(2);
        let dear = around.least(&mut sums);
        assert_eq!([DVec3::ZERO, DVec3::X].map(|x| dear.value(x)), [PAST_SINGLE; 2]);
        for (first, second) in [(1e30, -1e30), (f32::MAX, f32::MIN)] {
            (around.rows[0], around.rows[2]) = (first, second);
            let mut sums = around.between(2);
            around.least(&mut sums);
            let cost = sums.at_end(2, DVec3::X, 1.0);
            assert!(cost.is_finite() && cost > 1e30, "{cost:e}");
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
            sums.write_least(x, ANYWHERE, &mut least);
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
                // Bent, so that they cost something.
                around.rows[2 * width] = 7.5;
                let (mut costs, mut quadric) = (CostSums::default(), Quadric::default());
                around.between(count).add_faces(around.own(&[0, 1]), [count; 2], &mut costs);
                costs.add_to(count, &mut quadric);
                quadric
            });
            assert_eq!(costs[0], costs[1], "{count}");
            assert!(costs[0].value(DVec3::Y) > 1.0);
        }
    }

    #[test]
    fn each_number_of_any_block_is_held() {
        let rows: Vec<f32> = (0..3).flat_map(|r| (0..12).map(move |i| (i * (r + 1)) as f32)).collect();
        let mut sums = SideSums::default();
        sums.begin(WedgeNumbers::new(&rows, 0, 12), [0, 2], 12);
        let held = |x: f32, past: f32| (0..12).map(|i| held_by(&sums, i, x, past)).collect::<Vec<_>>();
        let times = |by: f32| (0..12).map(|i| i as f32 * by).collect::<Vec<_>>();
        assert_eq!((held(100.0, 0.0), held(-100.0, 0.0)), (times(3.0), times(1.0)));
        // And within half of their range beside them.
        assert_eq!((held(100.0, 0.5), held(-100.0, 0.5)), (times(4.0), times(0.0)));
        assert_eq!(held_by(&sums, 8, 17.0, 0.0), 17.0);
        // A zero keeps its sign.
        assert!(held_by(&sums, 0, -0.0, 0.0).is_sign_negative() && held_by(&sums, 0, 0.0, 0.0).is_sign_positive());
    }

    /// Each number has a bound of its own: of two that are equal one may be past those of the corners.
    #[test]
    fn what_is_written_is_held() {
        let mut around = Around::new(2);
        around.rows = corners().concat().iter().flat_map(|p| [row(*p)[0]; 2]).collect();
        let mut sums = around.between(2);
        sums.add_faces(around.own(&[0, 1]), [2; 2], &mut CostSums::default());
        let mut first = [0.0; NUMBERS];
        first[0] = 1.0;
        // Of 2x − y + 3 the corners have 1 to 5; far off it is 23.
        for (times, plus, expected) in [(0.0, 0.0, [5.0; 2]), (1.0, 0.0, [9.0, 5.0]), (1.0, 1.0, [13.0, 9.0])] {
            let mut least = [0.0; 2];
            sums.write_least(DVec3::X * 10.0, Past { of: &[first], times, plus }, &mut least);
            assert_eq!(least, expected);
        }
    }

    #[test]
    fn numbers_of_the_faces_hold_too_whatever_their_range() {
        let mut around = Around::new(2);
        (around.rows[4], around.rows[10]) = (f32::MAX, f32::MIN);
        let mut sums = around.between(2);
        assert!(held_by(&sums, 0, 1e30, 0.0) < 1e30);
        sums.add_faces(around.own(&[0, 1]), [2; 2], &mut CostSums::default());
        assert_eq!([0.0, 0.5].map(|past| held_by(&sums, 0, 1e30, past)), [1e30; 2]);
        let wild = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        assert_eq!(wild.map(|x| held_by(&sums, 0, x, 0.5)), [f32::MAX, f32::MIN, f32::MIN]);
    }
}
