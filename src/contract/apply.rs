//! A round's contractions applied to a GPU's copy of the surface, by kernels: the host's compaction ends in the same bytes.

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

use super::scan::Scan;
use super::surface::Surface;

/// What a copy needs to follow the host by its contractions alone.
#[derive(Debug)]
pub struct Apply {
    contractions: Buffer<Contraction>,
    /// What the round did to every vertex; zero between rounds.
    roles: Buffer<u32>,
    new_vertex: Buffer<u32>,
    new_face: Buffer<u32>,
    new_starts: Buffer<u32>,
    scan: Scan,
    /// Made by the first compaction, for what is left then.
    next: Option<Next>,
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

/// What a round leaves.
#[derive(Debug, Clone, Copy)]
pub struct Left {
    pub vertices: usize,
    pub faces: usize,
}

impl Apply {
    /// For a surface before its first round.
    pub fn new(queue: &Queue, surface: &Surface) -> Result<Self> {
        let (vertices, faces) = (surface.vertex_count, surface.face_count);
        Ok(Self {
            contractions: queue.buffer(vertices / 2 + 1)?,
            roles: queue.buffer(vertices)?,
            new_vertex: queue.buffer(vertices + 1)?,
            new_face: queue.buffer(faces + 1)?,
            new_starts: queue.buffer(vertices + 1)?,
            scan: Scan::new(queue, vertices.max(faces) + 1)?,
            next: None,
        })
    }

    /// Applies a round's contractions.
    pub fn run(
        &mut self,
        queue: &mut Queue,
        surface: &mut Surface,
        contractions: &[Contraction],
        left: Left,
    ) -> Result<()> {
        queue.write(&mut self.contractions, contractions)?;
        self.contract(queue, surface, contractions.len() as u32)?;
        self.compact(queue, surface, left)
    }

    /// Moves the kept vertices and marks the roles, as the commit did on the host.
    fn contract(&mut self, queue: &mut Queue, surface: &mut Surface, contraction_count: u32) -> Result<()> {
        let (contractions, roles) = (&self.contractions, &mut self.roles);
        let Surface { positions, quadrics, .. } = surface;
        if let Some(quadrics) = quadrics {
            queue.run(ContractQuadrics { contractions, contraction_count, positions, quadrics })?;
        }
        queue.run(ContractVertices { contractions, contraction_count, positions, roles })
    }

    /// Renames corners by the round's roles, drops what died, and numbers the rest without gaps.
    fn compact(&mut self, queue: &mut Queue, surface: &mut Surface, left: Left) -> Result<()> {
        let mut next = match self.next.take() {
            Some(next) => next,
            None => Next::new(queue, left, surface.quadrics.is_some())?,
        };
        let (roles, vertex_count, face_count) = (&self.roles, surface.vertex_count as u32, surface.face_count as u32);
        let Surface { positions, faces, ring_starts, ring_faces, quadrics, .. } = surface;
        queue.run(ContractFaces { roles, faces, face_count, live: &mut self.new_face })?;
        queue.run(LiveVertices {
            roles,
            ring_starts,
            ring_faces,
            face_live: &self.new_face,
            vertex_count,
            live: &mut self.new_vertex,
            ring_lengths: &mut self.new_starts,
        })?;
        self.scan.run(queue, &mut self.new_face, face_count as usize + 1)?;
        self.scan.run(queue, &mut self.new_vertex, vertex_count as usize + 1)?;
        self.scan.run(queue, &mut self.new_starts, vertex_count as usize + 1)?;
        let (new_vertex, new_face, new_starts) = (&self.new_vertex, &self.new_face, &self.new_starts);
        queue.run(CompactVertices {
            new_vertex,
            new_starts,
            positions,
            vertex_count,
            positions_out: &mut next.positions,
            starts_out: &mut next.ring_starts,
        })?;
        queue.run(CompactRings {
            roles,
            ring_starts,
            ring_faces,
            new_face,
            new_vertex,
            new_starts,
            vertex_count,
            rings_out: &mut next.ring_faces,
        })?;
        queue.run(CompactFaces { new_face, new_vertex, faces, face_count, faces_out: &mut next.faces })?;
        if let (Some(quadrics), Some(quadrics_out)) = (quadrics, &mut next.quadrics) {
            queue.run(CompactQuadrics { new_vertex, quadrics, vertex_count, quadrics_out })?;
        }
        next.swap(surface);
        self.next = Some(next);
        queue.clear(&mut self.roles, vertex_count as usize)?;
        (surface.vertex_count, surface.face_count) = (left.vertices, left.faces);
        Ok(())
    }
}

impl Next {
    fn new(queue: &Queue, left: Left, with_quadrics: bool) -> Result<Self> {
        Ok(Self {
            positions: queue.buffer(left.vertices)?,
            faces: queue.buffer(left.faces)?,
            ring_starts: queue.buffer(left.vertices + 1)?,
            ring_faces: queue.buffer(3 * left.faces)?,
            quadrics: with_quadrics.then(|| queue.buffer(left.vertices)).transpose()?,
        })
    }

    fn swap(&mut self, surface: &mut Surface) {
        std::mem::swap(&mut self.positions, &mut surface.positions);
        std::mem::swap(&mut self.faces, &mut surface.faces);
        std::mem::swap(&mut self.ring_starts, &mut surface.ring_starts);
        std::mem::swap(&mut self.ring_faces, &mut surface.ring_faces);
        std::mem::swap(&mut self.quadrics, &mut surface.quadrics);
    }
}
