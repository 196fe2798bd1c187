//! The point of a triangle that is closest to a point, in double precision.

use crate::math::DVec3;

/// The closest point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Squared distance to it.
    pub distance_sq: f64,
    /// Its weights at the three corners: none negative, their sum 1.
    pub weights: [f64; 3],
}

/// Below this share of |e|²|f|², |e × f|² says that the triangle is a sliver: its angle at `a` is below 1e-5 and the
/// products that tell the regions apart may have lost all digits.
pub(super) const SLIVER: f64 = 1e-10;

/// The point of the triangle `a`, `b`, `c` closest to `p`: a corner, a point of an edge, or inside, by the region that `p`
/// is in (seven of them).
///
/// A sliver is also taken edge by edge and the closest of all is given, so that a triangle without area is exactly its
/// longest segment, or a point.
pub fn closest_point(p: DVec3, [a, b, c]: [DVec3; 3]) -> Nearest {
    let (e, f) = (b - a, c - a);
    let (from_a, from_b, from_c) = (p - a, p - b, p - c);
    if e.cross(f).length_squared() <= SLIVER * e.length_squared() * f.length_squared() {
        return of_sliver(p, [a, b, c]);
    }
    let (e_a, f_a) = (e.dot(from_a), f.dot(from_a));
    if e_a <= 0.0 && f_a <= 0.0 {
        return Nearest { distance_sq: from_a.length_squared(), weights: [1.0, 0.0, 0.0] };
    }
    let (e_b, f_b) = (e.dot(from_b), f.dot(from_b));
    if e_b >= 0.0 && f_b <= e_b {
        return Nearest { distance_sq: from_b.length_squared(), weights: [0.0, 1.0, 0.0] };
    }
    let (e_c, f_c) = (e.dot(from_c), f.dot(from_c));
    if f_c >= 0.0 && e_c <= f_c {
        return Nearest { distance_sq: from_c.length_squared(), weights: [0.0, 0.0, 1.0] };
    }
    // Areas opposite the corners, times twice the area of all.
    let at_c = e_a * f_b - e_b * f_a;
    if at_c <= 0.0 && e_a >= 0.0 && e_b <= 0.0 {
        let t = e_a / (e_a - e_b);
        return Nearest { distance_sq: (from_a - e * t).length_squared(), weights: [1.0 - t, t, 0.0] };
    }
    let at_b = e_c * f_a - e_a * f_c;
    if at_b <= 0.0 && f_a >= 0.0 && f_c <= 0.0 {
        let t = f_a / (f_a - f_c);
        return Nearest { distance_sq: (from_a - f * t).length_squared(), weights: [1.0 - t, 0.0, t] };
    }
    let at_a = e_b * f_c - e_c * f_b;
    let (toward_c, toward_b) = (f_b - e_b, e_c - f_c);
    if at_a <= 0.0 && toward_c >= 0.0 && toward_b >= 0.0 {
        let t = toward_c / (toward_c + toward_b);
        return Nearest { distance_sq: (from_b - (c - b) * t).length_squared(), weights: [0.0, 1.0 - t, t] };
    }
    let total = at_a + at_b + at_c;
    let (v, w) = (at_b / total, at_c / total);
    Nearest { distance_sq: (from_a - e * v - f * w).length_squared(), weights: [(1.0 - v - w).max(0.0), v, w] }
}

/// The closest of the three edges and of the inside, where that can be told.
fn of_sliver(p: DVec3, [a, b, c]: [DVec3; 3]) -> Nearest {
    let mut least = inside(p, [a, b, c]);
    for (i, [s, e]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
        let (distance_sq, t) = closest_on_segment(p, s, e);
        if distance_sq < least.distance_sq {
            let mut weights = [0.0; 3];
            weights[i] = 1.0 - t;
            weights[(i + 1) % 3] = t;
            least = Nearest { distance_sq, weights };
        }
    }
    least
}

