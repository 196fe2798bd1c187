//! How many pairs cost how much: a histogram over the leading bits of the keys. Twin: `shaders/cost_histogram.wgsl`, by
//! contract.

use rayon::prelude::*;

use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Bits of a key below its bucket: what is left is the exponent and four bits of the mantissa, 6 % of a cost.
pub const BUCKET_SHIFT: u32 = 19;
/// Buckets: keys are positive, so the sign bit is 0.
pub const BUCKETS: u32 = 1 << (31 - BUCKET_SHIFT);
/// Keys an invocation counts.
pub const KEYS_EACH: u32 = 64;

/// One invocation for `KEYS_EACH` keys, a workgroup apart.
pub struct CostHistogram<'a> {
    /// Keys.
    pub keys: &'a Buffer<u32>,
    /// The last of `block_count` + 1 starts is how many of them are of pairs.
    pub pair_starts: &'a Buffer<u32>,
    /// Blocks of pairs.
    pub block_count: u32,
    /// How many they are at most.
    pub most_keys: u32,
    /// Adds to [`BUCKETS`] counts.
    pub buckets: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        block_count: u32,
    }
}

impl Kernel for CostHistogram<'_> {
    const NAME: &'static str = "cost_histogram";
    const SOURCE: &'static str = include_str!("../../shaders/cost_histogram.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("BUCKET_SHIFT", Constant::U32(BUCKET_SHIFT)),
        ("BUCKETS", Constant::U32(BUCKETS)),
        ("KEYS_EACH", Constant::U32(KEYS_EACH)),
    ];
    const WORKGROUP: u32 = 256;

    fn params(&self) -> Params {
        Params { block_count: self.block_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("keys", Access::Read, self.keys),
            Binding::new("pair_starts", Access::Read, self.pair_starts),
            Binding::new("buckets", Access::Add, self.buckets),
        ]
    }

    fn invocations(&self) -> u32 {
        self.most_keys.div_ceil(KEYS_EACH * Self::WORKGROUP) * Self::WORKGROUP
    }

    fn run_cpu(&mut self) {
        let keys = &self.keys.host()[..self.pair_starts.host()[self.block_count as usize] as usize];
        let chunk = keys.len().div_ceil(rayon::current_num_threads()).max(1 << 16);
        let counts: Vec<Vec<u32>> = keys
            .par_chunks(chunk)
            .map(|keys| {
                let mut counts = vec![0; BUCKETS as usize];
                for &key in keys {
                    counts[(key >> BUCKET_SHIFT) as usize] += 1;
                }
                counts
            })
            .collect();
        for counts in counts {
            for (bucket, count) in self.buckets.host_mut().iter_mut().zip(counts) {
                *bucket += count;
            }
        }
    }
}

/// The key below which at least `wanted` keys lie, at a bucket's bound, and how many do.
pub fn threshold(histogram: &[u32], wanted: usize) -> (u32, usize) {
    let mut count = 0;
    for (bucket, &keys) in histogram.iter().enumerate() {
        if count >= wanted {
            return ((bucket as u32) << BUCKET_SHIFT, count);
        }
        count += keys as usize;
    }
    ((histogram.len() as u32) << BUCKET_SHIFT, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_completes_the_bucket() {
        let histogram = [0, 3, 0, 4, 5];
        assert_eq!(threshold(&histogram, 0), (0, 0));
        assert_eq!(threshold(&histogram, 1), (2 << BUCKET_SHIFT, 3));
        assert_eq!(threshold(&histogram, 3), (2 << BUCKET_SHIFT, 3));
        assert_eq!(threshold(&histogram, 4), (4 << BUCKET_SHIFT, 7));
        assert_eq!(threshold(&histogram, 99), (5 << BUCKET_SHIFT, 12));
    }
}
