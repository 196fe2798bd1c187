//! Pair contraction in rounds.

use crate::backend::Device;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome};

/// What a contraction costs and where its vertex goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Metric {
    /// Volume swept, over the current faces of both stars \[LT98\].
    #[default]
    Volume,
    /// Squared distances to the planes of the original, accumulated \[GH97\].
    Plane,
}

/// Where the vertex of a contraction may go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// Where the metric is least.
    #[default]
    Optimal,
    /// At one of the two ends: the result's vertices are a subset of the input's.
    Endpoint,
}

/// Options of pair contraction.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The metric.
    pub metric: Metric,
    /// The placement policy.
    pub placement: Placement,
    /// Weight of border edges against faces; 0 lets borders move freely.
    pub border_weight: f32,
    /// Whether border vertices stay where they are.
    pub lock_border: bool,
    /// Largest turn of a face's normal in one contraction, in radians.
    pub max_flip_rad: f32,
    /// Join vertices at most this far apart first, in model units; `None` joins nothing, 0 joins equal positions.
    pub weld: Option<f64>,
    /// Drop components whose bounding box's diagonal is below this fraction of the mesh's first.
    pub prune: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            metric: Metric::Volume,
            placement: Placement::Optimal,
            border_weight: 1.0,
            lock_border: false,
            max_flip_rad: 1.369_438_4,
            weld: Some(0.0),
            prune: 0.0,
        }
    }
}

/// Runs pair contraction.
pub fn run(
    _mesh: &Mesh,
    _options: &Options,
    _budget: &Budget,
    _device: &Device,
    _progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    Err(crate::error::Error::Unsupported("not built yet".into()))
}
