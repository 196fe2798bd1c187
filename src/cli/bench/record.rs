//! What was measured: one record for the Markdown, the picture and the JSON.

use std::fmt;

use coarsen::Mesh;
use coarsen::metrics::Deviation;
use serde::Serialize;

use super::baseline;
use super::case::Case;
use super::contender::{Contender, Wish};
use super::contest::{Series, same_bytes};
use super::machine::Machine;
use super::numbers::{grouped, percent};
use super::plan::{Plan, Target};
use super::statistics::{Timing, exponent};
use crate::cli::record::Seconds;

/// A bench, as `--json` prints it. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
pub struct Record {
    pub schema: u32,
    pub version: &'static str,
    /// meshoptimizer's version; null where it is not built in.
    pub baseline: Option<&'static str>,
    pub machine: Machine,
    /// Runs of each job that count.
    pub repeats: usize,
    /// Points on the faces of each surface that the deviation was measured at; null where it was not.
    pub samples: Option<usize>,
    /// Whether the cases are one mesh in several sizes.
    pub scales: bool,
    pub devices: Vec<Entrant>,
    pub cases: Vec<CaseRecord>,
    /// With several sizes: how the time of each device grows.
    pub growth: Vec<Growth>,
}

/// Who was to take part.
#[derive(Debug, Serialize)]
pub struct Entrant {
    /// As the command line names it.
    pub name: String,
    /// What it is: adapter and driver, or function and version; null where it was not opened.
    pub device: Option<String>,
    pub is_software: bool,
    /// Why it did not take part.
    pub failure: Option<String>,
}

/// A mesh and the jobs done with it.
#[derive(Debug, Serialize)]
pub struct CaseRecord {
    pub input: String,
    pub faces: usize,
    pub vertices: usize,
    pub read_secs: f64,
    pub jobs: Vec<JobRecord>,
}

/// One target, by all contenders.
#[derive(Debug, Serialize)]
pub struct JobRecord {
    /// The fraction to keep, where the target is one.
    pub keep: Option<f64>,
    /// The faces to keep.
    pub faces: usize,
    pub results: Vec<Figures>,
    /// Who failed on the way.
    pub failures: Vec<Entrant>,
}

/// What one contender did.
#[derive(Debug, Serialize)]
pub struct Figures {
    pub device: String,
    /// From mesh in memory to mesh in memory.
    pub seconds: Timing,
    /// Faces of the input a second, at the median.
    pub faces_per_second: f64,
    pub faces_out: usize,
    /// Of the median run; null of a rival, as are the fields down to `bytes_moved`.
    pub phases: Option<Seconds>,
    pub rounds: Option<usize>,
    pub rounds_on_gpu: Option<usize>,
    /// To and from the device, in one run.
    pub bytes_moved: Option<u64>,
    /// What the memory of a process grows by that does the job once, the input included; null where the system does not
    /// tell.
    pub peak_bytes: Option<u64>,
    /// Whether every run made the same bytes.
    pub repeatable: bool,
    /// The first contender that made the same bytes, if it is another.
    pub same_bytes_as: Option<String>,
    /// Of the result from the input, which is the first surface; null where it was not measured.
    pub deviation: Option<Deviation>,
    pub warnings: Vec<String>,
}

/// How the time of a device grows with the size of the mesh.
#[derive(Debug, Serialize)]
pub struct Growth {
    pub device: String,
    /// Its job, by its place among the jobs of each case.
    pub job: usize,
    /// The power of the size that the median time grows by; null with one size.
    pub exponent: Option<f64>,
}

impl Record {
    /// A record of `plan` without figures.
    pub fn new(plan: &Plan, devices: Vec<Entrant>) -> Self {
        Self {
            schema: 1,
            version: env!("CARGO_PKG_VERSION"),
            baseline: cfg!(feature = "baseline").then_some(baseline::VERSION),
            machine: Machine::here(),
            repeats: plan.repeats,
            samples: plan.samples,
            scales: plan.scales,
            devices,
            cases: Vec::new(),
            growth: Vec::new(),
        }
    }

