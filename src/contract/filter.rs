//! Which contractions are legal, on the current state.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};

use crate::kernel::rows::{BORDER, LOCKED};
use crate::math::DVec3;
use crate::math::wide::{WIDE, WideVec3};
use crate::simplify::Blocked;

use super::quads::{Quad, Quads};
use super::star::{Star, StarFace};

/// Why a pair was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rejection {
    /// Both ends lie on a border and the pair does not.
    Border,
    /// The link condition.
    Link,
    /// A face would turn over.
    Flip,
    /// A face would become a sliver.
    Aspect,
    /// A seam would tear, or two come together.
    Seam,
    /// The texture would fold.
    Texture,
    /// A face would come to pass through another.
    Crossing,
    /// The error limit.
    Error,
    /// No longer as cheap as when the round began: it waits for the next one and blocks nothing.
    Outdated,
}

impl Blocked {
    /// Counts a rejection.
    pub fn count(&mut self, rejection: Rejection) {
        match rejection {
            Rejection::Border => self.border += 1,
            Rejection::Link => self.link += 1,
            Rejection::Flip => self.flip += 1,
            Rejection::Aspect => self.aspect += 1,
            Rejection::Seam => self.seam += 1,
            Rejection::Texture => self.texture += 1,
            Rejection::Crossing => self.crossing += 1,
            Rejection::Error => self.error += 1,
            Rejection::Outdated => {}
        }
    }

    /// How many candidates were refused: examined, known from before, or without a key.
    pub fn refused(&self) -> u64 {
        let Self { border, lock: _, seam, link, flip, aspect, texture, crossing, error } = self;
        border + seam + link + flip + aspect + texture + crossing + error
    }

    /// Adds the counts of another part of the round.
    pub fn add(&mut self, other: Self) {
        let Self { border, lock, seam, link, flip, aspect, texture, crossing, error } = other;
        self.border += border;
        self.lock += lock;
        self.seam += seam;
        self.link += link;
        self.flip += flip;
        self.aspect += aspect;
        self.texture += texture;
        self.crossing += crossing;
        self.error += error;
    }
}

/// The link condition \[DE99\]: contracting keeps the surface's topology exactly when the links of the ends meet in the
/// link of the pair, borders coned to a vertex of their own.
///
/// In faces: the common neighbors are the opposite vertices of the one or two shared faces, all different; two border
/// vertices contract only along the border; no tetrahedron closes flat; and at every opposite vertex the two edges that
/// become one leave an edge of as many faces as either had beside the shared one. A locked end may hide a border or an
/// edge of many faces, so a border vertex contracts onto it only along a border.
pub fn link_condition(star: &Star, w: u32, flags: [u32; 2]) -> Result<(), Rejection> {
    let (border, held) = (BORDER, BORDER | LOCKED);
    let along_border = flags[0] & flags[1] & BORDER != 0;
    match star.shared() {
        [k] => {
            let k = Star::opposite(k, w);
            if !along_border || !star.meets_only_at([k, k]) || !leaves_an_edge(star, k) {
                return Err(Rejection::Link);
            }
        }
        [k, l] => {
            let joins_borders =
                (flags[0] & border != 0 && flags[1] & held != 0) || (flags[1] & border != 0 && flags[0] & held != 0);
            if joins_borders {
                return Err(Rejection::Border);
            }
            let (k, l) = (Star::opposite(k, w), Star::opposite(l, w));
            if k == l || !star.meets_only_at([k, l]) || !leaves_an_edge(star, k) || !leaves_an_edge(star, l) {
                return Err(Rejection::Link);
            }
            let joins = |found: bool, face: &StarFace| found | (face.has(k) & face.has(l));
            if star.first().iter().fold(false, joins) & star.second().iter().fold(false, joins) {
                return Err(Rejection::Link);
            }
        }
        _ => return Err(Rejection::Link),
    }
    Ok(())
}

/// [`link_condition`] between two ends with one closed fan each, whose edge has two faces.
///
/// Every neighbor is the next corner of one face of its fan and the last of another: common neighbors other than the opposite
/// vertices k and l are next corners on either side, where k is one only around the first end and l only around the second.
/// An end has a face with both k and l where it has no other beside the shared ones.
pub fn closed_link_condition(star: &Star, w: u32) -> Result<(), Rejection> {
    let [k, l] = star.shared() else { return Err(Rejection::Link) };
    let next = |face: &StarFace| face.others[0];
    let (first, second) = (star.first(), star.second());
    let meets = |v: u32| first.iter().fold(false, |found, face| found | (next(face) == v));
    let meets = second.iter().fold(false, |found, face| found | meets(next(face)));
    let is_flat = first.len() == 1 && second.len() == 1;
    if meets | is_flat | (Star::opposite(k, w) == Star::opposite(l, w)) { Err(Rejection::Link) } else { Ok(()) }
}

