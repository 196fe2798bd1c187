//! The papers' tables as jobs: one method on one mesh, run and measured, and the sets of jobs that a claim is judged by.

pub mod average;
pub mod features;
pub mod light;
pub mod regions;
pub mod survey;

use crate::backend::Device;
use crate::contract::{Options, QuadricRecord};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::metrics::{self, Deviation, deviation};
use crate::simplify::{Budget, Method, Phases, StopReason, simplify};

/// What one method made of one mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Faces of the result.
    pub faces: usize,
    /// Why it ended.
    pub stop: StopReason,
    /// Rounds it took.
    pub rounds: usize,
    /// Seconds by phase.
    pub seconds: Phases,
    /// How its initial quadrics were stored, where they were.
    pub quadrics: Option<QuadricRecord>,
    /// From the input to the result and back.
    pub deviation: Deviation,
}

impl Trial {
    /// Seconds before the first round: welding, normalization, adjacency, quadrics, weights.
    pub fn start_secs(&self) -> f64 {
        self.seconds.weld + self.seconds.build
    }

    /// Seconds of the rounds.
    pub fn rounds_secs(&self) -> f64 {
        self.seconds.total - self.start_secs()
    }
}

/// Simplifies `mesh` by `method` until `budget` is met, and measures the result.
///
/// # Errors
/// As [`simplify()`] and [`deviation()`].
pub fn trial(
    mesh: &Mesh,
    method: &Method,
    budget: &Budget,
    measure: &metrics::Options,
    device: &Device,
) -> Result<Trial> {
    let outcome = simplify(mesh, method, budget, device, None)?;
    Ok(Trial {
        faces: outcome.mesh.faces.len(),
        stop: outcome.stop,
        rounds: outcome.rounds.len(),
        seconds: outcome.seconds,
        quadrics: outcome.quadrics,
        deviation: deviation(mesh, &outcome.mesh, measure, device)?,
    })
}

/// [`trial`]s of several contractions, the seconds of each the median of `repeats` more in turns; with none of the trial.
///
/// # Errors
/// As [`trial`].
pub fn trials(
    mesh: &Mesh,
    contenders: &[(&'static str, Options)],
    budget: &Budget,
    repeats: usize,
    measure: &metrics::Options,
    device: &Device,
) -> Result<Vec<Trial>> {
    let methods: Vec<Method> = contenders.iter().map(|(_, options)| Method::Contract(options.clone())).collect();
    let mut trials: Vec<Trial> =
        methods.iter().map(|method| trial(mesh, method, budget, measure, device)).collect::<Result<_>>()?;
    let mut turns: Vec<Vec<Phases>> = vec![Vec::with_capacity(repeats); methods.len()];
    for _ in 0..repeats {
        for (method, turns) in methods.iter().zip(&mut turns) {
            turns.push(simplify(mesh, method, budget, device, None)?.seconds);
        }
    }
    for (trial, turns) in trials.iter_mut().zip(&mut turns) {
        turns.sort_by(|a, b| a.total.total_cmp(&b.total));
        trial.seconds = turns.get(turns.len() / 2).copied().unwrap_or(trial.seconds);
    }
    Ok(trials)
}

/// The middle of `values`, the greater of two that are beside it; NaN of none.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The geometric mean of positive ratios; 1 of none.
pub fn geometric_mean(ratios: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = ratios.into_iter().fold((0.0, 0.0), |(sum, count), ratio| (sum + ratio.ln(), count + 1.0));
    if count == 0.0 { 1.0 } else { f64::exp(sum / count) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn a_trial_tells_what_came_out() {
        let (mesh, device) = (shapes::icosphere(3), Device::cpu(1).unwrap());
        let measure = metrics::Options::default();
        let trial = trial(&mesh, &Method::default(), &Budget::faces(320), &measure, &device).unwrap();
        assert_eq!((trial.faces, trial.stop), (320, StopReason::FacesReached));
        assert!((0.0..0.05).contains(&trial.deviation.symmetric().max) && trial.rounds > 0);
        assert!(trial.start_secs() > 0.0 && trial.rounds_secs() > 0.0);
    }

    #[test]
    fn medians() {
        assert!(median([]).is_nan());
        assert_eq!([median([3.0, 1.0, 2.0]), median([4.0, 1.0])], [2.0, 4.0]);
    }

    #[test]
    fn geometric_means() {
        assert_eq!(geometric_mean([]), 1.0);
        assert!((geometric_mean([0.5, 2.0, 1.0]) - 1.0).abs() < 1e-15);
        assert!((geometric_mean([4.0]) - 4.0).abs() < 1e-15);
    }
}
