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
    /// The first corner of the kept vertex as it was, before which the other's now stand.
    kept: u32,
    /// Faces that were dead before, and when the rings were joined.
    dead: [usize; 2],
}

#[derive(Debug)]
pub struct Rings {
    faces: Vec<[u32; 3]>,
    /// The first corner of each vertex.
    first: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    lives: Vec<bool>,
    /// Vertices with a ring.
    used: usize,
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
            lives: Vec::new(),
            used: 0,
            dead: Vec::new(),
        };
        rings.lives = (0..rings.faces.len()).map(lives).collect();
        // From the end, so that rings ascend.
        for face in (0..rings.faces.len()).rev() {
            if !rings.lives[face] {
                continue;
            }
            for corner in corners_of(face as u32) {
                let first = rings.first[rings.vertex(corner)];
                (rings.previous[corner as usize], rings.next[corner as usize]) = (END, first);
                rings.put_back(corner);
            }
        }
        rings
    }

    /// The corners of the faces that live.
    pub fn live_faces(&self) -> impl Iterator<Item = [u32; 3]> {
        self.faces.iter().zip(&self.lives).filter(|&(_, &lives)| lives).map(|(&face, _)| face)
    }

    /// How many faces died since the start.
    pub fn dead_count(&self) -> usize {
        self.dead.len()
    }

    /// How many vertices have a face.
    pub fn used_count(&self) -> usize {
        self.used
    }

    /// Makes `gone` part of `keep`; faces that have both die, and those of `cancelled` that still live.
    pub fn contract(&mut self, keep: u32, gone: u32, cancelled: impl IntoIterator<Item = u32>) -> Splice {
        let dead = self.dead.len();
        let (mut corner, mut last) = (self.first[gone as usize], END);
        while corner != END {
            let (face, next) = (corner / 3, self.next[corner as usize]);
            if self.faces[face as usize].contains(&keep) {
                self.kill(face);
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
            self.used -= usize::from(kept != END);
        }
        let splice = Splice { kept, dead: [dead, self.dead.len()] };
        for face in cancelled {
            if self.lives[face as usize] {
                self.kill(face);
            }
        }
        splice
    }

    /// Undoes a contraction of which this was the splice.
    pub fn split(&mut self, keep: u32, gone: u32, splice: Splice) {
        self.revive(splice.dead[1]);
        let mut corner = self.first[gone as usize];
        if corner != END {
            if splice.kept != END {
                self.used += 1;
                let last = std::mem::replace(&mut self.previous[splice.kept as usize], END);
                self.next[last as usize] = END;
            }
            self.first[keep as usize] = splice.kept;
        }
        while corner != END {
            self.faces.as_flattened_mut()[corner as usize] = gone;
            corner = self.next[corner as usize];
        }
        self.revive(splice.dead[0]);
    }

    fn kill(&mut self, face: u32) {
        corners_of(face).for_each(|corner| self.take_out(corner));
        self.lives[face as usize] = false;
        self.dead.push(face);
    }

    /// Lets the faces that died last live again, until this many are dead.
    fn revive(&mut self, dead: usize) {
        while self.dead.len() > dead
            && let Some(face) = self.dead.pop()
        {
            self.lives[face as usize] = true;
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
        self.used -= usize::from(previous == END && next == END);
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
        self.used += usize::from(previous == END && next == END);
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

    type Everything = (Vec<[u32; 3]>, Vec<[u32; 3]>, Vec<Vec<u32>>);

    fn all(rings: &Rings) -> Everything {
        (rings.faces.clone(), rings.live_faces().collect(), (0..5).map(|v| ring(rings, v)).collect())
    }

    #[test]
    fn a_contraction_joins_two_rings_and_a_split_parts_them() {
        let mut rings = Rings::new(FACES.to_vec(), 5, |_| true);
        let start = all(&rings);
        assert_eq!(start.2, [vec![0], vec![0, 1, 2], vec![1, 2], vec![0, 1], vec![2]]);
        let first = rings.contract(3, 1, []);
        assert_eq!((rings.dead_count(), rings.used_count()), (2, 3));
        let middle = all(&rings);
        assert_eq!((&middle.1, &middle.2[3], &middle.2[2]), (&vec![[2, 3, 4]], &vec![2], &vec![2]));
        let second = rings.contract(3, 4, []);
        assert_eq!((all(&rings).1, rings.dead_count(), rings.used_count()), (Vec::new(), 3, 0));
        rings.split(3, 4, second);
        assert_eq!((all(&rings), rings.used_count()), (middle, 3));
        rings.split(3, 1, first);
        assert_eq!((all(&rings), rings.dead_count(), rings.used_count()), (start, 0, 5));
    }

    #[test]
    fn vertices_without_an_edge_or_a_face_may_join() {
        let mut rings = Rings::new(FACES.to_vec(), 6, |face| face != 1);
        let start = all(&rings);
        let splices = [(4, 0), (4, 5), (5, 4)].map(|(keep, gone)| (keep, gone, rings.contract(keep, gone, [])));
        assert_eq!(rings.live_faces().collect::<Vec<_>>(), [[5, 1, 3], [2, 1, 5]]);
        assert_eq!((rings.dead_count(), rings.used_count()), (0, 4));
        splices.into_iter().rev().for_each(|(keep, gone, splice)| rings.split(keep, gone, splice));
        assert_eq!((all(&rings), rings.used_count()), (start, 5));
    }

    #[test]
    fn faces_are_cancelled_once_and_come_back() {
        let mut rings = Rings::new(FACES.to_vec(), 5, |_| true);
        let start = all(&rings);
        // 0 dies between the ends already.
        let splice = rings.contract(1, 0, [0, 2, 2]);
        assert_eq!(rings.live_faces().collect::<Vec<_>>(), [[1, 2, 3]]);
        assert_eq!((rings.dead_count(), rings.used_count()), (2, 3));
        rings.split(1, 0, splice);
        assert_eq!((all(&rings), rings.dead_count(), rings.used_count()), (start, 0, 5));
    }
}
