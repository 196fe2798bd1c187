//! Texture coordinates on their way through a run: one pair a vertex, and one a corner where a seam meets it.
//!
//! # Invariants
//! - A vertex on a seam is [`SEAM`] and [`LOCKED`](crate::kernel::rows::LOCKED): it stays, and each of its corners keeps the
//!   coordinates that it has.
//! - Within a round faces stay as it found them. A corner without coordinates of its own has those in the row of the
//!   vertex that it named then, whatever became of that vertex: a contraction writes the rows of all its ends.

use rayon::prelude::*;

use crate::kernel::contract_faces::renamed;
use crate::kernel::rows::{Face, Position, SEAM};
use crate::kernel::split::CHUNK;
use crate::math::Vec2;
use crate::mesh::Rings;

use super::compact::{close_gaps, keep_live};

/// The coordinates of all live corners.
#[derive(Debug)]
pub struct Charts {
    /// Of a vertex on no seam, at all its corners.
    of_vertex: Vec<Vec2>,
    /// Of a face's corners on seams; not a number for the others.
    of_corner: Vec<[Vec2; 3]>,
}

impl Charts {
    /// The charts of faces with these coordinates at their corners, and which vertices are on seams.
    ///
    /// A seam is an edge at one of whose ends its faces disagree; both ends are on it.
    pub fn new(faces: &[[u32; 3]], rings: &Rings, mut corners: Vec<[Vec2; 3]>) -> (Self, Vec<bool>) {
        let vertices = rings.vertex_count();
        let at = |vertex: u32, face: u32| {
            let [a, b, _] = faces[face as usize];
            let corner = if a == vertex {
                0
            } else if b == vertex {
                1
            } else {
                2
            };
            corners[face as usize][corner]
        };
        let each = |tell: &(dyn Fn(u32) -> bool + Sync)| -> Vec<bool> {
            (0..vertices as u32).into_par_iter().with_min_len(CHUNK).map(tell).collect()
        };
        let disagrees = each(&|v| {
            let ring = rings.ring(v);
            ring.split_first().is_some_and(|(&first, others)| others.iter().any(|&f| at(v, f) != at(v, first)))
        });
        // Where a seam ends: all agree at the vertex, and not at the far end of one of its edges.
        let ends_seam = |v: u32| {
            let far = rings.ring(v).iter().flat_map(|&f| faces[f as usize].map(|w| (w, f)));
            let mut far: Vec<_> = far.filter(|&(w, _)| w != v && disagrees[w as usize]).collect();
            far.sort_unstable();
            far.chunk_by(|a, b| a.0 == b.0).any(|uses| uses.iter().any(|&(w, f)| at(w, f) != at(w, uses[0].1)))
        };
        let seams = each(&|v| disagrees[v as usize] || ends_seam(v));
        let of_vertex = (0..vertices as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| rings.ring(v).first().map_or(Vec2::ZERO, |&f| at(v, f)))
            .collect();
        corners.par_iter_mut().zip(faces).with_min_len(CHUNK).for_each(|(row, face)| {
            for (uv, &v) in row.iter_mut().zip(face) {
                *uv = if seams[v as usize] { *uv } else { Vec2::NAN };
            }
        });
        (Self { of_vertex, of_corner: corners }, seams)
    }

    /// The rows of all, to read and to change.
    pub fn rows(&mut self) -> ChartRows<'_> {
        ChartRows { of_vertex: &mut self.of_vertex, of_corner: &self.of_corner }
    }

    /// Before a round's compaction: corners that came onto a seam get coordinates of their own, and faces that died go.
    pub fn settle(&mut self, faces: &[Face], roles: &[u32], positions: &[Position]) {
        let of_vertex = &self.of_vertex;
        let counts = self.of_corner.par_chunks_mut(CHUNK).zip(faces.par_chunks(CHUNK)).map(|(rows, faces)| {
            let mut live = 0;
            for (i, face) in faces.iter().enumerate() {
                let corners = face.corners();
                let [a, b, c] = corners.map(|v| renamed(v, roles[v as usize]));
                let mut row = rows[i];
                for ((uv, v), now) in row.iter_mut().zip(corners).zip([a, b, c]) {
                    if uv.is_nan() && positions[now as usize].flags & SEAM != 0 {
                        *uv = of_vertex[v as usize];
                    }
                }
                rows[live] = row;
                live += usize::from(Face { a, b, c }.is_live());
            }
            live
        });
        let counts: Vec<usize> = counts.collect();
        let left = close_gaps(&mut self.of_corner, &counts);
        self.of_corner.truncate(left);
    }

    /// Keeps the rows of live vertices: where the next entry of `new_vertex` is greater.
    pub fn compact(&mut self, new_vertex: &[u32]) {
        keep_live(&mut self.of_vertex, new_vertex);
    }

    /// The coordinates at the corners of a face, which are named as the round began.
    pub fn of_face(&self, index: usize, face: Face) -> [Vec2; 3] {
        let of_vertex = face.corners().map(|v| self.of_vertex[v as usize]);
        let own = self.of_corner[index];
        std::array::from_fn(|i| if own[i].is_nan() { of_vertex[i] } else { own[i] })
    }
}

/// The rows of consecutive vertices, and those of all faces.
#[derive(Debug)]
pub struct ChartRows<'a> {
    of_vertex: &'a mut [Vec2],
    of_corner: &'a [[Vec2; 3]],
}

impl ChartRows<'_> {
    /// The coordinates of a face's corner at a vertex that had this row as the round began.
    pub fn uv(&self, face: u32, corner: usize, row: usize) -> Vec2 {
        let own = self.of_corner[face as usize][corner];
        if own.is_nan() { self.of_vertex[row] } else { own }
    }

    /// Gives the corners at the vertex of a row these coordinates, but for those on seams.
    pub fn place(&mut self, row: usize, uv: Vec2) {
        self.of_vertex[row] = uv;
    }
}

impl<'a> ChartRows<'a> {
    /// The first `size` rows and the others.
    pub fn split_at(self, size: usize) -> (Self, Self) {
        let (of_vertex, others) = self.of_vertex.split_at_mut(size);
        let Self { of_corner, .. } = self;
        (Self { of_vertex, of_corner }, Self { of_vertex: others, of_corner })
    }
}
