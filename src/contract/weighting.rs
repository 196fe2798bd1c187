//! What every vertex counts: policies as data, and what is wrong with them.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::kernel::feature_weights::Params;

/// What the planes of a vertex count in the costs, beside those of others.
///
/// With the metric `plane` the quadric of a vertex is multiplied by its weight; with `volume` the cost of a pair by the
/// greater weight of its ends, and placements do not change. The estimated deviation of `plane` is then a weighted mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Weighting {
    /// All the same.
    #[default]
    Uniform,
    /// By how strongly the curvature changes about a vertex \[Yang13\].
    Feature(Feature),
    /// A weight for every vertex of the input, not negative; only their ratios count, so that weights which are all 0 are as good as all
    /// 1. Where vertices are joined, that of the lowest holds.
    Given(Arc<[f32]>),
}

/// Weights by visual features: the entropy of the mean curvatures about a vertex, over that of equal curvatures, is H; its
/// feature degree is 1 − H, in `[0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feature {
    /// From the degree to the weight.
    pub mode: FeatureMode,
    /// Added to every curvature, as a multiple of the mean of all: below it curvatures drown, so that the noise on a flat is
    /// no feature. 0 as in the paper.
    pub curvature_floor: f32,
    /// When weights are found.
    pub update: Update,
}

/// From the feature degree d to the weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FeatureMode {
    /// 1 + λd.
    Affine {
        /// λ, how much more a feature counts than a region of even curvature.
        lambda: f32,
    },
    /// 1 + λd·k/(k + floor), with k the curvature of the vertex itself: less beside a crease than on it.
    Gated {
        /// λ.
        lambda: f32,
    },
    /// d, at least 0.001: the product as the paper's text has it. Regions of even curvature cost next to nothing.
    Contrast,
    /// 1 − d, at least 0.001: the other reading of the paper's lost formula.
    Entropy,
}

/// When the weights of features are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Update {
    /// Once, on the input.
    #[default]
    Static,
    /// In every round, on the surface as it is then.
    Recompute,
}

/// The least weight of the modes that are products, as the reason for a floor at all: with 0 costs would not order.
const LEAST_WEIGHT: f32 = 1e-3;
/// Curvatures below this, in one over the mean edge, are rounding noise: a floor that is a mean is not below.
const LEAST_CURVATURE: f32 = 1e-4;
/// Greatest factor and floor.
const MOST: f32 = 1e6;

impl Default for Feature {
    /// 1 + 4d with the mean curvature as the floor, once.
    fn default() -> Self {
        Self { mode: FeatureMode::Affine { lambda: 4.0 }, curvature_floor: 1.0, update: Update::Static }
    }
}

impl Feature {
    /// What the kernel needs, on a surface of so many vertices.
    pub(super) fn params(&self, vertex_count: usize) -> Params {
        let (base, slope, least, of_fixed) = match self.mode {
            FeatureMode::Affine { lambda } | FeatureMode::Gated { lambda } => (1.0, lambda, 0.0, 1.0 + lambda),
            FeatureMode::Contrast => (0.0, 1.0, LEAST_WEIGHT, 1.0),
            FeatureMode::Entropy => (1.0, -1.0, LEAST_WEIGHT, 1.0),
        };
        Params {
            floor_share: (f64::from(self.curvature_floor) / vertex_count as f64) as f32,
            least_sum: LEAST_CURVATURE * vertex_count as f32,
            gated: u32::from(matches!(self.mode, FeatureMode::Gated { .. })),
            base,
            slope,
            least,
            of_fixed,
        }
    }

    /// The same for the degree itself.
    pub(super) fn degree_params(&self, vertex_count: usize) -> Params {
        Params { gated: 0, base: 0.0, slope: 1.0, least: 0.0, of_fixed: 1.0, ..self.params(vertex_count) }
    }

    fn check(&self) -> Result<()> {
        let within = |x: f32| (0.0..=MOST).contains(&x);
        match self.mode {
            FeatureMode::Affine { lambda } | FeatureMode::Gated { lambda } if !within(lambda) => {
                Err(Error::Parameter(format!("the feature factor λ is {lambda}, not in 0 … 1e6")))
            }
            _ if !within(self.curvature_floor) => {
                Err(Error::Parameter(format!("the curvature floor is {}, not in 0 … 1e6", self.curvature_floor)))
            }
            _ => Ok(()),
        }
    }
}

