//! Arithmetic whose bits do not depend on the device. Twin: `shaders/shared/exact.wgsl`, line for line except
//! [`divide`] and [`root`], which the host has in hardware.
//!
//! Here it is plain `f32` arithmetic in a fixed order; there every result passes a barrier against fusing and
//! reordering, and division and square root are put right to the last bit.
//!
//! # Underflow
//! A device may take numbers below 2⁻¹²⁶ for zero. [`divide`] and [`root`] do so on both sides; the rest does not test
//! for it, to stay fast. A kernel therefore [`flush`]es normals and border edges at [`LEAST_FACTOR`] before it squares
//! them, what it stores of longer sums at [`LEAST_SUM`], and costs at [`LEAST`]. Infinities and NaN have no place
//! here: they end in some number, the same or not.

#![expect(clippy::inline_always, reason = "each is one to a dozen instructions of a kernel's inner loop")]

use bytemuck::{Pod, Zeroable};

use super::Vec3;

/// The least magnitude that arithmetic keeps: one binary order above the least normal number, so that no device's way
/// of rounding at the edge shows.
pub const LEAST: f32 = f32::from_bits(2 << 23);

/// Factors are at least this or zero where their product must not underflow: products of two, and sums of such, are
/// multiples of 2⁻¹¹⁹.
pub const LEAST_FACTOR: f32 = f32::from_bits((127 - 48) << 23);
/// Sums below this are zero where a term may have underflowed: above, such a term is far below the last digit.
pub const LEAST_SUM: f32 = f32::from_bits((127 - 96) << 23);

/// `x`: the barrier of the shader, of no use on the host.
#[inline(always)]
pub fn keep(x: f32) -> f32 {
    x
}

/// The angle in 0 ..= π whose cotangent is `x`, off by at most 3 · 10⁻⁷.
///
/// The polynomial is atan(y)/y by y², for y in 0 ..= 1, with the least greatest relative error, 2 · 10⁻⁸.
#[inline(always)]
pub fn arccot(x: f32) -> f32 {
    let is_wide = x.abs() <= 1.0;
    let y = if is_wide { x } else { divide(1.0, x) };
    let s = mul(y, y);
    let mut p = 0.002_849_888_3;
    p = add(mul(p, s), -0.016_068_624);
    p = add(mul(p, s), 0.042_691_51);
    p = add(mul(p, s), -0.075_042_94);
    p = add(mul(p, s), 0.106_409_33);
    p = add(mul(p, s), -0.142_036_44);
    p = add(mul(p, s), 0.199_926_2);
    p = add(mul(p, s), -0.333_330_72);
    p = add(mul(p, s), 1.0);
    let arc = mul(y, p);
    let of_narrow = if x < 0.0 { add(std::f32::consts::PI, arc) } else { arc };
    if is_wide { sub(std::f32::consts::FRAC_PI_2, arc) } else { of_narrow }
}

/// a + b.
#[inline(always)]
pub fn add(a: f32, b: f32) -> f32 {
    keep(a + b)
}

/// a − b.
#[inline(always)]
pub fn sub(a: f32, b: f32) -> f32 {
    keep(a - b)
}

/// a·b.
#[inline(always)]
pub fn mul(a: f32, b: f32) -> f32 {
    keep(a * b)
}

/// `x`, or positive zero where its magnitude is below `least`.
#[inline(always)]
pub fn flush(x: f32, least: f32) -> f32 {
    if x.abs() < least { 0.0 } else { x }
}

/// a / b, correctly rounded; zero when either is below [`LEAST`] or the quotient is, the greatest finite number instead
/// of an infinity.
#[inline(always)]
pub fn divide(a: f32, b: f32) -> f32 {
    if a.abs() < LEAST || b.abs() < LEAST {
        return 0.0;
    }
    flush((a / b).clamp(f32::MIN, f32::MAX), LEAST)
}

/// √x, correctly rounded; zero when x is below [`LEAST`] or negative.
#[inline(always)]
pub fn root(x: f32) -> f32 {
    if x < LEAST { 0.0 } else { x.sqrt() }
}

/// The bits of √½.
const ROOT_HALF: i32 = 0x3f35_04f3;

