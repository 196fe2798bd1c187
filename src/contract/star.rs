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

use crate::kernel::stars::{Spoke, spoke};
use crate::math::DVec3;

use super::patch::Patch;

/// A live face of a star. Shared faces are seen from `u`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarFace {
    /// Which face.
    pub face: u32,
    /// The corners after the end, in order.
    pub others: [u32; 2],
    /// The same about the pair's midpoint.
    pub points: [DVec3; 2],
    /// (p1−p0)×(p2−p0): twice the area, along the normal.
    pub normal: DVec3,
}

/// Whether a vertex is one of two, without a branch.
#[inline(always)]
fn is_either(vertex: u32, [first, second]: [u32; 2]) -> bool {
    (vertex == first) | (vertex == second)
}

impl StarFace {
    #[inline(always)]
    pub fn has(&self, vertex: u32) -> bool {
        is_either(vertex, self.others)
    }
}

/// Part of a star lies outside of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outside;

/// The live faces around both ends of a pair.
#[derive(Debug, Default)]
pub struct Star {
    /// From the midpoint to `w`, half the pair.
    pub h: DVec3,
    /// Faces with `u` alone.
    pub first: Vec<StarFace>,
    /// Faces with `w` alone.
    pub second: Vec<StarFace>,
    /// Faces with both.
    pub shared: Vec<StarFace>,
    /// What `first` and `shared` are filled from.
    pub(super) of_first: Vec<[Seen; 2]>,
    /// What `second` is filled from.
    pub(super) of_second: Vec<Seen>,
}

impl Star {
    /// Gathers the star of the pair `u`, `w` about `middle`, which is `h` before `w`. Both took part in no contraction of
    /// this round, so their rings are those of its start.
    ///
    /// First the corners, then where they lie: which faces are shared nobody could foretell, and a branch on what is read
    /// last would be misjudged when most has begun. Each face is written wherever it may belong, and counted where it does.
    #[inline]
    pub fn gather(&mut self, [u, w]: [u32; 2], middle: DVec3, h: DVec3, patch: &Patch<'_>) -> Result<(), Outside> {
        self.h = h;
        let (of_u, of_w) = (patch.connectivity.ring(u), patch.connectivity.ring(w));
        let (mut first, mut second, mut shared) = (0, 0, 0);
        let seen = room(&mut self.of_first, of_u.len());
        for &f in of_u {
            let face = Seen::from(u, f, patch)?;
            (seen[first][0], seen[shared][1]) = (face, face);
            first += usize::from(face.is_live() & !face.has(w));
            shared += usize::from(face.is_live() & face.has(w));
        }
        let seen = room(&mut self.of_second, of_w.len());
        for &f in of_w {
            let face = Seen::from(w, f, patch)?;
            seen[second] = face;
            // Of two vertices that took part in nothing neither has another name.
            second += usize::from(face.is_live() & !face.has(u));
        }
        fill(&mut self.first, self.of_first[..first].iter().map(|seen| seen[0].located(-h, middle, patch)));
        fill(&mut self.shared, self.of_first[..shared].iter().map(|seen| seen[1].located(-h, middle, patch)));
        fill(&mut self.second, self.of_second[..second].iter().map(|seen| seen.located(h, middle, patch)));
        Ok(())
    }

    /// The corner of a shared face that is neither end; `w` is the second.
    #[inline(always)]
    pub fn opposite(face: &StarFace, w: u32) -> u32 {
        if face.others[0] == w { face.others[1] } else { face.others[0] }
    }

    /// Whether the ends have no neighbor in common but the opposite vertices of their shared faces, `tips`.
    ///
    /// Every common neighbor is a tip or a corner of faces with either end alone; a branch would be misjudged at each.
    pub fn meets_only_at(&self, tips: [u32; 2]) -> bool {
        let meets = |v: u32| {
            let is_corner = |found: bool, face: &StarFace| found | face.has(v);
            (v != tips[0]) & (v != tips[1]) & self.first.iter().fold(false, is_corner)
        };
        !self.second.iter().fold(false, |found, face| found | meets(face.others[0]) | meets(face.others[1]))
    }

    /// Takes out what folds together when the ends become one: two faces on the same edge and side, of which one is left,
    /// or on its two sides, of which none is. Returns the edges of those that go, as often as they go.
    pub fn cancel(&mut self) -> Vec<[u32; 2]> {
        let mut gone = Vec::new();
        let Self { first, second, .. } = self;
        second.retain(|face| {
            let [v1, v2] = face.others;
            if first.iter().any(|other| other.others == [v1, v2]) {
                gone.push([v1, v2]);
                return false;
            }
            let Some(opposite) = first.iter().position(|other| other.others == [v2, v1]) else { return true };
            first.swap_remove(opposite);
            gone.extend([[v1, v2], [v2, v1]]);
            false
        });
        gone
    }

    /// Tells the border edges at either end of the pair, and the pair itself where it is one; from, to.
    pub fn for_each_border_edge(&self, [u, w]: [u32; 2], mut tell: impl FnMut(DVec3, DVec3)) {
        if self.shared.len() == 1 {
            tell(-self.h, self.h);
        }
        for (end, other, at, own) in [(u, w, -self.h, &self.first), (w, u, self.h, &self.second)] {
            let is_border = |v: u32| {
                let by_shared = self.shared.iter().filter(|face| face.has(v)).count();
                own.iter().filter(|face| face.has(v)).count() + by_shared == 1
            };
            for face in own.iter().chain(&self.shared) {
                for (&v, &point) in face.others.iter().zip(&face.points) {
                    if v != end && v != other && is_border(v) {
                        tell(at, point);
                    }
                }
            }
        }
    }
}

