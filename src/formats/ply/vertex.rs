//! Where the values of a vertex stand in its row.

use super::FORMAT;
use super::header::{Kind, Property};
use super::scalar::Scalar;
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// The places of the values in the row, as indices of properties.
#[derive(Debug)]
pub(super) struct VertexLayout {
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
    pub(super) color: Option<ColorLayout>,
}

/// The places of the color channels.
#[derive(Debug)]
pub(super) struct ColorLayout {
    rgb: [usize; 3],
    alpha: Option<usize>,
    /// Take a stored channel to `[0, 1]`.
    factors: [f64; 4],
}

impl VertexLayout {
    /// Finds the values by their names.
    ///
    /// # Errors
    /// [`Error::Format`] when a coordinate is missing.
    pub(super) fn of(properties: &[Property]) -> Result<Self> {
        let scalar = |name: &str| -> Option<(usize, Scalar)> {
            properties.iter().enumerate().find_map(|(at, property)| match property.kind {
                Kind::Scalar(scalar) if property.name == name => Some((at, scalar)),
                _ => None,
            })
        };
        let places = |names: [&str; 3]| -> Option<[usize; 3]> {
            let [a, b, c] = names.map(|name| scalar(name).map(|(at, _)| at));
            Some([a?, b?, c?])
        };
        let Some(position) = places(["x", "y", "z"]) else {
            let message = "the element 'vertex' lacks one of the properties 'x', 'y', 'z'";
            return Err(Error::format(FORMAT, Place::File, message));
        };
        let color = ["", "diffuse_"].into_iter().find_map(|prefix| {
            let [red, green, blue, alpha] =
                ["red", "green", "blue", "alpha"].map(|channel| scalar(&format!("{prefix}{channel}")));
            let (red, green, blue) = (red?, green?, blue?);
            let factor = |(_, scalar): (usize, Scalar)| scalar.color_factor();
            Some(ColorLayout {
                rgb: [red.0, green.0, blue.0],
                alpha: alpha.map(|(at, _)| at),
                factors: [factor(red), factor(green), factor(blue), alpha.map_or(1.0, factor)],
            })
        });
        Ok(Self { position, normal: places(["nx", "ny", "nz"]), color })
    }

    /// The position of the row whose property `at` has the value `value(at)`.
    #[inline]
    pub(super) fn position(&self, value: impl Fn(usize) -> f64) -> DVec3 {
        DVec3::from(self.position.map(value))
    }

    /// Appends a row to `mesh`, whose normals and colors are there when the layout has them.
    pub(super) fn push(&self, mesh: &mut Mesh, value: impl Fn(usize) -> f64) {
        mesh.positions.push(self.position(&value));
        if let (Some(places), Some(normals)) = (self.normal, &mut mesh.normals) {
            normals.push(normal(places, &value));
        }
        if let (Some(layout), Some(colors)) = (&self.color, &mut mesh.colors) {
            colors.push(layout.color(&value));
        }
    }

    /// A mesh without vertices, ready for [`VertexLayout::push`].
    pub(super) fn empty_mesh(&self) -> Mesh {
        Mesh {
            normals: self.normal.is_some().then(Vec::new),
            colors: self.color.is_some().then(Vec::new),
            ..Mesh::default()
        }
    }
}

/// The unit normal of a row.
pub(super) fn normal(places: [usize; 3], value: impl Fn(usize) -> f64) -> Vec3 {
    attributes::unit_normal(Vec3::from(places.map(|at| value(at) as f32)))
}

impl ColorLayout {
    /// The color of a row.
    pub(super) fn color(&self, value: impl Fn(usize) -> f64) -> [f32; 4] {
        let [red, green, blue] = self.rgb.map(&value);
        let alpha = self.alpha.map_or(1.0, value);
        let stored = [red, green, blue, alpha];
        std::array::from_fn(|channel| attributes::channel(stored[channel], self.factors[channel]))
    }
}
