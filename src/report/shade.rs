//! From the faces seen to the colors of pixels: lights, and flat faces with thin edges or the surface's own colors.

use rayon::prelude::*;

use super::camera::{Camera, Frame};
use super::canvas::Color;
use super::heat;
use super::raster::{Outline, STEPS, Sight, draw, middle};
use super::skin::{CLAY, Model, Skin};
use crate::math::DVec3;
use crate::mesh::Mesh;

/// Samples along each side of a pixel.
pub const SAMPLES: usize = 4;
/// Half the width of an edge's line, in pixels; each of two neighbors draws its half.
const HALF_LINE: f32 = 0.55;
/// What a line takes of the light.
const LINE_SHADE: f32 = 0.5;
/// The root of a face's area, in pixels, below which it has no lines, and above which they are full. Lines of smaller
/// faces would fill the picture and darken it.
const LINES_FROM: f32 = 1.8;
const LINES_FULL: f32 = 10.0;

/// A light from afar: where it comes from (right, up, toward the eye; of length 1) and its color.
struct Light {
    from: DVec3,
    color: [f32; 3],
}

/// The key light from the upper left, a cooler fill light from the right, and a faint one from below.
const LIGHTS: [Light; 3] = [
    Light { from: DVec3::new(-0.48, 0.64, 0.6), color: [1.02, 0.99, 0.93] },
    Light { from: DVec3::new(0.8, 0.0, 0.6), color: [0.20, 0.23, 0.28] },
    Light { from: DVec3::new(0.0, -0.96, 0.28), color: [0.07, 0.06, 0.06] },
];
/// The light that is everywhere.
const AMBIENT: f32 = 0.06;
/// How much of a heat map's brightness the lights decide; the rest is the scale's.
const HEAT_RELIEF: f32 = 0.55;

/// The share of the light that falls on colors: white stays within the range of pixels.
const EXPOSURE: f32 = 0.92;

/// What a surface is painted with.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    /// None: flat faces, with lines around them.
    Clay,
    /// Its own colors and textures, smooth where it has normals, without lines.
    Colors,
    /// By a distance at each vertex, from 0 to the limit.
    Heat { distances: &'a [f64], limit: f64 },
}

/// An image of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// In rows; sRGB from 0 to 1.
    pub pixels: Vec<Color>,
    /// Whether the model covers any sample of a pixel.
    pub covered: Vec<bool>,
}

/// Draws `model` as `camera` sees it, on `background`; `frame` is in samples.
pub fn render(model: Model<'_>, paint: Paint, camera: &Camera, frame: &Frame, background: Color) -> Drawn {
    let mesh = model.mesh;
    let skin = Skin::new(model);
    let sight = match paint {
        Paint::Colors => draw(mesh, camera, frame, &|id, outline, at, areas| skin.is_there(id, outline, at, areas)),
        _ => draw(mesh, camera, frame, &|_, _, _, _| true),
    };
    let scene = Scene { mesh, skin: &skin, paint, camera, sight: &sight };
    let (width, height) = (frame.width / SAMPLES, frame.height / SAMPLES);
    let background = background.map(|c| c * c);
    let mut pixels = vec![[0.0; 3]; width * height];
    let mut covered = vec![false; width * height];
    let rows = pixels.par_chunks_mut(width.max(1)).zip(covered.par_chunks_mut(width.max(1)));
    rows.enumerate().for_each(|(y, (pixels, covered))| {
        for (x, (pixel, covered)) in pixels.iter_mut().zip(covered).enumerate() {
            let (light, is_covered) = scene.pixel(x, y, background);
            (*pixel, *covered) = (light.map(f32::sqrt), is_covered);
        }
    });
    Drawn { pixels, covered }
}

struct Scene<'a> {
    mesh: &'a Mesh,
    skin: &'a Skin<'a>,
    paint: Paint<'a>,
    camera: &'a Camera,
    sight: &'a Sight,
}

