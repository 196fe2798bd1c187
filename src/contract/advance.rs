//! How far what a pair makes comes to lie from the faces that were there, where its quadric does not tell.
//!
//! ```text
//!     to___                A quadric measures old planes from the new vertex. The rim of a hole is held by the wall of its plate
//!       |  \___u           alone, which is next to nothing where the plate is thin: that the rim u-w becomes a chord from x to
//!    m  |      |  plate    the vertex before u, so that a new face lies across the hole, costs no more than the wall between.
//!   hole|      |           Neither end retreats: both have the plate's new faces above them. Nor does it cost more that a
//!       x=w____|           vertex goes out from the rim, into the open.
//! ```
//!
//! The new vertex, and the middles m of the new edges of the crease that a pair lies on, are measured from the old faces: what
//! `retreat` does, the other way around. That is about half of how high u is above the chord where u is near w. A vertex that its
//! quadric has far out, where the planes of a fin meet, is drawn back.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};

use crate::math::DVec3;
use crate::math::wide::WideVec3;
use crate::spatial::triangle::{closest_on_segment, closest_point};

use super::placement::Quadric;
use super::quads::Quad;
use super::retreat::{Apex, NearestFace, are_covered, nearest_face};
use super::star::Star;

/// Cosine of the angle to the mean normal past which a face counts as turned: 60°, which neither the edges of a box nor most of a
/// scan reach. Measuring around all pairs took 3 to 5 % more time and told the same.
const TURNED_COS: f64 = 0.5;

/// Cosine of the least angle between the normals of two faces on either side of a crease: 60°, as between a plate and its wall even
/// where that leans.
const CREASE_COS: f64 = 0.5;

/// How many times as far out as it is a vertex counts that is drawn back, in where it goes and not in what that costs. With 1 the
/// greatest distances of scans are up to 1.3 times as large; with 2 and with 4 the boxes of an office, at 4 % of their faces, are 3.5
/// times as far off (RMS).
const OUT: f64 = 3.0;

/// How far a pair goes away from the old faces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Advance {
    /// The greatest distance.
    pub distance: f64,
    /// What the dearest triangle between an old edge and a new one costs in the units of a quadric: d high above an edge of length l,
    /// twice its area times its mean squared distance d²/6 from the edge.
    pub cost: f64,
}

impl Advance {
    /// Of a triangle `distance` high above an edge `base` long.
    pub fn of(base: f64, distance: f64) -> Self {
        Self { distance, cost: base * distance.powi(3) / 6.0 }
    }

    /// The greater distance, and the greater cost.
    pub fn max(self, other: Self) -> Self {
        Self { distance: self.distance.max(other.distance), cost: self.cost.max(other.cost) }
    }
}

/// A point away from the old faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Away {
    /// The closest point of the faces.
    pub foot: DVec3,
    pub distance: f64,
}

/// Whether a face of a star is turned from `mean`, the sum of their normals, or that is none: elsewhere planes tell all.
pub fn is_bent(star: &Star, mean: Option<DVec3>) -> bool {
    let is_turned = |mean| dispatch!(star.quads.level, simd => are_turned(simd, star.quads.rows(), mean));
    mean.is_none_or(is_turned)
}

#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn are_turned<S: Simd>(simd: S, quads: &[Quad], mean: DVec3) -> bool {
    let least_sq = f64x4::splat(simd, TURNED_COS * TURNED_COS * mean.length_squared());
    let (mean, zero) = (WideVec3::splat(simd, mean), f64x4::splat(simd, 0.0));
    let is_turned = |quad: &Quad| {
        let normal = quad.normals.load(simd);
        let along = normal.dot(mean);
        (along.simd_lt(zero) | (along * along).simd_lt(least_sq * normal.length_squared())).to_bitmask() != 0
    };
    quads.iter().fold(false, |found, quad| found | is_turned(quad))
}

