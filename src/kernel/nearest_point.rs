//! The point of a triangle nearest to another. In WGSL: `shaders/shared/nearest_point.wgsl`.
//!
//! # Reference
//! \[Eri05\] section 5.1.5: by the regions of the triangle's corners and sides.

use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, add3, divide, dot3, flush, flush3, mul, scale3, sub, sub3};

/// Corner weights of the point of the triangle nearest to the origin: the corners are given about it.
#[inline(always)]
pub fn nearest_weights(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let a1 = flush(-dot3(ab, a), LEAST_FACTOR);
    let a2 = flush(-dot3(ac, a), LEAST_FACTOR);
    if a1 <= 0.0 && a2 <= 0.0 {
        return Vec3::new(1.0, 0.0, 0.0);
    }
    let b1 = flush(-dot3(ab, b), LEAST_FACTOR);
    let b2 = flush(-dot3(ac, b), LEAST_FACTOR);
    if b1 >= 0.0 && b2 <= b1 {
        return Vec3::new(0.0, 1.0, 0.0);
    }
    let wc = sub(mul(a1, b2), mul(b1, a2));
    if wc <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        let t = divide(a1, sub(a1, b1));
        return Vec3::new(sub(1.0, t), t, 0.0);
    }
    let c1 = flush(-dot3(ab, c), LEAST_FACTOR);
    let c2 = flush(-dot3(ac, c), LEAST_FACTOR);
    if c2 >= 0.0 && c1 <= c2 {
        return Vec3::new(0.0, 0.0, 1.0);
    }
    let wb = sub(mul(c1, a2), mul(a1, c2));
    if wb <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        let t = divide(a2, sub(a2, c2));
        return Vec3::new(sub(1.0, t), 0.0, t);
    }
    let wa = sub(mul(b1, c2), mul(c1, b2));
    let (b_to_c, c_to_b) = (sub(b2, b1), sub(c1, c2));
    if wa <= 0.0 && b_to_c >= 0.0 && c_to_b >= 0.0 {
        let t = divide(b_to_c, add(b_to_c, c_to_b));
        return Vec3::new(0.0, sub(1.0, t), t);
    }
    let sum = add(add(wa, wb), wc);
    let (u, v) = (divide(wb, sum), divide(wc, sum));
    Vec3::new(sub(sub(1.0, u), v), u, v)
}

/// The weighted mean of a triangle's corners.
#[inline(always)]
pub fn point_at(weights: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    add3(add3(scale3(a, weights.x), scale3(b, weights.y)), scale3(c, weights.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangle (0,0) (4,0) (0,4) seen from points over each of its regions.
    #[test]
    fn every_region_of_a_triangle() {
        let at = |x: f32, y: f32, z: f32| {
            let about = |px: f32, py: f32| Vec3::new(px - x, py - y, -z);
            nearest_weights(about(0.0, 0.0), about(4.0, 0.0), about(0.0, 4.0)).to_array()
        };
        assert_eq!(at(1.0, 1.0, 5.0), [0.5, 0.25, 0.25]);
        assert_eq!(at(-1.0, -2.0, 1.0), [1.0, 0.0, 0.0]);
        assert_eq!(at(6.0, -1.0, 0.0), [0.0, 1.0, 0.0]);
        assert_eq!(at(-1.0, 7.0, 0.0), [0.0, 0.0, 1.0]);
        assert_eq!(at(1.0, -3.0, 2.0), [0.75, 0.25, 0.0]);
        assert_eq!(at(-3.0, 1.0, 2.0), [0.75, 0.0, 0.25]);
        assert_eq!(at(4.0, 4.0, 1.0), [0.0, 0.5, 0.5]);
    }

    #[test]
    fn a_triangle_without_area_has_a_nearest_point_too() {
        let p = |x: f32| Vec3::new(x, 1.0, 0.0);
        for corners in [[p(2.0), p(2.0), p(2.0)], [p(-1.0), p(1.0), p(3.0)], [p(3.0), p(-1.0), p(1.0)]] {
            let [a, b, c] = corners;
            let weights = nearest_weights(a, b, c);
            assert!((weights.element_sum() - 1.0).abs() < 1e-6, "{weights}");
        }
    }
}
