//! How many pairs the vertices of every block list. Twin: `shaders/count_pairs.wgsl`, by contract.
//!
//! The shader counts by faces, each of which knows the pairs of its half-edges but for those of borders: a quarter of what
//! the rings of all vertices are to read.

use rayon::prelude::*;

use super::pairs::{CONSTANTS, PAIR_BLOCK, Special, pairs_at};
use super::rows::{Face, Position};
use super::stars::Stars;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch};

/// One invocation a face.
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
    /// What beside ordinary vertices there is.
    pub special: Special,
    /// F.
    pub face_count: u32,
    /// Adds to one count a block.
    pub counts: &'a mut Buffer<u32>,
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
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn switches(&self) -> Vec<Switch> {
        self.special.switches()
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("counts", Access::Add, self.counts),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let vertex_count = self.vertex_count;
        let blocks = vertex_count.div_ceil(PAIR_BLOCK) as usize;
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let counts = &mut self.counts.host_mut()[..blocks];
        counts.par_iter_mut().enumerate().with_min_len(64).for_each(|(block, count)| {
            *count += listed_in_block(block as u32, vertex_count, &stars);
        });
    }
}
