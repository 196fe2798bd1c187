//! Writes the pairs that the vertices of every block list. Twin: `shaders/gather_pairs.wgsl`, by contract.

use rayon::prelude::*;

use super::pairs::{CONSTANTS, PAIR_BLOCK, Special, pairs_at};
use super::rows::{Edge, Face, Position};
use super::split::split_at_bounds;
use super::stars::Stars;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch, params};

/// Blocks a thread takes at a time.
const BLOCKS_EACH: usize = 64;

/// One invocation a block.
#[derive(Debug)]
pub struct GatherPairs<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V.
    pub vertex_count: u32,
    /// What beside ordinary vertices there is.
    pub special: Special,
    /// Pairs before every block.
    pub starts: &'a Buffer<u32>,
    /// Writes the pairs.
    pub pairs: &'a mut Buffer<Edge>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

impl Kernel for GatherPairs<'_> {
    const NAME: &'static str = "gather_pairs";
    const SOURCE: &'static str = include_str!("../../shaders/gather_pairs.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/stars.wgsl"), include_str!("../../shaders/shared/pairs.wgsl")];
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;

    fn params(&self) -> Params {
        Params { count: self.vertex_count }
    }

    fn switches(&self) -> Vec<Switch> {
        self.special.switches()
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("starts", Access::Read, self.starts),
            Binding::new("pairs", Access::Write, self.pairs),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count.div_ceil(PAIR_BLOCK)
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let blocks = self.vertex_count.div_ceil(PAIR_BLOCK) as usize;
        let starts = self.starts.host();
        let splits: Vec<u32> = (0..blocks).step_by(BLOCKS_EACH).chain([blocks]).map(|block| starts[block]).collect();
        let pieces = split_at_bounds(self.pairs.host_mut(), &splits);
        let chunk = BLOCKS_EACH as u32 * PAIR_BLOCK;
        (0..self.vertex_count).into_par_iter().step_by(chunk as usize).zip(pieces).for_each(|(first, pairs)| {
            let mut out = 0;
            for u in first..(first + chunk).min(self.vertex_count) {
                pairs_at(u, &stars, |pair| {
                    pairs[out] = pair;
                    out += 1;
                });
            }
        });
    }
}
