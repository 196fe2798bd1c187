//! Which region each face belongs to.

use crate::mesh::adjacency::group;
use crate::mesh::dual::{NONE, components};

/// Faces by region. Every face is in one region, and the faces of a region are connected across edges.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Partition {
    /// The region of every face, below `region_count`.
    pub labels: Vec<u32>,
    /// How many regions there are.
    pub region_count: usize,
}

/// What keeps labels from being a [`Partition`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// There are not as many labels as faces.
    Length {
        /// Labels.
        labels: usize,
        /// Faces.
        faces: usize,
    },
    /// A face has a label that is no region.
    Label {
        /// The first such face.
        face: u32,
    },
    /// A region has no face.
    Empty {
        /// The region.
        region: u32,
    },
    /// The faces of a region do not hang together.
    Torn {
        /// The region.
        region: u32,
        /// How many pieces they are.
        pieces: usize,
    },
}

impl Partition {
    /// What is wrong with it, given the faces [across each edge](crate::mesh::dual::neighbors); nothing of a partition.
    pub fn validate(&self, neighbors: &[[u32; 3]]) -> Vec<Fault> {
        if self.labels.len() != neighbors.len() {
            return vec![Fault::Length { labels: self.labels.len(), faces: neighbors.len() }];
        }
        if let Some(face) = self.labels.iter().position(|&label| label as usize >= self.region_count) {
            return vec![Fault::Label { face: face as u32 }];
        }
        let mut pieces = vec![0; self.region_count];
        let (_, firsts) =
            components(neighbors, |face, other| self.labels[face as usize] == self.labels[other as usize]);
        firsts.iter().for_each(|&first| pieces[self.labels[first as usize] as usize] += 1);
        (0..)
            .zip(pieces)
            .filter_map(|(region, pieces)| match pieces {
                0 => Some(Fault::Empty { region }),
                1 => None,
                _ => Some(Fault::Torn { region, pieces }),
            })
            .collect()
    }

    /// The partition of these labels with its regions in the order of their first faces, so that what is near in space is near in
    /// memory; also the label that each region had.
    pub(super) fn in_face_order(mut labels: Vec<u32>, region_count: usize) -> (Self, Vec<u32>) {
        let mut renamed = vec![NONE; region_count];
        let mut order = Vec::with_capacity(region_count);
        for label in &mut labels {
            let name = &mut renamed[*label as usize];
            if *name == NONE {
                *name = order.len() as u32;
                order.push(*label);
            }
            *label = *name;
        }
        (Self { labels, region_count: order.len() }, order)
    }

    /// The faces of every region in compressed rows, ascending: R + 1 starts, and the faces.
    pub fn faces_by_region(&self) -> (Vec<u32>, Vec<u32>) {
        group(self.labels.len(), self.region_count, |face| [self.labels[face]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of four faces.
    const STRIP: [[u32; 3]; 4] = [[NONE, NONE, 1], [0, 2, NONE], [1, 3, NONE], [2, NONE, NONE]];

    fn faults(labels: &[u32], region_count: usize) -> Vec<Fault> {
        Partition { labels: labels.to_vec(), region_count }.validate(&STRIP)
    }

    #[test]
    fn faults_are_found() {
        assert_eq!(faults(&[0, 0, 1, 1], 2), []);
        assert_eq!(faults(&[0, 1, 1], 2), [Fault::Length { labels: 3, faces: 4 }]);
        assert_eq!(faults(&[0, 0, 2, 1], 2), [Fault::Label { face: 2 }]);
        assert_eq!(faults(&[0, 0, 0, 0], 2), [Fault::Empty { region: 1 }]);
        assert_eq!(faults(&[0, 1, 0, 0], 2), [Fault::Torn { region: 0, pieces: 2 }]);
    }

    #[test]
    fn faces_are_listed_by_region() {
        let partition = Partition { labels: vec![1, 0, 1, 2], region_count: 4 };
        assert_eq!(partition.faces_by_region(), (vec![0, 1, 3, 4, 4], vec![1, 0, 2, 3]));
    }
}
