//! The quadric of a pair about its midpoint, its least point and its cost: what both metrics share. In WGSL:
//! `shaders/shared/pair_quadric.wgsl`.

use super::pairs::NO_FACE;
use super::rows::{BORDER, CORNER, HUB, JOINED, LOCKED, SEAM};
use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{
    LEAST, Sym3, add, add3, divide, dot3, flush, mul, scale3, sub, sym_add, sym_mul, sym_scale, sym_sub, trace,
};

/// A placement farther from the midpoint than this many half pairs is not trusted.
pub const REACH: f32 = 4.0;
/// The volume constraint holds when |Σn|² is more than this share of (Σ|n|)²: below, the two sides of a thin sheet cancel.
pub const CONSTRAINT: f32 = 1e-3;
/// Costs below this share of the trace are rounding noise and count as 0.
pub const NOISE: f32 = 1e-18;
/// Traces below this are of faces without area.
pub const NO_AREA: f32 = 1e-30;
/// Weights below this are of faces whose costs would underflow.
pub const NO_WEIGHT: f32 = 1e-11;
/// Greatest cost: infinity does not exist in WGSL.
pub const GREATEST: f32 = 3.0e38;
/// A third, rounded.
pub const THIRD: f32 = 1.0 / 3.0;
/// The key of what is no candidate: above that of every cost.
pub const NO_KEY: u32 = 0x7f80_0000;
/// A placement may be anywhere near.
pub const ANYWHERE: u32 = 0;
/// A placement lies between the ends.
pub const ON_SEGMENT: u32 = 1;
/// A placement is an end or the midpoint.
pub const AT_THREE: u32 = 2;
/// A placement is an end.
pub const AT_ENDS: u32 = 3;
/// The constants above under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("REACH", Constant::F32(REACH)),
    ("CONSTRAINT", Constant::F32(CONSTRAINT)),
    ("NOISE", Constant::F32(NOISE)),
    ("NO_AREA", Constant::F32(NO_AREA)),
    ("NO_WEIGHT", Constant::F32(NO_WEIGHT)),
    ("GREATEST", Constant::F32(GREATEST)),
    ("ON_SEGMENT", Constant::U32(ON_SEGMENT)),
    ("AT_THREE", Constant::U32(AT_THREE)),
    ("AT_ENDS", Constant::U32(AT_ENDS)),
    ("NO_KEY", Constant::U32(NO_KEY)),
    ("THIRD", Constant::F32(THIRD)),
    ("NO_FACE", Constant::U32(NO_FACE)),
    ("HUB", Constant::U32(HUB)),
    ("BORDER", Constant::U32(BORDER)),
    ("JOINED", Constant::U32(JOINED)),
    ("LOCKED", Constant::U32(LOCKED)),
    ("SEAM", Constant::U32(SEAM)),
    ("CORNER", Constant::U32(CORNER)),
];

/// xᵀA x − 2 b·x + c about the midpoint, and the plane n·x = d on which the volume is kept (none when n is 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairQuadric {
    /// A, positive semidefinite.
    pub a: Sym3,
    /// b.
    pub b: Vec3,
    /// c.
    pub c: f32,
    /// n.
    pub n: Vec3,
    /// d.
    pub d: f32,
}

/// Where a pair may go: flags of its ends and the policies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Freedom {
    /// The first end may not move.
    pub first_locked: bool,
    /// The second end may not move.
    pub second_locked: bool,
    /// [`ANYWHERE`], [`ON_SEGMENT`], [`AT_THREE`] or [`AT_ENDS`].
    pub placement: u32,
    /// Pulls the placement to the midpoint, as a share of the trace: bounds it on flats and creases, where the least is
    /// a plane or a line.
    pub regularization: f32,
}

/// Whether an end of these flags stays beside another of those: one on a seam may only move along it, and one where seams
/// meet only to another such.
#[inline(always)]
pub fn stays(own: u32, other: u32) -> bool {
    own & LOCKED != 0 || own & !other & (SEAM | CORNER) != 0
}

/// The quadric's value.
#[inline(always)]
pub fn value(q: PairQuadric, x: Vec3) -> f32 {
    add(sub(dot3(x, sym_mul(q.a, x)), mul(2.0, dot3(q.b, x))), q.c)
}

