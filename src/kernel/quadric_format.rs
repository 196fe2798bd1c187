//! Formats of average quadrics: how the ten entries, in −1 ..= 1, become codes of 8, 16 or 32 bits and numbers again. In
//! WGSL: `shaders/shared/quadric_format.wgsl`.
//!
//! The entries are those of the symmetric 4×4 matrix row by row: xx, xy, xz, xd, yy, yz, yd, zz, zd, dd. Conversions are
//! integer arithmetic and correctly rounded operations, not a device's own, whose rounding WGSL leaves open.

use super::rows::QuadricBound;
use crate::backend::Constant;
use crate::math::exact::{add, divide, mul, sub};

/// Ten numbers in single precision.
pub const F32: u32 = 0;
/// Ten numbers in half precision.
pub const F16: u32 = 1;
/// Ten numbers in steps of 1/32767.
pub const SNORM16: u32 = 2;
/// The 16 entries as four pixels of 8 bits a channel: (x + 1)/2 in steps of 1/255 \[Yu14\].
pub const RGBA8: u32 = 3;
/// The six of the 3×3 block, in steps of 1/65535 on the diagonal and of 1/65534 beside it.
pub const LOCAL16: u32 = 4;
/// The same in steps of 1/255 and 1/254.
pub const LOCAL8: u32 = 5;
/// The formats under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("F32", Constant::U32(F32)),
    ("F16", Constant::U32(F16)),
    ("SNORM16", Constant::U32(SNORM16)),
    ("RGBA8", Constant::U32(RGBA8)),
    ("LOCAL16", Constant::U32(LOCAL16)),
    ("LOCAL8", Constant::U32(LOCAL8)),
    ("PAIR_WORDS", Constant::U32(PAIR_WORDS)),
];

/// Words that the codes of two quadrics take at most. Two take whole words in every format.
pub const PAIR_WORDS: u32 = 20;

/// Codes to a quadric.
#[inline(always)]
pub fn code_count(format: u32) -> u32 {
    if format == RGBA8 {
        return 16;
    }
    if is_local(format) { 6 } else { 10 }
}

/// Bits to a code.
#[inline(always)]
pub fn code_width(format: u32) -> u32 {
    if format == RGBA8 || format == LOCAL8 {
        return 8;
    }
    if format == F32 { 32 } else { 16 }
}

/// Whether only the 3×3 block is stored: the quadric is about its own vertex, on all of whose planes it lies.
#[inline(always)]
pub fn is_local(format: u32) -> bool {
    format == LOCAL16 || format == LOCAL8
}

/// Which of the ten entries a code is of.
#[inline(always)]
pub fn code_entry(format: u32, k: u32) -> u32 {
    if format == RGBA8 {
        let of_pixels = [0, 1, 2, 3, 1, 4, 5, 6, 2, 5, 7, 8, 3, 6, 8, 9];
        return of_pixels[k as usize];
    }
    if is_local(format) {
        let of_matrix = [0, 1, 2, 4, 5, 7];
        return of_matrix[k as usize];
    }
    k
}

/// The nearest integer to a number from 0, the even one of two.
#[inline(always)]
fn nearest_even(x: f32) -> u32 {
    let below = x as u32;
    let over = sub(x, below as f32);
    below + u32::from(over > 0.5 || (over == 0.5 && below & 1 == 1))
}

/// 0 ..= 1 in steps of 1/most.
#[inline(always)]
pub fn to_unorm(x: f32, most: f32) -> u32 {
    let y = mul(x.clamp(0.0, 1.0), most);
    let below = y as u32;
    below + u32::from(sub(y, below as f32) >= 0.5)
}

/// The number of such a code.
#[inline(always)]
pub fn from_unorm(code: u32, most: f32) -> f32 {
    divide(code as f32, most)
}

/// −1 ..= 1 in steps of 1/most, in two's complement.
#[inline(always)]
pub fn to_snorm(x: f32, most: f32) -> u32 {
    let steps = to_unorm(x.abs(), most);
    if x < 0.0 { 0u32.wrapping_sub(steps) } else { steps }
}

