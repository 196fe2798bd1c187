//! How far colors are apart: as they are stored, and as they are seen.

use super::Spread;
use super::sums::Sums;
use crate::math::luv::luv;

/// The deviation of colors over many samples.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ColorDeviation {
    /// Euclidean in stored red, green and blue, each in `[0, 1]`; black is √3 from white.
    pub rgb: Spread,
    /// Euclidean in CIE L\*u\*v\*, where equal distances look about equal; black is 100 from white, and 1 is just noticed.
    pub luv: Spread,
}

/// Adds up the deviation of pairs of colors. Alpha takes no part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ColorSums {
    rgb: Sums,
    luv: Sums,
}

impl ColorSums {
    /// One more pair of sRGB colors, as a mesh holds them.
    pub fn add(&mut self, a: [f32; 4], b: [f32; 4]) {
        let (a, b) = (clamped(a), clamped(b));
        self.rgb.add(distance(a, b));
        self.luv.add(distance(luv(a), luv(b)));
    }

    /// The pairs of `other` after the own. Merging in a fixed order gives the same bits with any number of threads.
    pub fn merge(&mut self, other: &Self) {
        self.rgb.merge(&other.rgb);
        self.luv.merge(&other.luv);
    }

    /// The deviation over all pairs, or `None` of none.
    pub fn finish(&self) -> Option<ColorDeviation> {
        Some(ColorDeviation { rgb: self.rgb.finish()?, luv: self.luv.finish()? })
    }
}

/// The channels in `[0, 1]`; NaN becomes 0.
fn clamped([r, g, b, _]: [f32; 4]) -> [f64; 3] {
    [r, g, b].map(|channel| if channel > 0.0 { f64::from(channel.min(1.0)) } else { 0.0 })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
    const WHITE: [f32; 4] = [1.0; 4];

    #[track_caller]
    fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
        assert!(near && found.len() == expected.len(), "found {found:?}, expected {expected:?}");
    }

    #[test]
    fn primaries_are_where_the_tables_have_them() {
        for (srgb, expected) in [
            ([1.0, 0.0, 0.0], [53.2408, 175.0151, 37.7564]),
            ([0.0, 1.0, 0.0], [87.7347, -83.0776, 107.3985]),
            ([0.0, 0.0, 1.0], [32.2970, -9.4054, -130.3423]),
            ([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]),
            ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ] {
            assert_near(&luv(srgb), &expected, 0.001);
        }
    }

    #[test]
    fn grays_have_no_hue_and_the_dark_end_is_straight() {
        for gray in [0.01, 0.04, 0.5, 0.9] {
            assert_near(&luv([gray; 3])[1..], &[0.0, 0.0], 1e-12);
        }
        // 2/255 is linear in both curves: L* = 903.296… · (2/255)/12.92.
        assert_near(&luv([2.0 / 255.0; 3])[..1], &[24_389.0 / 27.0 * 2.0 / 255.0 / 12.92], 1e-9);
    }

    #[test]
    fn black_is_a_hundred_from_white() {
        let mut sums = ColorSums::default();
        sums.add(BLACK, WHITE);
        let ColorDeviation { rgb, luv } = sums.finish().expect("a pair was added");
        assert_near(&[rgb.max, rgb.mean, rgb.rms], &[3.0_f64.sqrt(); 3], 1e-15);
        assert_near(&[luv.max, luv.mean, luv.rms], &[100.0; 3], 1e-12);
    }

    #[test]
    fn alpha_is_ignored_and_the_order_does_not_matter() {
        let (red, clear) = ([1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]);
        let deviation = |a, b| {
            let mut sums = ColorSums::default();
            sums.add(a, b);
            sums.finish()
        };
        assert_eq!(deviation(red, clear).map(|d| (d.rgb, d.luv)), Some((Spread::default(), Spread::default())));
        assert_eq!(deviation(red, WHITE), deviation(WHITE, red));
        // What no file should hold counts as its nearest color.
        assert_eq!(deviation([f32::NAN, -1.0, 0.0, 0.0], [2.0, 1.0, f32::INFINITY, 0.0]), deviation(BLACK, WHITE));
        assert_eq!(ColorSums::default().finish(), None);
    }

    #[test]
    fn merging_is_adding_all() {
        let (mut all, mut first, mut second) = <(ColorSums, ColorSums, ColorSums)>::default();
        all.add(BLACK, WHITE);
        all.add(WHITE, WHITE);
        first.add(BLACK, WHITE);
        second.add(WHITE, WHITE);
        first.merge(&second);
        assert_eq!(first, all);
        let spread = all.finish().expect("pairs were added").luv;
        assert_near(&[spread.max, spread.mean, spread.rms], &[100.0, 50.0, 100.0 / 2.0_f64.sqrt()], 1e-12);
    }
}
