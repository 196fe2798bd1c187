//! Moves live vertices to their new numbers, with the starts of their rings, and tells which are hubs. Twin:
//! `shaders/compact_vertices.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::{FLAGS, Position, with_hub};
use super::split::{chunk_bounds, split_at_bounds};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// One invocation a vertex, and one that ends the starts.
pub struct CompactVertices<'a> {
    /// V + 1: live vertices before each; the next entry is greater for a live one.
    pub new_vertex: &'a Buffer<u32>,
    /// V + 1: where the new ring of each starts.
    pub new_starts: &'a Buffer<u32>,
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// V.
    pub vertex_count: u32,
    /// Writes a position for every live vertex.
    pub positions_out: &'a mut Buffer<Position>,
    /// Writes a start for every live vertex, and the end.
    pub starts_out: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

impl Kernel for CompactVertices<'_> {
    const NAME: &'static str = "compact_vertices";
    const SOURCE: &'static str = include_str!("../../shaders/compact_vertices.wgsl");
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;

    fn params(&self) -> Params {
        Params { count: self.vertex_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("new_vertex", Access::Read, self.new_vertex),
            Binding::new("new_starts", Access::Read, self.new_starts),
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("positions_out", Access::Write, self.positions_out),
            Binding::new("starts_out", Access::Write, self.starts_out),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count + 1
    }

    fn run_cpu(&mut self) {
        let count = self.vertex_count as usize;
        let (new_vertex, new_starts) = (self.new_vertex.host(), self.new_starts.host());
        let positions = self.positions.host();
        let bounds: Vec<usize> = chunk_bounds(count).collect();
        let splits: Vec<u32> = bounds.iter().map(|&vertex| new_vertex[vertex]).collect();
        let starts_out = self.starts_out.host_mut();
        starts_out[new_vertex[count] as usize] = new_starts[count];
        let positions_out = split_at_bounds(self.positions_out.host_mut(), &splits);
        let starts_out = split_at_bounds(starts_out, &splits);
        bounds.par_windows(2).zip(positions_out).zip(starts_out).for_each(|((range, positions_out), starts_out)| {
            let mut out = 0;
            for vertex in range[0]..range[1] {
                if new_vertex[vertex + 1] != new_vertex[vertex] {
                    let faces = new_starts[vertex + 1] - new_starts[vertex];
                    let position = positions[vertex];
                    positions_out[out] = Position { flags: with_hub(position.flags, faces), ..position };
                    starts_out[out] = new_starts[vertex];
                    out += 1;
                }
            }
        });
    }
}