/// The number of such a code of so many bits.
#[inline(always)]
pub fn from_snorm(code: u32, width: u32, most: f32) -> f32 {
    let shift = 32 - width;
    divide(((code << shift) as i32 >> shift) as f32, most)
}

/// To half precision: the nearest, the even one of two, never infinite.
#[inline(always)]
pub fn to_half(x: f32) -> u32 {
    let sign = (x.to_bits() >> 16) & 0x8000;
    let bits = x.to_bits() & 0x7fff_ffff;
    // Below 2⁻¹⁴ steps of 2⁻²⁴.
    if bits < 0x3880_0000 {
        return sign | nearest_even(mul(f32::from_bits(bits), 16_777_216.0));
    }
    let shifted = bits - (112 << 23);
    sign | ((shifted + 0xfff + ((shifted >> 13) & 1)) >> 13).min(0x7bff)
}

/// A number in half precision.
#[inline(always)]
pub fn from_half(code: u32) -> f32 {
    let sign = (code & 0x8000) << 16;
    let bits = code & 0x7fff;
    let small = mul(bits as f32, f32::from_bits((127 - 24) << 23)).to_bits();
    f32::from_bits(sign | if bits < 0x400 { small } else { (bits << 13) + (112 << 23) })
}

/// A diagonal entry is not below 0, and another, `n_x·n_y` with n a unit vector, not beyond ±½.
#[inline(always)]
fn to_local(entry: u32, x: f32, most_unsigned: f32, most_signed: f32) -> u32 {
    if is_diagonal(entry) {
        return to_unorm(x, most_unsigned);
    }
    to_snorm(mul(2.0, x), most_signed)
}

#[inline(always)]
fn from_local(entry: u32, code: u32, width: u32, most_unsigned: f32, most_signed: f32) -> f32 {
    if is_diagonal(entry) {
        return from_unorm(code, most_unsigned);
    }
    mul(0.5, from_snorm(code, width, most_signed))
}

#[inline(always)]
fn is_diagonal(entry: u32) -> bool {
    entry == 0 || entry == 4 || entry == 7
}

/// The code of an entry, in the lowest bits.
#[inline(always)]
pub fn to_code(format: u32, entry: u32, x: f32) -> u32 {
    match format {
        F16 => to_half(x),
        SNORM16 => to_snorm(x, 32_767.0) & 0xffff,
        RGBA8 => to_unorm(mul(0.5, add(x, 1.0)), 255.0),
        LOCAL16 => to_local(entry, x, 65_535.0, 32_767.0) & 0xffff,
        LOCAL8 => to_local(entry, x, 255.0, 127.0) & 0xff,
        _ => x.to_bits(),
    }
}

/// The entry of a code.
#[inline(always)]
pub fn from_code(format: u32, entry: u32, code: u32) -> f32 {
    match format {
        F16 => from_half(code),
        SNORM16 => from_snorm(code, 16, 32_767.0),
        RGBA8 => sub(mul(2.0, from_unorm(code, 255.0)), 1.0),
        LOCAL16 => from_local(entry, code, 16, 65_535.0, 32_767.0),
        LOCAL8 => from_local(entry, code, 8, 255.0, 127.0),
        _ => f32::from_bits(code),
    }
}

