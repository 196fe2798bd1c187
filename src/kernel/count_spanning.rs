//! How many faces of every block have their corners in three cells: those that a grid leaves, but for repetitions. Twin:
//! `shaders/count_spanning.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Face;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// Faces a block, which one invocation counts.
pub const SPAN_BLOCK: u32 = 64;

/// One invocation a block.
pub struct CountSpanning<'a> {
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// The key of every vertex.
    pub keys: &'a Buffer<[u32; 2]>,
    /// F.
    pub face_count: u32,
    /// Writes one count a block.
    pub counts: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

/// Whether the corners of a face lie in three cells.
#[inline(always)]
pub fn spans(a: [u32; 2], b: [u32; 2], c: [u32; 2]) -> bool {
    a != b && b != c && c != a
}

impl Kernel for CountSpanning<'_> {
    const NAME: &'static str = "count_spanning";
    const SOURCE: &'static str = include_str!("../../shaders/count_spanning.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("SPAN_BLOCK", Constant::U32(SPAN_BLOCK))];

    fn params(&self) -> Params {
        Params { count: self.face_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("keys", Access::Read, self.keys),
            Binding::new("counts", Access::Write, self.counts),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count.div_ceil(SPAN_BLOCK)
    }

    fn run_cpu(&mut self) {
        let keys = self.keys.host();
        let blocks = self.faces.host()[..self.face_count as usize].par_chunks(SPAN_BLOCK as usize);
        blocks.zip(self.counts.host_mut()).with_min_len(64).for_each(|(faces, spanning)| {
            let corners = faces.iter().map(|face| face.corners().map(|v| keys[v as usize]));
            *spanning = corners.map(|[a, b, c]| u32::from(spans(a, b, c))).sum();
        });
    }
}