/// Whether the edges from both ends to `tip`, an opposite vertex, become one edge of the same kind as either: not one
/// without a face, nor one that loses a third.
fn leaves_an_edge(star: &Star, tip: u32) -> bool {
    let faces_with_tip = |faces: &[StarFace]| faces.iter().map(|face| u32::from(face.has(tip))).sum::<u32>();
    let (first, second) = (faces_with_tip(star.first()), faces_with_tip(star.second()));
    matches!((first.min(second), first.max(second)), (0, 1) | (1, _))
}

/// How far a contraction may turn and flatten a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeLimits {
    /// Least cosine between a face's old and new normal.
    pub min_cos: f64,
    /// Least area of a face, doubled, over the sum of the squares of its two sides at the moved corner, unless it was worse or
    /// another around the pair is hardly better: about its height over its length.
    pub min_height: f64,
}

/// How thin a face may become beside faces that are thin already, of the thinnest of them: where all are strips, as along a pipe,
/// any vertex that moves along the rim leaves some of them a little thinner, and others wider.
const THINNER: f64 = 0.7;

/// What others around a pair excuse, of the height that faces have to keep: of what is thinner normals are rounding noise.
const THINNEST: f64 = 1e-3;

/// Squared normals below this are of faces without area, which may take any shape.
const NO_AREA_SQ: f64 = 1e-24;

/// Whether every surviving face of a star keeps its side and its shape when the ends move to `x`, about the pair's midpoint.
pub fn shapes_hold(star: &Star, x: DVec3, limits: ShapeLimits) -> Result<(), Rejection> {
    faces_hold(&star.quads, star.survivors(), star.h, x, limits)
}

/// The same for the first so many faces, told from ends that stand at `h` and its opposite.
pub fn faces_hold(quads: &Quads, count: usize, h: DVec3, x: DVec3, limits: ShapeLimits) -> Result<(), Rejection> {
    dispatch!(quads.level, simd => hold(simd, quads.rows(), count, h, x, limits))
}

#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn hold<S: Simd>(
    simd: S,
    quads: &[Quad],
    count: usize,
    h: DVec3,
    x: DVec3,
    limits: ShapeLimits,
) -> Result<(), Rejection> {
    let splat = |number: f64| f64x4::splat(simd, number);
    let (x, h) = (WideVec3::splat(simd, x), WideVec3::splat(simd, h));
    let least_cos_sq = splat(limits.min_cos * limits.min_cos);
    for (quad, first) in quads.iter().zip((0..count).step_by(WIDE)) {
        let [p1, p2] = [quad.points[0].load(simd), quad.points[1].load(simd)];
        let before = quad.normals.load(simd);
        let before_sq = before.length_squared();
        let counted = before_sq.simd_gt(splat(NO_AREA_SQ)).to_bitmask() & lanes_below(count - first);
        let (to_p1, to_p2) = (p1 - x, p2 - x);
        let after = to_p1.cross(to_p2);
        let (dot, after_sq) = (before.dot(after), after.length_squared());
        let keeps = dot.simd_gt(splat(0.0)) & (dot * dot).simd_gt(least_cos_sq * before_sq * after_sq);
        if !keeps.to_bitmask() & counted != 0 {
            return Err(Rejection::Flip);
        }
        let sides_sq = to_p1.length_squared() + to_p2.length_squared();
        let least = splat(limits.min_height) * sides_sq;
        let thin = after_sq.simd_lt(least * least);
        if thin.to_bitmask() & counted != 0 {
            let p0 = h.scaled(quad.sides.simd_into(simd));
            let was_sq = (p1 - p0).length_squared() + (p2 - p0).length_squared();
            let ratios = after_sq.sqrt() / sides_sq;
            let thinner = ratios.simd_lt(before_sq.sqrt() / was_sq);
            let too_thin = (thin & thinner).to_bitmask() & counted;
            if too_thin != 0 {
                let thinnest = (THINNER * thinnest(simd, quads, h)).max(THINNEST * limits.min_height);
                if ratios.simd_lt(splat(thinnest)).to_bitmask() & too_thin != 0 {
                    return Err(Rejection::Aspect);
                }
            }
        }
    }
    Ok(())
}