/// Measures the new edges of the crease that the pair `u`, `w` lies on, whose vertex goes to `x`, about its midpoint. Squared
/// distances up to `limit_sq` are none.
pub fn advance(star: &Star, [u, w]: [u32; 2], x: DVec3, limit_sq: f64) -> Advance {
    let ends = [-star.h, star.h];
    let moved = ends.map(|end| end != x);
    let mut advance = Advance::default();
    let shared = star.numbers_of_shared();
    if shared.len() == 2 && are_on_crease(star, [shared.start, shared.start + 1]) {
        for (end, pair) in [[u, w], [w, u]].into_iter().enumerate().filter(|&(end, _)| moved[end]) {
            for_each_crease(star, pair, end, |to| {
                let middle = (x + to) * 0.5;
                // Straight creases, which are most, are done with here.
                let is_near = |from: DVec3, to: DVec3| closest_on_segment(middle, from, to).0 <= limit_sq;
                if !is_near(ends[end], to)
                    && !is_near(ends[0], ends[1])
                    && let Some(away) = away_from_faces(star, middle, limit_sq)
                {
                    advance = advance.max(Advance::of((to - x).length(), away.distance));
                }
            });
        }
    }
    advance
}

/// The point of the faces of a star that is closest to one away from them; `None` where that lies above one of them, at most so far
/// from its plane, and where it is no farther.
pub fn away_from_faces(star: &Star, point: DVec3, limit_sq: f64) -> Option<Away> {
    if are_covered(star, star.faces().len(), Apex::Ends(star.h), [point], limit_sq) == [true] {
        return None;
    }
    let NearestFace { number, distance_sq } = nearest_face(star, star.faces().len(), Apex::Ends(star.h), point);
    // Squares of what is far past the frame may be too large for a number.
    (distance_sq > limit_sq && distance_sq.is_finite()).then(|| {
        let end = if star.numbers_of_second().contains(&number) { star.h } else { -star.h };
        let [p1, p2] = [0, 1].map(|corner| star.quads.point(number, corner));
        let [a, b, c] = closest_point(point, [end, p1, p2]).weights;
        Away { foot: end * a + p1 * b + p2 * c, distance: distance_sq.sqrt() }
    })
}

/// Where a vertex goes that a quadric has away from the old faces, at `x`, and how far away that is: between there and the foot, where
/// the quadric and what a vertex [`OUT`] times as far out costs beside it, over a pair so long, are least together. Planes that meet in
/// the open, as those of a fin do, tell nothing of the tip that they make.
pub fn drawn_back(quadric: &Quadric, length: f64, x: DVec3, away: Away) -> (DVec3, f64) {
    let out = x - away.foot;
    let [at_foot, between, at_x] = [0.0, 0.5, 1.0].map(|t| quadric.value(away.foot + out * t));
    // Along the way the quadric has a linear and a square term, and the rest is cubic.
    let (linear, square) = (4.0 * between - 3.0 * at_foot - at_x, 2.0 * (at_foot + at_x) - 4.0 * between);
    let cubic = Advance::of(length, OUT * away.distance).cost;
    let t = if linear < 0.0 { -linear / (square + (square * square - 3.0 * cubic * linear).sqrt()) } else { 0.0 };
    if t < 1.0 { (away.foot + out * t, away.distance * t) } else { (x, away.distance) }
}

/// Tells where the creases lead to that leave `own`, the first or second end of a pair, but for the pair. Around a vertex that is
/// manifold faces run one way, so that each edge is the second of one face, and the first of the other; elsewhere creases may be missed,
/// which lowers an estimate.
fn for_each_crease(star: &Star, [own, other]: [u32; 2], end: usize, mut tell: impl FnMut(DVec3)) {
    let alone = if end == 0 { star.numbers_of_first() } else { star.numbers_of_second() };
    let numbers = || alone.clone().chain(star.numbers_of_shared());
    let seen = |number: usize| match star.face(number).others {
        // Shared faces are told from the first end.
        [a, b] if end == 1 && number >= star.survivors() => {
            if a == own {
                [b, other]
            } else {
                [other, a]
            }
        }
        others => others,
    };
    for number in numbers() {
        let v = seen(number)[1];
        let across = || numbers().find(|&across| seen(across)[0] == v);
        if v != other && across().is_some_and(|across| are_on_crease(star, [number, across])) {
            tell(star.quads.point(number, usize::from(star.face(number).others[1] == v)));
        }
    }
}

/// How far the first or second end of a pair is from where a crease goes without it that leads through it, and not along the pair.
pub fn leaving_crease(star: &Star, pair: [u32; 2], end: usize) -> Advance {
    let mut advance = Advance::default();
    let shared = star.numbers_of_shared();
    if shared.len() == 2 && are_on_crease(star, [shared.start, shared.start + 1]) {
        return advance;
    }
    let (own, at) = if end == 0 { (pair, -star.h) } else { ([pair[1], pair[0]], star.h) };
    for_each_crease(star, own, end, |from| {
        for_each_crease(star, own, end, |to| {
            if from != to {
                let distance = closest_on_segment(at, from, to).0.sqrt();
                advance = advance.max(Advance::of((to - from).length(), distance));
            }
        });
    });
    advance
}

