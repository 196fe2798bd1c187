//! Accumulated quadrics, moved and added. In WGSL: `shaders/shared/plane_quadric.wgsl`.

use super::rows::PlaneQuadric;
use crate::math::Vec3;
use crate::math::exact::{Sym3, add, add3, dot3, mul, sym_add, sym_mul};

/// A quadric about a point other than its own: xᵀA x + 2 b·x + c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedQuadric {
    /// A.
    pub a: Sym3,
    /// b.
    pub b: Vec3,
    /// c.
    pub c: f32,
}

/// A quadric about the point `at` away from its own: q(y) with y = x + `at`.
#[inline(always)]
pub fn moved(quadric: PlaneQuadric, at: Vec3) -> MovedQuadric {
    let a = quadric.matrix();
    let linear = quadric.linear();
    let a_at = sym_mul(a, at);
    MovedQuadric { a, b: add3(linear, a_at), c: add(add(quadric.c, mul(2.0, dot3(linear, at))), dot3(at, a_at)) }
}

/// The sum of two quadrics about the same point.
#[inline(always)]
pub fn sum_moved(first: MovedQuadric, second: MovedQuadric) -> MovedQuadric {
    MovedQuadric { a: sym_add(first.a, second.a), b: add3(first.b, second.b), c: add(first.c, second.c) }
}
