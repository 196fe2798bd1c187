//! The greatest values of blocks. Twin: `shaders/block_maxima.wgsl`, line for line.
//!
//! Run on its own maxima until one is left, it finds the greatest of any number of rows, which no order changes.

use rayon::prelude::*;

use super::rows::QuadricBound;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Rows to a block.
pub const MAXIMUM_BLOCK: u32 = 256;

/// One invocation a block.
pub struct BlockMaxima<'a> {
    /// N rows, not negative.
    pub bounds: &'a Buffer<QuadricBound>,
    /// N.
    pub bound_count: u32,
    /// Writes the greatest of each member for every [`MAXIMUM_BLOCK`] rows.
    pub maxima: &'a mut Buffer<QuadricBound>,
}

params! {
    /// The uniform block.
    pub struct Params {
        bound_count: u32,
    }
}

#[inline(always)]
fn block_maximum(bounds: &[QuadricBound]) -> QuadricBound {
    let mut greatest = QuadricBound::default();
    for bound in bounds {
        greatest = QuadricBound {
            weight: greatest.weight.max(bound.weight),
            offset_sq: greatest.offset_sq.max(bound.offset_sq),
        };
    }
    greatest
}

impl Kernel for BlockMaxima<'_> {
    const NAME: &'static str = "block_maxima";
    const SOURCE: &'static str = include_str!("../../shaders/block_maxima.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("MAXIMUM_BLOCK", Constant::U32(MAXIMUM_BLOCK))];

    fn params(&self) -> Params {
        Params { bound_count: self.bound_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("bounds", Access::Read, self.bounds), Binding::new("maxima", Access::Write, self.maxima)]
    }

    fn invocations(&self) -> u32 {
        self.bound_count.div_ceil(MAXIMUM_BLOCK)
    }

    fn run_cpu(&mut self) {
        let blocks = self.bounds.host()[..self.bound_count as usize].par_chunks(MAXIMUM_BLOCK as usize);
        blocks.zip(self.maxima.host_mut()).with_min_len(16).for_each(|(bounds, maximum)| {
            *maximum = block_maximum(bounds);
        });
    }
}
