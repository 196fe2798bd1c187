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

use std::ops::Range;

use crate::kernel::stars::{Spoke, spoke};
use crate::math::DVec3;

use super::patch::Patch;
use super::quads::Quads;

/// A live face of a star, from one of its ends: shared faces are seen from `u`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StarFace {
    /// Which face.
    pub face: u32,
    /// The corners after the end, in order, as they are now.
    pub others: [u32; 2],
}

impl StarFace {
    /// A face from its corner `end`. It died this round if that is told of one corner twice.
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

    /// Whether a vertex is one of the others, without a branch.
    #[inline(always)]
    pub fn has(&self, vertex: u32) -> bool {
        (vertex == self.others[0]) | (vertex == self.others[1])
    }
}

/// Face `f` from its corner `end`; `None` for one that died this round.
pub fn seen(f: u32, end: u32, patch: &Patch<'_>) -> Result<Option<StarFace>, Outside> {
    let face = StarFace::from(end, f, patch)?;
    Ok(face.is_live().then_some(face))
}

/// Part of a star lies outside of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outside;

/// The live faces around both ends of a pair.
#[derive(Debug, Default)]
pub struct Star {
    /// From the midpoint to `w`, half the pair.
    pub h: DVec3,
    /// Faces with `u` alone, then those with `w` alone, then those with both; longer where there were more before.
    faces: Vec<StarFace>,
    /// How many there are with `u` alone, and with `w` alone.
    alone: [usize; 2],
    /// How many there are.
    len: usize,
    /// Where they stand.
    pub quads: Quads,
    of_shared: Vec<StarFace>,
}

impl Star {
    /// The connectivity of a star with these faces: of the first end alone, of the second, of both.
    pub fn of(parts: [&[StarFace]; 3]) -> Self {
        let mut star = Self::default();
        star.set(parts);
        star
    }

    fn set(&mut self, parts: [&[StarFace]; 3]) {
        self.faces = parts.concat();
        self.alone = [parts[0].len(), parts[1].len()];
        self.len = self.faces.len();
    }

    /// Gathers the star of the pair `u`, `w`, which is twice `h` long; where its faces lie has yet to be told, by
    /// [`locate`](Self::locate). Both took part in no contraction of this round, so their rings are those of its start.
    ///
    /// Which faces are shared nobody could foretell. Each is written wherever it may belong, and counted where it does.
    #[inline]
    pub fn gather(&mut self, [u, w]: [u32; 2], h: DVec3, patch: &Patch<'_>) -> Result<(), Outside> {
        self.h = h;
        let (of_u, of_w) = (patch.connectivity.ring(u), patch.connectivity.ring(w));
        let (mut first, mut second, mut shared) = (0, 0, 0);
        let faces = room(&mut self.faces, of_u.len() + of_w.len());
        let of_shared = room(&mut self.of_shared, of_u.len());
        for &f in of_u {
            let face = StarFace::from(u, f, patch)?;
            (faces[first], of_shared[shared]) = (face, face);
            first += usize::from(face.is_live() & !face.has(w));
            shared += usize::from(face.is_live() & face.has(w));
        }
        for &f in of_w {
            let face = StarFace::from(w, f, patch)?;
            faces[first + second] = face;
            // Of two vertices that took part in nothing neither has another name.
            second += usize::from(face.is_live() & !face.has(u));
        }
        let (alone, of_both) = faces.split_at_mut(first + second);
        of_both.iter_mut().zip(&of_shared[..shared]).for_each(|(face, &shared)| *face = shared);
        (self.alone, self.len) = ([first, second], alone.len() + shared);
        Ok(())
    }

    /// Finds where the faces stand about `middle`, that of the pair.
    pub fn locate(&mut self, middle: DVec3, patch: &Patch<'_>) {
        self.quads.locate(&self.faces[..self.len], self.numbers_of_second(), self.h, middle, patch);
    }

    /// All faces, by their numbers: those with the first end alone, with the second, with both.
    #[inline(always)]
    pub fn faces(&self) -> &[StarFace] {
        &self.faces[..self.len]
    }

    /// The faces with the first end alone.
    #[inline(always)]
    pub fn first(&self) -> &[StarFace] {
        &self.faces[self.numbers_of_first()]
    }

    /// The faces with the second end alone.
    #[inline(always)]
    pub fn second(&self) -> &[StarFace] {
        &self.faces[self.numbers_of_second()]
    }

    /// The faces with both.
    #[inline(always)]
    pub fn shared(&self) -> &[StarFace] {
        &self.faces[self.numbers_of_shared()]
    }

    /// Which of the faces have the first end alone.
    #[inline(always)]
    pub fn numbers_of_first(&self) -> Range<usize> {
        0..self.alone[0]
    }

    /// Which of the faces have the second end alone.
    #[inline(always)]
    pub fn numbers_of_second(&self) -> Range<usize> {
        self.alone[0]..self.survivors()
    }

    /// Which of the faces have both.
    #[inline(always)]
    pub fn numbers_of_shared(&self) -> Range<usize> {
        self.survivors()..self.len
    }

    /// How many faces, the first ones, survive the contraction.
    #[inline(always)]
    pub fn survivors(&self) -> usize {
        self.alone[0] + self.alone[1]
    }

