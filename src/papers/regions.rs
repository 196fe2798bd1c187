//! \[Jin09\]: regions by variational shape approximation, whose table names times and energies beside those of Lloyd's iterations.
//!
//! The stream of numbers in the paper's text was put back into rows by measurement: two of them fit no other place.

use std::time::Instant;

use super::median;
use crate::backend::Device;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::partition::Surface;
use crate::partition::vsa::{Goal, Options, Solver, partition};

/// How much higher than the paper's an energy may be.
pub const BAND: f64 = 1.05;
/// How many times as long Lloyd's iterations take, at least: the paper says three to four.
pub const LEAST_RATIO: f64 = 3.0;
/// Regions of meshes that are not the paper's.
pub const REGIONS: usize = 100;
/// An energy that is this much higher is the same but for rounding.
const ROUNDING: f64 = 1e-12;

/// A row of the paper's table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// What the mesh is called.
    pub model: &'static str,
    /// Its faces.
    pub faces: usize,
    /// Regions of the result.
    pub regions: usize,
    /// Milliseconds and energy of the paper's method.
    pub greedy: [f64; 2],
    /// The same of Lloyd's iterations, where the paper has them.
    pub lloyd: Option<[f64; 2]>,
}

/// All rows.
pub const ROWS: [Published; 4] = [
    Published { model: "bunny", faces: 69_451, regions: 100, greedy: [596.0, 0.3898], lloyd: None },
    Published { model: "fandisk", faces: 12_946, regions: 30, greedy: [76.0, 0.0968], lloyd: Some([181.0, 0.3712]) },
    Published { model: "feline", faces: 99_732, regions: 200, greedy: [696.0, 0.4781], lloyd: Some([2357.0, 0.4082]) },
    Published {
        model: "armadillo",
        faces: 331_904,
        regions: 300,
        greedy: [2403.0, 0.4092],
        lloyd: Some([8174.0, 0.4172]),
    },
];

/// The row of the mesh that a file is called after. By its name, for versions of other sizes are about.
pub fn published(name: &str) -> Option<&'static Published> {
    ROWS.iter().find(|row| name.to_ascii_lowercase().starts_with(row.model))
}

/// A way to partition, and the one of Lloyd's that it is to be compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contender {
    /// What it is called.
    pub name: &'static str,
    /// With [`REGIONS`].
    pub options: Options,
    /// The place of Lloyd's iterations with as many exchanges, behind all others; nothing for themselves.
    pub lloyd: Option<usize>,
}

/// The ways: faces one by one and Lloyd's iterations, both as the papers have them and both with regions exchanged, and the
/// parallel rounds. The best of three attempts each.
pub fn contenders() -> [Contender; 5] {
    let of = |name, solver, teleports: usize, lloyd| {
        let options = Options { solver, ..Options::new(Goal::Regions(REGIONS)) };
        Contender { name, options: Options { teleports: teleports.min(options.teleports), ..options }, lloyd }
    };
    [
        of("greedy, as published", Solver::Greedy, 0, Some(3)),
        of("greedy", Solver::Greedy, usize::MAX, Some(4)),
        of("rounds", Solver::Rounds, usize::MAX, Some(4)),
        of("Lloyd, as published", Solver::Lloyd, 0, None),
        of("Lloyd", Solver::Lloyd, usize::MAX, None),
    ]
}

/// What one way made of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Seconds from the mesh in memory to all regions of all attempts.
    pub secs: f64,
    /// How many regions.
    pub regions: usize,
    /// Of the best attempt, where half the diagonal is 1.
    pub energy: f64,
    /// Whether the energy never rose on the way.
    pub falls: bool,
}