/// The least height over length of the faces of a star that have an area, as they are.
#[inline(always)]
fn thinnest<S: Simd>(simd: S, quads: &[Quad], h: WideVec3<S>) -> f64 {
    let ratios = |quad: &Quad| -> [f64; WIDE] {
        let p0 = h.scaled(quad.sides.simd_into(simd));
        let sides = quad.points.map(|points| (points.load(simd) - p0).length_squared());
        let normal_sq = quad.normals.load(simd).length_squared();
        let has_area = normal_sq.simd_gt(f64x4::splat(simd, NO_AREA_SQ));
        has_area.select(normal_sq.sqrt() / (sides[0] + sides[1]), f64x4::splat(simd, f64::INFINITY)).into()
    };
    quads.iter().flat_map(ratios).fold(f64::INFINITY, f64::min)
}

/// The bits of as many lanes, of the first ones.
#[inline]
fn lanes_below(count: usize) -> u64 {
    (1 << count.min(WIDE)) - 1
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::patch::{Accumulated, Patch, Placed};
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::mesh::{Mesh, shapes};

    /// Compares both link conditions at every pair of a closed surface, of which every third legal one is contracted; tells how
    /// many were legal and how many were not.
    fn compare_conditions(mesh: &Mesh) -> [usize; 2] {
        let mut prepared = prepare(mesh, &Options::default()).expect("a valid mesh");
        let device = Device::cpu(1).expect("a device");
        let start = prepared.take_start();
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let mut patch = Patch::whole(&mut surface, &mut prepared.carried);
        let (mut star, mut counts) = (Star::default(), [0, 0]);
        for corners in patch.connectivity.faces.iter().map(|face| face.corners()) {
            for [u, w] in [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]) {
                if !(patch.is_free(u) && patch.is_free(w)) {
                    continue;
                }
                star.gather([u, w], DVec3::X, &patch).expect("the patch is the whole surface");
                let flags = [u, w].map(|v| patch.position(v).flags);
                assert_eq!(flags.map(|flags| flags & (BORDER | LOCKED)), [0, 0]);
                let condition = closed_link_condition(&star, w);
                assert_eq!(condition, link_condition(&star, w, flags), "{u} to {w}");
                counts[usize::from(condition.is_err())] += 1;
                if condition.is_ok() && counts[0] % 3 == 0 {
                    let (x, accumulated) = (patch.position(u).xyz(), Accumulated::Drift(0.0));
                    patch.contract([u, w], &Placed { x, t: 0.0, accumulated, flags: 0 });
                }
            }
        }
        counts
    }

    #[test]
    fn closed_fans_need_no_more_than_their_next_corners() {
        assert_eq!(compare_conditions(&shapes::tetrahedron()), [0, 12]);
        let [legal, illegal] = compare_conditions(&shapes::torus(3, 5));
        assert!(legal > 0 && illegal > 0, "{legal}, {illegal}");
        for level in 0..3 {
            let [legal, illegal] = compare_conditions(&shapes::icosphere(level));
            assert!(legal > illegal, "{legal}, {illegal}");
        }
    }

    /// The fan of two faces around the first end of a pair along x and one around the second: what the filters say of
    /// moving both ends to `x`, about the midpoint.
    fn moving_to(x: [f64; 3]) -> Result<(), Rejection> {
        let at = |x: f64, y: f64| DVec3::new(x - 0.5, y, 0.0);
        let (h, tip) = (at(1.0, 0.0), at(0.5, 1.0));
        let first = ([tip, at(-1.0, 0.5)], -1.0);
        let second = ([at(2.0, 0.5), tip], 1.0);
        let shared = ([h, tip], -1.0);
        let limits = ShapeLimits { min_cos: 0.2, min_height: 1e-2 };
        faces_hold(&Quads::of(&[first, second, shared], h), 2, h, DVec3::from_array(x), limits)
    }

    #[test]
    fn faces_may_not_turn_over_nor_flatten() {
        assert_eq!(moving_to([0.0, 0.0, 0.0]), Ok(()));
        // Beyond the line from the tip to (-1, 0.5) the first face turns over, almost on it it is a sliver.
        assert_eq!(moving_to([0.0, 2.0, 0.0]), Err(Rejection::Flip));
        assert_eq!(moving_to([-0.75, 0.746, 0.0]), Err(Rejection::Aspect));
    }
}
