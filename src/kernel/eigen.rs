//! Eigenvalues and eigenvectors of a symmetric 3×3 matrix by Jacobi's rotations. In WGSL: `shaders/shared/eigen.wgsl`.
//!
//! A fixed number of rotations in a fixed order, of additions, products, quotients and roots only: the same bits on every
//! device.

use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{Sym3, add, add3, divide, flush, flush3, mul, root, scale3, sub, sub3};

/// Sweeps over the three entries off the diagonal: four leave nothing above [`NEGLIGIBLE`] of a million random matrices,
/// with any eigenvalues twice or thrice.
pub const SWEEPS: u32 = 4;
/// Entries off the diagonal below this are zero, in a matrix of trace about 1. No product of a rotation underflows then.
pub const NEGLIGIBLE: f32 = f32::from_bits((127 - 30) << 23);
/// The constants above under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] =
    &[("SWEEPS", Constant::U32(SWEEPS)), ("NEGLIGIBLE", Constant::F32(NEGLIGIBLE))];

/// Eigenvalues in no order, and a unit eigenvector of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eigen {
    /// The eigenvalues.
    pub values: Vec3,
    /// Of the first.
    pub x: Vec3,
    /// Of the second.
    pub y: Vec3,
    /// Of the third.
    pub z: Vec3,
}

/// What a rotation in the plane of p and q changes: their 2×2 block, the row of the third axis, the eigenvectors.
#[derive(Debug, Clone, Copy)]
struct Turn {
    pp: f32,
    pq: f32,
    qq: f32,
    rp: f32,
    rq: f32,
    p: Vec3,
    q: Vec3,
}

/// The rotation by at most an eighth of a turn that makes `pq` zero.
#[inline(always)]
fn turned(t: Turn) -> Turn {
    let cot = divide(sub(t.qq, t.pp), mul(2.0, t.pq));
    let tangent_abs = divide(1.0, add(cot.abs(), root(add(mul(cot, cot), 1.0))));
    // Without an entry there is no rotation.
    let signed = if cot < 0.0 { -tangent_abs } else { tangent_abs };
    let tangent = if t.pq == 0.0 { 0.0 } else { signed };
    let cosine = divide(1.0, root(add(mul(tangent, tangent), 1.0)));
    let sine = mul(tangent, cosine);
    let shift = mul(tangent, t.pq);
    Turn {
        pp: sub(t.pp, shift),
        pq: 0.0,
        qq: add(t.qq, shift),
        rp: flush(sub(mul(cosine, t.rp), mul(sine, t.rq)), NEGLIGIBLE),
        rq: flush(add(mul(sine, t.rp), mul(cosine, t.rq)), NEGLIGIBLE),
        p: flush3(sub3(scale3(t.p, cosine), scale3(t.q, sine)), NEGLIGIBLE),
        q: flush3(add3(scale3(t.p, sine), scale3(t.q, cosine)), NEGLIGIBLE),
    }
}

/// The eigenvalues and eigenvectors of a matrix of trace about 1.
#[inline(always)]
pub fn eigen(m: Sym3) -> Eigen {
    let (mut xx, mut yy, mut zz) = (m.xx, m.yy, m.zz);
    let mut xy = flush(m.xy, NEGLIGIBLE);
    let mut xz = flush(m.xz, NEGLIGIBLE);
    let mut yz = flush(m.yz, NEGLIGIBLE);
    let (mut x, mut y, mut z) = (Vec3::X, Vec3::Y, Vec3::Z);
    for _ in 0..SWEEPS {
        let t = turned(Turn { pp: xx, pq: xy, qq: yy, rp: xz, rq: yz, p: x, q: y });
        (xx, xy, yy, xz, yz, x, y) = (t.pp, t.pq, t.qq, t.rp, t.rq, t.p, t.q);
        let t = turned(Turn { pp: xx, pq: xz, qq: zz, rp: xy, rq: yz, p: x, q: z });
        (xx, xz, zz, xy, yz, x, z) = (t.pp, t.pq, t.qq, t.rp, t.rq, t.p, t.q);
        let t = turned(Turn { pp: yy, pq: yz, qq: zz, rp: xy, rq: xz, p: y, q: z });
        (yy, yz, zz, xy, xz, y, z) = (t.pp, t.pq, t.qq, t.rp, t.rq, t.p, t.q);
    }
    Eigen { values: Vec3::new(xx, yy, zz), x, y, z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::exact::{dot3, outer, sym_add, sym_mul, sym_scale, trace};

    fn check(m: Sym3) {
        let Eigen { values, x, y, z } = eigen(m);
        for (value, v) in values.to_array().into_iter().zip([x, y, z]) {
            assert!((sym_mul(m, v) - v * value).length() < 1e-6, "{m:?}: {value} of {v}");
            assert!((dot3(v, v) - 1.0).abs() < 2e-6, "{m:?}: {v}");
        }
        assert!(dot3(x, y).abs() < 1e-6 && dot3(y, z).abs() < 1e-6 && dot3(z, x).abs() < 1e-6, "{m:?}");
        assert!((values.element_sum() - trace(m)).abs() < 1e-6, "{m:?}: {values}");
    }

    #[test]
    fn known_matrices() {
        let diagonal = eigen(Sym3::new(0.5, 0.0, 0.0, 0.3, 0.0, 0.2));
        assert_eq!((diagonal.values, diagonal.x), (Vec3::new(0.5, 0.3, 0.2), Vec3::X));
        // n nᵀ with n = (0, 3, 4)/5.
        let one = eigen(outer(Vec3::new(0.0, 0.6, 0.8)));
        assert!((one.values.max_element() - 1.0).abs() < 1e-6 && one.values.min_element().abs() < 1e-6);
        assert_eq!(one.x, Vec3::X);
        check(Sym3::default());
        let third = 1.0 / 3.0;
        check(Sym3::new(third, 0.0, 0.0, third, 0.0, third));
        check(Sym3::new(third, third, third, third, third, third));
    }

    #[test]
    fn sums_of_planes_are_decomposed() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        for planes in (1..=5).cycle().take(20_000) {
            let mut m = Sym3::default();
            for _ in 0..planes {
                // Some nearly the same, some of hardly any weight.
                let n = Vec3::new(next(), next() * next().abs().powi(8), next()).normalize_or_zero();
                m = sym_add(m, sym_scale(outer(n), next().abs().powi(12)));
            }
            if trace(m) > 1e-20 {
                check(sym_scale(m, 1.0 / trace(m)));
            }
        }
    }
}
