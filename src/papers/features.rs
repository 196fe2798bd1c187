//! \[Yang13\]: contraction that counts features, against half-edge contraction that does not.
//!
//! The paper's tables are lost. Its claim stands in the text: lower errors by Metro than plain quadrics, at about the same
//! time. Single rows go either way, so the claim is judged by the geometric means over a set of meshes and face counts.

use std::ops::RangeInclusive;

use super::{Trial, geometric_mean, trial};
use crate::backend::Device;
use crate::contract::{Feature, FeatureMode, Metric, Options, Placement, Update, Weighting};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::metrics;
use crate::simplify::{Budget, Method, StopReason};

/// The shares of the faces that are kept.
pub const KEPT: [f64; 4] = [0.2, 0.1, 0.05, 0.025];

/// The [`contenders`] that the claim is about: half-edges with features.
pub const CLAIMED: RangeInclusive<usize> = 1..=5;

/// The methods of a row by name: plain half-edge contraction first, then the default, the other modes, and features with
/// other placements and the other metric.
pub fn contenders() -> Vec<(&'static str, Options)> {
    let plain = Options { metric: Metric::Plane, placement: Placement::Endpoint, ..Options::default() };
    let of = |mode, curvature_floor, update| Weighting::Feature(Feature { mode, curvature_floor, update });
    let half_edge = |weighting| Options { weighting, ..plain.clone() };
    let affine = FeatureMode::Affine { lambda: 4.0 };
    let gated = FeatureMode::Gated { lambda: 16.0 };
    vec![
        ("half-edge", plain.clone()),
        ("affine", Options::feature_weighted()),
        ("affine, recomputed", half_edge(of(affine, 1.0, Update::Recompute))),
        ("gated", half_edge(of(gated, 1.0, Update::Static))),
        ("contrast", half_edge(of(FeatureMode::Contrast, 0.0, Update::Static))),
        ("entropy", half_edge(of(FeatureMode::Entropy, 0.0, Update::Static))),
        ("plane", Options { placement: Placement::Optimal, ..plain }),
        ("plane, affine", Options { placement: Placement::Optimal, ..Options::feature_weighted() }),
        ("volume", Options::default()),
        ("volume, affine", Options { weighting: of(affine, 1.0, Update::Static), ..Options::default() }),
    ]
}

/// One mesh at one share of its faces, by all [`contenders`] in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The share.
    pub kept: f64,
    /// What each made of it.
    pub trials: Vec<Trial>,
}

/// A contender's figures over those of plain half-edge contraction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratios {
    /// Hausdorff distance.
    pub max: f64,
    /// The greater mean distance of both sides.
    pub mean: f64,
    /// The greater root mean square.
    pub rms: f64,
    /// Seconds before the rounds.
    pub start_secs: f64,
    /// Seconds of the rounds.
    pub rounds_secs: f64,
    /// Seconds of the whole call.
    pub total_secs: f64,
}

/// Runs all contenders.
///
/// # Errors
/// As [`trial`].
pub fn row(mesh: &Mesh, kept: f64, measure: &metrics::Options, device: &Device) -> Result<Row> {
    let run = |(_, options)| trial(mesh, &Method::Contract(options), &Budget::keep(kept), measure, device);
    Ok(Row { kept, trials: contenders().into_iter().map(run).collect::<Result<_>>()? })
}

impl Row {
    /// Whether all have as many faces: where one is stuck the others are not to be compared with it.
    pub fn is_fair(&self) -> bool {
        let faces = |trial: &Trial| (trial.faces, trial.stop == StopReason::FacesReached);
        self.trials.windows(2).all(|pair| faces(&pair[0]) == faces(&pair[1])) && self.plain_is_apart()
    }

    fn plain_is_apart(&self) -> bool {
        self.trials.first().is_some_and(|plain| plain.deviation.symmetric().max > 0.0)
    }

    /// The ratios of every contender, plain half-edge contraction included.
    pub fn ratios(&self) -> Vec<Ratios> {
        let Some(plain) = self.trials.first() else { return Vec::new() };
        let by = plain.deviation.symmetric();
        let ratios = |trial: &Trial| {
            let spread = trial.deviation.symmetric();
            Ratios {
                max: spread.max / by.max,
                mean: spread.mean / by.mean,
                rms: spread.rms / by.rms,
                start_secs: trial.start_secs() / plain.start_secs(),
                rounds_secs: trial.rounds_secs() / plain.rounds_secs(),
                total_secs: trial.seconds.total / plain.seconds.total,
            }
        };
        self.trials.iter().map(ratios).collect()
    }
}

/// The geometric means of every contender's ratios over the rows that are fair.
pub fn means(rows: &[Row]) -> Vec<Ratios> {
    let fair: Vec<Vec<Ratios>> = rows.iter().filter(|row| row.is_fair()).map(Row::ratios).collect();
    let mean = |contender: usize, of: fn(&Ratios) -> f64| geometric_mean(fair.iter().map(|row| of(&row[contender])));
    (0..contenders().len())
        .map(|contender| Ratios {
            max: mean(contender, |ratios| ratios.max),
            mean: mean(contender, |ratios| ratios.mean),
            rms: mean(contender, |ratios| ratios.rms),
            start_secs: mean(contender, |ratios| ratios.start_secs),
            rounds_secs: mean(contender, |ratios| ratios.rounds_secs),
            total_secs: mean(contender, |ratios| ratios.total_secs),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    #[test]
    fn a_row_compares_all_with_plain_half_edges() {
        let mesh = sample("statue", Some(3000)).unwrap();
        let measure = metrics::Options { samples: Some(5000), ..metrics::Options::default() };
        let row = row(&mesh, 0.1, &measure, &Device::cpu(1).unwrap()).unwrap();
        assert_eq!(row.trials.len(), contenders().len());
        assert!(row.is_fair());
        let means = means(&[row.clone(), row.clone()]);
        assert_eq!((means[0].max, means[0].rounds_secs), (1.0, 1.0));
        assert!((means[1].mean - row.ratios()[1].mean).abs() < 1e-12);
        // Optimal placement is far more accurate than half-edges.
        assert!(means[6].rms < 0.9, "{means:?}");
    }
}
