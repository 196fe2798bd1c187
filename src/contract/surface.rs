//! The live mesh on one device: positions, faces and rings, and how a round's contractions change them.
//!
//! # Invariants
//! Between rounds: every face lives, vertices and faces are numbered without gaps in their original order, and every
//! ring lists its vertex's faces in ascending order. All devices hold the same bytes.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::compact_faces::CompactFaces;
use crate::kernel::compact_quadrics::CompactQuadrics;
use crate::kernel::compact_rings::CompactRings;
use crate::kernel::compact_vertices::CompactVertices;
use crate::kernel::contract_faces::ContractFaces;
use crate::kernel::contract_quadrics::ContractQuadrics;
use crate::kernel::contract_vertices::ContractVertices;
use crate::kernel::live_vertices::LiveVertices;
use crate::kernel::rows::{Contraction, Face, PlaneQuadric, Position};
use crate::mesh::adjacency::group_into;

use super::carry::Carried;
use super::compact;
use super::scan::Scan;

/// Vertices from which a run frees what only its first round needs: 35 bytes a face less at the peak, 4 % more time.
pub const LARGE_VERTICES: usize = 1 << 20;

/// Positions, faces and rings on one device.
#[derive(Debug)]
pub struct Surface {
    pub positions: Buffer<Position>,
    pub faces: Buffer<Face>,
    pub ring_starts: Buffer<u32>,
    pub ring_faces: Buffer<u32>,
    /// Accumulated plane quadrics, where something needs them.
    pub quadrics: Option<Buffer<PlaneQuadric>>,
    /// What this round did to every vertex; zero between rounds.
    pub roles: Buffer<u32>,
    pub vertex_count: usize,
    pub face_count: usize,
    new_vertex: Buffer<u32>,
    new_face: Buffer<u32>,
    new_starts: Buffer<u32>,
    scan: Scan,
    /// Made by the first compaction, for what is left then.
    next: Option<Next>,
    /// The same on the host, where all else is rewritten in place.
    spare: Option<(Buffer<Position>, Option<Buffer<PlaneQuadric>>)>,
}

/// The other half of every buffer that compaction rewrites.
#[derive(Debug)]
struct Next {
    positions: Buffer<Position>,
    faces: Buffer<Face>,
    ring_starts: Buffer<u32>,
    ring_faces: Buffer<u32>,
    quadrics: Option<Buffer<PlaneQuadric>>,
}

/// The start of a run, in host memory.
#[derive(Debug, Clone)]
pub struct Start {
    pub positions: Vec<Position>,
    pub faces: Vec<Face>,
    pub ring_starts: Vec<u32>,
    pub ring_faces: Vec<u32>,
}

impl Surface {
    /// The start of a run on the device of `queue`.
    pub fn new(queue: &mut Queue, start: Start, with_quadrics: bool) -> Result<Self> {
        let (vertex_count, face_count) = (start.positions.len(), start.faces.len());
        let quadrics = |queue: &Queue| with_quadrics.then(|| queue.buffer(vertex_count)).transpose();
        Ok(Self {
            positions: queue.buffer_from(start.positions)?,
            faces: queue.buffer_from(start.faces)?,
            ring_starts: queue.buffer_from(start.ring_starts)?,
            ring_faces: queue.buffer_from(start.ring_faces)?,
            quadrics: quadrics(queue)?,
            roles: queue.buffer(vertex_count)?,
            vertex_count,
            face_count,
            new_vertex: queue.buffer(vertex_count + 1)?,
            new_face: queue.buffer(face_count + 1)?,
            new_starts: queue.buffer(vertex_count + 1)?,
            scan: Scan::new(queue, vertex_count.max(face_count) + 1)?,
            next: None,
            spare: None,
        })
    }

    /// A copy on the device of `queue` of a host's surface before its first round.
    pub fn copy(queue: &mut Queue, host: &Self, with_quadrics: bool) -> Result<Self> {
        let start = Start {
            positions: host.positions.host().to_vec(),
            faces: host.faces.host().to_vec(),
            ring_starts: host.ring_starts.host().to_vec(),
            ring_faces: host.ring_faces.host().to_vec(),
        };
        Self::new(queue, start, with_quadrics)
    }

    /// Moves the vertices of accepted contractions and marks the roles, as the commit did on the host.
    pub fn replay(&mut self, queue: &mut Queue, contractions: &Buffer<Contraction>, count: usize) -> Result<()> {
        let contraction_count = count as u32;
        if let Some(quadrics) = &mut self.quadrics {
            queue.run(ContractQuadrics { contractions, contraction_count, positions: &self.positions, quadrics })?;
        }
        let (positions, roles) = (&mut self.positions, &mut self.roles);
        queue.run(ContractVertices { contractions, contraction_count, positions, roles })
    }