/// Whether two faces with an edge in common make a crease of it; one without an area never does.
fn are_on_crease(star: &Star, faces: [usize; 2]) -> bool {
    let [a, b] = faces.map(|number| star.quads.normal(number));
    let along = a.dot(b);
    along < 0.0 || along * along < CREASE_COS * CREASE_COS * a.length_squared() * b.length_squared()
}

#[cfg(test)]
mod tests {
    use super::super::retreat::retreat_sq;
    use super::super::retreat::tests::for_each_pair;
    use super::*;
    use crate::mesh::{Mesh, shapes};

    /// A flat ring so thick, of `count` steps around a hole of radius 1 and within one of radius 3.
    fn washer(count: u32, thickness: f64) -> Mesh {
        let mut ring = shapes::torus(count, 4);
        for (v, p) in ring.positions.iter_mut().enumerate() {
            let (radius, up) = [(3.0, 0.0), (3.0, thickness), (1.0, thickness), (1.0, 0.0)][v % 4];
            let out = DVec3::new(p.x, p.y, 0.0).normalize() * radius;
            *p = DVec3::new(out.x, out.y, up);
        }
        ring
    }

    /// Steps around the hole of a washer.
    const STEPS: u32 = 24;

    #[test]
    fn a_rim_that_becomes_a_chord_goes_into_the_hole_and_no_other_pair_does() {
        // A chord of two steps, and how far its middle is from either step.
        let angle = std::f64::consts::TAU / f64::from(STEPS);
        let (step, chord) = (2.0 * (angle / 2.0).sin(), 2.0 * angle.sin());
        let height = (1.0 - angle.cos()) * (angle / 2.0).cos();
        let mut on_rim = 0;
        for_each_pair(&washer(STEPS, 0.01), |star, [u, w], pair, limit_sq| {
            let found = advance(star, pair, star.h, limit_sq);
            // The hole's rims are the third and fourth of every four vertices.
            if u % 4 == w % 4 && u % 4 >= 2 {
                let unit = 2.0 * star.h.length() / step;
                assert!((found.distance / unit - height).abs() < 1e-4, "{u} to {w}: {found:?}");
                let cost = chord * height.powi(3) / 6.0 * unit.powi(4);
                assert!((found.cost / cost - 1.0).abs() < 1e-2, "{u} to {w}: {found:?}, not {cost}");
                assert_eq!(retreat_sq(star, star.h, limit_sq).filter(|sq| sq.sqrt() > 0.1 * found.distance), None);
                on_rim += 1;
            } else {
                assert_eq!(found, Advance::default(), "{u} to {w}");
            }
        });
        assert_eq!(on_rim, 2 * 2 * STEPS);
    }

    #[test]
    fn a_vertex_that_goes_out_from_a_rim_is_as_far_as_it_went() {
        let mut on_rim = 0;
        for_each_pair(&washer(STEPS, 0.01), |star, [u, w], _, limit_sq| {
            let [length, up] = [2.0 * star.h.length(), star.h.z];
            // Of the outer rims, which run around the ring's axis.
            if u % 4 == w % 4 && u % 4 < 2 {
                let out = star.h.cross(DVec3::Z).normalize() * if (w / 4) == (u / 4 + 1) % STEPS { 0.5 } else { -0.5 };
                let away = away_from_faces(star, out * length, limit_sq).expect("out of the ring");
                assert!(up.abs() < 1e-6 && (away.distance / length - 0.5).abs() < 1e-3, "{u} to {w}: {away:?}");
                assert!(
                    (away.foot.distance(out * length) - away.distance).abs() < 1e-9 * length,
                    "{u} to {w}: {away:?}"
                );
                assert_eq!(away_from_faces(star, -out * length, limit_sq), None, "{u} to {w} goes in");
                on_rim += 1;
            }
        });
        assert_eq!(on_rim, 2 * 2 * STEPS);
    }

