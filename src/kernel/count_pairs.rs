//! How many pairs the half-edges of every block of faces own. Twin: `shaders/count_pairs.wgsl`, line for line.

use rayon::prelude::*;

use super::pairs::{CONSTANTS, PAIR_BLOCK, owns_pair};
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
    /// F.
    pub face_count: u32,
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
fn owned_in_block(block: u32, face_count: u32, stars: &Stars<'_>) -> u32 {
    let mut owned = 0;
    for f in block * PAIR_BLOCK..((block + 1) * PAIR_BLOCK).min(face_count) {
        let face = stars.faces[f as usize];
        owned += u32::from(owns_pair(face.a, face.b, stars));
        owned += u32::from(owns_pair(face.b, face.c, stars));
        owned += u32::from(owns_pair(face.c, face.a, stars));
    }
    owned
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
        Params { count: self.face_count }
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
        self.face_count.div_ceil(PAIR_BLOCK) + 1
    }

    fn run_cpu(&mut self) {
        let face_count = self.face_count;
        let blocks = face_count.div_ceil(PAIR_BLOCK) as usize;
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let counts = &mut self.counts.host_mut()[..=blocks];
        counts[blocks] = 0;
        counts[..blocks].par_iter_mut().enumerate().with_min_len(64).for_each(|(block, count)| {
            *count = owned_in_block(block as u32, face_count, &stars);
        });
    }
}
