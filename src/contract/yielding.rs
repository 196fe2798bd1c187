//! Seams that give way, where a run that keeps them all cannot come to the number of faces asked for.
//!
//! Wedges of the ends that no vanishing face links stay two. Those of an end stand alone on a side of their own, and take the
//! best numbers of their faces where the new vertex stands:
//!
//! ```text
//!    a | b           three facets meet at u, two at w; along the crease a becomes one with d, and b with e,
//!  -c--u---w- c      and the facet c reaches the new vertex with a wedge of its own
//!    d | e
//! ```
//!
//! # Invariants
//! - Faces and what they share are those of any contraction: no seam opens, and materials stay closed.
//! - What agreed across a seam at the ends agrees at the new vertex, textures included.
//! - No face turns over in a texture.

use rayon::prelude::*;

use crate::kernel::rows::{CORNER, LOCKED, SEAM};
use crate::kernel::split::CHUNK;
use crate::mesh::adjacency::corner_of;

use super::filter::Rejection;
use super::patch::Patch;
use super::placement::Quadric;
use super::sides::{CornerFace, Sides};
use super::wedges::{WedgeRows, Wedges};

/// Which seams give way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Yields {
    /// None: where more than two meet, or one ends, the vertex stays.
    #[default]
    Nothing,
    /// Creases: normals and tangents hold nothing.
    Creases,
    /// The vertices where other seams meet or end, too, along one of these.
    Corners,
    /// All: seams may come together. A region of a material keeps a face.
    Seams,
}

impl Yields {
    /// What gives way when this was not enough.
    pub fn more(self) -> Option<Self> {
        match self {
            Self::Nothing => Some(Self::Creases),
            Self::Creases => Some(Self::Corners),
            Self::Corners => Some(Self::Seams),
            Self::Seams => None,
        }
    }

    /// What the user is told.
    pub fn warning(self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Creases => Some("creases of the normals yield: they would keep more faces than asked for"),
            Self::Corners => Some("corners of seams yield: they would keep more faces than asked for"),
            Self::Seams => Some("seams yield: they would keep more faces than asked for"),
        }
    }
}

/// An edge as a face at one of its vertices has it: the far end, and the wedges at both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeWedges {
    end: u32,
    wedges: [u32; 2],
}

/// So many uses of edges are compared each with each, without a branch: to sort a few is misjudged at every step.
const FEW: usize = 64;

/// How many edges of a vertex have faces that disagree in the wedges; `uses` are put in order.
fn count_seams(uses: &mut [EdgeWedges]) -> usize {
    if uses.len() > FEW {
        return count_seams_sorted(uses);
    }
    let is_torn = |(i, edge): &(usize, &EdgeWedges)| {
        let comes_again = |found: bool, other: &EdgeWedges| found | (other.end == edge.end);
        let disagrees = |found: bool, other: &EdgeWedges| {
            let ([near, far], [own_near, own_far]) = (other.wedges, edge.wedges);
            found | ((other.end == edge.end) & ((near != own_near) | (far != own_far)))
        };
        !uses[..*i].iter().fold(false, comes_again) & uses[i + 1..].iter().fold(false, disagrees)
    };
    uses.iter().enumerate().filter(is_torn).count()
}

/// [`count_seams`] of any number.
fn count_seams_sorted(uses: &mut [EdgeWedges]) -> usize {
    uses.sort_unstable();
    let is_torn = |uses: &&[EdgeWedges]| uses.iter().any(|edge| *edge != uses[0]);
    uses.chunk_by(|a, b| a.end == b.end).filter(is_torn).count()
}

impl Wedges {
    /// The wedge of a vertex that stands for those that count as one with another, where seams that yield count as none.
    fn standing(&self, vertex: u32, wedge: u32) -> u32 {
        if self.layout.yields == Yields::Nothing {
            return wedge;
        }
        let (_, starts) = self.connectivity();
        let agrees = |&other: &u32| {
            let same_material = self.material(other) == self.material(wedge);
            same_material && self.layout.agree_but_in_shading(self.row(other), self.row(wedge))
        };
        (starts[vertex as usize]..wedge).find(agrees).unwrap_or(wedge)
    }

