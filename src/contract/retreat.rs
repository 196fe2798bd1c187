//! How far a pair's ends come to lie from the surface that it leaves, where its quadric does not tell.
//!
//! ```text
//!  ____________u      A quadric measures from planes. Those of both sides of a thin sheet hold the sheet's rim wherever in them it is:
//!  ____________/      that u goes to w costs nothing, and the sheet is eaten from there. So do the sides of a finger hold its tip.
//!        w
//! ```
//!
//! An end mostly lies above one of the faces that are left, as near as the quadric says, and nothing more is asked. Else it is
//! measured how far it is from all of them.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};

use crate::math::DVec3;
use crate::math::wide::{WIDE, WideVec3};
use crate::spatial::wide_triangle::distances_sq;

use super::quads::Quad;
use super::star::Star;

/// How many times as far from what a pair leaves as its quadric says an end may be until that is believed no more.
pub const BELIEVED: f64 = 3.0;
/// What the squared distances of a star from what a pair leaves of it are in the mean, of that of the farther end.
pub const RETREAT: f64 = 0.2;
/// Up to which share of half the pair's length, squared, distances are rounding.
const ROUNDING_SQ: f64 = 1e-6;

/// Up to which squared distance a pair's quadric is believed: that many `times` as far, before squaring, as it tells by a mean of
/// squares, `off_sq`.
pub fn believed_sq(star: &Star, off_sq: f64, times: f64) -> f64 {
    times * times * off_sq + ROUNDING_SQ * star.h.length_squared()
}

/// The greatest squared distance of the ends of a pair from the faces of its star as they are with the new vertex at `x`, about the
/// pair's midpoint; `None` where it is at most `limit_sq`, and where no face is left.
pub fn retreat_sq(star: &Star, x: DVec3, limit_sq: f64) -> Option<f64> {
    let are_covered = are_covered(star, star.survivors(), Apex::At(x), [-star.h, star.h], limit_sq);
    let from_faces = |end: DVec3| nearest_face(star, star.survivors(), Apex::At(x), end).distance_sq;
    let ends = [-star.h, star.h].into_iter().zip(are_covered);
    let farthest = ends.filter(|(_, is_covered)| !is_covered).map(|(end, _)| from_faces(end)).fold(0.0, f64::max);
    (farthest > limit_sq && farthest.is_finite()).then_some(farthest)
}

/// Where the corner of faces stands that they were told from.
#[derive(Debug, Clone, Copy)]
pub enum Apex {
    /// As it will be.
    At(DVec3),
    /// As it is: at −h for those of a pair's first end, at h for those of its second.
    Ends(DVec3),
}

impl Apex {
    /// The corners of four faces.
    #[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
    #[inline(always)]
    fn of<S: Simd>(self, simd: S, quad: &Quad) -> WideVec3<S> {
        match self {
            Self::At(x) => WideVec3::splat(simd, x),
            Self::Ends(h) => WideVec3::splat(simd, h).scaled(quad.sides.simd_into(simd)),
        }
    }
}

/// Whether each point lies above one of the first so many faces of a star, at most so far from its plane.
pub fn are_covered<const N: usize>(
    star: &Star,
    count: usize,
    apex: Apex,
    points: [DVec3; N],
    limit_sq: f64,
) -> [bool; N] {
    dispatch!(star.quads.level, simd => covered(simd, star.quads.rows(), count, apex, points, limit_sq))
}

#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn covered<S: Simd, const N: usize>(
    simd: S,
    quads: &[Quad],
    count: usize,
    apex: Apex,
    points: [DVec3; N],
    limit_sq: f64,
) -> [bool; N] {
    let splat = |number: f64| f64x4::splat(simd, number);
    let (limit_sq, zero) = (splat(limit_sq), splat(0.0));
    let points = points.map(|point| WideVec3::splat(simd, point));
    let mut covered = [0; N];
    for (quad, first) in quads.iter().zip((0..count).step_by(WIDE)) {
        let from = apex.of(simd, quad);
        let [p1, p2] = [quad.points[0].load(simd) - from, quad.points[1].load(simd) - from];
        let normal = p1.cross(p2);
        let normal_sq = normal.length_squared();
        let lanes = (1 << (count - first).min(WIDE)) - 1;
        for (&point, covered) in points.iter().zip(&mut covered) {
            let point = point - from;
            // Twice the areas that the point's foot cuts off at each side, times that of the face.
            let [at_p2, at_p1] = [normal.dot(p1.cross(point)), normal.dot(point.cross(p2))];
            let at_from = normal_sq - at_p1 - at_p2;
            let height = normal.dot(point);
            let is_above = at_p1.simd_ge(zero) & at_p2.simd_ge(zero) & at_from.simd_ge(zero);
            let is_near = (height * height).simd_le(limit_sq * normal_sq) & normal_sq.simd_gt(zero);
            *covered |= (is_above & is_near).to_bitmask() & lanes;
        }
    }
    covered.map(|lanes| lanes != 0)
}

