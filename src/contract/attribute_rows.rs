//! The attributes of a round on a device: numbers of wedges, gradients of faces, how far these spread.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::attribute_spreads::AttributeSpreads;
use crate::kernel::face_gradients::FaceGradients;
use crate::kernel::rows::{Face, Normal, VolumeSum};

use super::evaluate::grow;
use super::surface::Surface;
use super::wedges::Wedges;

/// What the sums of a round need beside the geometry.
#[derive(Debug)]
pub struct AttributeBuffers {
    corners: Buffer<Face>,
    wedge_starts: Buffer<u32>,
    values: Buffer<f32>,
    gradients: Buffer<f32>,
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
            gradients: queue.buffer(3 * faces * costed)?,
            costed,
        }))
    }

    /// Takes the wedges of a round from the host.
    pub fn send(&mut self, queue: &mut Queue, wedges: &Wedges) -> Result<()> {
        let (corners, starts) = wedges.connectivity();
        let count = wedges.len() * self.costed;
        grow(queue, &mut self.values, count)?;
        queue.write(&mut self.corners, bytemuck::cast_slice(corners))?;
        queue.write(&mut self.wedge_starts, starts)?;
        if queue.is_on_host() {
            wedges.costed(&mut self.values.host_mut()[..count]);
            return Ok(());
        }
        let mut values = vec![0.0; count];
        wedges.costed(&mut values);
        queue.write(&mut self.values, &values)
    }

    /// Adds what the attributes cost to the sums of the surface as it is.
    pub fn add_to(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        normals: &Buffer<Normal>,
        sums: &mut Buffer<VolumeSum>,
    ) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        let Self { corners, wedge_starts, values, gradients, .. } = self;
        let costed = self.costed as u32;
        queue.run(FaceGradients { positions, faces, normals, corners, values, face_count, costed, gradients })?;
        queue.run(AttributeSpreads {
            normals,
            ring_starts,
            ring_faces,
            corners,
            wedge_starts,
            gradients,
            vertex_count,
            costed,
            sums,
        })
    }
}