/// What an average quadric was divided by: the greatest weight, and unless it is about its own vertex the greatest squared
/// distance of a plane where that is above 1.
#[inline(always)]
pub fn divisor(format: u32, bound: QuadricBound) -> f32 {
    if is_local(format) { bound.weight } else { mul(bound.weight, bound.offset_sq.max(1.0)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMATS: [u32; 6] = [F32, F16, SNORM16, RGBA8, LOCAL16, LOCAL8];

    /// The value of a finite half-precision number.
    fn half(code: u32) -> f64 {
        let (exponent, digits) = ((code >> 10 & 0x1f) as i32, f64::from(code & 0x3ff));
        let magnitude =
            if exponent == 0 { digits * 2f64.powi(-24) } else { (1024.0 + digits) * 2f64.powi(exponent - 25) };
        if code & 0x8000 == 0 { magnitude } else { -magnitude }
    }

    #[test]
    fn half_precision_is_read_exactly_and_written_to_the_nearest() {
        for code in (0..0x7c00).chain(0x8000..0xfc00) {
            let x = from_half(code);
            assert_eq!(f64::from(x), half(code), "{code:04x}");
            assert_eq!(to_half(x), code);
            // Half-way to the next, which is where rounding is decided.
            if code & 0x7fff < 0x7bff {
                let middle = f32::midpoint(x, from_half(code + 1));
                let [below, above] = [-1, 1].map(|step| f32::from_bits(middle.to_bits().wrapping_add_signed(step)));
                assert_eq!([below, above].map(to_half), [code, code + 1], "about {middle:e}");
                assert_eq!(to_half(middle), code + (code & 1), "{middle:e} is as near to both");
            }
        }
        assert_eq!([1e9, -1e9].map(to_half), [0x7bff, 0xfbff]);
        assert_eq!([1e-40, f32::from_bits(1)].map(to_half), [0, 0]);
    }

    #[test]
    fn even_steps_are_the_nearest() {
        for most in [127.0, 255.0, 32_767.0, 65_535.0] {
            for code in 0..=most as u32 {
                assert_eq!(to_unorm(from_unorm(code, most), most), code);
                assert_eq!(f64::from(from_unorm(code, most)) as f32, (f64::from(code) / f64::from(most)) as f32);
            }
            assert_eq!([-0.5, 0.0, 1.0, 2.0].map(|x| to_unorm(x, most)), [0, 0, most as u32, most as u32]);
        }
        assert_eq!([-1.0, 0.0, 1.0].map(|x| to_snorm(x, 127.0) & 0xff), [0x81, 0, 0x7f]);
        assert_eq!([0x81, 0, 0x7f].map(|code| from_snorm(code, 8, 127.0)), [-1.0, 0.0, 1.0]);
    }

    #[test]
    fn entries_come_back_within_half_a_step() {
        let steps = [0.0, 2f64.powi(-12), 1.0 / 65_534.0, 1.0 / 255.0, 1.0 / 131_068.0, 1.0 / 508.0];
        for (format, bound) in FORMATS.into_iter().zip(steps) {
            for k in 0..code_count(format) {
                let entry = code_entry(format, k);
                let (low, high) = match (is_local(format), is_diagonal(entry)) {
                    (true, true) => (0.0, 1.0),
                    (true, false) => (-0.5, 0.5),
                    (false, _) => (-1.0, 1.0),
                };
                let mut worst = 0.0_f64;
                for i in 0..=100_000 {
                    let x = low + (high - low) * (i as f32 / 100_000.0);
                    let code = to_code(format, entry, x);
                    assert!(code.checked_shr(code_width(format)).unwrap_or(0) == 0, "{format}: {code:x}");
                    worst = worst.max((f64::from(from_code(format, entry, code)) - f64::from(x)).abs());
                }
                // The bound, but for rounding in single precision; and no less, or it would bound nothing.
                assert!(worst <= bound * 1.005 && worst >= bound * 0.9, "{format}, {k}: {worst:e} for {bound:e}");
            }
        }
    }

    #[test]
    fn quadrics_take_the_bytes_that_they_are_said_to() {
        let bytes = FORMATS.map(|format| code_count(format) * code_width(format) / 8);
        assert_eq!(bytes, [40, 20, 20, 16, 12, 6]);
        let words = FORMATS.map(|format| 2 * code_count(format) * code_width(format) / 32);
        assert_eq!(words.into_iter().max(), Some(PAIR_WORDS));
        assert!(FORMATS.iter().all(|&format| (2 * code_count(format) * code_width(format)).is_multiple_of(32)));
    }
}