    /// Of which faces all vertices have one wedge; `None` where all of all have.
    pub fn whole_faces(&self, faces: &[[u32; 3]]) -> Option<Vec<bool>> {
        if self.are_vertices {
            return None;
        }
        let (_, starts) = self.connectivity();
        let is_one = |&v: &u32| starts[v as usize + 1] - starts[v as usize] == 1;
        Some(faces.par_iter().with_min_len(CHUNK).map(|face| face.iter().all(is_one)).collect())
    }

    /// The flags of a vertex that lies on a seam: [`SEAM`], and [`LOCKED`] or [`CORNER`] where it may not move along it.
    /// `is_whole` tells faces whose vertices have one wedge each; `uses` is overwritten.
    pub fn seam_flags(
        &self,
        vertex: u32,
        faces: &[[u32; 3]],
        is_whole: &[bool],
        ring: &[u32],
        on_border: bool,
        uses: &mut Vec<EdgeWedges>,
    ) -> u32 {
        if ring.iter().all(|&f| is_whole[f as usize]) {
            return 0;
        }
        let (corners, starts) = self.connectivity();
        let own = |vertex: u32| starts[vertex as usize]..starts[vertex as usize + 1];
        let is_parted = own(vertex).len() > 1;
        uses.clear();
        for &f in ring {
            let (face, wedges) = (faces[f as usize], corners[f as usize].corners());
            let k = corner_of(face, vertex);
            let near = self.standing(vertex, wedges[k]);
            for far in [(k + 1) % 3, (k + 2) % 3] {
                // An edge whose ends have one wedge each is no seam.
                if is_parted | (own(face[far]).len() > 1) {
                    uses.push(EdgeWedges { end: face[far], wedges: [near, self.standing(face[far], wedges[far])] });
                }
            }
        }
        let count = own(vertex).filter(|&wedge| self.standing(vertex, wedge) == wedge).count();
        match (count_seams(uses), count) {
            (0, 0 | 1) => 0,
            (2, 2) if !on_border => SEAM,
            _ if self.layout.yields >= Yields::Corners => SEAM | CORNER,
            _ => SEAM | LOCKED,
        }
    }
}

impl Sides {
    /// Completes the sides of a pair of these flags, of which those are found that vanishing faces tell.
    ///
    /// # Errors
    /// [`Rejection::Seam`] where a seam would have to give way that does not.
    pub fn find_yielding(&mut self, rows: &WedgeRows<'_>, pair: [u32; 2], flags: [u32; 2]) -> Result<(), Rejection> {
        let on_seam = flags.map(|flags| flags & SEAM != 0) == [true, true];
        let agree = |end: usize| {
            let mut wedges = self.sides.iter().map(|side| side.wedges[end]);
            let first = wedges.next();
            first.is_none_or(|first| wedges.all(|wedge| rows.agree_but_in_shading(first, wedge)))
        };
        let is_whole = agree(0) && agree(1);
        if on_seam
            && rows.layout.yields < Yields::Seams
            && (is_whole || self.loses_a_part(pair, |a, b| rows.agree_but_in_shading(a, b)))
        {
            return Err(Rejection::Seam);
        }
        if on_seam && self.loses_a_part(pair, |a, b| rows.same_material(a, b)) {
            return Err(Rejection::Seam);
        }
        // Where a seam ends, both sides have one wedge.
        let meets = |end: usize| match &self.sides[..] {
            [a, b] => a.wedges[end] == b.wedges[end] || (!is_whole && agree(end)),
            _ => false,
        };
        let stays =
            |end: usize| flags[end] & LOCKED != 0 || meets(end) || flags[end] & !flags[1 - end] & (SEAM | CORNER) != 0;
        self.fixed = match [stays(0), stays(1)] {
            [true, true] => return Err(Rejection::Seam),
            [true, false] => Some(0),
            [false, true] => Some(1),
            [false, false] => None,
        };
        self.at_an_end = on_seam && (is_whole || flags[0] & flags[1] & CORNER != 0);
        self.yields = true;
        for f in 0..self.faces.len() {
            let face = &self.faces[f];
            if !self.sides.iter().any(|side| side.has(face)) {
                self.push_alone(face.end, face.wedges[0], rows);
            }
        }
        Ok(())
    }