/// A face that is seen: what all its samples share.
struct Seen {
    id: u32,
    outline: Outline,
    /// The corners' vertices, in the order of the outline.
    vertices: [u32; 3],
    /// The normals of these, toward the eye and along its axes, where the surface is smooth.
    normals: Option<[DVec3; 3]>,
    /// Of the whole face, where it is flat.
    light: [f32; 3],
    /// How dark its lines are, from 0 to 1.
    lines: f32,
}

impl Scene<'_> {
    /// The mean of a pixel's samples, in squares, and whether any of them is covered.
    fn pixel(&self, x: usize, y: usize, background: [f32; 3]) -> ([f32; 3], bool) {
        let mut sum = [0.0; 3];
        let mut seen: Option<Seen> = None;
        let mut is_covered = false;
        for (row, column) in (0..SAMPLES).flat_map(|row| (0..SAMPLES).map(move |column| (row, column))) {
            let (column, row) = (x * SAMPLES + column, y * SAMPLES + row);
            let color = match self.sight.face(column, row) {
                None => background,
                Some(id) => {
                    is_covered = true;
                    if seen.as_ref().is_none_or(|seen| seen.id != id) {
                        seen = self.look_at(id);
                    }
                    seen.as_ref().map_or(background, |seen| self.sample(seen, middle(column, row)))
                }
            };
            sum = std::array::from_fn(|i| sum[i] + color[i]);
        }
        (sum.map(|c| (c / (SAMPLES * SAMPLES) as f32).min(1.0)), is_covered)
    }

    fn look_at(&self, id: u32) -> Option<Seen> {
        let face = self.mesh.faces[id as usize];
        let outline = self.sight.outline(face)?;
        let size = ((outline.area as f32 / 2.0).sqrt()) / (STEPS * SAMPLES as i64) as f32;
        let vertices = outline.order().map(|corner| face[corner]);
        let normal = self.toward_eye(face);
        Some(Seen {
            id,
            outline,
            vertices,
            normals: self.normals(vertices, normal),
            light: light(normal),
            lines: match self.paint {
                Paint::Colors => 0.0,
                _ => smoothstep((size - LINES_FROM) / (LINES_FULL - LINES_FROM)),
            },
        })
    }

    /// A face's normal along the axes of the eye, and toward it: both its sides are lit.
    fn toward_eye(&self, face: [u32; 3]) -> DVec3 {
        let corner = |v: u32| self.mesh.positions[v as usize];
        let normal = self.camera.direction(self.mesh.cross(face).normalize_or_zero());
        let facing = normal.dot(self.camera.eye_from(corner(face[0])));
        if facing < 0.0 { -normal } else { normal }
    }

    /// The normals of a face's vertices on the side of `normal`, where colors are drawn and all have one.
    fn normals(&self, vertices: [u32; 3], normal: DVec3) -> Option<[DVec3; 3]> {
        let normals = self.mesh.normals.as_ref().filter(|_| matches!(self.paint, Paint::Colors))?;
        let normals = vertices.map(|v| self.camera.direction(normals[v as usize].as_dvec3()));
        let side = normals.iter().sum::<DVec3>().dot(normal);
        let are_there = normals.iter().all(|normal| normal.is_finite() && *normal != DVec3::ZERO);
        are_there.then(|| normals.map(|normal| if side < 0.0 { -normal } else { normal }))
    }

    fn sample(&self, seen: &Seen, at: [i32; 2]) -> [f32; 3] {
        let outline = &seen.outline;
        let areas = outline.areas(at);
        let shares = outline.shares(areas).unwrap_or_default();
        let color = match self.paint {
            Paint::Clay => std::array::from_fn(|i| CLAY[i] * seen.light[i]),
            Paint::Colors => {
                let smooth = |normals: [DVec3; 3]| light((0..3).map(|i| normals[i] * shares[i]).sum());
                let [r, g, b, _] = self.skin.color(seen.id, outline, areas);
                let light = seen.normals.map_or(seen.light, smooth);
                std::array::from_fn(|i| EXPOSURE * [r, g, b][i] * light[i])
            }
            Paint::Heat { distances, limit } => {
                let distance = (0..3).map(|i| shares[i] * distances[seen.vertices[i] as usize]).sum();
                let color = heat::color(heat::share(distance, limit));
                let gray = seen.light[1] * HEAT_RELIEF + (1.0 - HEAT_RELIEF) * 0.85;
                color.map(|c| c * c * gray)
            }
        };
        if seen.lines == 0.0 {
            return color;
        }
        let light = 1.0 - LINE_SHADE * seen.lines * line(outline, areas);
        color.map(|c| c * light)
    }
}

