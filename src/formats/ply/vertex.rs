//! Where the values of a vertex stand in its row.

use super::FORMAT;
use super::color::{ColorLayout, scalar};
use super::header::{Kind, Property};
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{Channel, ChannelKind, Mesh};

/// The places of the values in the row, as indices of properties.
#[derive(Debug)]
pub(super) struct VertexLayout {
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
    pub(super) color: Option<ColorLayout>,
    pub(super) texcoord: Option<[usize; 2]>,
    /// All other numbers, by their names: whole ones are labels.
    pub(super) channels: Vec<(String, ChannelKind, usize)>,
}

/// Vertices as they are read: the texture coordinates wait here for the faces, whose corners get them.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub(super) mesh: Mesh,
    pub(super) texcoords: Option<Vec<Vec2>>,
}

impl Vertices {
    /// The mesh, once its faces are read. Texture coordinates that these have of their own stay.
    pub(super) fn into_mesh(self) -> Mesh {
        let mut mesh = self.mesh;
        if let (Some(of_vertex), None) = (&self.texcoords, &mesh.texcoords) {
            mesh.texcoords = Some(attributes::of_corners(&mesh.faces, of_vertex));
        }
        mesh
    }
}

impl VertexLayout {
    /// Finds the values by their names.
    ///
    /// # Errors
    /// [`Error::Format`] when a coordinate is missing.
    pub(super) fn of(properties: &[Property]) -> Result<Self> {
        let places = |names: [&str; 3]| -> Option<[usize; 3]> {
            let [a, b, c] = names.map(|name| scalar(properties, name).map(|(at, _)| at));
            Some([a?, b?, c?])
        };
        let Some(position) = places(["x", "y", "z"]) else {
            let message = "the element 'vertex' lacks one of the properties 'x', 'y', 'z'";
            return Err(Error::format(FORMAT, Place::File, message));
        };
        let float = |name: &str| scalar(properties, name).filter(|(_, scalar)| scalar.is_float()).map(|(at, _)| at);
        let texcoord = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]]
            .into_iter()
            .find_map(|[u, v]| Some([float(u)?, float(v)?]));
        let (normal, color) = (places(["nx", "ny", "nz"]), ColorLayout::of(properties));
        let is_standard = |place: &usize| {
            let mut listed = position.iter().chain(normal.iter().flatten()).chain(texcoord.iter().flatten());
            listed.any(|standard| standard == place) || color.as_ref().is_some_and(|color| color.contains(*place))
        };
        let channel = |(place, property): (usize, &Property)| {
            let Kind::Scalar(scalar) = property.kind else { return None };
            let kind = if scalar.is_float() { ChannelKind::Linear } else { ChannelKind::Label };
            (!is_standard(&place)).then(|| (property.name.clone(), kind, place))
        };
        let channels = properties.iter().enumerate().filter_map(channel).collect();
        Ok(Self { position, normal, color, texcoord, channels })
    }

    /// The position of the row whose property `at` has the value `value(at)`.
    #[inline]
    pub(super) fn position(&self, value: impl Fn(usize) -> f64) -> DVec3 {
        DVec3::from(self.position.map(value))
    }

    /// Appends a row to `vertices`, which [`VertexLayout::no_vertices`] made.
    pub(super) fn push(&self, vertices: &mut Vertices, value: impl Fn(usize) -> f64) {
        let Vertices { mesh, texcoords } = vertices;
        mesh.positions.push(self.position(&value));
        if let (Some(places), Some(normals)) = (self.normal, &mut mesh.normals) {
            normals.push(normal(places, &value));
        }
        if let (Some(layout), Some(colors)) = (&self.color, &mut mesh.colors) {
            colors.push(layout.color(&value));
        }
        if let (Some(places), Some(texcoords)) = (self.texcoord, texcoords) {
            texcoords.push(texcoord(places, &value));
        }
        for ((.., place), channel) in self.channels.iter().zip(&mut mesh.channels) {
            channel.values.push(value(*place) as f32);
        }
    }

    /// The channels, of these values.
    pub(super) fn channels(&self, values: impl Fn(usize) -> Vec<f32>) -> Vec<Channel> {
        let channel = |(name, kind, place): &(String, ChannelKind, usize)| Channel {
            name: name.clone(),
            kind: *kind,
            width: 1,
            values: values(*place),
        };
        self.channels.iter().map(channel).collect()
    }

    /// No vertices, ready for [`VertexLayout::push`].
    pub(super) fn no_vertices(&self) -> Vertices {
        let mesh = Mesh {
            normals: self.normal.is_some().then(Vec::new),
            colors: self.color.is_some().then(Vec::new),
            channels: self.channels(|_| Vec::new()),
            ..Mesh::default()
        };
        Vertices { mesh, texcoords: self.texcoord.is_some().then(Vec::new) }
    }
}

/// The texture coordinates of a row.
pub(super) fn texcoord(places: [usize; 2], value: impl Fn(usize) -> f64) -> Vec2 {
    attributes::texcoord(value(places[0]), value(places[1]))
}

/// The unit normal of a row.
pub(super) fn normal(places: [usize; 3], value: impl Fn(usize) -> f64) -> Vec3 {
    attributes::unit_normal(Vec3::from(places.map(|at| value(at) as f32)))
}
