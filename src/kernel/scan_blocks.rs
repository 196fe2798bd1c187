//! Exclusive prefix sums within blocks, and the sum of every block. Twin: `shaders/scan_blocks.wgsl`, line for line.

use rayon::prelude::*;

use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Values a block, which one invocation scans: without barriers, which cost software Vulkan more than another level.
pub const SCAN_BLOCK: u32 = 64;

/// One invocation a block.
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
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("SCAN_BLOCK", Constant::U32(SCAN_BLOCK))];

    fn params(&self) -> Params {
        Params { count: self.count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("values", Access::Write, self.values), Binding::new("sums", Access::Write, self.sums)]
    }

    fn invocations(&self) -> u32 {
        self.count.div_ceil(SCAN_BLOCK)
    }

    fn run_cpu(&mut self) {
        let values = &mut self.values.host_mut()[..self.count as usize];
        values.par_chunks_mut(SCAN_BLOCK as usize).zip(self.sums.host_mut()).with_min_len(256).for_each(
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