/// k + 64 for a positive normal number in [2²ᵏ⁻¹, 2²ᵏ⁺¹).
#[inline(always)]
pub fn half_exponent(x: f32) -> u32 {
    (((x.to_bits() >> 23) & 0xff) + 2) >> 1
}

/// 2⁻ᵏ for a half exponent: multiplying by it rounds nothing.
#[inline(always)]
pub fn scale_down(half: u32) -> f32 {
    f32::from_bits((191 - half) << 23)
}

/// 2ᵏ for a half exponent.
#[inline(always)]
pub fn scale_up(half: u32) -> f32 {
    f32::from_bits((63 + half) << 23)
}

/// The quadric whose value is s² times that of `q` and whose constraint is the same plane.
#[inline(always)]
pub fn scaled(q: PairQuadric, s: f32) -> PairQuadric {
    let s_sq = mul(s, s);
    PairQuadric { a: sym_scale(q.a, s_sq), b: scale3(q.b, s_sq), c: mul(q.c, s_sq), n: scale3(q.n, s), d: mul(q.d, s) }
}

/// The least point of a quadric of trace about 1, on its constraint where there is one: L D Lᵀ of the regularized
/// matrix, which needs no pivots.
#[inline(always)]
pub fn least(q: PairQuadric, regularization: f32) -> Vec3 {
    let t = trace(q.a);
    let r = mul(regularization, t);
    let r0 = divide(1.0, add(q.a.xx, r));
    let l1 = mul(q.a.xy, r0);
    let l2 = mul(q.a.xz, r0);
    let r1 = divide(1.0, sub(add(q.a.yy, r), mul(l1, q.a.xy)));
    let m = sub(q.a.yz, mul(l2, q.a.xy));
    let l3 = mul(m, r1);
    let r2 = divide(1.0, sub(sub(add(q.a.zz, r), mul(l2, q.a.xz)), mul(l3, m)));

    // A y = b.
    let b1 = sub(q.b.y, mul(l1, q.b.x));
    let b2 = sub(sub(q.b.z, mul(l2, q.b.x)), mul(l3, b1));
    let yz = mul(b2, r2);
    let yy = sub(mul(b1, r1), mul(l3, yz));
    let yx = sub(sub(mul(q.b.x, r0), mul(l1, yy)), mul(l2, yz));
    let y = Vec3::new(yx, yy, yz);
    if dot3(q.n, q.n) <= mul(CONSTRAINT, mul(t, t)) {
        return y;
    }

    // A z = n; x = y + z (d − n·y)/(n·z).
    let n1 = sub(q.n.y, mul(l1, q.n.x));
    let n2 = sub(sub(q.n.z, mul(l2, q.n.x)), mul(l3, n1));
    let zz = mul(n2, r2);
    let zy = sub(mul(n1, r1), mul(l3, zz));
    let zx = sub(sub(mul(q.n.x, r0), mul(l1, zy)), mul(l2, zz));
    let z = Vec3::new(zx, zy, zz);
    add3(y, scale3(z, divide(sub(q.d, dot3(q.n, y)), dot3(q.n, z))))
}

/// The cost of the best allowed placement of a pair from −h to h.
///
/// Fallback: a least point that is too far away gives way to the best of the ends and the midpoint. On the segment the
/// volume is not kept: it is a line, and the constraint a plane that seldom crosses it near.
#[inline(always)]
pub fn pair_cost(q: PairQuadric, h: Vec3, freedom: Freedom) -> f32 {
    let at_first = value(q, scale3(h, -1.0));
    let at_second = value(q, h);
    let at_ends = at_first.min(at_second);
    let x = least(q, freedom.regularization);
    let near = dot3(x, x) <= mul(mul(REACH, REACH), dot3(h, h));
    let at_three = q.c.min(at_ends);
    let along = divide(dot3(q.b, h), dot3(h, sym_mul(q.a, h))).clamp(-1.0, 1.0);
    let on_segment = value(q, scale3(h, along)).min(at_three);
    let mut cost = if near { value(q, x) } else { at_three };
    cost = if freedom.placement == ON_SEGMENT { on_segment } else { cost };
    cost = if freedom.placement == AT_THREE { at_three } else { cost };
    cost = if freedom.placement == AT_ENDS { at_ends } else { cost };
    cost = if freedom.first_locked { at_first } else { cost };
    cost = if freedom.second_locked { at_second } else { cost };
    if cost > NOISE { cost } else { 0.0 }
}

