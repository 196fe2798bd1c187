//! Sums blocks of values in their order. Twin: `shaders/block_sums.wgsl`, line for line.
//!
//! Run on its own sums until one is left, it sums any number of values in one order on every device.

use rayon::prelude::*;

use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST_SUM, add, flush};

/// Values to a block.
pub const SUM_BLOCK: u32 = 256;

/// One invocation a block.
pub struct BlockSums<'a> {
    /// N values, not negative.
    pub values: &'a Buffer<f32>,
    /// N.
    pub value_count: u32,
    /// Writes a sum for every [`SUM_BLOCK`] values.
    pub sums: &'a mut Buffer<f32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        value_count: u32,
    }
}

#[inline(always)]
fn block_sum(values: &[f32]) -> f32 {
    let mut sum = 0.0;
    for &value in values {
        sum = add(sum, value);
    }
    sum
}

impl Kernel for BlockSums<'_> {
    const NAME: &'static str = "block_sums";
    const SOURCE: &'static str = include_str!("../../shaders/block_sums.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("SUM_BLOCK", Constant::U32(SUM_BLOCK))];

    fn params(&self) -> Params {
        Params { value_count: self.value_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("values", Access::Read, self.values), Binding::new("sums", Access::Write, self.sums)]
    }

    fn invocations(&self) -> u32 {
        self.value_count.div_ceil(SUM_BLOCK)
    }

    fn run_cpu(&mut self) {
        let blocks = self.values.host()[..self.value_count as usize].par_chunks(SUM_BLOCK as usize);
        blocks.zip(self.sums.host_mut()).with_min_len(16).for_each(|(values, sum)| {
            *sum = flush(block_sum(values), LEAST_SUM);
        });
    }
}
