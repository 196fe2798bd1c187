//! Which side of a line a point lies on, decided exactly; and the order that makes one point of a ring its top.

use std::cmp::Ordering;

use robust::{Coord, orient2d};

use crate::math::DVec2;

/// Above zero where `c` lies left of the line from `a` to `b`, below zero to the right, zero on it: the sign is exact.
pub fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Greater for what is above zero, less for what is below.
pub fn by_sign(turn: f64) -> Ordering {
    turn.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
}

/// The order of points from below to above, from left to right on one height \[Liu99\].
pub fn compare(a: DVec2, b: DVec2) -> Ordering {
    let key = |p: DVec2| (p.y, p.x);
    key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal)
}

/// Whether `a` comes after `b` in that order.
pub fn is_above(a: DVec2, b: DVec2) -> bool {
    compare(a, b).is_gt()
}

/// Whether the way from `at` to `to` starts inside the corner of a ring whose inside is to the left.
pub fn corner_holds([before, at, after]: [DVec2; 3], to: DVec2) -> bool {
    let [first, second] = [turn(before, at, to) > 0.0, turn(at, after, to) > 0.0];
    if turn(before, at, after) > 0.0 { first && second } else { first || second }
}

/// Whether `p` lies in the closed triangle, which is counter-clockwise.
pub fn triangle_holds([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
}

/// Whether two closed segments that share no end have a point in common.
pub fn segments_meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let [lower, upper] = [a.min(b).max(c.min(d)), a.max(b).min(c.max(d))];
    let apart = |p: f64, q: f64| (p > 0.0 && q > 0.0) || (p < 0.0 && q < 0.0);
    lower.cmple(upper).all() && !apart(turn(a, b, c), turn(a, b, d)) && !apart(turn(c, d, a), turn(c, d, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_exact() {
        // One unit in the last place beside the diagonal: naive arithmetic says zero.
        let near = DVec2::new(0.5 + f64::EPSILON / 2.0, 0.5);
        let (a, b) = (DVec2::splat(12.0), DVec2::splat(24.0));
        assert!(turn(a, b, DVec2::splat(0.5)) == 0.0 && turn(a, b, near) < 0.0 && turn(b, a, near) > 0.0);
    }

    #[test]
    fn corners_hold_what_lies_inside() {
        let [east, north, origin] = [DVec2::X, DVec2::Y, DVec2::ZERO];
        let convex = |p| corner_holds([north, origin, east], p);
        assert!(convex(DVec2::ONE) && !convex(east) && !convex(north) && !convex(-DVec2::ONE) && !convex(-east));
        let reflex = |p| corner_holds([east, origin, north], p);
        assert!(!reflex(DVec2::ONE) && !reflex(east) && !reflex(north) && reflex(-DVec2::ONE) && reflex(-east));
        let straight = |p| corner_holds([-east, origin, east], p);
        assert!(straight(north) && !straight(-north) && !straight(east) && !straight(-east));
    }

    #[test]
    fn segments_meet_where_they_touch() {
        let p = |x: i32, y: i32| DVec2::new(f64::from(x), f64::from(y));
        let side = [p(0, 0), p(4, 0)];
        assert!(segments_meet(side, [p(2, -1), p(2, 1)]));
        assert!(segments_meet(side, [p(2, 0), p(2, 1)]));
        assert!(segments_meet(side, [p(3, 0), p(6, 0)]));
        assert!(!segments_meet(side, [p(5, 0), p(6, 0)]));
        assert!(!segments_meet(side, [p(2, 1), p(3, 1)]));
        assert!(!segments_meet(side, [p(5, -1), p(5, 1)]));
    }
}