/// log₂x, off by at most 1.5 · 10⁻⁷ of the greater of it and 1; exact for powers of two, zero when x is below [`LEAST`].
///
/// The polynomial is log₂(1 + f)/f for f in √½ − 1 ..= √2 − 1 with the least greatest relative error, 3 · 10⁻⁸.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    // x = 2ᵏ(1 + f).
    let above = (x.to_bits() as i32).wrapping_sub(ROOT_HALF);
    let k = (above >> 23) as f32;
    let f = sub(f32::from_bits(((above & 0x7f_ffff) + ROOT_HALF) as u32), 1.0);
    let mut p = 0.125_837_01;
    p = add(mul(p, f), -0.207_269_73);
    p = add(mul(p, f), 0.215_715_6);
    p = add(mul(p, f), -0.238_944_83);
    p = add(mul(p, f), 0.287_916_24);
    p = add(mul(p, f), -0.360_703_68);
    p = add(mul(p, f), 0.480_910_63);
    p = add(mul(p, f), -0.721_347_33);
    p = add(mul(p, f), std::f32::consts::LOG2_E);
    let logarithm = add(k, mul(p, f));
    if x < LEAST { 0.0 } else { logarithm }
}

/// a + b.
#[inline(always)]
pub fn add3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(add(a.x, b.x), add(a.y, b.y), add(a.z, b.z))
}

/// a − b.
#[inline(always)]
pub fn sub3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(sub(a.x, b.x), sub(a.y, b.y), sub(a.z, b.z))
}

/// The products of the components.
#[inline(always)]
pub fn mul3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(mul(a.x, b.x), mul(a.y, b.y), mul(a.z, b.z))
}

/// s·a.
#[inline(always)]
pub fn scale3(a: Vec3, s: f32) -> Vec3 {
    Vec3::new(mul(a.x, s), mul(a.y, s), mul(a.z, s))
}

/// [`flush`] of each component.
#[inline(always)]
pub fn flush3(a: Vec3, least: f32) -> Vec3 {
    Vec3::new(flush(a.x, least), flush(a.y, least), flush(a.z, least))
}

/// a·b, summed from left to right.
#[inline(always)]
pub fn dot3(a: Vec3, b: Vec3) -> f32 {
    add(add(mul(a.x, b.x), mul(a.y, b.y)), mul(a.z, b.z))
}

/// a × b.
#[inline(always)]
pub fn cross3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(sub(mul(a.y, b.z), mul(a.z, b.y)), sub(mul(a.z, b.x), mul(a.x, b.z)), sub(mul(a.x, b.y), mul(a.y, b.x)))
}

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the entries are named by row and column")]
pub struct Sym3 {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
}

impl Sym3 {
    /// The matrix of these entries, row by row.
    #[inline(always)]
    pub const fn new(xx: f32, xy: f32, xz: f32, yy: f32, yz: f32, zz: f32) -> Self {
        Self { xx, xy, xz, yy, yz, zz }
    }
}

/// n nᵀ.
#[inline(always)]
pub fn outer(n: Vec3) -> Sym3 {
    Sym3::new(mul(n.x, n.x), mul(n.x, n.y), mul(n.x, n.z), mul(n.y, n.y), mul(n.y, n.z), mul(n.z, n.z))
}

/// a + b.
#[inline(always)]
#[rustfmt::skip]
pub fn sym_add(a: Sym3, b: Sym3) -> Sym3 {
    Sym3::new(
        add(a.xx, b.xx), add(a.xy, b.xy), add(a.xz, b.xz), add(a.yy, b.yy), add(a.yz, b.yz), add(a.zz, b.zz),
    )
}

/// a − b.
#[inline(always)]
#[rustfmt::skip]
pub fn sym_sub(a: Sym3, b: Sym3) -> Sym3 {
    Sym3::new(
        sub(a.xx, b.xx), sub(a.xy, b.xy), sub(a.xz, b.xz), sub(a.yy, b.yy), sub(a.yz, b.yz), sub(a.zz, b.zz),
    )
}