    /// Adds to a quadric the squared distances to the seams at a pair that lie along no crease alone, as those to a border.
    /// What costs pairs for the gate knows nothing of them.
    pub fn add_seams(&self, patch: &Patch<'_>, pair: [u32; 2], quadric: &mut Quadric, weight: f64) {
        let Some(rows) = patch.wedges() else { return };
        let side = |face: &CornerFace, k: usize| [k, (k + 1) % 3].map(|k| (face.corners[k], face.wedges[k]));
        for face in &self.faces {
            let on_seam = face.corners.map(|v| patch.position(v).flags & SEAM != 0);
            for k in 0..3 {
                let [from, to] = side(face, k);
                // Flags tell both ends of a seam, so most edges need no search. Where joined parts tear they tell one
                // alone, but that vertex is locked: nothing is placed by this sum.
                if !(on_seam[k] & on_seam[(k + 1) % 3]) || !(pair.contains(&from.0) || pair.contains(&to.0)) {
                    continue;
                }
                // Each of its two faces tells an edge.
                let parts = |other: &CornerFace| {
                    let runs_back = |l: usize| (other.corners[l] == to.0) & (other.corners[(l + 1) % 3] == from.0);
                    (runs_back(0) | runs_back(1) | runs_back(2))
                        && (0..3).filter(|&l| runs_back(l)).map(|l| side(other, l)).any(|[start, end]| {
                            !(rows.agree_but_in_shading(from.1, end.1) && rows.agree_but_in_shading(to.1, start.1))
                        })
                };
                if self.faces.iter().any(parts) {
                    let (from, to) = (face.points[k], face.points[(k + 1) % 3]);
                    quadric.add_border(to - from, from, weight / 2.0);
                }
            }
        }
    }

    /// Whether a face that vanishes is the last of a part, by which wedges are of one.
    fn loses_a_part(&self, pair: [u32; 2], is_same: impl Fn(u32, u32) -> bool) -> bool {
        let same = |(face, k): (&CornerFace, usize), (other, l): (&CornerFace, usize)| {
            is_same(face.wedges[k], other.wedges[l])
        };
        self.faces.iter().any(|face| face.dies && self.closes(face, pair, same))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uses(rows: &[[u32; 3]]) -> Vec<EdgeWedges> {
        rows.iter().map(|&[end, near, far]| EdgeWedges { end, wedges: [near, far] }).collect()
    }

    #[test]
    fn an_edge_is_a_seam_once_however_many_faces_disagree() {
        let seams = |rows: &[[u32; 3]]| count_seams(&mut uses(rows));
        assert_eq!(seams(&[]), 0);
        // Two faces that agree, one alone, and two that disagree at the near end or at the far one.
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [5, 0, 1]]), 0);
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [5, 3, 1]]), 1);
        assert_eq!(seams(&[[5, 0, 1], [6, 0, 2], [6, 0, 4], [5, 3, 1]]), 2);
        // Three faces, of which the last disagrees alone.
        assert_eq!(seams(&[[5, 0, 1], [5, 0, 1], [5, 0, 2]]), 1);
        assert_eq!(seams(&[[5, 0, 1], [5, 2, 1], [5, 3, 1]]), 1);
    }

    #[test]
    fn few_edges_and_many_are_counted_alike() {
        let mut counts = Vec::new();
        for case in 0..300 {
            let random = |i: u64, below: u64| (crate::math::random(case, i) % below) as u32;
            let edge = |i: u64| [random(3 * i, 1 + case / 4), random(3 * i + 1, 2), random(3 * i + 2, 3)];
            let rows: Vec<[u32; 3]> = (0..case % (FEW as u64 + 1)).map(edge).collect();
            counts.push(count_seams(&mut uses(&rows)));
            assert_eq!(counts.last(), Some(&count_seams_sorted(&mut uses(&rows))), "{rows:?}");
        }
        assert!(counts.iter().max() > Some(&10), "{counts:?}");
    }
}