    /// Buffers to compact into.
    fn next(&mut self, queue: &Queue, vertices: usize, faces: usize) -> Result<Next> {
        if let Some(next) = self.next.take() {
            return Ok(next);
        }
        Ok(Next {
            positions: queue.buffer(vertices)?,
            faces: queue.buffer(faces)?,
            ring_starts: queue.buffer(vertices + 1)?,
            ring_faces: queue.buffer(3 * faces)?,
            quadrics: self.quadrics.is_some().then(|| queue.buffer(vertices)).transpose()?,
        })
    }

    /// Renames corners by the round's roles, drops what died, and numbers the rest without gaps.
    pub fn compact(&mut self, queue: &mut Queue, vertices_left: usize, faces_left: usize) -> Result<()> {
        let (vertex_count, face_count) = (self.vertex_count as u32, self.face_count as u32);
        let mut next = self.next(queue, vertices_left, faces_left)?;
        queue.run(ContractFaces {
            roles: &self.roles,
            faces: &mut self.faces,
            face_count,
            live: &mut self.new_face,
        })?;
        queue.run(LiveVertices {
            roles: &self.roles,
            ring_starts: &self.ring_starts,
            ring_faces: &self.ring_faces,
            face_live: &self.new_face,
            vertex_count,
            live: &mut self.new_vertex,
            ring_lengths: &mut self.new_starts,
        })?;
        self.scan.run(queue, &mut self.new_face, self.face_count + 1)?;
        self.scan.run(queue, &mut self.new_vertex, self.vertex_count + 1)?;
        self.scan.run(queue, &mut self.new_starts, self.vertex_count + 1)?;
        let (new_vertex, new_face, new_starts) = (&self.new_vertex, &self.new_face, &self.new_starts);
        queue.run(CompactVertices {
            new_vertex,
            new_starts,
            positions: &self.positions,
            vertex_count,
            positions_out: &mut next.positions,
            starts_out: &mut next.ring_starts,
        })?;
        queue.run(CompactRings {
            roles: &self.roles,
            ring_starts: &self.ring_starts,
            ring_faces: &self.ring_faces,
            new_face,
            new_vertex,
            new_starts,
            vertex_count,
            rings_out: &mut next.ring_faces,
        })?;
        queue.run(CompactFaces { new_face, new_vertex, faces: &self.faces, face_count, faces_out: &mut next.faces })?;
        if let (Some(quadrics), Some(quadrics_out)) = (&self.quadrics, &mut next.quadrics) {
            queue.run(CompactQuadrics { new_vertex, quadrics, vertex_count, quadrics_out })?;
            std::mem::swap(&mut self.quadrics, &mut next.quadrics);
        }
        std::mem::swap(&mut self.positions, &mut next.positions);
        std::mem::swap(&mut self.faces, &mut next.faces);
        std::mem::swap(&mut self.ring_starts, &mut next.ring_starts);
        std::mem::swap(&mut self.ring_faces, &mut next.ring_faces);
        self.next = Some(next);
        queue.clear(&mut self.roles, self.vertex_count)?;
        (self.vertex_count, self.face_count) = (vertices_left, faces_left);
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

    /// [`Surface::compact`] on the host, with what goes along.
    pub fn compact_on_host(&mut self, queue: &Queue, carried: &mut Carried, faces_left: usize) -> Result<()> {
        let (old_count, vertices) = (self.vertex_count, ..self.vertex_count);
        if let Some(charts) = &mut carried.charts {
            let faces = &self.faces.host()[..self.face_count];
            charts.settle(faces, self.roles.host(), self.positions.host());
        }
        let new_vertex = &mut self.new_vertex.host_mut()[..=old_count];
        let roles = &mut self.roles.host_mut()[vertices];
        compact::number(roles, new_vertex);
        compact::faces(roles, &mut self.faces.host_mut()[..self.face_count], &mut carried.face_origin);
        roles.fill(0);
        let new_vertex = &*new_vertex;
        (self.vertex_count, self.face_count) = (new_vertex[old_count] as usize, faces_left);

        let faces = &self.faces.host()[..faces_left];
        let (starts, rings) = (&mut self.ring_starts.host_mut()[..=self.vertex_count], self.ring_faces.host_mut());
        group_into(faces_left, |face| faces[face].corners(), starts, |total| &mut rings[..total]);

        if self.spare.is_none() {
            let quadrics = self.quadrics.is_some().then(|| queue.buffer(self.vertex_count)).transpose()?;
            self.spare = Some((queue.buffer(self.vertex_count)?, quadrics));
        }
        if let Some((positions, quadrics)) = &mut self.spare {
            compact::move_live(&self.positions.host()[vertices], new_vertex, positions.host_mut());
            compact::mark_hubs(&mut positions.host_mut()[..self.vertex_count], &*starts);
            std::mem::swap(&mut self.positions, positions);
            if let (Some(own), Some(spare)) = (&mut self.quadrics, quadrics) {
                compact::move_live(&own.host()[vertices], new_vertex, spare.host_mut());
                std::mem::swap(own, spare);
            }
        }
        // What held the whole input is far larger than any later round needs: the second allocates what stays.
        if old_count == self.roles.len() && old_count >= LARGE_VERTICES {
            self.spare = None;
        }
        carried.compact(new_vertex);
        Ok(())
    }
}
