//! Faces with a linked ring of corners at every vertex: contracting a pair and undoing it costs as much as a ring.
//!
//! A corner that is taken out keeps its links, so that putting back what was taken out last restores the ring (dancing
//! links). Corner `3 f + i` is corner `i` of face `f`.
//!
//! # Invariants
//! - A live face has three different corners, each in the ring of its vertex; a dead face is as it died.
//! - Contractions are undone from the last to the first.

/// Ends a ring.
const END: u32 = u32::MAX;

/// What has to be remembered to undo a contraction.
#[derive(Debug, Clone, Copy)]
pub struct Splice {
    /// The first corner of the kept vertex as it was, behind which the other's now stand.
    kept: u32,
    /// Faces that were dead before.
    dead: usize,
}

#[derive(Debug)]
pub struct Rings {
    faces: Vec<[u32; 3]>,
    /// The first corner of each vertex.
    first: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Faces that died, in order.
    dead: Vec<u32>,
}

impl Rings {
    /// The rings of `faces`, less those for which there is none; each live face has three different corners below
    /// `vertex_count`.
    pub fn new(faces: Vec<[u32; 3]>, vertex_count: usize, lives: impl Fn(usize) -> bool) -> Self {
        let corners = 3 * faces.len();
        let mut rings = Self {
            faces,
            first: vec![END; vertex_count],
            next: vec![END; corners],
            previous: vec![END; corners],
            dead: Vec::new(),
        };
        // From the end, so that rings ascend.
        for face in (0..rings.faces.len()).rev().filter(|&face| lives(face)) {
            for corner in corners_of(face as u32) {
                let first = rings.first[rings.vertex(corner)];
                (rings.previous[corner as usize], rings.next[corner as usize]) = (END, first);
                rings.put_back(corner);
            }
        }
        rings
    }

    /// The corners of all faces, live and dead.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The faces that died by contractions, in order.
    pub fn dead(&self) -> &[u32] {
        &self.dead
    }

    /// Makes `gone` part of `keep`; faces that have both die.
    pub fn contract(&mut self, keep: u32, gone: u32) -> Splice {
        let dead = self.dead.len();
        let (mut corner, mut last) = (self.first[gone as usize], END);
        while corner != END {
            let (face, next) = (corner / 3, self.next[corner as usize]);
            if self.faces[face as usize].contains(&keep) {
                corners_of(face).for_each(|corner| self.take_out(corner));
                self.dead.push(face);
            } else {
                self.faces.as_flattened_mut()[corner as usize] = keep;
                last = corner;
            }
            corner = next;
        }
        let kept = self.first[keep as usize];
        if last != END {
            self.link(last, kept);
            self.first[keep as usize] = self.first[gone as usize];
        }
        Splice { kept, dead }
    }

    /// Undoes a contraction of which this was the splice.
    pub fn split(&mut self, keep: u32, gone: u32, splice: Splice) {
        let mut corner = self.first[gone as usize];
        if corner != END {
            if splice.kept != END {
                let last = std::mem::replace(&mut self.previous[splice.kept as usize], END);
                self.next[last as usize] = END;
            }
            self.first[keep as usize] = splice.kept;
        }
        while corner != END {
            self.faces.as_flattened_mut()[corner as usize] = gone;
            corner = self.next[corner as usize];
        }
        while self.dead.len() > splice.dead
            && let Some(face) = self.dead.pop()
        {
            corners_of(face).rev().for_each(|corner| self.put_back(corner));
        }
    }

    fn vertex(&self, corner: u32) -> usize {
        self.faces.as_flattened()[corner as usize] as usize
    }

    fn link(&mut self, corner: u32, next: u32) {
        self.next[corner as usize] = next;
        if next != END {
            self.previous[next as usize] = corner;
        }
    }

    /// Takes a corner out of its ring; it keeps its own links.
    fn take_out(&mut self, corner: u32) {
        let (previous, next) = (self.previous[corner as usize], self.next[corner as usize]);
        match previous {
            END => {
                let vertex = self.vertex(corner);
                self.first[vertex] = next;
            }
            previous => self.next[previous as usize] = next,
        }
        if next != END {
            self.previous[next as usize] = previous;
        }
    }

    /// Puts a corner where its links say.
    fn put_back(&mut self, corner: u32) {
        let (previous, next) = (self.previous[corner as usize], self.next[corner as usize]);
        match previous {
            END => {
                let vertex = self.vertex(corner);
                self.first[vertex] = corner;
            }
            previous => self.next[previous as usize] = corner,
        }
        if next != END {
            self.previous[next as usize] = corner;
        }
    }
}

fn corners_of(face: u32) -> std::ops::Range<u32> {
    3 * face..3 * face + 3
}

#[cfg(test)]
mod tests {
    use super::*;

    // 3---2
    // | \ |    a square of two faces, and one more on its right side
    // 0---1
    const FACES: [[u32; 3]; 3] = [[0, 1, 3], [1, 2, 3], [2, 1, 4]];

    fn ring(rings: &Rings, vertex: u32) -> Vec<u32> {
        let follow = |&corner: &u32| Some(rings.next[corner as usize]).filter(|&next| next != END);
        std::iter::successors(Some(rings.first[vertex as usize]).filter(|&c| c != END), follow).map(|c| c / 3).collect()
    }

    fn all(rings: &Rings) -> (Vec<[u32; 3]>, Vec<Vec<u32>>) {
        (rings.faces.clone(), (0..5).map(|v| ring(rings, v)).collect())
    }

    #[test]
    fn a_contraction_joins_two_rings_and_a_split_parts_them() {
        let mut rings = Rings::new(FACES.to_vec(), 5, |_| true);
        let start = all(&rings);
        assert_eq!(start.1, [vec![0], vec![0, 1, 2], vec![1, 2], vec![0, 1], vec![2]]);
        let first = rings.contract(3, 1);
        assert_eq!(rings.dead(), [0, 1]);
        assert_eq!((rings.faces()[2], ring(&rings, 3), ring(&rings, 2)), ([2, 3, 4], vec![2], vec![2]));
        let middle = all(&rings);
        let second = rings.contract(3, 4);
        assert_eq!((rings.dead(), ring(&rings, 3), ring(&rings, 2)), (&[0, 1, 2][..], vec![], vec![]));
        rings.split(3, 4, second);
        assert_eq!(all(&rings), middle);
        rings.split(3, 1, first);
        assert_eq!((all(&rings), rings.dead().len()), (start, 0));
    }

    #[test]
    fn vertices_without_an_edge_or_a_face_may_join() {
        let mut rings = Rings::new(FACES.to_vec(), 6, |face| face != 1);
        let start = all(&rings);
        let splices = [(4, 0), (4, 5), (5, 4)].map(|(keep, gone)| (keep, gone, rings.contract(keep, gone)));
        assert_eq!((rings.faces()[0], rings.faces()[2]), ([5, 1, 3], [2, 1, 5]));
        assert_eq!(rings.dead().len(), 0);
        splices.into_iter().rev().for_each(|(keep, gone, splice)| rings.split(keep, gone, splice));
        assert_eq!(all(&rings), start);
    }
}
