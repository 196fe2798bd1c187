//! A picture, with smaller ones of itself to look at from afar.

use std::sync::LazyLock;

use rayon::prelude::*;

use super::{Wrap, decode};
use crate::error::{Error, Result};
use crate::math::DVec2;

/// The longest side of a picture that is decoded, in texels.
pub const LONGEST_SIDE: u32 = 8192;

/// A picture and its levels, each half as wide and high as the one before, down to a texel.
///
/// Texels are red, green, blue, opacity as stored; light is averaged as their squares, which is close to sRGB's curve and the
/// same on all systems.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    levels: Vec<Level>,
}

#[derive(Debug, Clone, PartialEq)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<[u8; 4]>,
}

impl Image {
    /// Decodes a PNG or JPEG file of at most `most` texels.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for another kind of file, [`Error::Limit`] for a picture that is larger or longer than
    /// [`LONGEST_SIDE`], [`Error::Format`] for a broken one.
    pub fn decode(bytes: &[u8], most: u64) -> Result<Self> {
        let (width, height, texels) = decode::decode(bytes, most)?;
        Self::new(width, height, texels)
    }

    /// A picture of these texels, in rows from above.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless there is a texel for each place, and one at least.
    pub fn new(width: usize, height: usize, texels: Vec<[u8; 4]>) -> Result<Self> {
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return Err(Error::Parameter(format!("{} texels for a picture of {width} × {height}", texels.len())));
        }
        let mut levels = vec![Level { width, height, texels }];
        while let Some(smaller) = levels.last().and_then(Level::halved) {
            levels.push(smaller);
        }
        Ok(Self { levels })
    }

    /// Its texels, without those of its levels.
    pub fn texel_count(&self) -> u64 {
        self.levels[0].texels.len() as u64
    }

    /// The light and opacity at a place, 0 … 1 across the picture, where neighbors are `steps` off: between the four nearest
    /// texels of the two levels whose texels are as large.
    pub(super) fn color(&self, at: DVec2, steps: [DVec2; 2], wrap: [Wrap; 2]) -> [f32; 4] {
        let at = DVec2::new(wrap[0].near(at.x), wrap[1].near(at.y));
        let size = DVec2::new(self.levels[0].width as f64, self.levels[0].height as f64);
        let texels = (steps[0] * size).length().max((steps[1] * size).length());
        let last = self.levels.len() - 1;
        if texels.is_nan() || texels <= 1.0 {
            return self.levels[0].color(at, wrap);
        }
        // The whole part of the logarithm is the exponent; the mantissa is close enough to the rest and as steady.
        let level = (texels.to_bits() >> 52) as usize - 1023;
        if level >= last {
            return self.levels[last].color(at, wrap);
        }
        let share = (texels / (1u64 << level) as f64 - 1.0) as f32;
        let [near, far] = [level, level + 1].map(|level| self.levels[level].color(at, wrap));
        std::array::from_fn(|i| near[i] + share * (far[i] - near[i]))
    }
}

impl Level {
    /// Between the four texels around a place.
    fn color(&self, at: DVec2, wrap: [Wrap; 2]) -> [f32; 4] {
        let sides = [(at.x, self.width, wrap[0]), (at.y, self.height, wrap[1])];
        let [(columns, right), (rows, down)] = sides.map(|(at, count, wrap)| {
            // A texel's own place is its middle.
            let texel = at * count as f64 - 0.5;
            let first = texel.floor();
            ([0, 1].map(|i| wrap.texel(first as i64 + i, count)), (texel - first) as f32)
        });
        let mixed = |a: [f32; 4], b: [f32; 4], share: f32| -> [f32; 4] {
            std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
        };
        let [upper, lower] = rows.map(|row| {
            let [left, right_one] = columns.map(|column| light(self.texels[row * self.width + column]));
            mixed(left, right_one, right)
        });
        mixed(upper, lower, down)
    }

    /// Half as wide and high: each texel is the mean over what it covers; `None` for a single texel.
    fn halved(&self) -> Option<Self> {
        if self.texels.len() == 1 {
            return None;
        }
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut texels = vec![[0; 4]; width * height];
        texels.par_chunks_mut(width).enumerate().for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                let mut sum = [0u64; 4];
                for (y, high) in covered(row, height, self.height) {
                    for (x, wide) in covered(column, width, self.width) {
                        let [r, g, b, a] = self.texels[y * self.width + x].map(u64::from);
                        let values = [r * r, g * g, b * b, a];
                        sum = std::array::from_fn(|i| sum[i] + high * wide * values[i]);
                    }
                }
                let [r, g, b, a] = sum.map(|sum| sum as f64 / (self.width * self.height) as f64);
                *texel = [r.sqrt(), g.sqrt(), b.sqrt(), a].map(|value| (value + 0.5) as u8);
            }
        });
        Some(Self { width, height, texels })
    }
}

