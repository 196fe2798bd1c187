//! What the surface of a model is painted with: colors of vertices and faces, materials, textures.

use super::raster::Outline;
use crate::looks::{Look, Opacity};
use crate::math::{DVec2, Vec2};
use crate::mesh::{Channel, Mesh};

/// A mesh, and how its materials look.
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// A look for each of its materials, or one for a mesh without; none is white.
    pub looks: &'a [Look],
}

impl<'a> From<&'a Mesh> for Model<'a> {
    fn from(mesh: &'a Mesh) -> Self {
        Self { mesh, looks: &[] }
    }
}

impl Model<'_> {
    /// Whether there is more to see than a shape.
    pub fn is_colored(&self) -> bool {
        let is_plain = |look: &Look| look.texture.is_none() && look.color[..3] == [1.0; 3];
        self.mesh.colors.is_some() || self.mesh.face_colors.is_some() || !self.looks.iter().all(is_plain)
    }
}

/// What a surface without colors is made of: a warm gray, as squares are blended.
pub const CLAY: [f32; 3] = [0.66, 0.62, 0.56];

/// The thresholds of a pixel's samples, in sixteenths: what is half there covers half of them, well spread.
const THRESHOLDS: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

/// The colors of a model, ready to be looked up.
pub struct Skin<'a> {
    mesh: &'a Mesh,
    looks: Vec<(&'a Look, Option<Coordinates<'a>>)>,
    /// The light of a face that nothing is said of.
    plain: [f32; 3],
}

