//! Whether triangles pass through each other.

use crate::math::DVec3;

use super::triangle::{SLIVER, closest_point};

/// A triangle and its plane.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    corners: [DVec3; 3],
    normal: DVec3,
    touching: f64,
    /// How far from the plane, times the length of the normal, is on neither side.
    within: f64,
    /// How far from it, times that length, nothing lies that is on the triangle: what a sliver's plane tells is noise.
    beside: f64,
}

impl Triangle {
    /// With such corners; what is within `touching` of its plane is on neither side.
    pub fn of([a, b, c]: [DVec3; 3], touching: f64) -> Self {
        let (e, f) = (b - a, c - a);
        let normal = e.cross(f);
        let within = touching * normal.length();
        let is_sliver = normal.length_squared() <= SLIVER * e.length_squared() * f.length_squared();
        // Twice as far: of another corner rounding may tell somewhat less.
        let beside = if is_sliver { f64::INFINITY } else { 2.0 * within };
        Self { corners: [a, b, c], normal, touching, within, beside }
    }

    /// How far a point is from its plane, times the length of its normal.
    fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.corners[0])
    }

    /// That of the corners of another; `None` where it has them on one side.
    fn between(&self, other: &Self) -> Option<[f64; 3]> {
        let at = other.corners.map(|p| self.height(p));
        let is_before = at.iter().any(|&at| at < -self.within);
        let is_behind = at.iter().any(|&at| at > self.within);
        (is_before && is_behind).then_some(at)
    }

    /// Whether points so far from its plane are on either side.
    fn parts(&self, s: f64, t: f64) -> bool {
        s < -self.within && t > self.within || s > self.within && t < -self.within
    }

    /// Whether two pass through each other, by more than is on neither side of the plane of one. Those that share a corner do by the
    /// edges across from it alone, and those on an edge do not.
    pub fn crosses(&self, other: &Self) -> bool {
        let Some(from_own) = self.between(other) else { return false };
        let Some(from_other) = other.between(self) else { return false };
        let pierces = |from: [DVec3; 3], at: [f64; 3], through: &Self| {
            let sides = [0, 1, 2].map(|k| (k, (k + 1) % 3));
            sides.into_iter().any(|(s, t)| through.parts(at[s], at[t]) && passes(from[s], from[t], through.corners))
        };
        pierces(other.corners, from_own, self) || pierces(self.corners, from_other, other)
    }

    /// Whether a point lies on it, or touches it: [`lies_on`], told by its plane where that tells enough.
    pub fn has(&self, p: DVec3) -> bool {
        self.height(p).abs() <= self.beside && lies_on(p, self.corners, self.touching)
    }
}

/// Whether two triangles pass through each other: see [`Triangle::crosses`].
pub fn cross(a: [DVec3; 3], b: [DVec3; 3], within: f64) -> bool {
    Triangle::of(a, within).crosses(&Triangle::of(b, within))
}

/// Whether the line from one side of a triangle's plane to the other passes through the triangle, or its edge.
fn passes(s: DVec3, t: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let turn = |p: DVec3, q: DVec3| (t - s).dot((p - s).cross(q - s));
    let turns = [turn(a, b), turn(b, c), turn(c, a)];
    turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
}

/// Whether a point lies on a triangle, `within` that distance.
pub fn lies_on(p: DVec3, triangle: [DVec3; 3], within: f64) -> bool {
    let low = triangle.into_iter().fold(DVec3::INFINITY, DVec3::min) - within;
    let high = triangle.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max) + within;
    p.cmpge(low).all() && p.cmple(high).all() && closest_point(p, triangle).distance_sq <= within * within
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: f64 = 1e-6;
    const FLAT: [DVec3; 3] = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];

    fn triangle(corners: [[f64; 3]; 3]) -> [DVec3; 3] {
        corners.map(DVec3::from)
    }

    /// Whether both cross, whichever is named first and from whichever corner.
    fn both_cross(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
        let found = cross(a, b, NEAR);
        for [i, j, k] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1]] {
            assert_eq!(cross([a[i], a[j], a[k]], b, NEAR), found);
            assert_eq!(cross(b, [a[i], a[j], a[k]], NEAR), found);
        }
        found
    }

    #[test]
    fn triangles_cross_where_an_edge_passes_through_the_other() {
        // Its edge, its tip, and no more than its plane.
        assert!(both_cross(FLAT, triangle([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 0.0]])));
        assert!(both_cross(FLAT, triangle([[1.0, 1.0, -0.1], [-5.0, 1.0, 3.0], [9.0, 1.0, 3.0]])));
        assert!(!both_cross(FLAT, triangle([[5.0, 5.0, -1.0], [5.0, 5.0, 1.0], [9.0, 9.0, 0.0]])));
        assert!(!both_cross(FLAT, triangle([[1.0, 1.0, 0.1], [-5.0, 1.0, 3.0], [9.0, 1.0, 3.0]])));
        // Through an edge.
        assert!(both_cross(FLAT, triangle([[2.0, 0.0, -1.0], [2.0, 0.0, 1.0], [2.0, -5.0, 0.0]])));
    }

    #[test]
    fn triangles_that_share_corners_cross_by_what_is_across_from_them() {
        let [a, b, c] = FLAT;
        // On an edge, folded as far as can be.
        assert!(!both_cross(FLAT, [b, a, DVec3::new(1.0, 1.0, 1e-3)]));
        // At a corner.
        assert!(both_cross(FLAT, [a, DVec3::new(2.0, 1.0, -1.0), DVec3::new(2.0, 1.0, 1.0)]));
        assert!(!both_cross(FLAT, [a, DVec3::new(-2.0, 1.0, -1.0), DVec3::new(-2.0, 1.0, 1.0)]));
        assert!(!both_cross(FLAT, [a, b, c]));
    }

    #[test]
    fn what_only_touches_does_not_cross() {
        let standing = |z: f64| triangle([[1.0, 1.0, z], [1.0, 2.0, 3.0], [2.0, 1.0, 3.0]]);
        for (z, crosses, touches) in
            [(0.5, false, false), (0.0, false, true), (-5e-7, false, true), (-0.1, true, false)]
        {
            assert_eq!(both_cross(FLAT, standing(z)), crosses, "{z}");
            assert_eq!(lies_on(standing(z)[0], FLAT, NEAR), touches, "{z}");
        }
        // In one plane, one on the other.
        let beside = triangle([[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [1.0, 9.0, 0.0]]);
        assert!(!both_cross(FLAT, beside) && lies_on(beside[0], FLAT, NEAR) && !lies_on(beside[1], FLAT, NEAR));
        let told = |p: DVec3| Triangle::of(FLAT, NEAR).has(p);
        assert_eq!([0.0, 5e-7, -5e-7, 1.5e-6, -0.1, 0.5].map(|z| told(DVec3::new(1.0, 1.0, z))), {
            [true, true, true, false, false, false]
        });
        // A sliver's plane is noise: some have points of their own longest side far from it.
        for step in 1..100 {
            let along = DVec3::new(0.1, 0.7, 0.3) * f64::from(step);
            let sliver = Triangle::of([DVec3::ZERO, along, along * 1.1], NEAR);
            assert!((1..10).all(|tenth| sliver.has(along * (0.1 * f64::from(tenth)))), "{step}");
        }
        // Without area.
        assert!(!both_cross(FLAT, [DVec3::ZERO; 3]) && lies_on(DVec3::ZERO, [DVec3::ZERO; 3], NEAR));
    }
}
