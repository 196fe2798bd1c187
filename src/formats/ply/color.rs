//! Where the channels of a color stand in a row, of a vertex or of a face.

use super::header::{Kind, Property};
use super::scalar::Scalar;
use crate::formats::attributes;

/// The number called `name` among the properties of a row: its place and type.
pub(super) fn scalar(properties: &[Property], name: &str) -> Option<(usize, Scalar)> {
    properties.iter().enumerate().find_map(|(at, property)| match property.kind {
        Kind::Scalar(scalar) if property.name == name => Some((at, scalar)),
        _ => None,
    })
}

/// The places of the color channels, as indices of properties.
#[derive(Debug)]
pub(super) struct ColorLayout {
    rgb: [usize; 3],
    alpha: Option<usize>,
    /// Take a stored channel to `[0, 1]`.
    factors: [f64; 4],
}

impl ColorLayout {
    /// Finds the channels by their names; nothing unless red, green and blue are there.
    pub(super) fn of(properties: &[Property]) -> Option<Self> {
        ["", "diffuse_"].into_iter().find_map(|prefix| {
            let [red, green, blue, alpha] =
                ["red", "green", "blue", "alpha"].map(|channel| scalar(properties, &format!("{prefix}{channel}")));
            let (red, green, blue) = (red?, green?, blue?);
            let factor = |(_, scalar): (usize, Scalar)| scalar.color_factor();
            Some(Self {
                rgb: [red.0, green.0, blue.0],
                alpha: alpha.map(|(at, _)| at),
                factors: [factor(red), factor(green), factor(blue), alpha.map_or(1.0, factor)],
            })
        })
    }

    /// Whether the property at this place is a channel.
    pub(super) fn contains(&self, place: usize) -> bool {
        self.rgb.contains(&place) || self.alpha == Some(place)
    }

    /// The last place of a channel.
    pub(super) fn last(&self) -> usize {
        self.rgb.into_iter().chain(self.alpha).fold(0, usize::max)
    }

    /// The color of the row whose property `at` has the value `value(at)`.
    pub(super) fn color(&self, value: impl Fn(usize) -> f64) -> [f32; 4] {
        let [red, green, blue] = self.rgb.map(&value);
        let alpha = self.alpha.map_or(1.0, value);
        let stored = [red, green, blue, alpha];
        std::array::from_fn(|channel| attributes::channel(stored[channel], self.factors[channel]))
    }
}
