//! \[Yu14\]: average quadrics, what their storage loses, and the time to find them.
//!
//! The patent has no results. It says that finding quadrics is a fifth or more of the time, took 10.6 s for 199,114 faces
//! by others, and far less on a GPU.

use super::{Trial, geometric_mean, median, trials};
use crate::backend::Device;
use crate::contract::{Options, Placement, QuadricFormat, QuadricFrame, Quadrics, initial_quadrics};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::metrics;
use crate::simplify::{Budget, Method, StopReason, simplify};

/// Faces that the formats are compared at.
pub const FACES: usize = 600;
/// Faces of the mesh that finding quadrics was timed on.
pub const TIMED_FACES: usize = 199_114;
/// Seconds that finding them may take for so many.
pub const MOST_SECS: f64 = 0.2;

/// The formats by name, with half-edges: quadrics as they are found first, then the patent to the letter.
pub fn contenders() -> Vec<(&'static str, Options)> {
    let averaged = Options { placement: Placement::Endpoint, ..Options::averaged() };
    let of = |format, frame| Options { quadrics: Quadrics { format, frame, ..averaged.quadrics }, ..averaged.clone() };
    let literal = of(Some(QuadricFormat::Rgba8), QuadricFrame::Raw);
    let mut all = vec![("as found", of(None, QuadricFrame::Normalized)), ("rgba8, raw", literal)];
    all.extend(QuadricFormat::ALL.map(|format| (format.name(), of(Some(format), QuadricFrame::Normalized))));
    all
}

/// Runs all [`contenders`] down to [`FACES`].
///
/// # Errors
/// As [`trials`].
pub fn row(mesh: &Mesh, measure: &metrics::Options, device: &Device) -> Result<Vec<Trial>> {
    trials(mesh, &contenders(), &Budget::faces(FACES), 0, measure, device)
}

/// Whether all of a row have as many faces.
pub fn is_fair(row: &[Trial]) -> bool {
    row.iter().all(|trial| trial.stop == StopReason::FacesReached && trial.faces == row[0].faces)
        && row.first().is_some_and(|found| found.deviation.forward.distance.mean > 0.0)
}

/// What a format loses: deviations over those of quadrics as they are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Symmetric greatest distance, the geometric mean over meshes.
    pub max: f64,
    /// Mean distance from the input, the geometric mean over meshes.
    pub mean: f64,
    /// The same of the worst mesh.
    pub worst_mean: f64,
}

/// The losses of all [`contenders`] over the rows that are fair.
pub fn losses(rows: &[Vec<Trial>]) -> Vec<Loss> {
    let ratios = |contender: usize, of: fn(&Trial) -> f64| -> Vec<f64> {
        rows.iter().filter(|row| is_fair(row)).map(|row| of(&row[contender]) / of(&row[0])).collect()
    };
    let loss = |contender: usize| {
        let means = ratios(contender, |trial| trial.deviation.forward.distance.mean);
        Loss {
            max: geometric_mean(ratios(contender, |trial| trial.deviation.symmetric().max)),
            mean: geometric_mean(means.iter().copied()),
            worst_mean: means.into_iter().fold(0.0, f64::max),
        }
    };
    (0..contenders().len()).map(loss).collect()
}

/// The time to find the initial quadrics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Initialization {
    /// Their format.
    pub format: QuadricFormat,
    /// Seconds of normals, sums, greatest values and codes.
    pub secs: f64,
    /// Seconds of a run to a tenth of the faces.
    pub total_secs: f64,
}

/// Finds the initial quadrics of `mesh` in every format, `repeats` times in turns: the medians.
///
/// # Errors
/// As [`initial_quadrics`] and [`simplify()`].
pub fn initializations(mesh: &Mesh, repeats: usize, device: &Device) -> Result<Vec<Initialization>> {
    let mut turns = vec![Vec::with_capacity(repeats); QuadricFormat::ALL.len()];
    for _ in 0..repeats {
        for (format, turns) in QuadricFormat::ALL.into_iter().zip(&mut turns) {
            let averaged = Options::averaged();
            let quadrics = Quadrics { format: Some(format), ..averaged.quadrics };
            let options = Options { quadrics, ..averaged };
            let secs = initial_quadrics(mesh, &options, device)?.record.secs;
            let total_secs =
                simplify(mesh, &Method::Contract(options), &Budget::keep(0.1), device, None)?.seconds.total;
            turns.push(Initialization { format, secs, total_secs });
        }
    }
    let medians = |(format, turns): (QuadricFormat, &Vec<Initialization>)| Initialization {
        format,
        secs: median(turns.iter().map(|turn| turn.secs)),
        total_secs: median(turns.iter().map(|turn| turn.total_secs)),
    };
    Ok(QuadricFormat::ALL.into_iter().zip(&turns).map(medians).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    #[test]
    fn formats_are_compared_with_what_was_found() {
        let mesh = sample("part", Some(3000)).unwrap();
        let trials = row(&mesh, &metrics::Options::default(), &Device::cpu(1).unwrap()).unwrap();
        assert!(trials.iter().all(|trial| trial.faces == FACES));
        let formats: Vec<_> = trials.iter().map(|trial| trial.quadrics.map(|record| record.format)).collect();
        assert_eq!(formats[..3], [None, Some(QuadricFormat::Rgba8), Some(QuadricFormat::F32)]);
        let losses = losses(&[trials.clone(), trials.clone()]);
        assert_eq!((losses[0].max, losses[0].mean, losses[0].worst_mean), (1.0, 1.0, 1.0));
        assert!(losses[1].mean > 2.0 && (0.7..1.3).contains(&losses[2].mean), "{losses:?}");
        let max_d2 = |i: usize| trials[i].quadrics.map_or(0.0, |record| record.max_d2);
        assert!(max_d2(1) > 1.0 && max_d2(2) <= 1.0, "raw coordinates are larger");
    }

    #[test]
    fn finding_quadrics_takes_a_part_of_the_time() {
        let mesh = sample("statue", Some(5000)).unwrap();
        for timed in initializations(&mesh, 3, &Device::cpu(1).unwrap()).unwrap() {
            assert!(timed.secs > 0.0 && timed.secs < timed.total_secs, "{timed:?}");
        }
    }
}
