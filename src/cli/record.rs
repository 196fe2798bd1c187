//! What a run did: one record for the line that people read and the JSON that programs read.

use std::fmt;

use coarsen::backend::KernelTime;
use coarsen::batch::{Deviation, Measured};
use coarsen::out_of_core::Pass;
use coarsen::simplify::{Blocked, Outcome, Phases, RoundRecord};
use coarsen::{Device, Mesh, Method, StopReason, contract, metrics, partition};
use serde::Serialize;

use super::resolve::Job;
use super::{memory, regions};

/// A run, as `--json` prints it. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
pub struct Record {
    schema: u32,
    input: String,
    output: String,
    method: &'static str,
    /// What a contraction costs; null with another method.
    metric: Option<&'static str>,
    device: String,
    /// The driver, if a GPU did the work and the driver is known.
    driver: Option<String>,
    version: &'static str,
    faces_in: usize,
    faces_out: usize,
    vertices_in: usize,
    vertices_out: usize,
    /// The face count asked for; null with only error limits.
    target: Option<usize>,
    pub reached: bool,
    stop_reason: StopReason,
    /// The side of a cell of the grid, in model units; null without one.
    cell_size: Option<f64>,
    /// How the initial quadrics were stored; null where they were left as they were found.
    quadrics: Option<Stored>,
    /// The regions that faces were made into; null with another method.
    regions: Option<Regions>,
    /// What was done in parts before the rounds; null where the mesh fitted the memory limit.
    parts: Option<Parts>,
    /// Edges turned after the run.
    flips: usize,
    /// Milliseconds from mesh in memory to mesh in memory.
    simplify_ms: f64,
    blocked: Blocked,
    error: Deviation,
    pub rounds: Vec<RoundRecord>,
    /// The time of every kernel on an adapter, with --verbose.
    pub kernels: Vec<KernelTime>,
    seconds: Seconds,
    /// Bytes resident at most; null where the system does not tell.
    peak_memory: Option<u64>,
    pub warnings: Vec<String>,
}

/// A run in parts.
#[derive(Debug, Serialize)]
struct Parts {
    /// Of all passes.
    count: usize,
    /// Those before the last, which has the whole.
    passes: Vec<Pass>,
}

/// What a record tells of the input.
#[derive(Debug, Clone, Copy)]
pub struct InputSize {
    pub vertices: usize,
    /// Of the bounding box, in model units.
    pub diagonal: f64,
}

impl From<&Mesh> for InputSize {
    fn from(mesh: &Mesh) -> Self {
        Self { vertices: mesh.positions.len(), diagonal: mesh.diagonal() }
    }
}

/// Regions of faces.
#[derive(Debug, Serialize)]
struct Regions {
    count: usize,
    /// Regions or parts of them that keep their faces, and those filled in space.
    undrawn: usize,
    spatial: usize,
    /// Of variational shape approximation, where half the diagonal is 1; null otherwise.
    energy: Option<f64>,
}

impl From<&partition::Regions> for Regions {
    fn from(regions: &partition::Regions) -> Self {
        let partition::Regions { count, not_planar: partition::NotPlanar { undrawn, spatial }, .. } = *regions;
        Self { count, undrawn, spatial, energy: regions.energies.last().copied() }
    }
}

impl fmt::Display for Regions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, ", {} regions", self.count)?;
        self.energy.map_or(Ok(()), |energy| write!(f, " of energy {energy:.4}"))
    }
}

/// Quadrics in a format.
#[derive(Debug, Serialize)]
struct Stored {
    format: &'static str,
    /// A vertex.
    bytes: u32,
    /// The greatest weight of the planes at a vertex, and their greatest squared distance from the origin.
    max_num: f32,
    max_d2: f32,
    /// How far off an entry of an average quadric may be, and a distance: of the diagonal, or in the local formats of the way
    /// from the vertex.
    entry_bound: f64,
    deviation_bound: f64,
    seconds: f64,
}

impl From<contract::QuadricRecord> for Stored {
    fn from(record: contract::QuadricRecord) -> Self {
        Self {
            format: record.format.name(),
            bytes: record.format.bytes(),
            max_num: record.max_num,
            max_d2: record.max_d2,
            entry_bound: record.format.entry_bound(),
            deviation_bound: record.deviation_bound(),
            seconds: record.secs,
        }
    }
}

