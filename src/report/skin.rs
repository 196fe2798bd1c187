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
    /// A look for each of its materials; none for a mesh without.
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
        let material = self.mesh.materials.as_ref()?.of_face[id as usize];
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
