//! Moves live faces to their new numbers, their corners to the new numbers of their vertices. Twin:
//! `shaders/compact_faces.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Face;
use super::split::{chunk_bounds, split_at_bounds};
use crate::backend::{Access, Binding, Buffer, Kernel};

/// One invocation a face.
pub struct CompactFaces<'a> {
    /// F + 1: live faces before each; the next entry is greater for a live one.
    pub new_face: &'a Buffer<u32>,
    /// V + 1: live vertices before each.
    pub new_vertex: &'a Buffer<u32>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes every live face.
    pub faces_out: &'a mut Buffer<Face>,
}

impl Kernel for CompactFaces<'_> {
    const NAME: &'static str = "compact_faces";
    const SOURCE: &'static str = include_str!("../../shaders/compact_faces.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("new_face", Access::Read, self.new_face),
            Binding::new("new_vertex", Access::Read, self.new_vertex),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("faces_out", Access::Write, self.faces_out),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let (new_face, new_vertex, faces) = (self.new_face.host(), self.new_vertex.host(), self.faces.host());
        let bounds: Vec<usize> = chunk_bounds(self.face_count as usize).collect();
        let splits: Vec<u32> = bounds.iter().map(|&face| new_face[face]).collect();
        let pieces = split_at_bounds(self.faces_out.host_mut(), &splits);
        bounds.par_windows(2).zip(pieces).for_each(|(range, faces_out)| {
            let live = (range[0]..range[1]).filter(|&face| new_face[face + 1] != new_face[face]);
            for (face, out) in live.zip(faces_out) {
                let [a, b, c] = faces[face].corners().map(|corner| new_vertex[corner as usize]);
                *out = Face { a, b, c };
            }
        });
    }
}