/// The texture coordinates of a look.
#[derive(Clone, Copy)]
enum Coordinates<'a> {
    OfCorners(&'a [[Vec2; 3]]),
    OfVertices(&'a Channel),
}

impl<'a> Skin<'a> {
    pub fn new(model: Model<'a>) -> Self {
        let mesh = model.mesh;
        let coordinates = |look: &Look| match &look.texture.as_ref()?.channel {
            None => mesh.texcoords.as_deref().map(Coordinates::OfCorners),
            Some(name) => {
                let channel = mesh.channels.iter().find(|channel| channel.name == *name && channel.width == 2);
                channel.map(Coordinates::OfVertices)
            }
        };
        let looks = model.looks.iter().map(|look| (look, coordinates(look))).collect();
        Self { mesh, looks, plain: if model.is_colored() { [1.0; 3] } else { CLAY } }
    }

    /// The light and opacity of a face where these are the areas of its outline.
    pub fn color(&self, id: u32, outline: &Outline, areas: [i64; 3]) -> [f32; 4] {
        let [r, g, b] = self.plain;
        let mut color = [r, g, b, 1.0];
        let Some(shares) = outline.shares(areas) else { return color };
        let times = |color: [f32; 4], other: [f32; 4]| std::array::from_fn(|i| color[i] * other[i]);
        if let Some(colors) = &self.mesh.face_colors {
            color = times(color, light(colors[id as usize]));
        } else if let Some(colors) = &self.mesh.colors {
            let face = self.mesh.faces[id as usize];
            let corners = outline.order().map(|corner| colors[face[corner] as usize]);
            let mean = |i: usize| (0..3).map(|corner| shares[corner] as f32 * corners[corner][i]).sum();
            color = times(color, light(std::array::from_fn(mean)));
        }
        let Some((look, coordinates)) = self.look(id) else { return color };
        color = times(color, light(look.color));
        if let (Some(texture), Some(coordinates)) = (&look.texture, coordinates) {
            let corners = self.texcoords(coordinates, id, outline);
            let place = |shares: [f64; 3]| (0..3).map(|corner| corners[corner] * shares[corner]).sum::<DVec2>();
            let at = place(shares);
            let steps = outline.gains().map(|gains| {
                let there = outline.shares(std::array::from_fn(|i| areas[i] + gains[i]));
                there.map_or(DVec2::ZERO, |shares| place(shares) - at)
            });
            color = times(color, texture.color(at, steps));
        }
        color
    }

    /// Whether a face is there at a sample: where it is not opaque, in as many samples as it hides of what lies behind.
    pub fn is_there(&self, id: u32, outline: &Outline, [column, row]: [usize; 2], areas: [i64; 3]) -> bool {
        let opacity = || self.color(id, outline, areas)[3];
        match self.look(id).map(|(look, _)| look.opacity) {
            None | Some(Opacity::Opaque) => true,
            Some(Opacity::Mask(least)) => opacity() >= least,
            Some(Opacity::Blend) => 16.0 * opacity() > f32::from(THRESHOLDS[row % 4][column % 4]) + 0.5,
        }
    }

    fn look(&self, id: u32) -> Option<(&'a Look, Option<Coordinates<'a>>)> {
        let material = self.mesh.materials.as_ref().map_or(0, |materials| materials.of_face[id as usize]);
        self.looks.get(material as usize).copied()
    }

    /// The texture coordinates of an outline's corners.
    fn texcoords(&self, coordinates: Coordinates<'_>, id: u32, outline: &Outline) -> [DVec2; 3] {
        outline.order().map(|corner| match coordinates {
            Coordinates::OfCorners(rows) => rows[id as usize][corner].as_dvec2(),
            Coordinates::OfVertices(channel) => {
                let row = channel.row(self.mesh.faces[id as usize][corner] as usize);
                DVec2::new(row[0].into(), row[1].into())
            }
        })
    }
}

/// The light of a color.
fn light([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    [r * r, g * g, b * b, a]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::camera::{Camera, Frame};
    use super::super::shade::{Paint, SAMPLES, render};
    use super::*;
    use crate::looks::{Image, Texture, Wrap};
    use crate::math::{DVec3, Vec3};
    use crate::mesh::{ChannelKind, Materials};

    /// A square that fills an image, seen from above, its texture coordinates its own.
    fn square() -> Mesh {
        let positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let faces = vec![[0, 1, 2], [0, 2, 3]];
        let texcoords =
            faces.iter().map(|face: &[u32; 3]| face.map(|v| Vec2::from(positions[v as usize].map(|x| x as f32))));
        let texcoords = Some(texcoords.collect());
        let positions = positions.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
        Mesh { texcoords, ..Mesh::new(positions, faces) }
    }

    fn pixels(mesh: &Mesh, looks: &[Look]) -> Vec<[f32; 3]> {
        let frame = Frame { width: 8 * SAMPLES, height: 8 * SAMPLES, margin: 0 };
        let camera = Camera::new(mesh, DVec3::Z, DVec3::Y, &frame);
        render(Model { mesh, looks }, Paint::Colors, &camera, &frame, [0.0; 3]).pixels
    }

    /// The red of a white surface that faces the eye.
    fn white() -> f32 {
        let mut mesh = square();
        mesh.face_colors = Some(vec![[1.0; 4]; 2]);
        pixels(&mesh, &[])[0][0]
    }

    fn textured(texels: [[u8; 4]; 4]) -> Look {
        let image = Arc::new(Image::new(2, 2, texels.to_vec()).expect("a picture"));
        let texture = Texture { image, channel: None, transform: Texture::UP, wrap: [Wrap::Clamp; 2] };
        Look { texture: Some(texture), ..Look::default() }
    }

    #[test]
    fn a_texture_lies_as_its_coordinates_say() {
        // Of four texels only the upper left one is white.
        let black = [0, 0, 0, 255];
        let look = textured([[255; 4], black, black, black]);
        let corners = |pixels: &[[f32; 3]]| [0, 7, 56, 63].map(|pixel| pixels[pixel][0]);
        assert_eq!(corners(&pixels(&square(), std::slice::from_ref(&look))), [white(), 0.0, 0.0, 0.0]);
        // The same by a channel of the vertices, which turns it by a quarter, and with a color.
        let values = vec![0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0];
        let channel = Channel { name: "TEXCOORD_1".into(), kind: ChannelKind::Texcoords, width: 2, values };
        let mesh = Mesh { channels: vec![channel], ..square() };
        let mut look = Look { color: [0.5, 1.0, 1.0, 1.0], ..look };
        look.texture.iter_mut().for_each(|texture| texture.channel = Some("TEXCOORD_1".into()));
        let [upper_left, upper_right, lower_left, lower_right] = corners(&pixels(&mesh, &[look]));
        assert_eq!([upper_left, upper_right, lower_right], [0.0; 3]);
        assert!((lower_left - 0.5 * white()).abs() < 1e-6, "{lower_left}");
    }

    #[test]
    fn what_is_half_there_hides_half() {
        let texel = |alpha| [255, 255, 255, alpha];
        let mut look = textured([0, 128, 128, 255].map(texel));
        let corners = |look: &Look| [0, 7, 56, 63].map(|pixel| pixels(&square(), std::slice::from_ref(look))[pixel][0]);
        assert_eq!(corners(&look), [white(); 4]);
        look.opacity = Opacity::Blend;
        let found = corners(&look);
        assert_eq!((found[0], found[3]), (0.0, white()));
        assert!((found[1] - 0.5_f32.sqrt() * white()).abs() < 1e-6, "{found:?}");
        look.opacity = Opacity::Mask(0.6);
        assert_eq!(corners(&look), [0.0, 0.0, 0.0, white()]);
    }

    #[test]
    fn every_face_has_its_material() {
        let materials = Materials { of_face: vec![1, 0], names: vec!["a".into(), "b".into()] };
        let mesh = Mesh { materials: Some(materials), ..square() };
        let of_color = |color| Look { color, ..Look::default() };
        let pixels = pixels(&mesh, &[of_color([1.0, 0.0, 0.0, 1.0]), of_color([0.0, 1.0, 0.0, 1.0])]);
        // The first face is the lower right half.
        assert!(pixels[63 - 8][1] > 0.5 && pixels[63 - 8][0] == 0.0 && pixels[8][0] > 0.5 && pixels[8][1] == 0.0);
    }

    #[test]
    fn normals_make_it_smooth_on_both_sides() {
        let flat = pixels(&square(), &[]);
        let up = |normal| Mesh { normals: Some(vec![normal; 4]), ..square() };
        assert_eq!(pixels(&up(Vec3::Z), &[]), flat);
        assert_eq!(pixels(&up(Vec3::NEG_Z), &[]), flat);
        assert_eq!(pixels(&up(Vec3::ZERO), &[]), flat);
        let to_the_light = pixels(&up(Vec3::new(-0.48, 0.64, 0.6)), &[]);
        assert!(to_the_light[20][0] > flat[20][0] + 0.05);
    }

    #[test]
    fn clay_is_what_has_no_colors() {
        let mesh = square();
        let is_colored = |looks: &[Look]| Model { mesh: &mesh, looks }.is_colored();
        assert!(!is_colored(&[]) && !is_colored(&[Look::default()]));
        assert!(is_colored(&[Look { color: [0.9; 4], ..Look::default() }]));
        assert!(Model::from(&Mesh { colors: Some(vec![[1.0; 4]; 4]), ..square() }).is_colored());
        // Coordinates that are not there leave the color.
        let mut look = textured([[0, 0, 0, 255]; 4]);
        look.texture.iter_mut().for_each(|texture| texture.channel = Some("none".into()));
        assert_eq!(pixels(&mesh, &[look])[0][0], white());
    }
}
