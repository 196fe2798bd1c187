//! The faces around a pair, gathered once and used by every filter and by the placement.
//!
//! ```text
//!        k             u, w   the ends
//!       / \            k, l   the opposite vertices of the shared faces, one on a border
//!      /   \           the other live faces around u and around w survive the contraction
//!     u-----w
//!      \   /
//!       \ /
//!        l
//! ```

use crate::kernel::pairs::Stars;
use crate::kernel::rows::Face;

/// The live faces around both ends of a pair.
#[derive(Debug, Default)]
pub struct Star {
    /// Faces with `u` alone.
    pub first: Vec<Face>,
    /// Faces with `w` alone.
    pub second: Vec<Face>,
    /// Faces with both.
    pub shared: Vec<Face>,
}

impl Star {
    /// Gathers the star of the pair `u`, `w`. Both are untouched this round, so their rings are those of its start.
    pub fn gather(&mut self, u: u32, w: u32, stars: &Stars<'_>) {
        self.first.clear();
        self.second.clear();
        self.shared.clear();
        for &f in stars.ring(u) {
            let face = stars.faces[f as usize];
            if face.is_live() {
                if face.corners().contains(&w) { self.shared.push(face) } else { self.first.push(face) }
            }
        }
        for &f in stars.ring(w) {
            let face = stars.faces[f as usize];
            if face.is_live() && !face.corners().contains(&u) {
                self.second.push(face);
            }
        }
    }

    /// The vertex of a shared face that is neither end.
    pub fn opposite(face: Face, u: u32, w: u32) -> u32 {
        let [a, b, c] = face.corners();
        if a != u && a != w {
            a
        } else if b != u && b != w {
            b
        } else {
            c
        }
    }
}

/// Marks on vertices that are cleared by moving on to the next number.
#[derive(Debug)]
pub struct Marks {
    marks: Vec<u32>,
    now: u32,
}

impl Marks {
    /// No vertex is marked.
    pub fn new(vertex_count: usize) -> Self {
        Self { marks: vec![0; vertex_count], now: 0 }
    }

    fn next(&mut self) -> u32 {
        if self.now == u32::MAX {
            self.marks.fill(0);
            self.now = 0;
        }
        self.now += 1;
        self.now
    }

    /// How many vertices other than the ends are joined by an edge to both ends of a pair.
    pub fn common_neighbors(&mut self, star: &Star, u: u32, w: u32) -> usize {
        let of_first = self.next();
        for face in star.first.iter().chain(&star.shared) {
            for v in face.corners() {
                self.marks[v as usize] = of_first;
            }
        }
        let of_both = self.next();
        let mut count = 0;
        for face in star.second.iter().chain(&star.shared) {
            for v in face.corners() {
                let mark = &mut self.marks[v as usize];
                if *mark == of_first && v != u && v != w {
                    *mark = of_both;
                    count += 1;
                }
            }
        }
        count
    }
}
