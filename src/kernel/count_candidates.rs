//! How many keys of every block pass the gate. Twin: `shaders/count_candidates.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Threshold;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};

/// Keys a block, which one invocation counts and gathers: no barriers, few counts to scan.
pub const GATE_BLOCK: u32 = 32;

/// One invocation a block of as many keys as there may be, and one that ends `counts` with 0.
pub struct CountCandidates<'a> {
    /// Keys.
    pub keys: &'a Buffer<u32>,
    /// How many of them are of pairs, and which pass: one row.
    pub threshold: &'a Buffer<Threshold>,
    /// How many they are at most.
    pub most_keys: u32,
    /// Writes one count a block, and 0.
    pub counts: &'a mut Buffer<u32>,
}

impl Kernel for CountCandidates<'_> {
    const NAME: &'static str = "count_candidates";
    const SOURCE: &'static str = include_str!("../../shaders/count_candidates.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("GATE_BLOCK", Constant::U32(GATE_BLOCK))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("keys", Access::Read, self.keys),
            Binding::new("threshold", Access::Read, self.threshold),
            Binding::new("counts", Access::Write, self.counts),
        ]
    }

    fn invocations(&self) -> u32 {
        self.most_keys.div_ceil(GATE_BLOCK) + 1
    }

    fn run_cpu(&mut self) {
        let Threshold { pairs, key: threshold, .. } = self.threshold.host()[0];
        let keys = &self.keys.host()[..pairs as usize];
        let counts = &mut self.counts.host_mut()[..=self.most_keys.div_ceil(GATE_BLOCK) as usize];
        counts[keys.len().div_ceil(GATE_BLOCK as usize)..].fill(0);
        keys.par_chunks(GATE_BLOCK as usize).zip(counts).with_min_len(512).for_each(|(block, count)| {
            *count = block.iter().filter(|&&key| key < threshold).count() as u32;
        });
    }
}