/// s·a.
#[inline(always)]
pub fn sym_scale(a: Sym3, s: f32) -> Sym3 {
    Sym3::new(mul(a.xx, s), mul(a.xy, s), mul(a.xz, s), mul(a.yy, s), mul(a.yz, s), mul(a.zz, s))
}

/// m·v.
#[inline(always)]
pub fn sym_mul(m: Sym3, v: Vec3) -> Vec3 {
    Vec3::new(
        dot3(Vec3::new(m.xx, m.xy, m.xz), v),
        dot3(Vec3::new(m.xy, m.yy, m.yz), v),
        dot3(Vec3::new(m.xz, m.yz, m.zz), v),
    )
}

/// The sum of the diagonal.
#[inline(always)]
pub fn trace(m: Sym3) -> f32 {
    add(add(m.xx, m.yy), m.zz)
}

/// The cofactors of m: its inverse is `cofactors(m)` / [`sym_det`]`(m, cofactors(m))`.
#[inline(always)]
pub fn cofactors(m: Sym3) -> Sym3 {
    Sym3::new(
        sub(mul(m.yy, m.zz), mul(m.yz, m.yz)),
        sub(mul(m.xz, m.yz), mul(m.xy, m.zz)),
        sub(mul(m.xy, m.yz), mul(m.xz, m.yy)),
        sub(mul(m.xx, m.zz), mul(m.xz, m.xz)),
        sub(mul(m.xy, m.xz), mul(m.xx, m.yz)),
        sub(mul(m.xx, m.yy), mul(m.xy, m.xy)),
    )
}

