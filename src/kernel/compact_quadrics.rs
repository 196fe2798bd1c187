//! Moves the quadrics of live vertices to their new numbers. Twin: `shaders/compact_quadrics.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::PlaneQuadric;
use super::split::{chunk_bounds, split_at_bounds};
use crate::backend::{Access, Binding, Buffer, Kernel};

/// One invocation a vertex.
pub struct CompactQuadrics<'a> {
    /// V + 1: live vertices before each; the next entry is greater for a live one.
    pub new_vertex: &'a Buffer<u32>,
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// V.
    pub vertex_count: u32,
    /// Writes a quadric for every live vertex.
    pub quadrics_out: &'a mut Buffer<PlaneQuadric>,
}

impl Kernel for CompactQuadrics<'_> {
    const NAME: &'static str = "compact_quadrics";
    const SOURCE: &'static str = include_str!("../../shaders/compact_quadrics.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("new_vertex", Access::Read, self.new_vertex),
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("quadrics_out", Access::Write, self.quadrics_out),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let (new_vertex, quadrics) = (self.new_vertex.host(), self.quadrics.host());
        let bounds: Vec<usize> = chunk_bounds(self.vertex_count as usize).collect();
        let splits: Vec<u32> = bounds.iter().map(|&vertex| new_vertex[vertex]).collect();
        let pieces = split_at_bounds(self.quadrics_out.host_mut(), &splits);
        bounds.par_windows(2).zip(pieces).for_each(|(range, quadrics_out)| {
            let live = (range[0]..range[1]).filter(|&vertex| new_vertex[vertex + 1] != new_vertex[vertex]);
            for (vertex, out) in live.zip(quadrics_out) {
                *out = quadrics[vertex];
            }
        });
    }
}