    /// Adds what follows from all cases together.
    pub fn finish(&mut self) {
        if !self.scales {
            return;
        }
        let jobs = self.cases.iter().map(|case| case.jobs.len()).max().unwrap_or(0);
        for job in 0..jobs {
            for entrant in self.devices.iter().filter(|entrant| entrant.failure.is_none()) {
                let points: Vec<(f64, f64)> = self.times(&entrant.name, job).collect();
                self.growth.push(Growth { device: entrant.name.clone(), job, exponent: exponent(&points) });
            }
        }
    }

    /// The faces of each case and the median seconds of a device's job there.
    pub fn times<'a>(&'a self, device: &'a str, job: usize) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.cases.iter().filter_map(move |case| {
            let figures = case.jobs.get(job)?.results.iter().find(|figures| figures.device == device)?;
            Some((case.faces as f64, figures.seconds.median))
        })
    }
}

impl Entrant {
    /// A contender that is there.
    pub fn of(contender: &Contender) -> Self {
        let (device, is_software) = (Some(contender.what.clone()), contender.is_software());
        Self { name: contender.name.clone(), device, is_software, failure: None }
    }

    /// One that could not be opened.
    pub fn absent(wish: &Wish, reason: String) -> Self {
        Self { name: wish.to_string(), device: None, is_software: false, failure: Some(reason) }
    }

    /// One that failed at a job.
    pub fn failed(contender: &Contender, reason: String) -> Self {
        Self { failure: Some(reason), ..Self::of(contender) }
    }
}

impl CaseRecord {
    /// The jobs done with `case`.
    pub fn new(case: &Case, jobs: Vec<JobRecord>) -> Self {
        Self {
            input: case.name.clone(),
            faces: case.mesh.faces.len(),
            vertices: case.mesh.positions.len(),
            read_secs: case.read_secs,
            jobs,
        }
    }
}

impl JobRecord {
    /// A job that nobody has done.
    pub fn new(target: Target, faces: usize) -> Self {
        let keep = match target {
            Target::Keep(fraction) => Some(fraction),
            Target::Faces(_) => None,
        };
        Self { keep, faces, results: Vec::new(), failures: Vec::new() }
    }

    /// Notes which of `outputs`, one a result, are the same.
    pub fn compare(&mut self, outputs: &[Mesh]) {
        for (i, output) in outputs.iter().enumerate() {
            let first = outputs[..i].iter().position(|earlier| same_bytes(earlier, output));
            self.results[i].same_bytes_as = first.map(|first| self.results[first].device.clone());
        }
    }
}

/// The target in words.
impl fmt::Display for JobRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.keep {
            Some(fraction) => f.write_str(&percent(fraction)),
            None => write!(f, "{} faces", grouped(self.faces)),
        }
    }
}

impl Figures {
    /// The figures of a contender's runs of one job.
    pub fn new(contender: &Contender, case: &Case, series: &Series) -> Self {
        let seconds = Timing::of(series.trials.iter().map(|trial| trial.secs).collect());
        let told = series.trials.get(seconds.median_run()).and_then(|trial| trial.told.as_ref());
        Self {
            device: contender.name.clone(),
            faces_per_second: case.mesh.faces.len() as f64 / seconds.median,
            faces_out: series.output.faces.len(),
            phases: told.map(|told| told.phases.clone()),
            rounds: told.map(|told| told.rounds),
            rounds_on_gpu: told.map(|told| told.rounds_on_gpu),
            bytes_moved: told.map(|told| told.bytes_moved),
            peak_bytes: None,
            repeatable: series.repeatable,
            same_bytes_as: None,
            deviation: None,
            warnings: told.map(|told| told.warnings.clone()).unwrap_or_default(),
            seconds,
        }
    }
}
