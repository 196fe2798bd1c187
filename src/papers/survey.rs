//! \[Wu12\]: contraction by quadrics, whose table names the times of two results on one mesh.
//!
//! The paper prints no deviation, and one of its shares is not that of the count beside it: both counts are run. What
//! deviations are held against was measured with a serial prototype in double precision, and may be a quarter off.

use super::{Trial, trials};
use crate::backend::Device;
use crate::contract::{Metric, Options, Quadrics};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::metrics;
use crate::simplify::Budget;

/// Vertices and faces of the paper's mesh, a cow.
pub const COW: (usize, usize) = (2903, 5804);
/// How much higher than expected a deviation may be.
pub const BAND: f64 = 1.25;

/// A row of the paper's table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// Faces of the result.
    pub faces: usize,
    /// Milliseconds, where the paper has them.
    pub millis: Option<f64>,
    /// The symmetric greatest and the forward mean deviation in percent of the diagonal that are expected of planes that count
    /// alike, and by area.
    pub expected: [[f64; 2]; 2],
}

/// The rows for [`COW`]; 366 faces are the share that the paper tells with the time of 326.
pub const ROWS: [Published; 3] = [
    Published { faces: 2636, millis: Some(66.36), expected: [[0.61, 0.0270], [0.56, 0.0182]] },
    Published { faces: 366, millis: None, expected: [[3.28, 0.242], [3.90, 0.204]] },
    Published { faces: 326, millis: Some(111.78), expected: [[4.34, 0.276], [3.90, 0.225]] },
];

/// The methods of a row by name: the paper's quadrics, those that are expected to be better, and the default.
pub fn contenders() -> Vec<(&'static str, Options)> {
    let by_area = Options { metric: Metric::Plane, ..Options::default() };
    let alike = Options { quadrics: Quadrics { format: None, ..Options::averaged().quadrics }, ..Options::averaged() };
    vec![("planes alike", alike), ("planes by area", by_area), ("volume", Options::default())]
}

/// Whether a mesh is the paper's, by its counts.
pub fn is_cow(mesh: &Mesh) -> bool {
    (mesh.positions.len(), mesh.faces.len()) == COW
}

/// The row of the paper's table as a share of another mesh's faces.
pub fn faces_of(published: &Published, mesh: &Mesh) -> usize {
    (published.faces as f64 * mesh.faces.len() as f64 / COW.1 as f64).round() as usize
}

/// Runs all contenders, each `repeats` more times for its seconds.
///
/// # Errors
/// As [`trials`].
pub fn row(
    mesh: &Mesh,
    published: &Published,
    repeats: usize,
    measure: &metrics::Options,
    device: &Device,
) -> Result<Vec<Trial>> {
    trials(mesh, &contenders(), &Budget::faces(faces_of(published, mesh)), repeats, measure, device)
}

impl Published {
    /// Whether a contender keeps what the row says of it: the paper's time, where it has one, and the deviations that are
    /// expected, where they are.
    pub fn is_held(&self, contender: usize, trial: &Trial) -> bool {
        let diagonal = trial.deviation.diagonal;
        let [greatest, mean] = [trial.deviation.symmetric().max, trial.deviation.forward.distance.mean];
        let in_time = self.millis.is_none_or(|millis| trial.seconds.total * 1e3 <= millis);
        let is_near = self.expected.get(contender).is_none_or(|&[by_greatest, by_mean]| {
            100.0 * greatest / diagonal <= BAND * by_greatest && 100.0 * mean / diagonal <= BAND * by_mean
        });
        in_time && is_near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn rows_are_held_in_time_and_near() {
        let (mesh, device) = (shapes::icosphere(3), Device::cpu(1).unwrap());
        assert!(!is_cow(&mesh));
        let published = Published { faces: 580, millis: Some(60_000.0), expected: [[100.0; 2]; 2] };
        let trials = row(&mesh, &published, 2, &metrics::Options::default(), &device).unwrap();
        assert!(trials.iter().all(|trial| trial.faces == 128));
        assert!((0..3).all(|i| published.is_held(i, &trials[i])));
        assert!(!Published { millis: Some(0.0), ..published }.is_held(0, &trials[0]));
        assert!(!Published { expected: [[0.0; 2], [100.0; 2]], ..published }.is_held(0, &trials[0]));
        assert!(Published { expected: [[0.0; 2]; 2], ..published }.is_held(2, &trials[2]));
    }
}
