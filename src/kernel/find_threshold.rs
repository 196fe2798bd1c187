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
    /// At most this share of the pairs, in units of 2⁻³²; the greatest is all.
    pub share: u32,
    /// At most this many, before the bucket of the last is completed.
    pub most: u32,
    /// Writes one row.
    pub threshold: &'a mut Buffer<Threshold>,
}

params! {
    /// The uniform block.
    pub struct Params {
        block_count: u32,
        share: u32,
        most: u32,
    }
}

/// `count` · `share` · 2⁻³², rounded up.
#[inline(always)]
pub fn share_of(count: u32, share: u32) -> u32 {
    let product = u64::from(count) * u64::from(share);
    (product >> 32) as u32 + u32::from(product as u32 != 0)
}

/// The threshold that lets `share` of the pairs pass, or `most` if that is less, and all of the last one's bucket.
pub fn threshold(buckets: &[u32], pairs: u32, share: u32, most: u32) -> Threshold {
    let (key, passing) = cost_histogram::threshold(buckets, share_of(pairs, share).min(most) as usize);
    Threshold { pairs, key, passing: passing as u32 }
}

impl Kernel for FindThreshold<'_> {
    const NAME: &'static str = "find_threshold";
    const SOURCE: &'static str = include_str!("../../shaders/find_threshold.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] =
        &[("BUCKET_SHIFT", Constant::U32(BUCKET_SHIFT)), ("BUCKETS_EACH", Constant::U32(BUCKETS / Self::WORKGROUP))];
    const WORKGROUP: u32 = 256;

    fn params(&self) -> Params {
        Params { block_count: self.block_count, share: self.share, most: self.most }
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
        self.threshold.host_mut()[0] = threshold(self.buckets.host(), pairs, self.share, self.most);
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

    #[test]
    fn threshold_completes_the_bucket() {
        let mut buckets = vec![0; BUCKETS as usize];
        (buckets[1], buckets[3], buckets[4]) = (3, 4, 5);
        let found = |most| {
            let Threshold { pairs, key, passing } = threshold(&buckets, 12, u32::MAX, most);
            assert_eq!((pairs, key % (1 << BUCKET_SHIFT)), (12, 0));
            (key >> BUCKET_SHIFT, passing)
        };
        assert_eq!([0, 1, 3, 4, 8].map(found), [(0, 0), (2, 3), (2, 3), (4, 7), (5, 12)]);
        // Half of them are six.
        assert_eq!(threshold(&buckets, 12, 1 << 31, 9).passing, 7);
        // More than there are.
        assert_eq!(threshold(&buckets, 40, u32::MAX, 40), Threshold { pairs: 40, key: 1 << 31, passing: 12 });
    }
}
