//! Writes the new ring of every live vertex: the live faces of its own ring and of the one it took in, under their new
//! numbers, ascending. Twin: `shaders/compact_rings.wgsl`, line for line.
//!
//! Both rings ascend and faces keep their order, so merging them keeps rings ascending without any sort or atomic.

use rayon::prelude::*;

use super::contract_vertices::{KEEPS, ROLES, VERTEX};
use super::split::{chunk_bounds, split_at_bounds};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};

/// No face: past the end of a ring.
const END: u32 = u32::MAX;

/// One invocation a vertex.
pub struct CompactRings<'a> {
    /// V roles.
    pub roles: &'a Buffer<u32>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F + 1: live faces before each; the next entry is greater for a live one.
    pub new_face: &'a Buffer<u32>,
    /// V + 1: live vertices before each; the next entry is greater for a live one.
    pub new_vertex: &'a Buffer<u32>,
    /// V + 1: where the new ring of each starts.
    pub new_starts: &'a Buffer<u32>,
    /// V.
    pub vertex_count: u32,
    /// Writes the new rings.
    pub rings_out: &'a mut Buffer<u32>,
}

impl Kernel for CompactRings<'_> {
    const NAME: &'static str = "compact_rings";
    const SOURCE: &'static str = include_str!("../../shaders/compact_rings.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[ROLES[0], ROLES[1], ROLES[2], ("END", Constant::U32(END))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("roles", Access::Read, self.roles),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("new_face", Access::Read, self.new_face),
            Binding::new("new_vertex", Access::Read, self.new_vertex),
            Binding::new("new_starts", Access::Read, self.new_starts),
            Binding::new("rings_out", Access::Write, self.rings_out),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let count = self.vertex_count as usize;
        let (roles, new_face, new_vertex) = (self.roles.host(), self.new_face.host(), self.new_vertex.host());
        let (ring_starts, ring_faces) = (self.ring_starts.host(), self.ring_faces.host());
        let new_starts = self.new_starts.host();
        let bounds: Vec<usize> = chunk_bounds(count).collect();
        let splits: Vec<u32> = bounds.iter().map(|&vertex| new_starts[vertex]).collect();
        let pieces = split_at_bounds(self.rings_out.host_mut(), &splits);
        bounds.par_windows(2).zip(pieces).for_each(|(range, rings_out)| {
            let mut out = 0;
            for vertex in range[0]..range[1] {
                if new_vertex[vertex + 1] == new_vertex[vertex] {
                    continue;
                }
                let role = roles[vertex];
                let (mut i, i_end) = (ring_starts[vertex], ring_starts[vertex + 1]);
                let (mut j, mut j_end) = (0, 0);
                if role & KEEPS != 0 {
                    let other = (role & VERTEX) as usize;
                    (j, j_end) = (ring_starts[other], ring_starts[other + 1]);
                }
                let head = |at: u32, end: u32| if at < end { ring_faces[at as usize] } else { END };
                let (mut own, mut taken) = (head(i, i_end), head(j, j_end));
                while own.min(taken) != END {
                    let face = own.min(taken) as usize;
                    if own < taken {
                        i += 1;
                        own = head(i, i_end);
                    } else {
                        j += 1;
                        taken = head(j, j_end);
                    }
                    if new_face[face + 1] != new_face[face] {
                        rings_out[out] = new_face[face];
                        out += 1;
                    }
                }
            }
        });
    }
}
