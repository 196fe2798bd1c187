//! Vertices that become one for each part of the faces around them.

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::adjacency::Rings;
use super::disjoint::DisjointSets;

/// Where faces leave a vertex for its copies.
pub(super) struct Copies {
    vertex: u32,
    /// How many there are.
    count: u32,
    /// Faces, ascending, and the number of the copy from 1 on.
    faces: Vec<(u32, u32)>,
}

impl Copies {
    /// The copies of a vertex for all `parts` of its ring but the one with its lowest face; `None` where there is one part.
    pub fn of_parts(vertex: u32, ring: &[u32], parts: &mut DisjointSets) -> Option<Self> {
        let (mut found, mut copies) = (0, Vec::with_capacity(ring.len()));
        for place in 0..ring.len() as u32 {
            let first = parts.find(place);
            if first == place {
                copies.push(found);
                found += 1;
            } else {
                copies.push(copies[first as usize]);
            }
        }
        let faces = ring.iter().copied().zip(copies).filter(|&(_, copy)| copy > 0).collect();
        (found > 1).then(|| Self { vertex, count: found - 1, faces })
    }

    /// The number of the copy that a face around the vertex goes to; 0 for the vertex itself.
    fn of(&self, face: u32) -> u32 {
        self.faces.binary_search_by_key(&face, |&(face, _)| face).map_or(0, |at| self.faces[at].1)
    }
}

/// Hands the copies of vertices, ascending, out to the faces around them. Returns the vertex that each was, ascending, a copy
/// after the vertex that it is of.
pub(super) fn hand_out(faces: &mut [[u32; 3]], rings: &mut Rings, all: &[Copies]) -> Vec<u32> {
    // Copies follow their vertices, so that those along a curve stay together.
    let count = rings.vertex_count();
    let mut number = Vec::with_capacity(count);
    let mut was = Vec::with_capacity(count + all.len());
    let mut next = all.iter().peekable();
    for vertex in 0..count as u32 {
        number.push(was.len() as u32);
        let copies = next.next_if(|copies| copies.vertex == vertex).map_or(0, |copies| copies.count);
        was.extend((0..=copies).map(|_| vertex));
    }
    faces.par_iter_mut().with_min_len(PARALLEL_ROWS).for_each(|face| *face = face.map(|v| number[v as usize]));
    for Copies { vertex, faces: left, .. } in all {
        let first = number[*vertex as usize];
        for &(face, copy) in left {
            let corners = &mut faces[face as usize];
            *corners = corners.map(|v| if v == first { first + copy } else { v });
        }
    }
    split_rings(rings, &was, all);
    was
}

/// Deals the ring of each vertex that has copies to these.
fn split_rings(rings: &mut Rings, was: &[u32], all: &[Copies]) {
    let before = std::mem::take(&mut rings.starts);
    for copies in all {
        let v = copies.vertex as usize;
        rings.faces[before[v] as usize..before[v + 1] as usize].sort_by_key(|&face| copies.of(face));
    }
    rings.starts.reserve(was.len() + 1);
    let mut next = all.iter().peekable();
    for (vertex, &start) in (0..).zip(&before) {
        rings.starts.push(start);
        let Some(copies) = next.next_if(|copies| copies.vertex == vertex) else { continue };
        let ring = &rings.faces[start as usize..before[vertex as usize + 1] as usize];
        for copy in 1..=copies.count {
            rings.starts.push(start + ring.partition_point(|&face| copies.of(face) < copy) as u32);
        }
    }
}