/// What number `i` of `parts` equal parts covers of `count` texels: each with its share, of `count` in all.
fn covered(i: usize, parts: usize, count: usize) -> impl Iterator<Item = (usize, u64)> {
    let (start, end) = (i * count, (i + 1) * count);
    (start / parts..end.div_ceil(parts)).map(move |texel| {
        let (left, right) = ((texel * parts).max(start), ((texel + 1) * parts).min(end));
        (texel, (right - left) as u64)
    })
}

/// The light and opacity of a texel.
fn light(texel: [u8; 4]) -> [f32; 4] {
    static SQUARES: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|stored| (stored as f32 / 255.0) * (stored as f32 / 255.0)));
    let squares = &*SQUARES;
    let [r, g, b, a] = texel;
    [squares[usize::from(r)], squares[usize::from(g)], squares[usize::from(b)], f32::from(a) / 255.0]
}

/// A size that may be decoded.
pub(super) fn checked_size((width, height): (u32, u32), most: u64) -> Result<(usize, usize)> {
    if width.max(height) > LONGEST_SIDE {
        let message = format!("a picture of {width} × {height}: at most {LONGEST_SIDE} × {LONGEST_SIDE} are decoded");
        return Err(Error::Limit(message));
    }
    if u64::from(width) * u64::from(height) > most {
        let message = format!("a picture of {width} × {height}: all pictures together have too many texels");
        return Err(Error::Limit(message));
    }
    Ok((width as usize, height as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 4] = [255; 4];
    const BLACK: [u8; 4] = [0, 0, 0, 255];

    fn gray(image: &Image, at: [f64; 2], step: f64) -> f32 {
        let step = DVec2::splat(step);
        image.color(at.into(), [DVec2::new(step.x, 0.0), DVec2::new(0.0, step.y)], [Wrap::Repeat; 2])[0]
    }

    #[test]
    fn between_texels_light_is_linear() {
        let image = Image::new(2, 1, vec![BLACK, WHITE]).expect("a picture");
        for (u, light) in [(0.25, 0.0), (0.75, 1.0), (0.5, 0.5), (0.375, 0.25), (0.0, 0.5), (-0.25, 1.0), (9.25, 0.0)] {
            assert_eq!(gray(&image, [u, 0.5], 0.0), light, "at {u}");
        }
        let clamped = |u| image.color(DVec2::new(u, 0.5), [DVec2::ZERO; 2], [Wrap::Clamp; 2])[0];
        assert_eq!([-1e300, 0.0, 1.0, 1e300].map(clamped), [0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn from_afar_light_is_the_mean() {
        let texels = (0..64).map(|i| if (i + i / 8) % 2 == 0 { WHITE } else { BLACK }).collect();
        let board = Image::new(8, 8, texels).expect("a picture");
        assert_eq!(board.levels.iter().map(|level| level.width).collect::<Vec<_>>(), [8, 4, 2, 1]);
        for step in [0.25, 0.5, 1.0, 7.0, f64::INFINITY] {
            assert!((gray(&board, [0.3, 0.7], step) - 0.5).abs() < 0.003, "{step}");
        }
        // Half way between a level and the next.
        let near = gray(&board, [1.0 / 16.0, 1.0 / 16.0], 0.0);
        assert!((gray(&board, [1.0 / 16.0, 1.0 / 16.0], 1.5 / 8.0) - (near + 0.5) / 2.0).abs() < 0.003);
    }

    #[test]
    fn odd_sides_lose_no_texel() {
        for (width, height) in [(1, 1), (3, 1), (1, 7), (5, 3)] {
            let texels = (0..width * height).map(|i| if i == 0 { WHITE } else { BLACK }).collect();
            let image = Image::new(width, height, texels).expect("a picture");
            let last = image.levels.last().expect("a level");
            let expected = 255.0 / ((width * height) as f64).sqrt();
            assert_eq!(last.texels.len(), 1);
            assert!((f64::from(last.texels[0][0]) - expected).abs() < 1.5, "{width} × {height}: {:?}", last.texels);
        }
        assert_eq!(covered(0, 2, 5).collect::<Vec<_>>(), [(0, 2), (1, 2), (2, 1)]);
        assert_eq!(covered(1, 2, 5).collect::<Vec<_>>(), [(2, 1), (3, 2), (4, 2)]);
    }

    #[test]
    fn sizes_have_limits() {
        assert_eq!(checked_size((8192, 8192), u64::MAX).ok(), Some((8192, 8192)));
        assert!(matches!(checked_size((8193, 1), u64::MAX), Err(Error::Limit(_))));
        assert!(matches!(checked_size((10, 10), 99), Err(Error::Limit(_))));
        assert!(Image::new(2, 2, vec![WHITE; 3]).is_err() && Image::new(0, 0, Vec::new()).is_err());
    }
}
