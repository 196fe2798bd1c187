//! The live mesh on one device: positions, faces and rings, and what a round leaves of them.
//!
//! # Invariants
//! Between rounds: every face lives, vertices and faces are numbered without gaps in their original order, and every
//! ring lists its vertex's faces in ascending order. All devices hold the same bytes.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::rows::{Face, PlaneQuadric, Position};
use crate::kernel::split::join;
use crate::mesh::adjacency::group_into;

use super::carry::Carried;
use super::compact;

/// Vertices from which a run frees what only its first round needs: a lower peak, for a little more time.
pub const LARGE_VERTICES: usize = 1 << 20;

/// Positions, faces and rings on one device.
#[derive(Debug)]
pub struct Surface {
    pub positions: Buffer<Position>,
    pub faces: Buffer<Face>,
    pub ring_starts: Buffer<u32>,
    pub ring_faces: Buffer<u32>,
    /// Accumulated plane quadrics, of the metric `plane`.
    pub quadrics: Option<Buffer<PlaneQuadric>>,
    pub vertex_count: usize,
    pub face_count: usize,
    /// On the host: what this round did to every vertex; zero between rounds.
    pub roles: Buffer<u32>,
    /// On the host: live vertices before each.
    new_vertex: Buffer<u32>,
}

/// The start of a run, in host memory.
#[derive(Debug, Clone, Default)]
pub struct Start {
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub ring_starts: Vec<u32>,
    pub ring_faces: Vec<u32>,
}

impl Surface {
    /// The start of a run on the host.
    pub fn new(queue: &mut Queue, start: Start, with_quadrics: bool) -> Result<Self> {
        let (vertex_count, face_count) = (start.positions.len(), start.faces.len());
        Ok(Self {
            positions: queue.buffer_from(start.positions)?,
            faces: queue.buffer_from(start.faces)?,
            ring_starts: queue.buffer_from(start.ring_starts)?,
            ring_faces: queue.buffer_from(start.ring_faces)?,
            quadrics: with_quadrics.then(|| queue.buffer(vertex_count)).transpose()?,
            vertex_count,
            face_count,
            roles: queue.buffer(vertex_count)?,
            new_vertex: queue.buffer(vertex_count + 1)?,
        })
    }

    /// A copy on the device of `queue` of a host's surface before its first round; quadrics are not copied.
    pub fn copy(queue: &mut Queue, host: &Self, with_quadrics: bool) -> Result<Self> {
        let (vertex_count, face_count) = (host.vertex_count, host.face_count);
        let mut copy = Self {
            positions: queue.buffer(vertex_count)?,
            faces: queue.buffer(face_count)?,
            ring_starts: queue.buffer(vertex_count + 1)?,
            ring_faces: queue.buffer(3 * face_count)?,
            quadrics: None,
            vertex_count,
            face_count,
            roles: queue.buffer(0)?,
            new_vertex: queue.buffer(0)?,
        };
        copy.send(queue, host)?;
        copy.quadrics = with_quadrics.then(|| queue.buffer(vertex_count)).transpose()?;
        Ok(copy)
    }

    /// Sends the rows of a host's surface to this copy of it.
    pub fn send(&mut self, queue: &mut Queue, host: &Self) -> Result<()> {
        (self.vertex_count, self.face_count) = (host.vertex_count, host.face_count);
        queue.write(&mut self.positions, &host.positions.host()[..host.vertex_count])?;
        queue.write(&mut self.faces, &host.faces.host()[..host.face_count])?;
        queue.write(&mut self.ring_starts, &host.ring_starts.host()[..=host.vertex_count])?;
        queue.write(&mut self.ring_faces, &host.ring_faces.host()[..3 * host.face_count])?;
        if let (Some(copy), Some(quadrics)) = (&mut self.quadrics, &host.quadrics) {
            queue.write(copy, &quadrics.host()[..host.vertex_count])?;
        }
        Ok(())
    }

    /// Marks faces of the host as dead, for the next compaction.
    pub fn kill(&mut self, faces: impl IntoIterator<Item = u32>) {
        for f in faces {
            let face = &mut self.faces.host_mut()[f as usize];
            (face.b, face.c) = (face.a, face.a);
        }
    }

    /// For host buffers: live vertices before each vertex of the round that was compacted last.
    pub fn new_vertex(&self) -> &[u32] {
        self.new_vertex.host()
    }

    /// Compacts what a round leaves on the host, with what goes along.
    pub fn compact_on_host(&mut self, carried: &mut Carried, faces_left: usize) {
        let (old_count, vertices) = (self.vertex_count, ..self.vertex_count);
        if let Some(wedges) = &mut carried.wedges {
            wedges.settle(&self.faces.host()[..self.face_count], &self.roles.host()[vertices]);
        }
        let new_vertex = &mut self.new_vertex.host_mut()[..=old_count];
        let roles = &mut self.roles.host_mut()[vertices];
        compact::number(roles, new_vertex);
        let own = &mut self.faces.host_mut()[..self.face_count];
        let stretches = compact::faces(roles, own, &mut carried.face_origin);
        roles.fill(0);
        let new_vertex = &*new_vertex;
        (self.vertex_count, self.face_count) = (new_vertex[old_count] as usize, faces_left);

        let Self { positions, faces, ring_starts, ring_faces, quadrics, .. } = self;
        let faces = &faces.host()[..faces_left];
        let (starts, rings) = (&mut ring_starts.host_mut()[..=self.vertex_count], ring_faces.host_mut());
        // One thread moves rows meanwhile.
        let threads = (rayon::current_num_threads() - 1).max(1);
        let count_rings =
            || group_into(&stretches, |face| faces[face].corners(), &mut *starts, threads, |total| &mut rings[..total]);
        let move_rows = || {
            compact::keep_live_in(positions.host_mut(), new_vertex);
            if let Some(quadrics) = quadrics {
                compact::keep_live_in(quadrics.host_mut(), new_vertex);
            }
            if let Some(wedges) = &mut carried.wedges {
                wedges.compact(faces, new_vertex);
            }
            carried.compact(new_vertex);
        };
        join(faces_left, count_rings, move_rows);
        compact::mark_hubs(&mut self.positions.host_mut()[..self.vertex_count], &*starts);
    }
}
