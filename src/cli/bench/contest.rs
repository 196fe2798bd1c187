//! The contest: every contender once, then all again.

use std::io;
use std::time::Instant;

use coarsen::Mesh;
use coarsen::formats::{self, Format, WriteOptions};

use super::case::Case;
use super::contender::{Contender, Run};
use super::ticker::Ticker;
use crate::cli::record::{Clocks, Seconds};

/// A contender's runs of one job.
pub struct Series {
    /// What the first run made.
    pub output: Mesh,
    /// Whether every run made the same bytes.
    pub repeatable: bool,
    /// Those that count, in the order they were run.
    pub trials: Vec<Trial>,
}

/// What is kept of a run.
pub struct Trial {
    pub secs: f64,
    /// By what coarsen tells; nothing of a rival.
    pub told: Option<Told>,
}

/// What coarsen tells about a run.
pub struct Told {
    pub phases: Seconds,
    pub rounds: usize,
    pub rounds_on_gpu: usize,
    pub bytes_moved: u64,
    pub warnings: Vec<String>,
}

/// Lets the contenders simplify `case` to `faces` in turns; one that fails is out, with its reason.
///
/// The first turn warms caches, threads and pipelines, and does not count.
pub fn contest(
    case: &Case,
    faces: usize,
    contenders: &[Contender],
    repeats: usize,
    ticker: &Ticker,
) -> Vec<Result<Series, String>> {
    let first = |contender: &Contender| {
        ticker.show(&format!("warming up, {}", contender.name));
        let Run { mesh, .. } = contender.run(case, faces).map_err(|error| error.to_string())?;
        Ok(Series { output: mesh, repeatable: true, trials: Vec::with_capacity(repeats) })
    };
    let mut all: Vec<Result<Series, String>> = contenders.iter().map(first).collect();
    for repeat in 1..=repeats {
        for (contender, series) in contenders.iter().zip(&mut all) {
            ticker.show(&format!("repeat {repeat} of {repeats}, {}", contender.name));
            let added = series.as_mut().map(|series| series.add(case, contender.run(case, faces)));
            if let Ok(Err(reason)) = added {
                *series = Err(reason);
            }
        }
    }
    all
}

impl Series {
    fn add(&mut self, case: &Case, run: coarsen::Result<Run>) -> Result<(), String> {
        let run = run.map_err(|error| error.to_string())?;
        self.repeatable &= same_bytes(&self.output, &run.mesh);
        let clock = Instant::now();
        formats::write_to(&run.mesh, Format::Ply, &WriteOptions::default(), &mut io::sink())
            .map_err(|error| error.to_string())?;
        let write = clock.elapsed().as_secs_f64();
        let total = case.read_secs + run.secs + write;
        let clocks = Clocks { read: case.read_secs, solve: run.secs, write, total, ..Clocks::default() };
        let told = run.outcome.map(|outcome| Told {
            phases: Seconds::new(&outcome.seconds, &clocks),
            rounds: outcome.rounds.len(),
            rounds_on_gpu: outcome.rounds.iter().filter(|round| round.on_gpu).count(),
            bytes_moved: outcome.bytes_moved,
            warnings: outcome.warnings,
        });
        self.trials.push(Trial { secs: run.secs, told });
        Ok(())
    }
}

/// Whether two meshes are the same, bit for bit.
pub fn same_bytes(a: &Mesh, b: &Mesh) -> bool {
    fn bytes(mesh: &Mesh) -> &[u8] {
        bytemuck::cast_slice(&mesh.positions)
    }
    a.faces == b.faces && bytes(a) == bytes(b)
}

#[cfg(test)]
mod tests {
    use coarsen::math::DVec3;

    use super::*;

    #[test]
    fn bytes_tell_zeros_apart() {
        let mesh = |x| Mesh::new(vec![DVec3::new(x, 0.0, 0.0); 3], vec![[0, 1, 2]]);
        assert!(same_bytes(&mesh(0.0), &mesh(0.0)));
        assert!(mesh(0.0) == mesh(-0.0) && !same_bytes(&mesh(0.0), &mesh(-0.0)));
        assert!(!same_bytes(&mesh(0.0), &Mesh { faces: vec![[1, 2, 0]], ..mesh(0.0) }));
    }
}