/// The foot of `p` on the triangle's plane, if it is inside; corner `a` otherwise.
fn inside(p: DVec3, [a, b, c]: [DVec3; 3]) -> Nearest {
    let (e, f) = (b - a, c - a);
    let n = e.cross(f);
    let n_sq = n.length_squared();
    let from_a = p - a;
    let (v, w) = (from_a.cross(f).dot(n) / n_sq, e.cross(from_a).dot(n) / n_sq);
    // Not a number where the area is zero: then no comparison holds.
    if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
        let distance_sq = (from_a - e * v - f * w).length_squared();
        return Nearest { distance_sq, weights: [1.0 - v - w, v, w] };
    }
    Nearest { distance_sq: from_a.length_squared(), weights: [1.0, 0.0, 0.0] }
}

/// Squared distance from `p` to the segment and where along it, 0 at `s` and 1 at `e`.
pub fn closest_on_segment(p: DVec3, s: DVec3, e: DVec3) -> (f64, f64) {
    let along = e - s;
    let t = (p - s).dot(along) / along.length_squared();
    // Not a number for a point: then it is `s`.
    if t >= 1.0 {
        (p.distance_squared(e), 1.0)
    } else if t > 0.0 {
        ((p - s - along * t).length_squared(), t)
    } else {
        (p.distance_squared(s), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];

    fn at(x: f64, y: f64, z: f64) -> (f64, [f64; 3]) {
        let Nearest { distance_sq, weights } = closest_point(DVec3::new(x, y, z), TRIANGLE);
        (distance_sq, weights)
    }

    #[test]
    fn every_region_has_its_nearest_point() {
        assert_eq!(at(1.0, 1.0, 3.0), (9.0, [0.5, 0.25, 0.25]), "inside");
        assert_eq!(at(-1.0, -2.0, 2.0), (9.0, [1.0, 0.0, 0.0]), "a");
        assert_eq!(at(6.0, -1.0, 2.0), (9.0, [0.0, 1.0, 0.0]), "b");
        assert_eq!(at(-2.0, 5.0, 2.0), (9.0, [0.0, 0.0, 1.0]), "c");
        assert_eq!(at(1.0, -3.0, 4.0), (25.0, [0.75, 0.25, 0.0]), "ab");
        assert_eq!(at(-3.0, 2.0, -4.0), (25.0, [0.5, 0.0, 0.5]), "ca");
        assert_eq!(at(4.0, 4.0, 0.0), (8.0, [0.0, 0.5, 0.5]), "bc");
    }

    #[test]
    fn a_point_on_the_triangle_is_at_zero() {
        for p in TRIANGLE {
            assert_eq!(closest_point(p, TRIANGLE).distance_sq, 0.0);
        }
        assert_eq!(at(1.0, 2.0, 0.0).0, 0.0);
        assert_eq!(at(2.0, 2.0, 0.0).0, 0.0);
    }

    #[test]
    fn triangles_without_area_are_segments_and_points() {
        let (o, x) = (DVec3::ZERO, DVec3::X);
        let p = DVec3::new(0.25, 3.0, 4.0);
        for corners in [[o, x, x], [x, o, o], [o, x, o], [o, 0.5 * x, x], [x, o, 0.5 * x], [0.25 * x, o, x]] {
            let nearest = closest_point(p, corners);
            assert_eq!(nearest.distance_sq, 25.0, "{corners:?}");
            let q: DVec3 = nearest.weights.iter().zip(corners).map(|(&w, corner)| corner * w).sum();
            assert_eq!(q, 0.25 * x, "{corners:?}");
        }
        assert_eq!(closest_point(DVec3::new(2.0, 0.0, 1.0), [o, x, 0.5 * x]).distance_sq, 2.0);
        assert_eq!(closest_point(p, [x; 3]), Nearest { distance_sq: 25.5625, weights: [1.0, 0.0, 0.0] });
    }

    /// The plain products of a sliver cancel: its distance must still be that of the segment it nearly is.
    #[test]
    fn slivers_keep_their_digits() {
        for thin in [1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-18] {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, thin, 0.0)];
            for p in [DVec3::new(0.3, 0.7, 0.2), DVec3::new(-0.5, -0.1, 0.3), DVec3::new(0.6, 0.0, 0.4)] {
                let segment = closest_on_segment(p, DVec3::ZERO, DVec3::X).0.sqrt();
                let distance = closest_point(p, corners).distance_sq.sqrt();
                assert!(distance <= segment && distance >= segment - thin, "{thin} {p}: {distance} {segment}");
            }
        }
    }
}