impl Weighting {
    /// Whether a mesh of so many vertices can be weighed by it.
    pub(super) fn check(&self, vertex_count: usize) -> Result<()> {
        match self {
            Self::Uniform => Ok(()),
            Self::Feature(feature) => feature.check(),
            Self::Given(weights) if weights.len() != vertex_count => {
                let given = weights.len();
                Err(Error::Parameter(format!("{given} weights for a mesh of {vertex_count} vertices: give one each")))
            }
            Self::Given(weights) => match weights.iter().position(|weight| !(*weight >= 0.0 && weight.is_finite())) {
                Some(vertex) => Err(Error::Parameter(format!(
                    "the weight of vertex {vertex} is {}: give finite numbers from 0",
                    weights[vertex]
                ))),
                None => Ok(()),
            },
        }
    }

    /// Given weights for the vertices that began as these, times a power of two: the greatest is in 1 .. 2. With 0 for all costs would
    /// not order, and a greatest one there is not: then all are 1.
    pub(super) fn given(&self, origins: &[u32]) -> Option<Vec<f32>> {
        let Self::Given(weights) = self else { return None };
        let greatest = origins.iter().map(|&v| weights[v as usize]).fold(0.0_f32, f32::max);
        if greatest == 0.0 {
            return Some(vec![1.0; origins.len()]);
        }
        // From the bits, where even the least number has its full exponent: exact, and the same on every platform.
        let exponent = (f64::from(greatest).to_bits() >> 52) as i64 - 1023;
        let scale = f64::from_bits(((1023 - exponent) as u64) << 52);
        Some(origins.iter().map(|&v| (f64::from(weights[v as usize]) * scale) as f32).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(weights: &[f32]) -> Weighting {
        Weighting::Given(weights.into())
    }

    #[test]
    fn weights_are_scaled_by_powers_of_two() {
        assert_eq!(given(&[1.0, 0.5, 0.0]).given(&[2, 1, 0]), Some(vec![0.0, 0.5, 1.0]));
        assert_eq!(given(&[12.0, 3.0]).given(&[0, 1]), Some(vec![1.5, 0.375]));
        assert_eq!(given(&[3e38, 1.0]).given(&[0]).map(|w| (1.0..2.0).contains(&w[0])), Some(true));
        assert_eq!(given(&[1e-45, 0.0]).given(&[0, 1]), Some(vec![1.0, 0.0]));
        // The greatest is that of the vertices that are left.
        assert_eq!(given(&[8.0, 1.0]).given(&[1]), Some(vec![1.0]));
        assert_eq!(Weighting::Uniform.given(&[0]), None);
    }

    #[test]
    fn weights_that_are_all_zero_order_as_equal_ones_do() {
        assert_eq!(given(&[0.0; 2]).given(&[0, 1]), Some(vec![1.0; 2]));
        assert_eq!(given(&[8.0, 0.0, -0.0]).given(&[1, 2]), Some(vec![1.0; 2]));
    }

    #[test]
    fn bad_weights_are_told() {
        let message = |weights: &[f32]| given(weights).check(2).map_err(|error| error.to_string()).err();
        assert_eq!(message(&[0.0, 3e38]), None);
        for (weights, part) in [
            (&[1.0][..], "1 weights for a mesh of 2 vertices"),
            (&[1.0, f32::NAN], "vertex 1 is NaN"),
            (&[-1.0, 1.0], "vertex 0 is -1"),
            (&[1.0, f32::INFINITY], "vertex 1 is inf"),
        ] {
            assert!(message(weights).is_some_and(|text| text.contains(part)), "{part}");
        }
    }

    #[test]
    fn bad_factors_are_told() {
        let check = |mode, curvature_floor| {
            Weighting::Feature(Feature { mode, curvature_floor, ..Feature::default() }).check(9).is_ok()
        };
        assert!(check(FeatureMode::Affine { lambda: 0.0 }, 0.0) && check(FeatureMode::Contrast, 1e6));
        assert!(!check(FeatureMode::Affine { lambda: -1.0 }, 1.0) && !check(FeatureMode::Gated { lambda: 2e6 }, 1.0));
        assert!(!check(FeatureMode::Affine { lambda: f32::NAN }, 1.0) && !check(FeatureMode::Entropy, f32::NAN));
    }
}
