//! What a round leaves of the wedges: those that have corners, by their vertices.

use rayon::prelude::*;

use crate::backend::Buffer;
use crate::kernel::contract_faces::renamed;
use crate::kernel::contract_vertices::GONE;
use crate::kernel::rows::Face;
use crate::kernel::split::CHUNK;

use super::compact::{close_gaps, keep_live, keep_live_rows};
use super::surface::LARGE_VERTICES;
use super::wedges::{NO_VERTEX, OWN, Wedges, find_owners, now};

/// What compaction works in.
#[derive(Debug, Default)]
pub struct Scratch {
    /// The vertex of each wedge that has a corner.
    owners: Vec<u32>,
    /// These, in their order; longer than there are.
    live: Vec<u32>,
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
    /// Before a round's compaction: corners take the wedges that theirs have become, and faces that died go. Where wedges are
    /// vertices, [`Wedges::compact`] does both.
    pub fn settle(&mut self, faces: &[Face], vertex_roles: &[u32]) {
        // Where parts met, a vertex may have the wedges of both.
        let both_are_one = |(&vertex, &wedge): (&u32, &u32)| vertex & GONE == 0 || wedge != OWN;
        self.are_vertices = self.are_vertices && vertex_roles.par_iter().zip(&self.roles).all(both_are_one);
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
        // While there are many, every round allocates what it leaves.
        if self.roles.len() >= LARGE_VERTICES {
            let left = self.origin.len() * self.layout.width;
            self.buffers.rows = Buffer::on_host(self.buffers.rows.host()[..left].to_vec());
            self.scratch = Scratch::default();
        }
        self.roles.clear();
        self.roles.resize(self.origin.len(), OWN);
    }

