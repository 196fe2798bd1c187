//! How far two models look apart: the pixels of both from six sides.

use rayon::prelude::*;

use super::camera::{Camera, Frame};
use super::canvas::Color;
use super::shade::{Drawn, Paint, SAMPLES, render};
use super::skin::Model;
use crate::error::Result;
use crate::math::DVec3;

/// The sides from which both are seen, by their names, and what is up there.
const VIEWS: [(&str, DVec3, DVec3); 6] = [
    ("+x", DVec3::X, DVec3::Z),
    ("-x", DVec3::NEG_X, DVec3::Z),
    ("+y", DVec3::Y, DVec3::Z),
    ("-y", DVec3::NEG_Y, DVec3::Z),
    ("+z", DVec3::Z, DVec3::Y),
    ("-z", DVec3::NEG_Z, DVec3::Y),
];

/// The width and height of an image, in pixels.
const SIDE: usize = 512;
/// What is left free around the first model, in pixels.
const MARGIN: usize = 16;
/// As far from white as from black, so that outlines of bright and of dark models count alike.
const BACKGROUND: Color = [0.5; 3];

/// How far images of two models are apart: of 1, from black to white.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ImageDifference {
    /// The root of the mean square over the red, green and blue of all pixels that either model covers, in all six images.
    pub rmse: f64,
    /// The image where it is the greatest.
    pub greatest: ViewDifference,
}

/// How far two images are apart.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ViewDifference {
    /// The side from which both are seen: `+x`, `-x` and so on.
    pub view: &'static str,
    /// The root of the mean square over its pixels.
    pub rmse: f64,
}

/// Draws `a` and `b` from six sides, 512 × 512 pixels each, and compares the images.
///
/// Both are drawn with their colors and textures, as clay where they have none, smooth where they have normals, by the same
/// camera, which frames `a`. The result does not depend on the number of threads. Without a pixel to compare it is 0.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) for an invalid mesh.
pub fn image_difference<'a>(a: impl Into<Model<'a>>, b: impl Into<Model<'a>>) -> Result<ImageDifference> {
    let (a, b) = (a.into(), b.into());
    a.mesh.check()?;
    b.mesh.check()?;
    let frame = Frame { width: SIDE * SAMPLES, height: SIDE * SAMPLES, margin: MARGIN * SAMPLES };
    let views = VIEWS.map(|(view, toward, up)| {
        let camera = Camera::new(a.mesh, toward, up, &frame);
        let [a, b] = [a, b].map(|model| render(model, Paint::Colors, &camera, &frame, BACKGROUND));
        (view, Squares::between(&a, &b))
    });
    let mut greatest = ViewDifference { view: VIEWS[0].0, rmse: 0.0 };
    for &(view, squares) in &views {
        if squares.root() > greatest.rmse {
            greatest = ViewDifference { view, rmse: squares.root() };
        }
    }
    let all = views.iter().fold(Squares::default(), |all, (_, squares)| all.plus(*squares));
    Ok(ImageDifference { rmse: all.root(), greatest })
}

/// Squares of differences of channels.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    sum: f64,
    count: u64,
}

impl Squares {
    /// Those of the pixels that either image covers.
    fn between(a: &Drawn, b: &Drawn) -> Self {
        let row = |row: usize| {
            let pixels = row * SIDE..(row + 1) * SIDE;
            let covered = pixels.filter(|&pixel| a.covered[pixel] || b.covered[pixel]);
            covered.fold(Self::default(), |squares, pixel| {
                let of = |channel: usize| {
                    let difference = f64::from(a.pixels[pixel][channel]) - f64::from(b.pixels[pixel][channel]);
                    difference * difference
                };
                squares.plus(Self { sum: of(0) + of(1) + of(2), count: 3 })
            })
        };
        // Added in the order of the rows, so that the sum has the same bits on any number of threads.
        let rows: Vec<Self> = (0..SIDE).into_par_iter().map(row).collect();
        rows.into_iter().fold(Self::default(), Self::plus)
    }

    fn plus(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, count: self.count + other.count }
    }

    fn root(self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.sum / self.count as f64).sqrt() }
    }
}
