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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::torus;

    /// A square of half this width, at this height, in a gray.
    fn square(from: f64, to: f64, height: f64, gray: f32) -> Mesh {
        let corner = |x, y| DVec3::new(x, y, height);
        let positions = vec![corner(from, -1.0), corner(to, -1.0), corner(to, 1.0), corner(from, 1.0)];
        let mut mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]);
        mesh.colors = Some(vec![[gray, gray, gray, 1.0]; 4]);
        mesh
    }

    fn difference(a: &Mesh, b: &Mesh) -> ImageDifference {
        image_difference(a, b).expect("a difference")
    }

    /// What a white surface that faces the eye sends there, from the lights and the exposure.
    const WHITE: [f64; 3] = [0.92 * 0.8116, 0.92 * 0.8088, 0.92 * 0.8028];

    #[test]
    fn one_color_against_another() {
        let [white, gray, black] = [1.0, 0.25, 0.0].map(|gray| square(-1.0, 1.0, 0.0, gray));
        let root = (WHITE.iter().sum::<f64>() / 3.0).sqrt();
        for (a, b, expected) in [(&white, &gray, 0.75 * root), (&gray, &black, 0.25 * root), (&gray, &gray, 0.0)] {
            let found = difference(a, b);
            assert!((found.rmse - expected).abs() < 1e-5, "{found:?}, expected {expected}");
            assert!((found.greatest.rmse - expected).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn what_one_does_not_cover_shows_the_background() {
        let (whole, half) = (square(-1.0, 1.0, 0.0, 0.0), square(-1.0, 0.0, 0.0, 0.0));
        let expected = 0.5 * 0.5_f64.sqrt();
        for (a, b) in [(&whole, &half), (&whole, &Mesh::default())] {
            let expected = if b.faces.is_empty() { 0.5 } else { expected };
            let found = difference(a, b).rmse;
            assert!((found - expected).abs() < 1e-5, "{found}, expected {expected}");
        }
        assert_eq!(difference(&Mesh::default(), &Mesh::default()).rmse, 0.0);
    }

    #[test]
    fn the_side_that_differs_is_named() {
        // From above one sees the upper square alone.
        let both = |upper: f32| {
            let (mut mesh, above) = (square(-1.0, 1.0, 0.0, 1.0), square(-1.0, 1.0, 0.5, upper));
            mesh.faces.extend(above.faces.iter().map(|face| face.map(|v| v + 4)));
            mesh.positions.extend(above.positions);
            mesh.colors.iter_mut().for_each(|colors| colors.extend(above.colors.iter().flatten()));
            mesh
        };
        let found = difference(&both(1.0), &both(0.0));
        assert_eq!(found.greatest.view, "+z");
        assert!(found.greatest.rmse > 0.8 && found.rmse < found.greatest.rmse, "{found:?}");
    }

    #[test]
    fn a_mesh_against_itself_is_nothing_and_threads_do_not_show() {
        let (fine, coarse) = (torus(60, 40), torus(12, 8));
        assert_eq!(difference(&fine, &fine).rmse, 0.0);
        let found = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| difference(&fine, &coarse))
        };
        assert_eq!(found(1), found(5));
        assert!(found(2).rmse > 0.01);
    }
}