/// Wall-clock seconds by phase.
#[derive(Debug, Clone, Serialize)]
pub struct Seconds {
    pub read: f64,
    /// From mesh in memory to mesh in memory; phases of it follow.
    pub solve: f64,
    pub weld: f64,
    pub build: f64,
    pub cost: f64,
    pub select: f64,
    pub filter: f64,
    pub apply: f64,
    pub fit: f64,
    pub flip: f64,
    pub transfer: f64,
    pub restore: f64,
    pub write: f64,
    pub measure: f64,
    pub total: f64,
}

/// Seconds that the library does not see.
#[derive(Debug, Default)]
pub struct Clocks {
    pub read: f64,
    pub solve: f64,
    pub write: f64,
    pub measure: f64,
    pub total: f64,
}

impl Seconds {
    /// The library's phases between the program's own.
    pub fn new(phases: &Phases, clocks: &Clocks) -> Self {
        let Phases { weld, build, cost, select, filter, apply, fit, flip, transfer, restore, .. } = *phases;
        let Clocks { read, solve, write, measure, total } = *clocks;
        Self {
            read,
            solve,
            weld,
            build,
            cost,
            select,
            filter,
            apply,
            fit,
            flip,
            transfer,
            restore,
            write,
            measure,
            total,
        }
    }
}

impl Record {
    /// The record of a run that is done.
    pub fn new(job: &Job, input: impl Into<InputSize>, outcome: &Outcome, device: &Device, clocks: &Clocks) -> Self {
        let (method, metric) = words_of(&job.setup.method);
        let InputSize { vertices, diagonal } = input.into();
        Self {
            schema: 1,
            input: job.setup.source.to_string(),
            output: job.sink.to_string(),
            method,
            metric,
            device: outcome.device.clone(),
            driver: driver(device, &outcome.device),
            version: env!("CARGO_PKG_VERSION"),
            faces_in: outcome.faces_in,
            faces_out: outcome.mesh.faces.len(),
            vertices_in: vertices,
            vertices_out: outcome.mesh.positions.len(),
            target: job.budget.counts_faces().then_some(outcome.target),
            reached: job.budget.is_reached(outcome.stop) && regions::are_reached(job, outcome),
            stop_reason: outcome.stop,
            cell_size: outcome.cell_size,
            quadrics: outcome.quadrics.map(Stored::from),
            regions: outcome.regions.as_ref().map(Regions::from),
            parts: None,
            flips: outcome.flips,
            simplify_ms: clocks.solve * 1e3,
            blocked: outcome.blocked,
            error: Deviation::new(outcome.error_estimate, diagonal, None),
            rounds: outcome.rounds.clone(),
            kernels: device.kernel_times(),
            seconds: Seconds::new(&outcome.seconds, clocks),
            peak_memory: memory::peak(),
            warnings: outcome.warnings.clone(),
        }
    }

    /// The record with what the output lost beside what the run warned of.
    pub fn with_losses(mut self, losses: Vec<String>) -> Self {
        self.warnings.extend(losses);
        self
    }

    /// The record with what was measured.
    pub fn with_measured(mut self, measured: Option<&metrics::Deviation>) -> Self {
        self.error.measured = measured.map(Measured::from);
        self
    }

    /// The record of a run in parts.
    pub fn with_passes(self, passes: Vec<Pass>) -> Self {
        let count = passes.iter().map(|pass| pass.parts).sum();
        Self { parts: Some(Parts { count, passes }), ..self }
    }

    /// What was missed, for `--require-target`.
    pub fn shortfall(&self) -> String {
        let reasons = blocked_by(&self.blocked);
        let asked = match (self.target, &self.regions) {
            (Some(target), _) => format!("{} faces are left of {} asked for", self.faces_out, target),
            (None, Some(regions)) => format!("there are {} regions", regions.count),
            (None, None) => format!("{} faces are left and the error limit is not reached", self.faces_out),
        };
        format!("the target is not reached: {asked} (stop={}{reasons})", name(self.stop_reason))
    }
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} → {} faces, stop={}{}, estimated error {} of the diagonal, read {:.2} solve {:.2} write {:.2} s, {}",
            self.faces_in,
            self.faces_out,
            name(self.stop_reason),
            match &self.regions {
                Some(regions) => regions.to_string(),
                None if self.reached => String::new(),
                None => blocked_by(&self.blocked),
            },
            percent(self.error.estimate_relative),
            self.seconds.read,
            self.simplify_ms / 1e3,
            self.seconds.write,
            self.device,
        )?;
        if let Some(Parts { count, passes }) = &self.parts {
            let before = if passes.len() == 1 { "a pass".into() } else { format!("{} passes", passes.len()) };
            write!(f, ", {count} parts in {before} and a last one")?;
        }
        if let Some(measured) = &self.error.measured {
            let [max, mean, rms] =
                [measured.max_relative, measured.mean_relative, measured.rms_relative].map(|share| share * 100.0);
            write!(
                f,
                "\nmeasured: greatest {max:.4}%, mean {mean:.4}%, root mean square {rms:.4}% of the diagonal, {:.2} s",
                self.seconds.measure
            )?;
        }
        Ok(())
    }
}

