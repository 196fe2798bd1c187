//! The key below which as many pairs pass as the gate wants, at the bound of a bucket of the histogram. Twin:
//! `shaders/find_threshold.wgsl`, by contract.

use super::cost_histogram::{self, BUCKET_SHIFT, BUCKETS};
use super::rows::Threshold;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// One workgroup, whose invocations share the buckets out evenly.
pub struct FindThreshold<'a> {
    /// The last of `block_count` + 1 starts is how many pairs there are.
    pub pair_starts: &'a Buffer<u32>,
    /// Blocks of pairs.
    pub block_count: u32,
    /// How many pairs have keys in each bucket.
    pub buckets: &'a Buffer<u32>,
    /// How many of them pass.
    pub gate: Gate,
    /// Writes one row.
    pub threshold: &'a mut Buffer<Threshold>,
}

/// How many of the cheapest pairs pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gate {
    /// At most this share of the pairs, in units of 2⁻³²; the greatest is all.
    pub share: u32,
    /// At most this many, before the bucket of the last is completed.
    pub most: u32,
    /// The same of pairs that cost no more than eight times as much as the dearest of those; 0 where no others pass.
    pub wide_share: u32,
    /// At most this many with those.
    pub wide_most: u32,
}

impl Gate {
    /// How many of so many pairs it wants at most.
    pub fn wanted(self, pairs: usize) -> usize {
        let wanted = |share, most: u32| share_of(pairs as u32, share).min(most) as usize;
        wanted(self.share, self.most).max(wanted(self.wide_share, self.wide_most))
    }
}

/// Buckets to a cost eight times as great: three octaves.
const REACH: u32 = 3 << (23 - BUCKET_SHIFT);

params! {
    /// The uniform block.
    pub struct Params {
        block_count: u32,
        share: u32,
        most: u32,
        wide_share: u32,
        wide_most: u32,
    }
}

/// `count` · `share` · 2⁻³², rounded up.
#[inline(always)]
pub fn share_of(count: u32, share: u32) -> u32 {
    let product = u64::from(count) * u64::from(share);
    (product >> 32) as u32 + u32::from(product as u32 != 0)
}

/// The threshold that lets as many pairs pass as a gate wants, and all of the last one's bucket.
pub fn threshold(buckets: &[u32], pairs: u32, gate: Gate) -> Threshold {
    let Gate { share, most, wide_share, wide_most } = gate;
    let found = |share, most| cost_histogram::threshold(buckets, share_of(pairs, share).min(most) as usize);
    let (usual, wide) = (found(share, most), found(wide_share, wide_most));
    let farthest = usual.0 + (REACH << BUCKET_SHIFT);
    let (key, passing) = if wide.0 > farthest {
        (farthest, buckets[..(farthest >> BUCKET_SHIFT) as usize].iter().sum::<u32>() as usize)
    } else {
        usual.max(wide)
    };
    Threshold { pairs, key, passing: passing as u32 }
}

impl Kernel for FindThreshold<'_> {
    const NAME: &'static str = "find_threshold";
    const SOURCE: &'static str = include_str!("../../shaders/find_threshold.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("BUCKET_SHIFT", Constant::U32(BUCKET_SHIFT)),
        ("BUCKETS_EACH", Constant::U32(BUCKETS / Self::WORKGROUP)),
        ("REACH", Constant::U32(REACH)),
    ];
    const WORKGROUP: u32 = 256;

    fn params(&self) -> Params {
        let Gate { share, most, wide_share, wide_most } = self.gate;
        Params { block_count: self.block_count, share, most, wide_share, wide_most }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("pair_starts", Access::Read, self.pair_starts),
            Binding::new("buckets", Access::Read, self.buckets),
            Binding::new("threshold", Access::Write, self.threshold),
        ]
    }

    fn invocations(&self) -> u32 {
        Self::WORKGROUP
    }

    fn run_cpu(&mut self) {
        let pairs = self.pair_starts.host()[self.block_count as usize];
        self.threshold.host_mut()[0] = threshold(self.buckets.host(), pairs, self.gate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_rounded_up() {
        assert_eq!(share_of(7, 1 << 31), 4);
        assert_eq!(share_of(8, 1 << 31), 4);
        assert_eq!(share_of(0, u32::MAX), 0);
        assert_eq!(share_of(u32::MAX, u32::MAX), u32::MAX);
    }

    fn gate(share: u32, most: u32) -> Gate {
        Gate { share, most, wide_share: 0, wide_most: 0 }
    }

    #[test]
    fn threshold_completes_the_bucket() {
        let mut buckets = vec![0; BUCKETS as usize];
        (buckets[1], buckets[3], buckets[4]) = (3, 4, 5);
        let found = |most| {
            let Threshold { pairs, key, passing } = threshold(&buckets, 12, gate(u32::MAX, most));
            assert_eq!((pairs, key % (1 << BUCKET_SHIFT)), (12, 0));
            (key >> BUCKET_SHIFT, passing)
        };
        assert_eq!([0, 1, 3, 4, 8].map(found), [(0, 0), (2, 3), (2, 3), (4, 7), (5, 12)]);
        // Half of them are six.
        assert_eq!(threshold(&buckets, 12, gate(1 << 31, 9)).passing, 7);
        // More than there are.
        let all = Threshold { pairs: 40, key: 1 << 31, passing: 12 };
        assert_eq!(threshold(&buckets, 40, gate(u32::MAX, 40)), all);
    }

    #[test]
    fn a_wide_gate_reaches_eight_times_as_far() {
        // The bucket of 1 ends at 1.0625, that of 2 at 2.125.
        let costs = [1.0, 2.0, 8.4, 16.9, 17.1_f32];
        let mut buckets = vec![0; BUCKETS as usize];
        costs.iter().for_each(|cost| buckets[(cost.to_bits() >> BUCKET_SHIFT) as usize] += 10);
        let passing = |most, wide_share, wide_most| {
            let found = threshold(&buckets, 50, Gate { share: u32::MAX, most, wide_share, wide_most });
            let below = |cost: &&f32| cost.to_bits() < found.key;
            assert_eq!(10 * costs.iter().filter(below).count() as u32, found.passing);
            found.passing
        };
        assert_eq!([0, 10, 11, 21, 40].map(|wide_most| passing(10, u32::MAX, wide_most)), [10, 10, 20, 30, 30]);
        // From 2 on only the last lies beyond.
        assert_eq!([(1 << 31, 50), (u32::MAX, 50)].map(|(share, most)| passing(20, share, most)), [30, 40]);
        assert_eq!(passing(30, u32::MAX, 50), 50);
        assert_eq!(Gate { share: 1 << 31, most: 20, wide_share: 1 << 31, wide_most: 90 }.wanted(100), 50);
    }
}
