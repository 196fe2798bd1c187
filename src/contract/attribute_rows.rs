//! The attributes of a round on a device: wedges, and how far the gradients of their numbers spread.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::attribute_spreads::AttributeSpreads;
use crate::kernel::gradient_operators::GradientOperators;
use crate::kernel::rows::{Face, GradientOperator, Normal, VolumeSum};

use super::evaluate::grow;
use super::surface::Surface;
use super::wedges::Wedges;

/// The wedges of a surface on one device.
#[derive(Debug)]
pub struct WedgeBuffers {
    /// The wedge of every corner of every face.
    pub corners: Buffer<Face>,
    /// The first wedge of each vertex, and the end.
    pub starts: Buffer<u32>,
    /// `width` numbers a wedge, first those that decide.
    pub rows: Buffer<f32>,
    pub width: usize,
}

impl WedgeBuffers {
    /// Room on a device for what is sent of the host's in any round: of the rows the numbers that decide alone.
    pub fn with_room(queue: &Queue, wedges: &Wedges) -> Result<Self> {
        let (WedgeBuffers { corners, starts, .. }, width) = (&wedges.buffers, wedges.layout.costed);
        Ok(Self {
            corners: queue.buffer(corners.len())?,
            starts: queue.buffer(starts.len())?,
            rows: queue.buffer(wedges.len() * width)?,
            width,
        })
    }

    /// Takes the wedges of a round, of so many faces and vertices, from the host.
    pub fn send(&mut self, queue: &mut Queue, wedges: &Wedges, surface: &Surface) -> Result<()> {
        let WedgeBuffers { corners, starts, .. } = &wedges.buffers;
        queue.write(&mut self.corners, &corners.host()[..surface.face_count])?;
        queue.write(&mut self.starts, &starts.host()[..=surface.vertex_count])?;
        queue.write(&mut self.rows, &wedges.costed())
    }
}

/// What the sums of a round need beside the geometry and the wedges.
#[derive(Debug)]
pub struct Spreads {
    operators: Buffer<GradientOperator>,
    costed: usize,
}

impl Spreads {
    /// For wedges some of whose numbers decide; `None` for others.
    pub fn new(queue: &Queue, wedges: Option<&Wedges>) -> Result<Option<Self>> {
        let Some(wedges) = wedges.filter(|wedges| wedges.layout.costed > 0) else { return Ok(None) };
        Ok(Some(Self { operators: queue.buffer(0)?, costed: wedges.layout.costed }))
    }

    /// Frees what the largest round needed.
    pub fn release(&mut self, queue: &Queue) -> Result<()> {
        self.operators = queue.buffer(0)?;
        Ok(())
    }

    /// Adds what the attributes cost to the sums of the surface as it is.
    pub fn add_to(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        wedges: &WedgeBuffers,
        normals: &Buffer<Normal>,
        sums: &mut Buffer<VolumeSum>,
    ) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        let operators = &mut self.operators;
        grow(queue, operators, surface.face_count)?;
        queue.run(GradientOperators { positions, faces, normals, face_count, operators })?;
        queue.run(AttributeSpreads {
            ring_starts,
            ring_faces,
            corners: &wedges.corners,
            wedge_starts: &wedges.starts,
            values: &wedges.rows,
            operators,
            vertex_count,
            width: wedges.width as u32,
            costed: self.costed as u32,
            sums,
        })
    }
}
