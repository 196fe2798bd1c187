//! From the faces seen to the colors of pixels: two lights, flat faces, thin edges.

use rayon::prelude::*;

use super::camera::{Camera, Frame};
use super::heat;
use super::raster::{Outline, STEPS, Sight, draw, middle};
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
/// What a surface without a heat map is made of: a warm gray, as squares are blended.
const CLAY: [f32; 3] = [0.66, 0.62, 0.56];

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

/// What a surface is painted with.
#[derive(Debug, Clone, Copy)]
pub enum Paint<'a> {
    Clay,
    /// By a distance at each vertex, from 0 to the limit.
    Heat {
        distances: &'a [f64],
        limit: f64,
    },
}

/// The pixels of `mesh` seen by `camera`, in rows, on `background`; sRGB from 0 to 1. `frame` is in samples.
pub fn render(mesh: &Mesh, paint: Paint, camera: &Camera, frame: &Frame, background: [f32; 3]) -> Vec<[f32; 3]> {
    let sight = draw(mesh, camera, frame);
    let scene = Scene { mesh, paint, camera, sight: &sight };
    let (width, height) = (frame.width / SAMPLES, frame.height / SAMPLES);
    let background = background.map(|c| c * c);
    let mut pixels = vec![[0.0; 3]; width * height];
    pixels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = scene.pixel(x, y, background).map(f32::sqrt);
        }
    });
    pixels
}

struct Scene<'a> {
    mesh: &'a Mesh,
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
    light: [f32; 3],
    /// How dark its lines are, from 0 to 1.
    lines: f32,
}

impl Scene<'_> {
    /// The mean of a pixel's samples, in squares.
    fn pixel(&self, x: usize, y: usize, background: [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let mut seen: Option<Seen> = None;
        for (row, column) in (0..SAMPLES).flat_map(|row| (0..SAMPLES).map(move |column| (row, column))) {
            let (column, row) = (x * SAMPLES + column, y * SAMPLES + row);
            let color = match self.sight.face(column, row) {
                None => background,
                Some(id) => {
                    if seen.as_ref().is_none_or(|seen| seen.id != id) {
                        seen = self.look_at(id);
                    }
                    seen.as_ref().map_or(background, |seen| self.sample(seen, middle(column, row)))
                }
            };
            sum = std::array::from_fn(|i| sum[i] + color[i]);
        }
        sum.map(|c| (c / (SAMPLES * SAMPLES) as f32).min(1.0))
    }

    fn look_at(&self, id: u32) -> Option<Seen> {
        let face = self.mesh.faces[id as usize];
        let outline = self.sight.outline(face)?;
        let [a, b, c] = face;
        let size = ((outline.area as f32 / 2.0).sqrt()) / (STEPS * SAMPLES as i64) as f32;
        Some(Seen {
            id,
            outline,
            vertices: if outline.turned { [a, c, b] } else { face },
            light: self.light(face),
            lines: smoothstep((size - LINES_FROM) / (LINES_FULL - LINES_FROM)),
        })
    }

    /// The light that a face sends to the eye: both its sides are lit.
    fn light(&self, face: [u32; 3]) -> [f32; 3] {
        let corner = |v: u32| self.mesh.positions[v as usize];
        let normal = self.camera.direction(self.mesh.cross(face).normalize_or_zero());
        let facing = normal.dot(self.camera.eye_from(corner(face[0])));
        let normal = if facing < 0.0 { -normal } else { normal };
        LIGHTS.iter().fold([AMBIENT; 3], |sum, light| {
            let lit = normal.dot(light.from).max(0.0) as f32;
            std::array::from_fn(|i| sum[i] + lit * light.color[i])
        })
    }

    fn sample(&self, seen: &Seen, at: [i32; 2]) -> [f32; 3] {
        let areas = seen.outline.areas(at);
        let color = match self.paint {
            Paint::Clay => std::array::from_fn(|i| CLAY[i] * seen.light[i]),
            Paint::Heat { distances, limit } => {
                // Perspective: the shares are of nearness times area.
                let shares: [f64; 3] =
                    std::array::from_fn(|i| areas[i] as f64 * f64::from(seen.outline.corners[i].nearness));
                let sum: f64 = (0..3).map(|i| shares[i] * distances[seen.vertices[i] as usize]).sum();
                let color = heat::color(heat::share(sum / shares.iter().sum::<f64>(), limit));
                let gray = seen.light[1] * HEAT_RELIEF + (1.0 - HEAT_RELIEF) * 0.85;
                color.map(|c| c * c * gray)
            }
        };
        if seen.lines == 0.0 {
            return color;
        }
        let light = 1.0 - LINE_SHADE * seen.lines * line(&seen.outline, areas);
        color.map(|c| c * light)
    }
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
        render(&mesh, paint, &camera, &FRAME, [1.0; 3])
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
            let pixels =
                render(&mesh, Paint::Clay, &Camera::new(&mesh, DVec3::NEG_Y, DVec3::Z, &frame), &frame, [1.0; 3]);
            // Around the middle of the ball the light hardly changes, so a step is a line.
            let row = &pixels[100 * 200 + 90..100 * 200 + 110];
            row.windows(2).map(|pair| (pair[0][0] - pair[1][0]).abs()).fold(0.0, f32::max)
        };
        assert!(darkest(2) > 0.1, "no lines: {}", darkest(2));
        assert!(darkest(6) < 0.03, "lines: {}", darkest(6));
    }
}
