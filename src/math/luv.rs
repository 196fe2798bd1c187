//! CIE L\*u\*v\*, where equal distances between colors look about equal.
//!
//! # Reference
//! \[CIE15\]. The white point is that of the matrix, so that every gray has u\* = v\* = 0. Roots are found by Newton's steps,
//! for those of the system differ from one to the next.

/// From linear sRGB to CIE XYZ, a row each for X, Y and Z. White is D65.
const XYZ: [[f64; 3]; 3] = [
    [0.412_456_4, 0.357_576_1, 0.180_437_5],
    [0.212_672_9, 0.715_152_2, 0.072_175_0],
    [0.019_333_9, 0.119_192_0, 0.950_304_1],
];
/// Its inverse.
const RGB: [[f64; 3]; 3] = [
    [3.240_454_836_021_408_3, -1.537_138_850_102_575_1, -0.498_531_546_868_480_9],
    [-0.969_266_389_875_653_7, 1.876_010_928_842_491_3, 0.041_556_082_346_673_5],
    [0.055_643_419_604_213_6, -0.204_025_854_267_698_1, 1.057_225_162_457_928_7],
];
/// (6/29)³: the share of light below which the cube root would be too steep, and the L\* that it has.
const DARK: f64 = 216.0 / 24_389.0;
const DARK_LIGHTNESS: f64 = 8.0;
/// L\* for a share of the light below it.
const SLOPE: f64 = 24_389.0 / 27.0;

/// CIE L\*, u\*, v\* of a color in sRGB.
pub fn luv(srgb: [f64; 3]) -> [f64; 3] {
    let white = times(XYZ, [1.0; 3]);
    let color = times(XYZ, srgb.map(linear));
    let y = color[1] / white[1];
    let lightness = if y > DARK { 116.0 * root(y, 3) - 16.0 } else { y * SLOPE };
    let [u, v] = chromaticity(color);
    let [white_u, white_v] = chromaticity(white);
    [lightness, 13.0 * lightness * (u - white_u), 13.0 * lightness * (v - white_v)]
}

/// The color in sRGB of CIE L\*, u\*, v\*, each channel brought into `[0, 1]`.
pub fn srgb([lightness, u, v]: [f64; 3]) -> [f64; 3] {
    let is_light = lightness > 0.0;
    if !is_light {
        return [0.0; 3];
    }
    let white = times(XYZ, [1.0; 3]);
    let [white_u, white_v] = chromaticity(white);
    let cubed = |x: f64| x * x * x;
    let y = if lightness > DARK_LIGHTNESS { cubed((lightness + 16.0) / 116.0) } else { lightness / SLOPE } * white[1];
    let (u, v) = (u / (13.0 * lightness) + white_u, v / (13.0 * lightness) + white_v);
    let color = [y * 9.0 * u / (4.0 * v), y, y * (12.0 - 3.0 * u - 20.0 * v) / (4.0 * v)];
    times(RGB, color).map(|light| if light > 0.0 { encoded(light.min(1.0)) } else { 0.0 })
}

/// An sRGB channel as a share of the light.
fn linear(channel: f64) -> f64 {
    if channel <= 0.040_45 {
        return channel / 12.92;
    }
    // To the power of 2.4.
    let sq = ((channel + 0.055) / 1.055) * ((channel + 0.055) / 1.055);
    sq * root(sq, 5)
}

/// The sRGB channel of a share of the light in `[0, 1]`.
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        return light * 12.92;
    }
    // To the power of 5/12.
    let power = root((light * light * light * light * light).sqrt().sqrt(), 3);
    (1.055 * power - 0.055).min(1.0)
}

fn times(matrix: [[f64; 3]; 3], color: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * color[0] + row[1] * color[1] + row[2] * color[2])
}

/// u′ and v′; black has none, and as its L\* is 0 any will do.
fn chromaticity([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + 15.0 * y + 3.0 * z;
    if sum > 0.0 { [4.0 * x / sum, 9.0 * y / sum] } else { [0.0; 2] }
}

/// The `n`-th root of a positive number, by operations that every system rounds alike; 0 for others.
fn root(x: f64, n: u32) -> f64 {
    let is_positive = x > 0.0;
    if !is_positive {
        return 0.0;
    }
    /// The exponent of 1 in the bits of a number.
    const ONE: u64 = 1023 << 52;
    let count = f64::from(n);
    let mut y = f64::from_bits(x.to_bits() / u64::from(n) + ONE / u64::from(n) * u64::from(n - 1));
    // Six steps double the five bits of the start more than is needed.
    for _ in 0..6 {
        let power = (1..n).fold(1.0, |power, _| power * y);
        y = ((count - 1.0) * y + x / power) / count;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_those_of_the_library() {
        for x in [1e-12, 1e-3, 0.2, 0.5, 1.0, 1.7, 2.0, 8.0, 1000.0] {
            assert!((root(x, 3) / x.cbrt() - 1.0).abs() < 1e-15, "{x}");
            assert!((root(x, 5) / x.powf(0.2) - 1.0).abs() < 1e-15, "{x}");
        }
        assert_eq!((root(0.0, 3), root(-1.0, 3), root(f64::NAN, 5)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn every_color_comes_back() {
        for step in 0..17_u32.pow(3) {
            let color = [step % 17, step / 17 % 17, step / 289].map(|channel| f64::from(channel) / 16.0);
            let back = srgb(luv(color));
            assert!(color.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-7), "{color:?} became {back:?}");
        }
    }

    #[test]
    fn what_no_color_is_becomes_one() {
        for far in [[50.0, 500.0, -500.0], [120.0, 0.0, 0.0], [-3.0, 1.0, 1.0], [10.0, -100.0, 300.0], [f64::NAN; 3]] {
            assert!(srgb(far).iter().all(|channel| (0.0..=1.0).contains(channel)), "{far:?}: {:?}", srgb(far));
        }
        assert_eq!(srgb([100.0, 0.0, 0.0]).map(|x| (x * 1e6).round()), [1e6; 3]);
    }
}