    /// Finds which wedges are kept, and renumbers those of corners.
    fn find_kept(&mut self, faces: &[Face], vertices: usize) {
        let Scratch { owners, live, next, kept, numbers, .. } = &mut self.scratch;
        let corners = &mut self.buffers.corners.host_mut()[..faces.len()];
        let starts = &mut self.buffers.starts.host_mut()[..=vertices];
        owners.clear();
        owners.resize(self.origin.len(), NO_VERTEX);
        // Corners are settled: what each has become is itself.
        find_owners(faces.iter().copied().zip(corners.iter().copied()), &self.roles, owners);
        // Written whether it has one or not: a branch would be misjudged at a third of them.
        live.resize(owners.len(), 0);
        let mut count = 0;
        for (wedge, &owner) in (0..).zip(&*owners) {
            live[count] = wedge;
            count += usize::from(owner != NO_VERTEX);
        }
        let live = &live[..count];
        starts.fill(0);
        live.iter().for_each(|&wedge| starts[owners[wedge as usize] as usize + 1] += 1);
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        next.clear();
        next.extend_from_slice(starts);
        kept.resize(count, 0);
        numbers.resize(owners.len(), 0);
        for &wedge in live {
            let number = &mut next[owners[wedge as usize] as usize];
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
        let width = buffers.width;
        if width > 0 {
            let next = rows.get_or_insert_with(|| Buffer::on_host(bytemuck::zeroed_vec(kept.len() * width)));
            let old = buffers.rows.host();
            next.host_mut().par_chunks_mut(width).zip(&*kept).with_min_len(CHUNK).for_each(|(row, &wedge)| {
                row.copy_from_slice(&old[wedge as usize * width..][..width]);
            });
            std::mem::swap(&mut buffers.rows, next);
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

#[cfg(test)]
mod tests {
    use super::super::attributes::Attributes;
    use super::super::compact;
    use super::super::layout::Layout;
    use super::super::{Metric, carry::MOVED_FROM};
    use super::*;
    use crate::kernel::contract_vertices::KEEPS;
    use crate::mesh::frame::Frame;
    use crate::mesh::{Rings, shapes};

    /// A colored plane of several chunks of vertices, on its way through rounds.
    struct Run {
        wedges: Wedges,
        faces: Vec<Face>,
        vertices: usize,
    }

    impl Run {
        fn new() -> Self {
            let mut mesh = shapes::plane(100, 100);
            mesh.colors = Some((0..mesh.positions.len()).map(|i| [i as f32 / 2e4, 0.5, 0.25, 1.0]).collect());
            let frame = Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds());
            let layout = Layout::new(&mesh, &Attributes::default(), Metric::Volume, frame, true).expect("colors");
            let vertices = mesh.positions.len();
            let rings = Rings::new(&mesh.faces, vertices);
            let face_origin: Vec<u32> = (0..mesh.faces.len() as u32).collect();
            let wedges = Wedges::smooth(layout, &rings, &face_origin, &mesh.faces, (None, mesh.colors));
            Self { wedges, faces: bytemuck::cast_vec(mesh.faces), vertices }
        }

        /// Contracts every seventh vertex with the next, whose wedges become one but for those of `apart`.
        fn round(&mut self, apart: Option<u32>) {
            let mut roles = vec![0; self.vertices];
            let row = vec![0.125; self.wedges.layout.width];
            for keep in (0..self.vertices as u32 - 1).step_by(7) {
                (roles[keep as usize], roles[keep as usize + 1]) = (KEEPS | (keep + 1), GONE | keep);
                let mut rows = self.wedges.rows();
                rows.write(keep, &row, None);
                rows.write(keep + 1, &row, Some(keep));
                if apart != Some(keep) {
                    rows.join(keep + 1, keep);
                }
            }
            self.wedges.settle(&self.faces, &roles);
            let mut new_vertex = vec![0; self.vertices + 1];
            compact::number(&mut roles, &mut new_vertex);
            let mut origin: Vec<u32> = (0..self.faces.len() as u32).collect();
            compact::faces(&roles, &mut self.faces, &mut origin);
            self.faces.truncate(origin.len());
            self.vertices = new_vertex[self.vertices] as usize;
            self.wedges.compact(&self.faces, &new_vertex);
        }

        /// Corners, starts, numbers and origins of what lives.
        fn left(&mut self) -> (Vec<Face>, Vec<u32>, Vec<f32>, Vec<u32>) {
            let (corners, starts) = self.wedges.connectivity();
            let (corners, starts) = (corners[..self.faces.len()].to_vec(), starts[..=self.vertices].to_vec());
            (
                corners,
                starts,
                self.wedges.buffers.rows.host()[..self.wedges.len() * self.wedges.layout.width].to_vec(),
                self.wedges.origin.clone(),
            )
        }
    }

    #[test]
    fn wedges_that_are_vertices_are_kept_as_any_others() {
        let (mut as_vertices, mut by_corners) = (Run::new(), Run::new());
        assert!(as_vertices.wedges.are_vertices && as_vertices.vertices > 2 * CHUNK);
        by_corners.wedges.are_vertices = false;
        for _ in 0..3 {
            as_vertices.round(None);
            by_corners.round(None);
            assert!(as_vertices.wedges.are_vertices);
            assert_eq!(as_vertices.left(), by_corners.left());
        }
        let (_, starts, rows, origin) = as_vertices.left();
        assert_eq!((rows[0], origin[0]), (0.125, origin[0] | MOVED_FROM));
        assert_eq!(starts.last(), Some(&(origin.len() as u32)));
    }

    #[test]
    fn a_vertex_may_come_to_have_the_wedges_of_two() {
        let mut run = Run::new();
        run.round(None);
        run.round(Some(14));
        assert!(!run.wedges.are_vertices && run.wedges.len() == run.vertices + 1);
        let (_, starts, ..) = run.left();
        // Of fourteen vertices two went.
        let of = |vertex: usize| starts[vertex + 1] - starts[vertex];
        assert_eq!([of(11), of(12), of(13)], [1, 2, 1]);
    }
}
