//! How many keys of every block pass the gate. Twin: `shaders/count_candidates.wgsl`, line for line.

use rayon::prelude::*;

use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Keys a block, which one invocation counts and gathers: no barriers, few counts to scan.
pub const GATE_BLOCK: u32 = 32;

/// One invocation a block, and one that ends `counts` with 0.
pub struct CountCandidates<'a> {
    /// Keys.
    pub keys: &'a Buffer<u32>,
    /// How many.
    pub key_count: u32,
    /// Keys below this pass.
    pub threshold: u32,
    /// Writes one count a block, and 0.
    pub counts: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
        threshold: u32,
    }
}

impl Kernel for CountCandidates<'_> {
    const NAME: &'static str = "count_candidates";
    const SOURCE: &'static str = include_str!("../../shaders/count_candidates.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("GATE_BLOCK", Constant::U32(GATE_BLOCK))];

    fn params(&self) -> Params {
        Params { count: self.key_count, threshold: self.threshold }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("keys", Access::Read, self.keys), Binding::new("counts", Access::Write, self.counts)]
    }

    fn invocations(&self) -> u32 {
        self.key_count.div_ceil(GATE_BLOCK) + 1
    }

    fn run_cpu(&mut self) {
        let keys = &self.keys.host()[..self.key_count as usize];
        let blocks = keys.len().div_ceil(GATE_BLOCK as usize);
        let threshold = self.threshold;
        let counts = &mut self.counts.host_mut()[..=blocks];
        counts[blocks] = 0;
        keys.par_chunks(GATE_BLOCK as usize).zip(counts).with_min_len(512).for_each(|(block, count)| {
            *count = block.iter().filter(|&&key| key < threshold).count() as u32;
        });
    }
}
