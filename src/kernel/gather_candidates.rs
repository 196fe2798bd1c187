//! Writes the pairs that pass the gate, in the order of the list. Twin: `shaders/gather_candidates.wgsl`, line
//! for line.

use rayon::prelude::*;

use super::count_candidates::GATE_BLOCK;
use super::rows::{Candidate, Edge, Threshold};
use super::split::split_at_bounds;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};

/// Blocks a thread takes at a time.
const BLOCKS_EACH: usize = 512;

/// One invocation a block.
pub struct GatherCandidates<'a> {
    /// Keys, one a pair.
    pub keys: &'a Buffer<u32>,
    /// The pairs.
    pub pairs: &'a Buffer<Edge>,
    /// How many of them are of pairs, and which pass: one row.
    pub threshold: &'a Buffer<Threshold>,
    /// How many they are at most.
    pub most_keys: u32,
    /// Candidates before every block.
    pub starts: &'a Buffer<u32>,
    /// Writes the candidates.
    pub candidates: &'a mut Buffer<Candidate>,
}

impl Kernel for GatherCandidates<'_> {
    const NAME: &'static str = "gather_candidates";
    const SOURCE: &'static str = include_str!("../../shaders/gather_candidates.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("GATE_BLOCK", Constant::U32(GATE_BLOCK))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("keys", Access::Read, self.keys),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("threshold", Access::Read, self.threshold),
            Binding::new("starts", Access::Read, self.starts),
            Binding::new("candidates", Access::Write, self.candidates),
        ]
    }

    fn invocations(&self) -> u32 {
        self.most_keys.div_ceil(GATE_BLOCK)
    }

    fn run_cpu(&mut self) {
        let Threshold { pairs, key: threshold, .. } = self.threshold.host()[0];
        let keys = &self.keys.host()[..pairs as usize];
        let blocks = keys.len().div_ceil(GATE_BLOCK as usize);
        let starts = self.starts.host();
        let splits: Vec<u32> = (0..blocks).step_by(BLOCKS_EACH).chain([blocks]).map(|block| starts[block]).collect();
        let pieces = split_at_bounds(self.candidates.host_mut(), &splits);
        let chunk = BLOCKS_EACH * GATE_BLOCK as usize;
        let pairs = &self.pairs.host()[..keys.len()];
        keys.par_chunks(chunk).zip(pairs.par_chunks(chunk)).zip(pieces).for_each(|((keys, pairs), candidates)| {
            let passing = keys.iter().zip(pairs).filter(|&(&key, _)| key < threshold);
            for ((&key, &Edge { half_edge, .. }), candidate) in passing.zip(candidates) {
                *candidate = Candidate { key, half_edge };
            }
        });
    }
}