/// What `--method` calls a method, and its metric if it has one.
pub fn words_of(method: &Method) -> (&'static str, Option<&'static str>) {
    match method {
        Method::Contract(options) => (method_name(options), Some(metric_name(options.metric))),
        Method::Cluster(_) => ("cluster", None),
        Method::Removal(_) => ("removal", None),
        Method::Partition(options) => (regions_name(&options.by), None),
        _ => ("", None),
    }
}

fn method_name(options: &contract::Options) -> &'static str {
    match (&options.weighting, options.quadrics.planes) {
        (contract::Weighting::Feature(_), _) => "feature",
        (_, contract::PlaneWeight::One) => "average",
        (_, contract::PlaneWeight::Area) => "contract",
    }
}

/// The method that makes these regions.
pub fn regions_name(by: &partition::By) -> &'static str {
    match by {
        partition::By::Coplanar(_) => "coplanar",
        partition::By::Superfaces(_) => "superface",
        partition::By::Variational(_) => "vsa",
    }
}

fn metric_name(metric: contract::Metric) -> &'static str {
    match metric {
        contract::Metric::Volume => "volume",
        contract::Metric::Plane => "plane",
    }
}

/// The name of a reason in the record.
pub fn name(stop: StopReason) -> &'static str {
    match stop {
        StopReason::FacesReached => "faces_reached",
        StopReason::ErrorReached => "error_reached",
        StopReason::Stuck => "stuck",
        StopReason::GridReached => "grid_reached",
        StopReason::RegionsRebuilt => "regions_rebuilt",
        StopReason::Cancelled => "cancelled",
    }
}

/// A fraction in percent; of what is no whole thousandth of one, that it is less.
pub fn percent(fraction: f64) -> String {
    let percent = fraction * 100.0;
    if percent > 0.0 && percent < 1e-3 { "<0.001%".into() } else { format!("{percent:.3}%") }
}

/// The reasons for refusals with their counts: `, blocked by link 12, flip 3`.
pub fn blocked_by(blocked: &Blocked) -> String {
    let Blocked { border, lock, seam, link, flip, aspect, texture, crossing, error } = *blocked;
    let reasons: Vec<String> = [
        ("border", border),
        ("lock", lock),
        ("seam", seam),
        ("link", link),
        ("flip", flip),
        ("aspect", aspect),
        ("texture", texture),
        ("crossing", crossing),
        ("error", error),
    ]
    .iter()
    .filter(|(_, count)| *count > 0)
    .map(|(reason, count)| format!("{reason} {count}"))
    .collect();
    if reasons.is_empty() { String::new() } else { format!(", blocked by {}", reasons.join(", ")) }
}

/// The driver of the adapter that did the work: the open device tells the adapter's name and driver in one text.
pub fn driver(device: &Device, worked: &str) -> Option<String> {
    if !device.is_gpu() || worked != device.description() {
        return None;
    }
    let adapters = coarsen::backend::adapters();
    adapters.into_iter().find(|a| worked.starts_with(&a.name) && worked.contains(&a.driver)).map(|a| a.driver)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stop_reasons_have_one_name() {
        use StopReason::{Cancelled, ErrorReached, FacesReached, GridReached, RegionsRebuilt, Stuck};
        for stop in [FacesReached, ErrorReached, Stuck, GridReached, RegionsRebuilt, Cancelled] {
            assert_eq!(serde_json::to_value(stop).ok(), Some(name(stop).into()));
        }
    }

    #[test]
    fn a_little_is_not_nothing() {
        assert_eq!([0.0, 9.9e-6, 1e-5, 0.01234].map(percent), ["0.000%", "<0.001%", "0.001%", "1.234%"]);
    }

    #[test]
    fn reasons_are_listed_with_their_counts() {
        let blocked = Blocked { link: 12, flip: 3, ..Blocked::default() };
        assert_eq!(blocked_by(&blocked), ", blocked by link 12, flip 3");
        assert_eq!(blocked_by(&Blocked::default()), "");
    }
}