/// The determinant of m, from its cofactors c.
#[inline(always)]
pub fn sym_det(m: Sym3, c: Sym3) -> f32 {
    add(add(mul(m.xx, c.xx), mul(m.xy, c.xy)), mul(m.xz, c.xz))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMPLICIT_BIT: u32 = 0x80_0000;
    const FRACTION: u32 = 0x7f_ffff;

    fn biased_exponent(x: f32) -> i32 {
        (x.to_bits() >> 23 & 0xff) as i32
    }

    fn significand(x: f32) -> u32 {
        x.to_bits() & FRACTION | IMPLICIT_BIT
    }

    fn assemble(sign: u32, exponent: i32, digits: u32) -> f32 {
        let biased = exponent + (digits >> 24) as i32;
        match biased {
            ..2 => 0.0,
            2..=254 => f32::from_bits(sign | (biased as u32) << 23 | digits & FRACTION),
            _ => f32::from_bits(sign | f32::MAX.to_bits()),
        }
    }

    /// `x` moved by `ulps` units in the last place: what a device's `/` or `sqrt` may return.
    fn off_by(x: f32, ulps: i32) -> f32 {
        if x == 0.0 { x } else { f32::from_bits(x.to_bits().wrapping_add_signed(ulps)) }
    }

    fn quotient_digits(n: u32, y: u32, guess: f32, ulps: i32) -> u32 {
        let mut q = (guess * 8_388_608.0) as u32;
        let mut r = (n << 23).wrapping_sub(q.wrapping_mul(y)) as i32;
        let step = off_by(r as f32 / y as f32, ulps).floor() as i32;
        q = q.wrapping_add_signed(step);
        r -= step * y as i32;
        if r < 0 {
            q -= 1;
            r += y as i32;
        }
        if r >= y as i32 {
            q += 1;
            r -= y as i32;
        }
        if 2 * r > y as i32 {
            q += 1;
        }
        q
    }

    fn root_digits(n: u32, guess: f32, ulps: i32) -> u32 {
        let mut s = guess as u32;
        let mut r = (n << 23).wrapping_sub(s.wrapping_mul(s)) as i32;
        let step = off_by(r as f32 / (2 * s) as f32, ulps).floor() as i32;
        r -= step * (2 * s as i32 + step);
        s = s.wrapping_add_signed(step);
        if r < 0 {
            s -= 1;
            r += 2 * s as i32 + 1;
        }
        if r > 2 * s as i32 {
            r -= 2 * s as i32 + 1;
            s += 1;
        }
        if r > s as i32 {
            s += 1;
        }
        s
    }

    /// The shader's `divide` on a device whose divisions are off by `ulps`.
    fn divide_as_shader(a: f32, b: f32, ulps: i32) -> f32 {
        if a.abs() < LEAST || b.abs() < LEAST {
            return 0.0;
        }
        let (x, y) = (significand(a), significand(b));
        let less = u32::from(x < y);
        let n = x << less;
        let q = quotient_digits(n, y, off_by(n as f32 / y as f32, ulps), ulps);
        let sign = (a.to_bits() ^ b.to_bits()) & (1 << 31);
        assemble(sign, biased_exponent(a) - biased_exponent(b) + 127 - less as i32, q)
    }

    /// The shader's `root` on a device whose roots and divisions are off by `ulps`.
    fn root_as_shader(x: f32, ulps: i32) -> f32 {
        if x < LEAST {
            return 0.0;
        }
        let exponent = biased_exponent(x);
        let odd = 1 - (exponent as u32 & 1);
        let n = significand(x) << odd;
        let s = root_digits(n, off_by((n as f32 * 8_388_608.0).sqrt(), ulps), ulps);
        assemble(0, 127 + (exponent - 127 - odd as i32) / 2, s)
    }

    /// A sequence of 32-bit numbers that looks random (Marsaglia's xorshift).
    fn random() -> impl FnMut() -> u32 {
        let mut state = 0x9e37_79b9u32;
        move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        }
    }

    /// Pairs that make rounding hard: any bits, quotients next to a half-way point, equal and neighboring digits,
    /// the ends of the range.
    fn hostile_pairs(count: usize) -> impl Iterator<Item = (f32, f32)> {
        let mut next = random();
        let ends = [0, 1, 0x7f_ffff, 0x80_0000, 0x80_0001, 2 << 23, 0x3f80_0000, 0x3f7f_ffff, 0x7f7f_ffff];
        (0..count).map(move |k| {
            let (mut a, mut b) = (next(), next());
            match k % 4 {
                0 => {}
                1 => {
                    // a = b·(q + ½ unit), rounded: the quotient lies as close to half-way as it can.
                    let half_way = f64::from(significand(f32::from_bits(a)) * 2 + 1) / f64::from(1 << 24);
                    b = b & FRACTION | 0x3f80_0000;
                    a = ((f64::from(f32::from_bits(b)) * half_way) as f32).to_bits();
                }
                2 => b = a ^ (b & 3) ^ (b & 0x7f80_0000),
                _ => {
                    let end = |bits: u32| ends[bits as usize % ends.len()] | bits & 1 << 31;
                    (a, b) = (end(a), if a & 2 == 0 { b } else { end(b) });
                }
            }
            // No infinities, no NaN.
            let finite = |bits: u32| f32::from_bits(if bits >> 23 & 0xff == 0xff { bits & !(1 << 30) } else { bits });
            (finite(a), finite(b))
        })
    }

    /// Squares of 24-bit numbers, rounded, with their neighbors, and numbers whose root lies next to a half-way point.
    fn hostile_squares(count: usize) -> impl Iterator<Item = f32> {
        let mut next = random();
        (0..count).map(move |k| {
            let base = f64::from(significand(f32::from_bits(next())));
            let around = if k % 2 == 0 { base * base } else { (base + 0.5) * (base + 0.5) };
            let exponent = 2f64.powi((next() % 200) as i32 - 140);
            off_by((around * exponent) as f32, (next() % 3) as i32 - 1)
        })
    }

    #[test]
    fn division_is_correctly_rounded_from_any_guess() {
        for ulps in [-16, -3, -2, -1, 0, 1, 2, 3, 16] {
            for (a, b) in hostile_pairs(400_000) {
                let (want, got) = (divide(a, b), divide_as_shader(a, b, ulps));
                assert_eq!(
                    want.to_bits(),
                    got.to_bits(),
                    "{a:e} / {b:e} with a guess {ulps} off: {want:e}, not {got:e}"
                );
            }
        }
    }

    #[test]
    fn the_root_is_correctly_rounded_from_any_guess() {
        for ulps in [-16, -3, -2, -1, 0, 1, 2, 3, 16] {
            let random_bits = hostile_pairs(200_000).map(|(a, _)| a);
            for x in random_bits.chain(hostile_squares(400_000)) {
                let (want, got) = (root(x), root_as_shader(x, ulps));
                assert_eq!(want.to_bits(), got.to_bits(), "√{x:e} with a guess {ulps} off: {want:e}, not {got:e}");
            }
        }
    }

    /// What the two tests above would see of a device that rounds in another way: most of their inputs tell.
    #[test]
    fn uncorrected_results_would_be_seen() {
        let truncated = |exact: f64, rounded: f32| f64::from(rounded.abs()) > exact.abs();
        let quotients = hostile_pairs(10_000).filter(|&(a, b)| truncated(f64::from(a) / f64::from(b), divide(a, b)));
        let roots = hostile_squares(10_000).filter(|&x| truncated(f64::from(x).sqrt(), root(x)));
        assert!(quotients.count() > 2_000, "quotients that are rounded up");
        assert!(roots.count() > 2_000, "roots that are rounded up");
    }

    #[test]
    fn the_edges_of_the_range_are_defined() {
        assert_eq!(divide(1.0, 0.0), 0.0);
        assert_eq!(divide(f32::MIN_POSITIVE / 2.0, 1.0).to_bits(), 0);
        assert_eq!(divide(-f32::MIN_POSITIVE / 2.0, 1.0).to_bits(), 0);
        assert_eq!(divide(f32::MAX, LEAST), f32::MAX);
        assert_eq!(divide(-f32::MAX, LEAST), f32::MIN);
        assert_eq!(divide(LEAST, 2.0), 0.0);
        assert_eq!(divide(1.0, 3.0), 1.0 / 3.0);
        assert_eq!(root(-1.0), 0.0);
        assert_eq!(root(LEAST / 2.0), 0.0);
        assert_eq!(root(2.0), std::f32::consts::SQRT_2);
        assert_eq!(flush(-1e-30, 1e-20).to_bits(), 0);
        assert_eq!(flush(-1e-10, 1e-20), -1e-10);
    }

    #[test]
    fn the_logarithm_is_within_its_bound() {
        // All digits about one, and some at every exponent.
        let near_one = (0x3f00_0000..0x4000_0000u32).step_by(7);
        let anywhere = (LEAST.to_bits()..=f32::MAX.to_bits()).step_by(1_009);
        for x in near_one.chain(anywhere).map(f32::from_bits) {
            let (got, exact) = (f64::from(log2(x)), f64::from(x).log2());
            assert!((got - exact).abs() <= 1.5e-7 * exact.abs().max(1.0), "log2 {x:e} is {exact}, not {got}");
        }
        for k in -125..=127 {
            assert_eq!(log2(2f32.powi(k)), k as f32);
        }
        assert_eq!([0.0, -1.0, LEAST / 2.0].map(log2), [0.0; 3]);
    }

    #[test]
    fn the_arc_cotangent_is_within_its_bound() {
        let anywhere = (0..=f32::MAX.to_bits()).step_by(10_007).map(f32::from_bits);
        for x in anywhere.flat_map(|x| [x, -x]) {
            let (got, exact) = (f64::from(arccot(x)), 1f64.atan2(x.into()));
            assert!((got - exact).abs() <= 3e-7, "arccot {x:e} is {exact}, not {got}");
        }
        assert_eq!([0.0, f32::MAX, f32::MIN].map(arccot), [std::f32::consts::FRAC_PI_2, 0.0, std::f32::consts::PI]);
    }

    #[test]
    fn cofactors_invert() {
        let m = Sym3::new(4.0, 1.0, 2.0, 5.0, 3.0, 6.0);
        let c = cofactors(m);
        assert_eq!(c, Sym3::new(21.0, 0.0, -7.0, 20.0, -10.0, 19.0));
        assert_eq!(sym_det(m, c), 70.0);
        assert_eq!(sym_mul(m, Vec3::new(c.xx, c.xy, c.xz)), Vec3::new(70.0, 0.0, 0.0));
        assert_eq!(trace(outer(Vec3::new(1.0, 2.0, 3.0))), 14.0);
    }
}
