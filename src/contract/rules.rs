//! What stays the same over all rounds of a run.

use crate::kernel::plane_costs::PLANE_REGULARIZATION;
use crate::kernel::volume_costs::{BORDER_FACTOR, VOLUME_REGULARIZATION};
use crate::mesh::limits::min_cos;

use super::filter::ShapeLimits;
use super::{Metric, Options, Placement};

/// Least height of a changed face over its length. Thinner faces have normals of rounding noise, which the next
/// contraction lays over.
const MIN_HEIGHT: f64 = 1e-3;

/// What legal contractions, and where their vertices go, depend on.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    pub metric: Metric,
    pub placement: Placement,
    pub border_weight: f64,
    pub regularization: f64,
    pub limits: ShapeLimits,
    /// Whether pairs may join parts, and change the topology where they have or the surface was not manifold.
    pub joins: bool,
    /// Whether it costs that both sides of a wall cancel each other out: where parts join that is meant.
    pub keeps_walls: bool,
    /// Whether borders are to be those of the input, also where parts join.
    pub locks_border: bool,
    /// Greatest estimated deviation, in the normalized frame.
    pub max_deviation: f64,
}

impl Rules {
    /// The rules that `options` set, where vertices yield or not at which the surface is not manifold, with an error limit in the
    /// normalized frame.
    pub fn new(options: &Options, complex_yield: bool, max_deviation: f64) -> Self {
        Self {
            metric: options.metric,
            placement: options.placement,
            border_weight: f64::from(BORDER_FACTOR * options.border_weight),
            regularization: f64::from(match options.metric {
                Metric::Volume => VOLUME_REGULARIZATION,
                Metric::Plane => PLANE_REGULARIZATION,
            }),
            limits: ShapeLimits { min_cos: min_cos(options.max_flip_rad), min_height: MIN_HEIGHT },
            max_deviation,
            joins: options.joins() || complex_yield,
            keeps_walls: complex_yield && !options.joins(),
            locks_border: options.lock_border && !options.joins(),
        }
    }
}