/// A face from one of its corners, before anything is read of where the others lie.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    face: u32,
    /// The other corners as they are now: one twice where it died this round.
    others: [u32; 2],
}

impl Seen {
    #[inline(always)]
    fn from(end: u32, f: u32, patch: &Patch<'_>) -> Result<Self, Outside> {
        let Spoke { next, last, .. } = spoke(patch.connectivity.faces[f as usize], end);
        let others = patch.current_both([next, last]).ok_or(Outside)?;
        Ok(Self { face: f, others })
    }

    #[inline(always)]
    fn is_live(&self) -> bool {
        self.others[0] != self.others[1]
    }

    #[inline(always)]
    fn has(&self, vertex: u32) -> bool {
        is_either(vertex, self.others)
    }

    /// About `middle`, from which its corner stands at `at`.
    #[inline(always)]
    fn located(&self, at: DVec3, middle: DVec3, patch: &Patch<'_>) -> StarFace {
        let points = self.others.map(|v| patch.position(v).xyz().as_dvec3() - middle);
        let normal = (points[0] - at).cross(points[1] - at);
        StarFace { face: self.face, others: self.others, points, normal }
    }
}

/// So many rows, of which none is promised to hold anything.
fn room<T: Clone + Default>(rows: &mut Vec<T>, count: usize) -> &mut [T] {
    if rows.len() < count {
        rows.resize(count, T::default());
    }
    &mut rows[..count]
}

/// Replaces `faces`.
fn fill(faces: &mut Vec<StarFace>, others: impl Iterator<Item = StarFace>) {
    faces.clear();
    faces.extend(others);
}

/// Face `f` turned so that `end`, which stands at `at`, comes first; `None` for one that died this round.
#[inline(always)]
pub fn located(f: u32, end: u32, at: DVec3, middle: DVec3, patch: &Patch<'_>) -> Result<Option<StarFace>, Outside> {
    let seen = Seen::from(end, f, patch)?;
    Ok(seen.is_live().then(|| seen.located(at, middle, patch)))
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::patch::Placed;
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::kernel::rows::PlaneQuadric;
    use crate::mesh::shapes;

    /// First, second and shared faces by a walk around either end.
    fn walked([u, w]: [u32; 2], middle: DVec3, h: DVec3, patch: &Patch<'_>) -> [Vec<StarFace>; 3] {
        let [mut first, mut second, mut shared] = [const { Vec::new() }; 3];
        let around = |end: u32, at: DVec3| {
            let ring = patch.connectivity.ring(end).iter();
            ring.filter_map(move |&f| located(f, end, at, middle, patch).expect("the patch is the whole surface"))
        };
        around(u, -h).for_each(|face| if face.has(w) { shared.push(face) } else { first.push(face) });
        second.extend(around(w, h).filter(|face| !face.has(u)));
        [first, second, shared]
    }

    /// Compares the stars of all free pairs of a patch; tells how many there are and how many faces had died around them.
    fn compare(star: &mut Star, patch: &Patch<'_>) -> (usize, usize) {
        let (mut pairs, mut died) = (0, 0);
        for corners in patch.connectivity.faces.iter().map(|face| face.corners()) {
            for k in 0..3 {
                let [u, w] = [corners[k], corners[(k + 1) % 3]];
                if !(patch.is_free(u) && patch.is_free(w)) {
                    continue;
                }
                let [pu, pw] = [u, w].map(|v| patch.position(v).xyz().as_dvec3());
                let (h, middle) = ((pw - pu) * 0.5, (pu + pw) * 0.5);
                star.gather([u, w], middle, h, patch).expect("the patch is the whole surface");
                let found = [&star.first, &star.second, &star.shared];
                assert_eq!(found, walked([u, w], middle, h, patch).each_ref(), "{u} to {w}");
                let live: usize = found.iter().map(|faces| faces.len()).sum();
                pairs += 1;
                died +=
                    [u, w].map(|v| patch.connectivity.ring(v).len()).iter().sum::<usize>() - (live + star.shared.len());
            }
        }
        (pairs, died)
    }

    #[test]
    fn stars_are_those_of_a_walk_whatever_was_gathered_before() {
        // Rings of 3 to 40 faces, each gathered after larger ones and smaller ones.
        for mesh in [shapes::cylinder(40), shapes::plane(6, 6)] {
            let mut prepared = prepare(&mesh, &Options::default()).expect("a valid mesh");
            let device = Device::cpu(1).expect("a device");
            let start = prepared.take_start();
            let mut surface = Surface::new(&mut device.cpu_queue(), start, true).expect("room");
            let mut patch = Patch::whole(&mut surface, &mut prepared.carried);
            let mut star = Star::default();
            let (all, died) = compare(&mut star, &patch);
            assert_eq!((all, died), (3 * mesh.faces.len(), 0));
            for u in (0..patch.len() as u32).step_by(5) {
                let face = patch.connectivity.faces[patch.connectivity.ring(u)[0] as usize];
                let w = spoke(face, u).next;
                if patch.is_free(u) && patch.is_free(w) {
                    let placed = Placed {
                        x: patch.position(u).xyz(),
                        t: 0.0,
                        quadric: PlaneQuadric::default(),
                        drift: 0.0,
                        flags: 0,
                    };
                    patch.contract([u, w], &placed);
                }
            }
            let (left, died) = compare(&mut star, &patch);
            assert!(0 < left && left < all && died > 0, "{left} of {all}, {died} died");
        }
    }
}
