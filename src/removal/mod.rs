//! Vertex removal in rounds: take the vertices nearest to the plane of their neighborhood away, and fill the holes.
//!
//! The vertices of the result are vertices of the input, bit for bit. The loop is in `driver`: costs on a device and a gate
//! (`evaluate`), the `hole` that a vertex leaves, its `fill`, and `commit`, which takes an independent set in the order of
//! cost.
//!
//! # Classes
//! As \[SZL92\]: simple vertices go by their distance to the average plane, those on a border or between two feature edges
//! by their distance to the line of the two neighbors; where the surface is not one consistently oriented fan vertices stay, and
//! where features meet or end if [`Features::Keep`] says so.
//!
//! # Invariants
//! - No two vertices of a round share an edge, so that each hole is what the round began with; the diagonals of a hole are
//!   edges nowhere else. A disk takes the place of a disk: manifold in, manifold out; Euler characteristic, borders and
//!   parts are kept.
//! - Holes are examined in parallel and closed in the order of (cost, hash): the same bytes for any number of threads.
//!
//! # Error
//! Every removed vertex is kept as a sample of a face of the result: the nearest of those that took the place of its own,
//! and again whenever these are replaced. No vertex of a face of the input is farther from the result than the greatest distance of a
//! sample to its face, but for those that a weld moved. The other way, how far the middle of every new edge is from the faces that
//! went adds up: where a rim bends inward a vertex lies inside of what fills its hole. The estimate is the greater of both; points
//! within faces may be farther.

mod commit;
mod driver;
mod evaluate;
mod examine;
mod fill;
mod hole;
mod polygon;
mod prepare;
mod samples;
mod surface;

use crate::backend::Device;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::mesh::limits::{MAX_FLIP_RAD, check_max_flip, check_weld, crease_cos};
use crate::polish::Flips;
use crate::simplify::{Budget, OnProgress, Outcome};

#[doc(hidden)]
pub use fill::triangulations;

/// How a hole is filled. All avoid folds first: of the fills that each looks at the one whose sharpest edge bends least, of
/// those the one with the roundest faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// By the best fan around one of its vertices: what contracting an edge leaves.
    Fan,
    /// By cutting off the roundest ear, again and again \[Liu99\].
    Ears,
    /// By dynamic programming over all triangulations, in O(k³); fans beyond [`MOST_DYNAMIC`] edges.
    #[default]
    Dynamic,
    /// By the best of all triangulations up to [`MOST_ENUMERATED`] edges, and as [`Fill::Dynamic`] beyond.
    Exhaustive,
}

/// What edges are worth whose faces' normals are farther apart than an angle in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Features {
    /// Nothing.
    Ignore,
    /// A vertex on two of them goes along them, and its hole is filled on either side.
    Guide(f32),
    /// The same, and vertices where they meet or end stay \[SZL92\]: a run may get stuck above its target.
    Keep(f32),
}

/// Default angle of features, 60°.
const GUIDE_RAD: f32 = std::f32::consts::FRAC_PI_3;

impl Default for Features {
    fn default() -> Self {
        Self::Guide(GUIDE_RAD)
    }
}

/// Edges of the largest hole that [`Fill::Dynamic`] fills by itself.
pub const MOST_DYNAMIC: usize = 40;
/// Edges of the largest hole whose triangulations [`Fill::Exhaustive`] lists: 42.
pub const MOST_ENUMERATED: usize = 7;

/// Options of vertex removal.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// How holes are filled.
    pub fill: Fill,
    /// What sharp edges are worth.
    pub features: Features,
    /// Whether border vertices stay.
    pub lock_border: bool,
    /// Largest angle between the normal of a new face and the average normal of those it replaces, in radians.
    pub max_flip_rad: f32,
    /// Join vertices at most this far apart first, in model units; `None` joins nothing, 0 joins equal positions.
    pub weld: Option<f64>,
    /// Edge flips after the rounds: the estimate is then none of the result.
    pub flips: Flips,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fill: Fill::default(),
            features: Features::default(),
            lock_border: false,
            max_flip_rad: MAX_FLIP_RAD,
            weld: Some(0.0),
            flips: Flips::default(),
        }
    }
}

impl Options {
    /// The cosine below which an edge is a feature; −2 without any.
    fn crease_cos(&self) -> f32 {
        match self.features {
            Features::Guide(angle) | Features::Keep(angle) => crease_cos(angle),
            Features::Ignore => -2.0,
        }
    }

    /// Whether corners stay.
    fn keeps_corners(&self) -> bool {
        matches!(self.features, Features::Keep(_))
    }

    fn check(&self) -> Result<()> {
        check_max_flip(self.max_flip_rad)?;
        if let Features::Guide(angle) | Features::Keep(angle) = self.features
            && !(0.0..=std::f32::consts::PI).contains(&angle)
        {
            return Err(Error::Parameter(format!("the feature angle is {}°, not in 0 … 180", angle.to_degrees())));
        }
        check_weld(self.weld)
    }
}

/// Runs vertex removal: see [`crate::simplify()`].
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    options.check()?;
    device.install(|| driver::run(mesh, options, budget, device, progress))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_is_the_same_whether_corners_stay_or_not() {
        let of = |features: Features| Options { features, ..Options::default() }.crease_cos();
        for angle in [0.0, 0.5, GUIDE_RAD, 2.0] {
            assert_eq!(of(Features::Guide(angle)), of(Features::Keep(angle)), "{angle}");
        }
        assert_eq!((of(Features::Keep(GUIDE_RAD)), of(Features::Ignore)), (0.5, -2.0));
    }
}
