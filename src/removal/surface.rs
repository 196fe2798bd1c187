//! The live mesh on the host.

use rayon::prelude::*;

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::rows::{Face, Position, with_hub};
use crate::kernel::stars::Stars;
use crate::mesh::Rings;

use super::samples::Samples;

/// Rows that a thread takes at a time.
const ROWS: usize = 1 << 12;
/// The new name of a vertex that is gone.
const NONE: u32 = u32::MAX;

/// Positions, faces and rings. Between rounds every face lives and every vertex has one.
#[derive(Debug)]
pub struct Surface {
    pub positions: Buffer<Position>,
    pub faces: Buffer<Face>,
    pub ring_starts: Buffer<u32>,
    pub ring_faces: Buffer<u32>,
    /// Greatest distance of a sample to each face.
    pub deviations: Buffer<f32>,
    /// The vertex of the start that each is.
    pub source: Vec<u32>,
    /// The input face in whose place each stands.
    pub face_source: Vec<u32>,
}

impl Surface {
    /// As kernels see it.
    pub fn stars(&self) -> Stars<'_> {
        Stars::on_host(&self.positions, &self.faces, &self.ring_starts, &self.ring_faces)
    }

    /// Positions, faces and rings on the device of another queue.
    pub fn copy(&self, queue: &mut Queue) -> Result<Self> {
        Ok(Self {
            positions: queue.buffer_from(self.positions.host().to_vec())?,
            faces: queue.buffer_from(self.faces.host().to_vec())?,
            ring_starts: queue.buffer_from(self.ring_starts.host().to_vec())?,
            ring_faces: queue.buffer_from(self.ring_faces.host().to_vec())?,
            deviations: queue.buffer_from(self.deviations.host().to_vec())?,
            source: Vec::new(),
            face_source: Vec::new(),
        })
    }

    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Drops dead faces and the vertices that are `gone`, and numbers what is left without gaps.
    pub fn compact(&mut self, queue: &mut Queue, gone: &[bool], samples: &mut Samples) -> Result<()> {
        let mut renamed = vec![NONE; gone.len()];
        let mut count = 0;
        for (name, &gone) in renamed.iter_mut().zip(gone) {
            if !gone {
                *name = count;
                count += 1;
            }
        }
        let old = self.faces.host();
        let live: Vec<u32> =
            (0..old.len() as u32).into_par_iter().with_min_len(ROWS).filter(|&f| old[f as usize].is_live()).collect();
        let corners = |&f: &u32| old[f as usize].corners().map(|v| renamed[v as usize]);
        let faces: Vec<[u32; 3]> = live.par_iter().with_min_len(ROWS).map(corners).collect();
        self.face_source = live.par_iter().with_min_len(ROWS).map(|&f| self.face_source[f as usize]).collect();
        samples.compact(&live);
        let deviations = self.deviations.host();
        self.deviations = queue.buffer_from(live.iter().map(|&f| deviations[f as usize]).collect())?;

        let Rings { starts, faces: ring_faces } = Rings::new(&faces, count as usize);
        let mut positions = Vec::with_capacity(count as usize);
        let rows = self.positions.host().iter().zip(gone).filter(|(_, gone)| !**gone);
        positions.extend(
            rows.zip(starts.windows(2))
                .map(|((&row, _), ends)| Position { flags: with_hub(row.flags, ends[1] - ends[0]), ..row }),
        );
        let mut is_gone = gone.iter();
        self.source.retain(|_| is_gone.next() == Some(&false));
        self.positions = queue.buffer_from(positions)?;
        self.faces = queue.buffer_from(faces.into_iter().map(|[a, b, c]| Face { a, b, c }).collect())?;
        self.ring_starts = queue.buffer_from(starts)?;
        self.ring_faces = queue.buffer_from(ring_faces)?;
        Ok(())
    }
}
