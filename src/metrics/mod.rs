//! How far one mesh is from another, in place, color and texture; and how good a mesh is by itself.

mod atlas;
pub mod color;
pub mod quality;
mod sums;
pub mod texture;
pub mod view;

pub use color::{ColorDeviation, ColorSums};
pub use quality::{Quality, quality};
pub use texture::{TextureDeviation, texture_deviation};
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