/// Runs all [`contenders`] to `regions` regions, `repeats` times in turns after once that is not counted: the medians of their
/// seconds.
///
/// # Errors
/// As [`partition`] and [`Surface::new`].
pub fn row(mesh: &Mesh, regions: usize, repeats: usize, device: &Device) -> Result<Vec<Trial>> {
    let run = |options: Options| {
        let options = Options { goal: Goal::Regions(regions), ..options };
        let clock = Instant::now();
        let found = partition(&Surface::new(mesh, Some(0.0))?, &options, device, None)?;
        Ok(Trial {
            secs: clock.elapsed().as_secs_f64(),
            regions: found.partition.region_count,
            energy: found.energies.last().copied().unwrap_or(0.0),
            falls: found.energies.windows(2).all(|pair| pair[1] <= pair[0] + ROUNDING),
        })
    };
    device.install(|| {
        let mut trials: Vec<Trial> = contenders().into_iter().map(|way| run(way.options)).collect::<Result<_>>()?;
        let mut turns = vec![Vec::with_capacity(repeats); trials.len()];
        for _ in 0..repeats {
            for (way, turns) in contenders().into_iter().zip(&mut turns) {
                turns.push(run(way.options)?.secs);
            }
        }
        for (trial, turns) in trials.iter_mut().zip(turns).filter(|(_, turns)| !turns.is_empty()) {
            trial.secs = median(turns);
        }
        Ok(trials)
    })
}

impl Published {
    /// The paper's milliseconds and energy of a contender.
    pub fn figures(&self, way: &Contender) -> Option<[f64; 2]> {
        if way.lloyd.is_some() { Some(self.greedy) } else { self.lloyd }
    }

    /// Whether a contender keeps the paper's time and comes near its energy; nothing where the mesh has another size, nor of
    /// Lloyd's iterations, which are there to compare with.
    pub fn is_held(&self, way: &Contender, faces: usize, trial: &Trial) -> Option<bool> {
        let is_judged = faces == self.faces && way.lloyd.is_some();
        let [millis, energy] = self.greedy;
        let is_near = trial.energy <= BAND * energy && trial.regions <= self.regions;
        is_judged.then_some(trial.secs * 1e3 <= millis && is_near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    #[test]
    fn meshes_are_found_by_their_names() {
        assert_eq!(published("bunny.ply").map(|row| row.regions), Some(100));
        assert_eq!(published("Armadillo_quarter.obj").map(|row| row.faces), Some(331_904));
        assert_eq!(published("sample:part@20k"), None);
    }

    #[test]
    fn a_row_compares_with_lloyd() {
        let mesh = sample("part", Some(3000)).unwrap();
        let trials = row(&mesh, 30, 2, &Device::cpu(1).unwrap()).unwrap();
        assert_eq!(trials.iter().map(|trial| trial.regions).collect::<Vec<_>>(), [30; 5]);
        assert!(trials[..3].iter().all(|trial| trial.falls && trial.secs > 0.0), "{trials:?}");
        for exchanged in [1, 4] {
            let published = contenders()[exchanged].lloyd.map_or(3, |_| 0);
            assert!(trials[exchanged].energy <= trials[published].energy, "exchanges only help: {trials:?}");
        }
        for way in contenders() {
            let teleports = way.lloyd.map(|lloyd| contenders()[lloyd].options.teleports);
            assert!(teleports.is_none_or(|teleports| teleports == way.options.teleports), "{}", way.name);
        }
    }

    #[test]
    fn rows_are_held_in_time_and_near() {
        let [row, trial] = [&ROWS[1], &ROWS[2]].map(|row| {
            let [millis, energy] = row.greedy;
            (row, Trial { secs: millis / 1e3, regions: row.regions, energy: 1.04 * energy, falls: true })
        });
        let [published, greedy, .., lloyd] = contenders();
        assert_eq!(row.0.is_held(&published, row.0.faces, &row.1), Some(true));
        assert_eq!(row.0.is_held(&greedy, row.0.faces, &trial.1), Some(false));
        let late = Trial { secs: 1.0, ..row.1 };
        assert_eq!(row.0.is_held(&published, row.0.faces, &late), Some(false));
        assert_eq!((row.0.is_held(&published, 500, &row.1), row.0.is_held(&lloyd, row.0.faces, &row.1)), (None, None));
        assert_eq!((row.0.figures(&greedy), row.0.figures(&lloyd)), (Some([76.0, 0.0968]), Some([181.0, 0.3712])));
    }
}
