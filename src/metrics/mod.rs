//! How far one mesh is from another, in place, direction, color and texture; and how good a mesh is by itself.
//!
//! Lengths are in model units, angles in radians. Nothing depends on the device or on the number of threads.

mod atlas;
pub mod color;
pub mod compare;
pub mod deviation;
mod proposals;
pub mod quality;
mod rims;
pub mod sampling;
mod sums;
mod texels;
pub mod texture;
pub mod view;

pub use color::{ColorDeviation, ColorSums};
pub use compare::{Comparison, compare};
pub use deviation::{AngleSpread, Deviation, MOST_SAMPLES, Options, Side, deviation, vertex_distances};
pub use quality::{Quality, quality};
pub use sampling::Kinds;
pub use texture::{MaterialTexture, TextureDeviation, texture_by_material, texture_deviation};
pub use view::View;

/// A deviation over many samples.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Spread {
    /// The greatest.
    pub max: f64,
    /// The arithmetic mean.
    pub mean: f64,
    /// The root of the mean square.
    pub rms: f64,
}

impl Spread {
    /// The greater of each.
    pub fn greater(self, other: Self) -> Self {
        Self { max: self.max.max(other.max), mean: self.mean.max(other.mean), rms: self.rms.max(other.rms) }
    }
}