    #[test]
    fn a_vertex_away_from_its_faces_goes_where_both_costs_are_least() {
        let (mut nearer, mut at_foot) = (0, 0);
        for_each_pair(&washer(STEPS, 0.01), |star, [u, w], _, limit_sq| {
            let (quadric, length) = (Quadric::of_star(star), 2.0 * star.h.length());
            // Up to three lengths of the pair away, where the quadric asks for it and where it does not.
            for x in [DVec3::X, DVec3::Y, -DVec3::X].map(|axis| (axis + star.h / length) * 3.0 * length) {
                let Some(away) = away_from_faces(star, x, limit_sq) else { continue };
                let (drawn, distance) = drawn_back(&quadric, length, x, away);
                let cost = |t: f64| {
                    quadric.value(away.foot + (x - away.foot) * t) + length * (OUT * t * away.distance).powi(3) / 6.0
                };
                let t = distance / away.distance;
                assert!((away.foot + (x - away.foot) * t).distance(drawn) <= 1e-9 * length, "{u} to {w}");
                let least = (0..=100).map(|i| cost(f64::from(i) / 100.0)).fold(f64::INFINITY, f64::min);
                assert!(cost(t) <= least + 1e-9 * least.abs(), "{u} to {w}: {} at {t}, not {least}", cost(t));
                // A pair of no length costs nothing beside its quadric, whose least along the way may be at `x`.
                let (_, alone) = drawn_back(&quadric, 0.0, x, away);
                assert!(alone >= distance, "{u} to {w}: {alone}, {distance}");
                nearer += u32::from(0.0 < t && t < 1.0);
                at_foot += u32::from(t == 0.0);
            }
        });
        assert!(nearer > 100 && at_foot > 100, "{nearer}, {at_foot}");
    }

    #[test]
    fn who_leaves_a_crease_is_measured_from_its_chord() {
        let angle = std::f64::consts::TAU / f64::from(STEPS);
        let (mut across, mut along) = (0, 0);
        for_each_pair(&washer(STEPS, 0.01), |star, [u, w], pair, _| {
            let found = [0, 1].map(|end| leaving_crease(star, pair, end));
            // From rim to rim over the top, in units of the frame.
            if u / 4 == w / 4 && u % 4 + w % 4 == 3 && u % 4 != 0 && w % 4 != 0 {
                let unit = star.h.length();
                for (v, found) in [u, w].into_iter().zip(found) {
                    let radius = if v % 4 == 1 { 3.0 } else { 1.0 };
                    let height = radius * (1.0 - angle.cos());
                    let distance = found.distance / unit;
                    assert!((distance - height).abs() < 1e-3 * height, "{v}: {distance} {height}");
                    let chord = 2.0 * radius * angle.sin() * unit;
                    let cost = chord * found.distance.powi(3) / 6.0;
                    assert!((found.cost / cost - 1.0).abs() < 1e-3, "{v}: {found:?}, not {cost}");
                }
                across += 1;
            } else if u % 4 == w % 4 {
                assert_eq!(found, [Advance::default(); 2], "{u} to {w} goes along its crease");
                along += 1;
            }
        });
        assert!(across >= 2 * STEPS && along >= 8 * STEPS, "{across}, {along}");
    }

    #[test]
    fn rims_are_bent_and_what_is_smooth_is_not() {
        let around = |star: &Star| (0..star.faces().len()).map(|face| star.quads.normal(face)).sum();
        for_each_pair(&washer(STEPS, 0.01), |star, _, _, _| {
            assert!(is_bent(star, Some(around(star))) && is_bent(star, None))
        });
        for_each_pair(&shapes::icosphere(3), |star, _, _, _| assert!(!is_bent(star, Some(around(star)))));
    }

    #[test]
    fn a_crease_that_is_straight_goes_nowhere() {
        let mut straight = 0;
        // Of a corner, too, all that is new lies within the cube's faces or inside of it, as far from them as it retreats.
        for_each_pair(&shapes::cube(4), |star, _, pair, limit_sq| {
            let found = advance(star, pair, star.h, limit_sq);
            let retreat = retreat_sq(star, star.h, limit_sq).map_or(0.0, f64::sqrt);
            assert!(found.distance <= retreat, "{pair:?}: {found:?}, {retreat}");
            let [a, b] = [0, 1].map(|face| star.quads.normal(star.numbers_of_shared().start + face));
            straight += u32::from(a.dot(b) == 0.0 && retreat == 0.0);
        });
        // Twelve creases of four steps, whose ends next to a corner may take it along: seen from either face, one way each.
        assert!(straight >= 2 * 12 * 2, "{straight}");
    }
}
