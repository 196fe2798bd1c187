//! Every face with its corners renamed to their cells. Twin: `shaders/cell_faces.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::Face;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Kernel};

/// One invocation a face.
pub struct CellFaces<'a> {
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// The cell of every vertex.
    pub vertex_cells: &'a Buffer<u32>,
    /// F.
    pub face_count: u32,
    /// Writes the cells of F faces.
    pub cell_faces: &'a mut Buffer<Face>,
}

impl Kernel for CellFaces<'_> {
    const NAME: &'static str = "cell_faces";
    const SOURCE: &'static str = include_str!("../../shaders/cell_faces.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("vertex_cells", Access::Read, self.vertex_cells),
            Binding::new("cell_faces", Access::Write, self.cell_faces),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let cells = self.vertex_cells.host();
        let rows = self.cell_faces.host_mut()[..self.face_count as usize].par_iter_mut().zip(self.faces.host());
        rows.with_min_len(CHUNK).for_each(|(cell_face, face)| {
            let [a, b, c] = face.corners().map(|v| cells[v as usize]);
            *cell_face = Face { a, b, c };
        });
    }
}
