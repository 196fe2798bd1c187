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

use crate::kernel::rows::{Face, Position};
use crate::kernel::stars::Stars;
use crate::math::DVec3;

/// A live face of a star, turned so that its end comes first; `u` for shared faces.
#[derive(Debug, Clone, Copy)]
pub struct StarFace {
    /// The end and the other two corners in order.
    pub corners: [u32; 3],
    /// The same about the pair's midpoint; set by [`Star::locate`].
    pub points: [DVec3; 3],
    /// (p1−p0)×(p2−p0): twice the area, along the normal; set by [`Star::locate`].
    pub normal: DVec3,
}

impl StarFace {
    #[inline(always)]
    fn new(face: Face, end: u32) -> Self {
        let [a, b, c] = face.corners();
        let corners = if a == end {
            [a, b, c]
        } else if b == end {
            [b, c, a]
        } else {
            [c, a, b]
        };
        Self { corners, points: [DVec3::ZERO; 3], normal: DVec3::ZERO }
    }

    #[inline(always)]
    fn has(&self, vertex: u32) -> bool {
        self.corners[1] == vertex || self.corners[2] == vertex
    }
}

/// The live faces around both ends of a pair.
#[derive(Debug, Default)]
pub struct Star {
    /// Faces with `u` alone.
    pub first: Vec<StarFace>,
    /// Faces with `w` alone.
    pub second: Vec<StarFace>,
    /// Faces with both.
    pub shared: Vec<StarFace>,
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
                let face = StarFace::new(face, u);
                if face.has(w) { self.shared.push(face) } else { self.first.push(face) }
            }
        }
        for &f in stars.ring(w) {
            let face = stars.faces[f as usize];
            if face.is_live() {
                let face = StarFace::new(face, w);
                if !face.has(u) {
                    self.second.push(face);
                }
            }
        }
    }

    /// Looks up the points of all faces about `middle`, and their normals.
    pub fn locate(&mut self, positions: &[Position], middle: DVec3) {
        for face in self.first.iter_mut().chain(&mut self.second).chain(&mut self.shared) {
            face.points = face.corners.map(|v| positions[v as usize].xyz().as_dvec3() - middle);
            let [p0, p1, p2] = face.points;
            face.normal = (p1 - p0).cross(p2 - p0);
        }
    }

    /// All faces, each once.
    pub fn faces(&self) -> impl Iterator<Item = &StarFace> {
        self.first.iter().chain(&self.second).chain(&self.shared)
    }

    /// The corner of a shared face that is neither end; `w` is the second.
    pub fn opposite(face: &StarFace, w: u32) -> u32 {
        if face.corners[1] == w { face.corners[2] } else { face.corners[1] }
    }

    /// The other ends of the border edges at either end of the pair, and the pair itself where it is one; from, to.
    pub fn border_edges(&self, [u, w]: [u32; 2]) -> Vec<[DVec3; 2]> {
        let mut edges = Vec::new();
        if let [face] = &self.shared[..] {
            let at_second = if face.corners[1] == w { 1 } else { 2 };
            edges.push([face.points[0], face.points[at_second]]);
        }
        for (end, other, own) in [(u, w, &self.first), (w, u, &self.second)] {
            let uses = |v: u32| {
                let by_shared = self.shared.iter().filter(|f| f.has(v) || f.corners[0] == v).count();
                own.iter().filter(|f| f.has(v)).count() + by_shared
            };
            for face in own.iter().chain(&self.shared) {
                let Some(at_end) = face.corners.iter().position(|&v| v == end) else { continue };
                for (&v, &point) in face.corners.iter().zip(&face.points) {
                    if v != end && v != other && uses(v) == 1 {
                        edges.push([face.points[at_end], point]);
                    }
                }
            }
        }
        edges
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
            self.marks[face.corners[1] as usize] = of_first;
            self.marks[face.corners[2] as usize] = of_first;
        }
        let of_both = self.next();
        let mut count = 0;
        for v in star.second.iter().chain(&star.shared).flat_map(|face| face.corners) {
            let mark = &mut self.marks[v as usize];
            if *mark == of_first && v != u && v != w {
                *mark = of_both;
                count += 1;
            }
        }
        count
    }
}
