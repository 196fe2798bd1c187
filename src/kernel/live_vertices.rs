//! Tells which vertices still live after a round's contractions, and the length of their rings. Twin:
//! `shaders/live_vertices.wgsl`, line for line.

use rayon::prelude::*;

use super::contract_vertices::{GONE, KEEPS, ROLES, VERTEX};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};

/// One invocation a vertex, and one that ends both outputs with 0.
pub struct LiveVertices<'a> {
    /// V roles.
    pub roles: &'a Buffer<u32>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F: 1 for a face that lives, otherwise 0.
    pub face_live: &'a Buffer<u32>,
    /// V.
    pub vertex_count: u32,
    /// Writes V + 1: 1 for a vertex that lives, otherwise 0.
    pub live: &'a mut Buffer<u32>,
    /// Writes V + 1: live faces around the vertex, those of the vertex it took in included.
    pub ring_lengths: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        count: u32,
    }
}

#[inline(always)]
fn live_faces(vertex: u32, ring_starts: &[u32], ring_faces: &[u32], face_live: &[u32]) -> u32 {
    let (start, end) = (ring_starts[vertex as usize], ring_starts[vertex as usize + 1]);
    ring_faces[start as usize..end as usize].iter().map(|&face| face_live[face as usize]).sum()
}

impl Kernel for LiveVertices<'_> {
    const NAME: &'static str = "live_vertices";
    const SOURCE: &'static str = include_str!("../../shaders/live_vertices.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = ROLES;

    fn params(&self) -> Params {
        Params { count: self.vertex_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("roles", Access::Read, self.roles),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("face_live", Access::Read, self.face_live),
            Binding::new("live", Access::Write, self.live),
            Binding::new("ring_lengths", Access::Write, self.ring_lengths),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count + 1
    }

    fn run_cpu(&mut self) {
        let count = self.vertex_count as usize;
        let (roles, starts) = (self.roles.host(), self.ring_starts.host());
        let (faces, face_live) = (self.ring_faces.host(), self.face_live.host());
        let (live, lengths) = (&mut self.live.host_mut()[..=count], &mut self.ring_lengths.host_mut()[..=count]);
        (live[count], lengths[count]) = (0, 0);
        live[..count].par_iter_mut().zip(&mut lengths[..count]).enumerate().with_min_len(CHUNK).for_each(
            |(vertex, (live, length))| {
                let role = roles[vertex];
                if role & GONE != 0 {
                    (*live, *length) = (0, 0);
                    return;
                }
                let mut sum = live_faces(vertex as u32, starts, faces, face_live);
                if role & KEEPS != 0 {
                    sum += live_faces(role & VERTEX, starts, faces, face_live);
                }
                (*live, *length) = (1, sum);
            },
        );
    }
}
