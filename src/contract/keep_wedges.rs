//! What a round leaves of the wedges: those that have corners, by their vertices.

use rayon::prelude::*;

use crate::backend::Buffer;
use crate::kernel::contract_faces::renamed;
use crate::kernel::contract_vertices::GONE;
use crate::kernel::rows::Face;
use crate::kernel::split::CHUNK;

use super::compact::{close_gaps, keep_live, keep_live_rows};
use super::surface::LARGE_VERTICES;
use super::wedges::{OWN, Wedges, now};

/// A wedge without a corner has no vertex.
const NO_VERTEX: u32 = u32::MAX;

/// What compaction works in.
#[derive(Debug, Default)]
pub struct Scratch {
    /// The vertex of each wedge that has a corner.
    owners: Vec<u32>,
    /// Where the next wedge of each vertex goes.
    next: Vec<u32>,
    /// The wedges that are kept, in their new order.
    kept: Vec<u32>,
    /// The new number of each.
    numbers: Vec<u32>,
    /// The other half of the rows.
    rows: Option<Buffer<f32>>,
}

impl Wedges {
    /// Before a round's compaction: corners take the wedges that theirs have become, and faces that died go.
    pub fn settle(&mut self, faces: &[Face], vertex_roles: &[u32]) {
        // Where parts met, a vertex may have the wedges of both.
        let both_are_one = |(&vertex, &wedge): (&u32, &u32)| vertex & GONE == 0 || wedge != OWN;
        self.are_vertices &= vertex_roles.iter().zip(&self.roles).all(both_are_one);
        if self.are_vertices {
            return;
        }
        let (roles, corners) = (&self.roles, self.buffers.corners.host_mut());
        let counts = corners[..faces.len()].par_chunks_mut(CHUNK).zip(faces.par_chunks(CHUNK)).map(|(rows, faces)| {
            let mut live = 0;
            for (i, face) in faces.iter().enumerate() {
                let [a, b, c] = face.corners().map(|v| renamed(v, vertex_roles[v as usize]));
                rows[live] = renumbered(rows[i], |wedge| now(wedge, roles));
                live += usize::from(Face { a, b, c }.is_live());
            }
            live
        });
        let counts: Vec<usize> = counts.collect();
        close_gaps(corners, 1, &counts);
    }

    /// After a round's compaction, which left these faces: numbers the wedges that have corners, by their vertices.
    /// `new_vertex` has for each vertex before how many live ones come before it, and how many there are.
    pub fn compact(&mut self, faces: &[Face], new_vertex: &[u32]) {
        if self.are_vertices {
            self.buffers.corners.host_mut()[..faces.len()].copy_from_slice(faces);
            keep_live_rows(self.buffers.rows.host_mut(), self.layout.width, new_vertex);
            keep_live(&mut self.origin, new_vertex);
            if !self.materials.is_empty() {
                keep_live(&mut self.materials, new_vertex);
            }
        } else {
            self.find_kept(faces, new_vertex[new_vertex.len() - 1] as usize);
            self.keep();
        }
        self.roles.clear();
        self.roles.resize(self.origin.len(), OWN);
    }

    /// Finds which wedges are kept, and renumbers those of corners.
    fn find_kept(&mut self, faces: &[Face], vertices: usize) {
        let Scratch { owners, next, kept, numbers, .. } = &mut self.scratch;
        let corners = &mut self.buffers.corners.host_mut()[..faces.len()];
        let starts = &mut self.buffers.starts.host_mut()[..=vertices];
        owners.clear();
        owners.resize(self.origin.len(), NO_VERTEX);
        for (face, wedges) in faces.iter().zip(&*corners) {
            for (vertex, wedge) in face.corners().into_iter().zip(wedges.corners()) {
                owners[wedge as usize] = vertex;
            }
        }
        let with_corners = || (0..).zip(&*owners).filter(|(_, owner)| **owner != NO_VERTEX);
        starts.fill(0);
        with_corners().for_each(|(_, &owner): (u32, _)| starts[owner as usize + 1] += 1);
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        next.clear();
        next.extend_from_slice(starts);
        kept.resize(starts[vertices] as usize, 0);
        numbers.resize(owners.len(), 0);
        for (wedge, &owner) in with_corners() {
            let number = &mut next[owner as usize];
            kept[*number as usize] = wedge;
            numbers[wedge as usize] = *number;
            *number += 1;
        }
        let numbers = &*numbers;
        corners.par_iter_mut().with_min_len(CHUNK).for_each(|wedges| {
            *wedges = renumbered(*wedges, |wedge| numbers[wedge as usize]);
        });
    }

    /// Moves what belongs to the wedges that are kept to their new numbers.
    fn keep(&mut self) {
        let Self { buffers, origin, materials, scratch: Scratch { kept, rows, .. }, .. } = self;
        let (width, before) = (buffers.width, origin.len());
        if width > 0 {
            let next = rows.get_or_insert_with(|| Buffer::on_host(bytemuck::zeroed_vec(kept.len() * width)));
            let old = buffers.rows.host();
            next.host_mut().par_chunks_mut(width).zip(&*kept).with_min_len(CHUNK).for_each(|(row, &wedge)| {
                row.copy_from_slice(&old[wedge as usize * width..][..width]);
            });
            std::mem::swap(&mut buffers.rows, next);
            // As with the surface: the next round's allocates what stays.
            if before >= LARGE_VERTICES && buffers.rows.len() < next.len() {
                *rows = None;
            }
        }
        *origin = crate::mesh::take(origin, kept);
        if !materials.is_empty() {
            *materials = crate::mesh::take(materials, kept);
        }
    }
}

/// A face's wedges under other numbers.
fn renumbered(wedges: Face, number: impl Fn(u32) -> u32) -> Face {
    let [a, b, c] = wedges.corners().map(number);
    Face { a, b, c }
}
