//! How many pairs the vertices of every block list. Twin: `shaders/count_pairs.wgsl`, line for line.

use rayon::prelude::*;

use super::pairs::{CONSTANTS, PAIR_BLOCK, pairs_at};
use super::rows::{Face, Position};
use super::stars::Stars;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// One invocation a block, and one that ends `counts` with 0.
#[derive(Debug)]
pub struct CountPairs<'a> {
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
    /// Writes one count a block, and 0.
    pub counts: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

#[inline(always)]
fn listed_in_block(block: u32, vertex_count: u32, stars: &Stars<'_>) -> u32 {
    let mut count = 0;
    for u in block * PAIR_BLOCK..((block + 1) * PAIR_BLOCK).min(vertex_count) {
        pairs_at(u, stars, |_| count += 1);
    }
    count
}

impl Kernel for CountPairs<'_> {
    const NAME: &'static str = "count_pairs";
    const SOURCE: &'static str = include_str!("../../shaders/count_pairs.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/stars.wgsl"), include_str!("../../shaders/shared/pairs.wgsl")];
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;

    fn params(&self) -> Params {
        Params { count: self.vertex_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("counts", Access::Write, self.counts),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count.div_ceil(PAIR_BLOCK) + 1
    }

    fn run_cpu(&mut self) {
        let vertex_count = self.vertex_count;
        let blocks = vertex_count.div_ceil(PAIR_BLOCK) as usize;
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let counts = &mut self.counts.host_mut()[..=blocks];
        counts[blocks] = 0;
        counts[..blocks].par_iter_mut().enumerate().with_min_len(64).for_each(|(block, count)| {
            *count = listed_in_block(block as u32, vertex_count, &stars);
        });
    }
}