/// The light that a surface sends to the eye, by its normal along the axes of the eye, of any length.
fn light(normal: DVec3) -> [f32; 3] {
    let normal = normal.normalize_or_zero();
    LIGHTS.iter().fold([AMBIENT; 3], |sum, light| {
        let lit = normal.dot(light.from).max(0.0) as f32;
        std::array::from_fn(|i| sum[i] + lit * light.color[i])
    })
}

/// How much of a sample the lines along the edges cover, from 0 to 1.
fn line(outline: &Outline, areas: [i64; 3]) -> f32 {
    let [a, b, c] = outline.corners.map(|corner| corner.at.map(|x| x as f32));
    let length = |p: [f32; 2], q: [f32; 2]| ((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1])).sqrt();
    let lengths = [length(b, c), length(c, a), length(a, b)];
    let nearest = areas.iter().zip(lengths).map(|(&area, length)| area as f32 / length).fold(f32::INFINITY, f32::min);
    let samples = nearest / STEPS as f32;
    (HALF_LINE * SAMPLES as f32 - samples + 0.5).clamp(0.0, 1.0)
}

fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    const FRAME: Frame = Frame { width: 40 * SAMPLES, height: 40 * SAMPLES, margin: 0 };

    fn ball(faces: &dyn Fn([u32; 3]) -> [u32; 3], paint: Paint) -> Vec<[f32; 3]> {
        let mut mesh = icosphere(4);
        let camera = Camera::new(&mesh, DVec3::NEG_Y, DVec3::Z, &FRAME);
        mesh.faces.iter_mut().for_each(|face| *face = faces(*face));
        render((&mesh).into(), paint, &camera, &FRAME, [1.0; 3]).pixels
    }

    #[test]
    fn light_comes_from_the_upper_left_on_both_sides_of_a_face() {
        let outside = ball(&|face| face, Paint::Clay);
        let sum = |x: usize, y: usize| outside[y * 40 + x].iter().sum::<f32>();
        assert!(sum(12, 10) > sum(28, 10) && sum(28, 10) > sum(28, 30), "the light falls wrongly");
        assert_eq!(outside[0], [1.0; 3]);
        assert_eq!(outside, ball(&|[a, b, c]| [a, c, b], Paint::Clay));
    }

    #[test]
    fn a_heat_map_has_the_scales_colors() {
        let hot = vec![2.0; icosphere(4).positions.len()];
        for (limit, scale) in [(2.0, 1.0), (4.0, 0.5), (0.0, 0.0)] {
            let pixel = ball(&|face| face, Paint::Heat { distances: &hot, limit })[20 * 40 + 20];
            let expected = heat::color(scale);
            let ratios: [f32; 3] = std::array::from_fn(|i| pixel[i] / expected[i].max(1e-6));
            assert!((ratios[1] - ratios[2]).abs() < 0.02, "{pixel:?} is no shade of {expected:?}");
        }
    }

    #[test]
    fn large_faces_have_lines_and_small_ones_none() {
        let darkest = |level| {
            let mesh = icosphere(level);
            let frame = Frame { width: 200 * SAMPLES, height: 200 * SAMPLES, margin: 0 };
            let camera = Camera::new(&mesh, DVec3::NEG_Y, DVec3::Z, &frame);
            let pixels = render((&mesh).into(), Paint::Clay, &camera, &frame, [1.0; 3]).pixels;
            // Around the middle of the ball the light hardly changes, so a step is a line.
            let row = &pixels[100 * 200 + 90..100 * 200 + 110];
            row.windows(2).map(|pair| (pair[0][0] - pair[1][0]).abs()).fold(0.0, f32::max)
        };
        assert!(darkest(2) > 0.1, "no lines: {}", darkest(2));
        assert!(darkest(6) < 0.03, "lines: {}", darkest(6));
    }
}
