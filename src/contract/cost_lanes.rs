//! What numbers of sides cost, many of them side by side, and added up at last.
//!
//! Lanes past the numbers that decide hold anything and are never read.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use multiversion::multiversion;

use crate::kernel::attribute_spreads::MOST_COSTED;
use crate::math::DVec3;
use crate::math::lanes::{NUMBERS, Numbers};

use super::placement::Quadric;

/// Blocks of so many for all that decide.
pub const BLOCKS: usize = MOST_COSTED / NUMBERS;

/// What costs more than single precision can tell.
pub const PAST_SINGLE: f64 = f32::MAX as f64;

/// Numbers of a row side by side.
pub type Lanes = Numbers<f32>;

/// Sums of |n| (g·x + e)², a number to a lane.
#[derive(Debug, Clone, Copy)]
pub struct QuadricLanes<const COUNT: usize> {
    /// The upper half of Σ |n| g gᵀ, row by row; Σ |n| g e; Σ |n| e².
    columns: [[f32; COUNT]; 10],
}

impl<const COUNT: usize> QuadricLanes<COUNT> {
    /// Of nothing.
    pub const ZERO: Self = Self { columns: [[0.0; COUNT]; 10] };

    /// Adds |n| (g·x + e)² of a number, with g and |n| g, e and |n| e.
    #[inline(always)]
    pub fn add(&mut self, lane: usize, [x, y, z]: [f32; 3], e: f32, [wx, wy, wz]: [f32; 3], we: f32) {
        let terms = [wx * x, wx * y, wx * z, wy * y, wy * z, wz * z, wx * e, wy * e, wz * e, we * e];
        for (column, term) in self.columns.iter_mut().zip(terms) {
            column[lane] += term;
        }
    }

    /// Adds to the first lanes of another's.
    #[inline(always)]
    pub fn add_to_first(&self, other: &mut QuadricLanes<NUMBERS>) {
        for (column, own) in other.columns.iter_mut().zip(&self.columns) {
            for lane in 0..COUNT {
                column[lane] += own[lane];
            }
        }
    }
}

/// All bits of the first so many lanes, and none of the others.
const FIRST: [[u32; NUMBERS]; NUMBERS + 1] = {
    let mut masks = [[0; NUMBERS]; NUMBERS + 1];
    let mut count = 0;
    while count <= NUMBERS {
        let mut lane = 0;
        while lane < count {
            masks[count][lane] = u32::MAX;
            lane += 1;
        }
        count += 1;
    }
    masks
};

/// The sum of the first lanes, halves of all of them at a time; others hold anything. By masks: a choice for each lane becomes a
/// branch without AVX-512.
#[inline(always)]
fn sum_of_first(lanes: &Lanes, count: usize) -> f32 {
    let (mask, mut left) = (&FIRST[count.min(NUMBERS)], [0.0; NUMBERS]);
    for lane in 0..NUMBERS {
        left[lane] = f32::from_bits(lanes[lane].to_bits() & mask[lane]);
    }
    let mut half = NUMBERS / 2;
    while half > 0 {
        for lane in 0..half {
            left[lane] += left[lane + half];
        }
        half /= 2;
    }
    left[0]
}

/// What the numbers of all sides of a pair cost where they are best at every place, before the lanes are added up.
#[derive(Debug)]
pub struct CostSums {
    pub(super) least: [QuadricLanes<NUMBERS>; BLOCKS],
}

impl Default for CostSums {
    fn default() -> Self {
        Self { least: [QuadricLanes::ZERO; BLOCKS] }
    }
}

impl CostSums {
    /// Forgets all sides, for so many numbers that decide.
    pub fn begin(&mut self, costed: usize) {
        self.least[..costed.div_ceil(NUMBERS)].fill(QuadricLanes::ZERO);
    }

    /// Adds to a quadric what so many numbers cost. What is past single precision costs that everywhere.
    pub fn add_to(&self, costed: usize, quadric: &mut Quadric) {
        for (first, QuadricLanes { columns }) in (0..costed).step_by(NUMBERS).zip(&self.least) {
            let [xx, xy, xz, yy, yz, zz, x, y, z, c] = sums_of_first(columns, costed - first).map(f64::from);
            if [xx, xy, xz, yy, yz, zz, x, y, z, c].iter().sum::<f64>().is_finite() {
                quadric.add_sums([xx, xy, xz, yy, yz, zz], DVec3::new(x, y, z), c);
            } else {
                quadric.add_sums([0.0; 6], DVec3::ZERO, PAST_SINGLE);
            }
        }
    }
}

/// [`sum_of_first`] of every column.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn sums_of_first(columns: &[Lanes; 10], count: usize) -> [f32; 10] {
    let mut sums = [0.0; 10];
    for (sum, column) in sums.iter_mut().zip(columns) {
        *sum = sum_of_first(column, count);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_past_the_last_number_count_nothing() {
        let mut lanes = [f32::NAN; NUMBERS];
        for count in 0..=NUMBERS {
            assert_eq!(sum_of_first(&lanes, count), (count * (count + 1) / 2) as f32);
            if count < NUMBERS {
                lanes[count] = (count + 1) as f32;
            }
        }
    }

    #[test]
    fn a_quadric_is_that_of_each_number() {
        // (x + 2)² and 3 (2 y − z)², in lanes of their own.
        let mut own = QuadricLanes::<2>::ZERO;
        own.add(0, [1.0, 0.0, 0.0], 2.0, [1.0, 0.0, 0.0], 2.0);
        own.add(1, [0.0, 2.0, -1.0], 0.0, [0.0, 6.0, -3.0], 0.0);
        let mut costs = CostSums::default();
        own.add_to_first(&mut costs.least[0]);
        let value = |count: usize, x: DVec3| {
            let mut quadric = Quadric::default();
            costs.add_to(count, &mut quadric);
            quadric.value(x)
        };
        let x = DVec3::new(0.5, 1.0, -1.0);
        assert_eq!([1, 2].map(|count| value(count, x)), [6.25, 6.25 + 27.0]);
    }
}
