//! Writes the pairs that pass the gate, in the order of the list. Twin: `shaders/gather_candidates.wgsl`, line
//! for line.

use rayon::prelude::*;

use super::count_candidates::GATE_BLOCK;
use super::rows::{Candidate, Edge};
use super::split::split_at_bounds;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Blocks a thread takes at a time.
const BLOCKS_EACH: usize = 512;

/// One invocation a block.
pub struct GatherCandidates<'a> {
    /// Keys, one a pair.
    pub keys: &'a Buffer<u32>,
    /// The pairs.
    pub pairs: &'a Buffer<Edge>,
    /// How many.
    pub key_count: u32,
    /// Keys below this pass.
    pub threshold: u32,
    /// Candidates before every block.
    pub starts: &'a Buffer<u32>,
    /// Writes the candidates.
    pub candidates: &'a mut Buffer<Candidate>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
        threshold: u32,
    }
}

impl Kernel for GatherCandidates<'_> {
    const NAME: &'static str = "gather_candidates";
    const SOURCE: &'static str = include_str!("../../shaders/gather_candidates.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("GATE_BLOCK", Constant::U32(GATE_BLOCK))];

    fn params(&self) -> Params {
        Params { count: self.key_count, threshold: self.threshold }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("keys", Access::Read, self.keys),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("starts", Access::Read, self.starts),
            Binding::new("candidates", Access::Write, self.candidates),
        ]
    }

    fn invocations(&self) -> u32 {
        self.key_count.div_ceil(GATE_BLOCK)
    }

    fn run_cpu(&mut self) {
        let keys = &self.keys.host()[..self.key_count as usize];
        let blocks = keys.len().div_ceil(GATE_BLOCK as usize);
        let starts = self.starts.host();
        let splits: Vec<u32> = (0..blocks).step_by(BLOCKS_EACH).chain([blocks]).map(|block| starts[block]).collect();
        let pieces = split_at_bounds(self.candidates.host_mut(), &splits);
        let chunk = BLOCKS_EACH * GATE_BLOCK as usize;
        let (pairs, threshold) = (&self.pairs.host()[..keys.len()], self.threshold);
        keys.par_chunks(chunk).zip(pairs.par_chunks(chunk)).zip(pieces).for_each(|((keys, pairs), candidates)| {
            let passing = keys.iter().zip(pairs).filter(|&(&key, _)| key < threshold);
            for ((&key, &Edge { half_edge, .. }), candidate) in passing.zip(candidates) {
                *candidate = Candidate { key, half_edge };
            }
        });
    }
}
