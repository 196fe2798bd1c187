//! Exclusive prefix sums within blocks, and the sum of every block. Twin: `shaders/scan_blocks.wgsl`, by contract.

use rayon::prelude::*;

use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Values a block: one workgroup scans it in its shared memory.
pub const SCAN_BLOCK: u32 = 1024;
/// Invocations a workgroup; each takes `SCAN_BLOCK / SCAN_THREADS` values.
pub const SCAN_THREADS: u32 = 256;

/// One workgroup a block.
pub struct ScanBlocks<'a> {
    /// `count` values, replaced by the sum of those before them in their block.
    pub values: &'a mut Buffer<u32>,
    /// How many.
    pub count: u32,
    /// Writes one sum a block.
    pub sums: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

impl Kernel for ScanBlocks<'_> {
    const NAME: &'static str = "scan_blocks";
    const SOURCE: &'static str = include_str!("../../shaders/scan_blocks.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] =
        &[("SCAN_BLOCK", Constant::U32(SCAN_BLOCK)), ("SCAN_THREADS", Constant::U32(SCAN_THREADS))];
    const WORKGROUP: u32 = SCAN_THREADS;

    fn params(&self) -> Params {
        Params { count: self.count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("values", Access::Write, self.values), Binding::new("sums", Access::Write, self.sums)]
    }

    fn invocations(&self) -> u32 {
        self.count.div_ceil(SCAN_BLOCK) * SCAN_THREADS
    }

    fn run_cpu(&mut self) {
        let values = &mut self.values.host_mut()[..self.count as usize];
        values.par_chunks_mut(SCAN_BLOCK as usize).zip(self.sums.host_mut()).with_min_len(16).for_each(
            |(block, total)| {
                let mut sum = 0;
                for value in block {
                    sum += std::mem::replace(value, sum);
                }
                *total = sum;
            },
        );
    }
}