/// The key of a cost: its bits, which order as costs do.
#[inline(always)]
pub fn cost_key(cost: f32) -> u32 {
    flush(cost.min(GREATEST), LEAST).to_bits()
}

/// A with the terms of both ends, the mutual ones counted once; b and c from half the pair.
///
/// Every plane of the first end has d = −n·h about the midpoint and every plane of the second d = n·h; the mutual ones
/// hold both ends, so n·h = 0.
#[inline(always)]
pub fn end_matrices(first: Sym3, second: Sym3, mutual: Sym3, h: Vec3) -> PairQuadric {
    let both = sym_add(first, second);
    PairQuadric {
        a: sym_sub(both, mutual),
        b: sym_mul(sym_sub(second, first), h),
        c: dot3(h, sym_mul(both, h)),
        n: Vec3::ZERO,
        d: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_exact_powers_of_two() {
        for x in [1.0_f32, 1.5, 2.0, 3.9, 4.0, 1e-20, 7e19, 0.25, 0.4] {
            let half = half_exponent(x);
            let (down, up) = (scale_down(half), scale_up(half));
            assert_eq!(down * up, 1.0);
            assert!((0.5..2.0).contains(&(x * down * down)), "{x} scales to {}", x * down * down);
        }
    }

    #[test]
    fn least_of_three_planes_is_their_corner() {
        // Planes x = 1, y = 2, z = 0 with weight 1/3 each: trace 1.
        let third = 1.0 / 3.0;
        let q = PairQuadric {
            a: Sym3 { xx: third, yy: third, zz: third, ..Sym3::default() },
            b: Vec3::new(third, 2.0 * third, 0.0),
            c: 5.0 * third,
            n: Vec3::ZERO,
            d: 0.0,
        };
        let x = least(q, 1e-4);
        assert!((x - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-3, "{x}");
        assert!(value(q, x) < 1e-6);
    }

    #[test]
    fn policies_allow_less_and_cost_more() {
        // Planes z = 0.3 and x = 0.5 about a pair along x: free in y, and off the segment by 0.3.
        let q = PairQuadric {
            a: Sym3 { xx: 0.5, zz: 0.5, ..Sym3::default() },
            b: Vec3::new(0.25, 0.0, 0.15),
            c: 0.125 + 0.045,
            n: Vec3::ZERO,
            d: 0.0,
        };
        let cost = |placement| {
            let freedom = Freedom { first_locked: false, second_locked: false, placement, regularization: 1e-6 };
            pair_cost(q, Vec3::X, freedom)
        };
        let expected = [(ANYWHERE, 0.0), (ON_SEGMENT, 0.045), (AT_THREE, 0.17), (AT_ENDS, 0.17)];
        for (placement, expected) in expected {
            assert!((cost(placement) - expected).abs() < 1e-5, "{placement}: {} for {expected}", cost(placement));
        }
        let locked = Freedom { first_locked: true, second_locked: false, placement: ANYWHERE, regularization: 1e-6 };
        assert!((pair_cost(q, Vec3::X, locked) - (0.5 * 2.25 + 0.045)).abs() < 1e-5);
    }

    #[test]
    fn constraint_is_kept_on_a_flat() {
        let q = PairQuadric {
            a: Sym3 { zz: 1.0, ..Sym3::default() },
            b: Vec3::new(0.0, 0.0, 0.3),
            c: 0.09,
            n: Vec3::new(0.0, 0.0, 1.0),
            d: 0.3,
        };
        assert!((least(q, 1e-4) - Vec3::new(0.0, 0.0, 0.3)).length() < 1e-6);
    }

    #[test]
    fn cost_keys_order_as_costs() {
        let costs = [0.0, 1e-30, 1e-3, 1.0, 7.5, 1e30, f32::INFINITY];
        assert!(costs.map(cost_key).is_sorted());
        assert!(cost_key(f32::INFINITY) < u32::MAX);
    }
}
