//! The attributes of a round on a device: numbers of wedges, gradients of faces, sums.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::attribute_costs::WedgeBuffers;
use crate::kernel::attribute_sums::AttributeSums;
use crate::kernel::face_gradients::FaceGradients;
use crate::kernel::rows::{AttributeSum, Face, Normal, Slope};

use super::evaluate::grow;
use super::surface::Surface;
use super::wedges::Wedges;

/// What the cost of a pair needs beside the geometry.
#[derive(Debug)]
pub struct AttributeBuffers {
    corners: Buffer<Face>,
    wedge_starts: Buffer<u32>,
    values: Buffer<f32>,
    face_sums: Buffer<AttributeSum>,
    gradients: Buffer<Slope>,
    sums: Buffer<AttributeSum>,
    slopes: Buffer<Slope>,
    costed: usize,
}

impl AttributeBuffers {
    /// For wedges some of whose numbers decide; `None` for others.
    pub fn new(queue: &Queue, wedges: Option<&Wedges>) -> Result<Option<Self>> {
        let Some(wedges) = wedges.filter(|wedges| wedges.layout.costed > 0) else { return Ok(None) };
        let (corners, starts) = wedges.connectivity();
        let (faces, count, costed) = (corners.len(), wedges.len(), wedges.layout.costed);
        Ok(Some(Self {
            corners: queue.buffer(faces)?,
            wedge_starts: queue.buffer(starts.len())?,
            values: queue.buffer(count * costed)?,
            face_sums: queue.buffer(faces)?,
            gradients: queue.buffer(faces * costed)?,
            sums: queue.buffer(count)?,
            slopes: queue.buffer(count * costed)?,
            costed,
        }))
    }

    /// Takes the wedges of a round from the host.
    pub fn send(&mut self, queue: &mut Queue, wedges: &Wedges) -> Result<()> {
        let (corners, starts) = wedges.connectivity();
        let count = wedges.len() * self.costed;
        grow(queue, &mut self.sums, wedges.len())?;
        grow(queue, &mut self.slopes, count)?;
        grow(queue, &mut self.values, count)?;
        queue.write(&mut self.corners, bytemuck::cast_slice(corners))?;
        queue.write(&mut self.wedge_starts, starts)?;
        let mut values = vec![0.0; count];
        wedges.costed(&mut values);
        queue.write(&mut self.values, &values)
    }

    /// Sums what the attributes need of the surface as it is.
    pub fn sum(&mut self, queue: &mut Queue, surface: &Surface, normals: &Buffer<Normal>) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        let Self { corners, wedge_starts, values, face_sums, gradients, sums, slopes, .. } = self;
        let costed = self.costed as u32;
        queue.run(FaceGradients {
            positions,
            faces,
            normals,
            corners,
            values,
            face_count,
            costed,
            sums: face_sums,
            gradients,
        })?;
        queue.run(AttributeSums {
            positions,
            faces,
            ring_starts,
            ring_faces,
            corners,
            wedge_starts,
            values,
            face_sums,
            gradients,
            vertex_count,
            costed,
            sums,
            slopes,
        })
    }

    /// What costs are computed from.
    pub fn rows(&self) -> WedgeBuffers<'_> {
        let Self { corners, sums, slopes, costed, .. } = self;
        WedgeBuffers { corners, wedge_sums: sums, slopes, costed: *costed }
    }
}
