//! The faces of a round that change their region. Twin: `shaders/label_moves.wgsl`, line for line.
//!
//! Of the faces around a vertex that would, one: the one with the greatest hash. So no move sees the labels around it change,
//! and what [`boundary_gains`](super::boundary_gains) found of the pieces a region falls into holds for all of them at once; the
//! neighbor that a face joins does not leave in the same round either.

use rayon::prelude::*;

use super::boundary_gains::NONE;
use super::rows::Face;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::tie_hash;

/// One invocation a face.
pub struct LabelMoves<'a> {
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F: the region a face would go to, or [`NONE`].
    pub targets: &'a Buffer<u32>,
    /// F.
    pub face_count: u32,
    /// Which round it is: the hashes of every round differ.
    pub round: u32,
    /// F labels; writes those of the faces that move.
    pub labels: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        round: u32,
    }
}

/// What decides.
#[derive(Debug, Clone, Copy)]
struct Targets<'a> {
    faces: &'a [Face],
    ring_starts: &'a [u32],
    ring_faces: &'a [u32],
    targets: &'a [u32],
    round: u32,
}

/// Whether no other face around a vertex that would move has a greater hash.
#[inline(always)]
fn is_first_at(vertex: u32, hash: u32, seen: &Targets<'_>) -> bool {
    let (start, end) = (seen.ring_starts[vertex as usize], seen.ring_starts[vertex as usize + 1]);
    for i in start..end {
        let other = seen.ring_faces[i as usize];
        if seen.targets[other as usize] != NONE && tie_hash(other, seen.round) > hash {
            return false;
        }
    }
    true
}

#[inline(always)]
fn moves(face: u32, seen: &Targets<'_>) -> bool {
    if seen.targets[face as usize] == NONE {
        return false;
    }
    let corners = seen.faces[face as usize];
    let hash = tie_hash(face, seen.round);
    is_first_at(corners.a, hash, seen) && is_first_at(corners.b, hash, seen) && is_first_at(corners.c, hash, seen)
}

impl Kernel for LabelMoves<'_> {
    const NAME: &'static str = "label_moves";
    const SOURCE: &'static str = include_str!("../../shaders/label_moves.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("NONE", Constant::U32(NONE))];

    fn params(&self) -> Params {
        Params { round: self.round }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("targets", Access::Read, self.targets),
            Binding::new("labels", Access::Write, self.labels),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let seen = Targets {
            faces: self.faces.host(),
            ring_starts: self.ring_starts.host(),
            ring_faces: self.ring_faces.host(),
            targets: self.targets.host(),
            round: self.round,
        };
        let labels = self.labels.host_mut()[..self.face_count as usize].par_iter_mut().enumerate();
        labels.with_min_len(CHUNK).for_each(|(face, label)| {
            if moves(face as u32, &seen) {
                *label = seen.targets[face];
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;

    /// Four faces around vertex 0, and one apart.
    const FACES: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 6, 7]];

    fn moved(targets: [u32; 5], round: u32) -> Vec<u32> {
        let device = Device::cpu(1).expect("a thread");
        let mut queue = device.cpu_queue();
        let rings = [vec![0, 1, 2, 3], vec![0, 3], vec![0, 1], vec![1, 2], vec![2, 3], vec![4], vec![4], vec![4]];
        let starts = std::iter::once(0).chain(rings.iter().scan(0, |sum, ring| {
            *sum += ring.len() as u32;
            Some(*sum)
        }));
        let faces = FACES.map(|[a, b, c]| Face { a, b, c }).to_vec();
        let faces = queue.buffer_from(faces).expect("memory");
        let ring_starts = queue.buffer_from(starts.collect()).expect("memory");
        let ring_faces = queue.buffer_from(rings.concat()).expect("memory");
        let targets = queue.buffer_from(targets.to_vec()).expect("memory");
        let mut labels = queue.buffer_from(vec![9; 5]).expect("memory");
        let kernel = LabelMoves {
            faces: &faces,
            ring_starts: &ring_starts,
            ring_faces: &ring_faces,
            targets: &targets,
            face_count: 5,
            round,
            labels: &mut labels,
        };
        queue.run(kernel).expect("the CPU");
        labels.host().to_vec()
    }

    #[test]
    fn of_those_around_a_vertex_the_one_with_the_greatest_hash_moves() {
        for round in 0..8 {
            let first = (0..4).max_by_key(|&face| tie_hash(face, round)).expect("four faces") as usize;
            let mut wanted = [9, 9, 9, 9, 7];
            wanted[first] = 3;
            assert_eq!(moved([3, 3, 3, 3, 7], round), wanted, "{round}");
        }
    }

    #[test]
    fn what_stays_is_in_nobody_s_way() {
        for round in 0..8 {
            assert_eq!(moved([NONE, 3, NONE, NONE, NONE], round), [9, 3, 9, 9, 9]);
            assert_eq!(moved([NONE; 5], round), [9; 5]);
        }
    }
}