    /// A face by its number.
    #[inline(always)]
    pub fn face(&self, number: usize) -> StarFace {
        self.faces[number]
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
        let (first, second) = (self.first(), self.second());
        let meets = |v: u32| {
            let is_corner = |found: bool, face: &StarFace| found | face.has(v);
            (v != tips[0]) & (v != tips[1]) & first.iter().fold(false, is_corner)
        };
        !second.iter().fold(false, |found, face| found | meets(face.others[0]) | meets(face.others[1]))
    }

    /// Takes out what folds together when the ends become one: two faces on the same edge and side, of which one is left,
    /// or on its two sides, of which none is. Returns the edges of those that go, as often as they go.
    pub fn cancel(&mut self, middle: DVec3, patch: &Patch<'_>) -> Vec<[u32; 2]> {
        let mut gone = Vec::new();
        let [mut first, mut second, shared] = [self.first(), self.second(), self.shared()].map(<[_]>::to_vec);
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
        if !gone.is_empty() {
            self.set([&first, &second, &shared]);
            self.locate(middle, patch);
        }
        gone
    }

    /// Tells the border edges at either end of the pair, and the pair itself where it is one; from, to.
    pub fn for_each_border_edge(&self, [u, w]: [u32; 2], mut tell: impl FnMut(DVec3, DVec3)) {
        if self.shared().len() == 1 {
            tell(-self.h, self.h);
        }
        for (end, other, at, own) in
            [(u, w, -self.h, self.numbers_of_first()), (w, u, self.h, self.numbers_of_second())]
        {
            let numbers = || own.clone().chain(self.numbers_of_shared());
            let is_border = |v: u32| numbers().filter(|&number| self.face(number).has(v)).count() == 1;
            for number in numbers() {
                for (corner, v) in self.face(number).others.into_iter().enumerate() {
                    if v != end && v != other && is_border(v) {
                        tell(at, self.quads.point(number, corner));
                    }
                }
            }
        }
    }
}

/// So many rows, of which none is promised to hold anything.
fn room<T: Clone + Default>(rows: &mut Vec<T>, count: usize) -> &mut [T] {
    if rows.len() < count {
        rows.resize(count, T::default());
    }
    &mut rows[..count]
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::patch::Accumulated;
    use super::super::patch::Placed;
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::math::wide::WIDE;
    use crate::mesh::shapes;

    /// A face, where its corners stand, and its normal.
    type Located = (StarFace, [DVec3; 2], DVec3);

    /// First, second and shared faces by a walk around either end.
    fn walked([u, w]: [u32; 2], middle: DVec3, h: DVec3, patch: &Patch<'_>) -> [Vec<Located>; 3] {
        let [mut first, mut second, mut shared] = [const { Vec::new() }; 3];
        let around = |end: u32, at: DVec3| {
            let ring = patch.connectivity.ring(end).iter();
            let faces = ring.filter_map(move |&f| seen(f, end, patch).expect("the patch is the whole surface"));
            faces.map(move |face| {
                let points = face.others.map(|v| patch.position(v).xyz().as_dvec3() - middle);
                (face, points, (points[0] - at).cross(points[1] - at))
            })
        };
        around(u, -h).for_each(|row| if row.0.has(w) { shared.push(row) } else { first.push(row) });
        second.extend(around(w, h).filter(|row| !row.0.has(u)));
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
                star.gather([u, w], h, patch).expect("the patch is the whole surface");
                star.locate(middle, patch);
                let located = |number: usize| {
                    let points = [0, 1].map(|corner| star.quads.point(number, corner));
                    (star.face(number), points, star.quads.normal(number))
                };
                let numbers = [star.numbers_of_first(), star.numbers_of_second(), star.numbers_of_shared()];
                let found = numbers.map(|numbers| numbers.map(located).collect::<Vec<_>>());
                let live: usize = found.iter().map(|faces| faces.len()).sum();
                assert_eq!(found, walked([u, w], middle, h, patch), "{u} to {w}");
                let lanes = star.quads.rows().len() * WIDE;
                assert!((live..lanes).all(|lane| star.quads.normal(lane) == DVec3::ZERO));
                pairs += 1;
                let around: usize = [u, w].map(|v| patch.connectivity.ring(v).len()).iter().sum();
                died += around - (live + star.shared().len());
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
            let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
            let mut patch = Patch::whole(&mut surface, &mut prepared.carried);
            let mut star = Star::default();
            let (all, died) = compare(&mut star, &patch);
            assert_eq!((all, died), (3 * mesh.faces.len(), 0));
            for u in (0..patch.len() as u32).step_by(5) {
                let face = patch.connectivity.faces[patch.connectivity.ring(u)[0] as usize];
                let w = spoke(face, u).next;
                if patch.is_free(u) && patch.is_free(w) {
                    let placed =
                        Placed { x: patch.position(u).xyz(), t: 0.0, accumulated: Accumulated::Drift(0.0), flags: 0 };
                    patch.contract([u, w], &placed);
                }
            }
            let (left, died) = compare(&mut star, &patch);
            assert!(0 < left && left < all && died > 0, "{left} of {all}, {died} died");
        }
    }
}