/// The face of a star that a point is nearest to.
#[derive(Debug, Clone, Copy)]
pub struct NearestFace {
    /// The first of those at this squared distance; infinite where there is none.
    pub number: usize,
    pub distance_sq: f64,
}

/// The nearest of the first so many faces of a star.
pub fn nearest_face(star: &Star, count: usize, apex: Apex, point: DVec3) -> NearestFace {
    dispatch!(star.quads.level, simd => nearest(simd, star.quads.rows(), count, apex, point))
}

#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn nearest<S: Simd>(simd: S, quads: &[Quad], count: usize, apex: Apex, point: DVec3) -> NearestFace {
    let mut found = NearestFace { number: 0, distance_sq: f64::INFINITY };
    for (quad, first) in quads.iter().zip((0..count).step_by(WIDE)) {
        let triangles = [apex.of(simd, quad), quad.points[0].load(simd), quad.points[1].load(simd)];
        let distances_sq = distances_sq(simd, point, triangles);
        for (number, distance_sq) in (first..count).zip(distances_sq) {
            if distance_sq < found.distance_sq {
                found = NearestFace { number, distance_sq };
            }
        }
    }
    found
}

#[cfg(test)]
pub mod tests {
    use super::super::Options;
    use super::super::patch::Patch;
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::mesh::{Mesh, shapes};

    /// Tells the stars of all pairs of a mesh, by their numbers there and in the star, and up to what they believe no distance.
    pub fn for_each_pair(mesh: &Mesh, mut tell: impl FnMut(&Star, [u32; 2], [u32; 2], f64)) {
        let mut prepared = prepare(mesh, &Options::default()).expect("a valid mesh");
        let device = Device::cpu(1).expect("a device");
        let origin = prepared.carried.origin.clone();
        let start = prepared.take_start();
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let patch = Patch::whole(&mut surface, &mut prepared.carried);
        let mut star = Star::default();
        for corners in patch.connectivity.faces.iter().map(|face| face.corners()) {
            for pair in [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]) {
                let [pu, pw] = pair.map(|v| patch.position(v).xyz().as_dvec3());
                star.gather(pair, (pw - pu) * 0.5, &patch).expect("the patch is the whole surface");
                star.locate((pu + pw) * 0.5, &patch);
                tell(&star, pair.map(|v| origin[v as usize]), pair, believed_sq(&star, 0.0, 1.0));
            }
        }
    }

    /// What is found of the pairs of a mesh that each go where the second end is, which is in all planes: in lengths of theirs.
    fn retreats(mesh: &Mesh) -> Vec<([u32; 2], Option<f64>)> {
        let mut found = Vec::new();
        for_each_pair(mesh, |star, input, _, limit_sq| {
            let share = retreat_sq(star, star.h, limit_sq).map(|sq| sq.sqrt() / (2.0 * star.h.length()));
            found.push((input, share));
        });
        found
    }

    #[test]
    fn pairs_within_flats_and_along_their_borders_are_believed() {
        let plane = shapes::plane(6, 6);
        let is_on_rim = |v: u32| plane.positions[v as usize].to_array()[..2].iter().any(|&x| x == 0.0 || x == 6.0);
        let is_corner = |v: u32| plane.positions[v as usize].to_array()[..2].iter().all(|&x| x == 0.0 || x == 6.0);
        for ([u, w], retreat) in retreats(&plane) {
            let shares_a_side = {
                let [p, q] = [u, w].map(|v| plane.positions[v as usize]);
                (p.x == q.x && (p.x == 0.0 || p.x == 6.0)) || (p.y == q.y && (p.y == 0.0 || p.y == 6.0))
            };
            let stays = !is_on_rim(u) || (shares_a_side && !is_corner(u));
            assert_eq!(retreat.is_none(), stays, "{u} to {w}: {retreat:?}");
            // As far as it is from the straight line between its neighbors, at most as far as it went.
            assert!(retreat.is_none_or(|share| (0.3..=1.0).contains(&share)), "{u} to {w}: {retreat:?}");
        }
    }
}
