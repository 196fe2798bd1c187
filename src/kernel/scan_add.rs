//! Adds to every value the scanned sum of its block. Twin: `shaders/scan_add.wgsl`, line for line.

use rayon::prelude::*;

use super::scan_blocks::SCAN_BLOCK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};

/// One invocation a value.
pub struct ScanAdd<'a> {
    /// One sum a block, scanned.
    pub sums: &'a Buffer<u32>,
    /// `count` values, scanned within their blocks.
    pub values: &'a mut Buffer<u32>,
    /// How many.
    pub count: u32,
}

impl Kernel for ScanAdd<'_> {
    const NAME: &'static str = "scan_add";
    const SOURCE: &'static str = include_str!("../../shaders/scan_add.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("SCAN_BLOCK", Constant::U32(SCAN_BLOCK))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("sums", Access::Read, self.sums), Binding::new("values", Access::Write, self.values)]
    }

    fn invocations(&self) -> u32 {
        self.count
    }

    fn run_cpu(&mut self) {
        let values = &mut self.values.host_mut()[..self.count as usize];
        values.par_chunks_mut(SCAN_BLOCK as usize).zip(self.sums.host()).with_min_len(256).for_each(|(block, &sum)| {
            for value in block {
                *value += sum;
            }
        });
    }
}
