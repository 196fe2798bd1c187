//! An image to put panels, bars and words on.

use crate::error::{Error, Result};

/// A color, sRGB from 0 to 1.
pub type Color = [f32; 3];

/// An image in rows.
#[derive(Debug, Clone)]
pub struct Canvas {
    width: usize,
    pixels: Vec<Color>,
}

impl Canvas {
    /// One of a single color.
    pub fn new(width: usize, height: usize, color: Color) -> Self {
        Self { width, pixels: vec![color; width * height] }
    }

    /// Puts rows of `width` pixels with their upper left corner at `x`, `y`; what lies outside is lost.
    pub fn put(&mut self, x: usize, y: usize, width: usize, pixels: &[Color]) {
        for (row, pixels) in (y..self.height()).zip(pixels.chunks(width.max(1))) {
            let width = pixels.len().min(self.width.saturating_sub(x));
            self.pixels[row * self.width + x..][..width].copy_from_slice(&pixels[..width]);
        }
    }

    /// Mixes `color` into a pixel, if it is there.
    pub fn blend(&mut self, x: i64, y: i64, color: Color, share: f32) {
        if (0..self.width as i64).contains(&x) && (0..self.height() as i64).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            *pixel = std::array::from_fn(|i| pixel[i] + share * (color[i] - pixel[i]));
        }
    }

    fn height(&self) -> usize {
        self.pixels.len().checked_div(self.width).unwrap_or(0)
    }

    /// The image as PNG.
    ///
    /// # Errors
    /// [`Error::Limit`] for an image that PNG cannot hold.
    pub fn png(&self) -> Result<Vec<u8>> {
        let bytes: Vec<u8> = self.pixels.iter().flatten().map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
        let mut png = Vec::new();
        let too_large = |error| Error::Limit(format!("the picture does not fit PNG: {error}"));
        let mut encoder = png::Encoder::new(&mut png, self.width as u32, self.height() as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(too_large)?;
        writer.write_image_data(&bytes).map_err(too_large)?;
        writer.finish().map_err(too_large)?;
        Ok(png)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_gives_back_the_pixels() {
        let mut canvas = Canvas::new(5, 3, [1.0; 3]);
        canvas.put(3, 1, 3, &[[0.0; 3]; 9]);
        canvas.blend(0, 0, [1.0, 0.0, 0.0], 0.5);
        canvas.blend(-1, 7, [0.0; 3], 1.0);
        let png = canvas.png().expect("a PNG");
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("a header");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("an image");
        assert_eq!((info.width, info.height, info.color_type), (5, 3, png::ColorType::Rgb));
        let red: Vec<u8> = bytes.iter().skip(1).step_by(3).copied().collect();
        assert_eq!(red, [128, 255, 255, 255, 255, 255, 255, 255, 0, 0, 255, 255, 255, 0, 0]);
    }

    #[test]
    fn an_image_of_nothing_is_refused() {
        assert!(matches!(Canvas::new(0, 0, [1.0; 3]).png(), Err(Error::Limit(_))));
    }
}
