//! What every verb that simplifies needs to know, and the steps that they share: open, read, solve.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;
use std::time::Instant;

use coarsen::backend::{GpuOptions, Selector};
use coarsen::contract::Feature;
use coarsen::formats::{Scene, Weights, WriteOptions};
use coarsen::simplify::OnProgress;
use coarsen::{Budget, Device, Mesh, Method, metrics};

use super::args::{self, Progress};
use super::console::{self, Verbosity};
use super::failure::at;
use super::method::Asked;
use super::progress::Meter;
use super::resolve::{Problems, check_beside, selector};
use super::source::Source;
use super::{interrupt, memory, method, quadrics, weights};

/// Faces for each thread from which a GPU gains about what it takes to open it, a quarter of a second: beside an H100 2, 4, 8 and
/// 16 threads save 60 to 160, 50, 25 and 14 ns a face.
const GAIN_FACES_A_THREAD: u64 = 1_500_000;

/// From where, how and on what to simplify, and what to say of it.
#[derive(Debug)]
pub struct Setup {
    pub source: Source,
    pub method: Method,
    /// The weights that the method lacks yet.
    pub weight: Option<Weights>,
    /// The file of the vertices that it does not know yet to stay.
    pub lock: Option<PathBuf>,
    /// Where to write the feature degrees of the input, and how they are found.
    pub write_feature: Option<(PathBuf, Feature)>,
    selector: Selector,
    threads: usize,
    pub memory_limit: Option<u64>,
    pub writing: WriteOptions,
    /// Where the log of the contractions goes, if anywhere.
    pub log: Option<PathBuf>,
    /// Whether to measure results, and how.
    pub measure: Option<metrics::Options>,
    pub json: bool,
    pub verbosity: Verbosity,
    progress: Progress,
}

/// The arguments that verbs share.
#[derive(Debug, Clone, Copy)]
pub struct Shared<'a> {
    pub how: &'a args::How,
    pub feature_file: &'a args::FeatureFile,
    pub device: &'a args::Device,
    pub writing: &'a args::Writing,
    /// Cells of a grid, and whether there is an error limit: targets that say something of the method.
    pub grid: Option<u32>,
    pub by_error: bool,
}

impl Setup {
    /// Makes it of the arguments for `source`; what is written beside is to be none of `outputs`.
    pub fn new(args: Shared<'_>, source: Option<Source>, outputs: &[&Path], problems: &mut Problems) -> Option<Self> {
        let Shared { how, feature_file, device, writing, grid, by_error } = args;
        let asked = Asked { how, grid, by_error, with_log: writing.write_log.is_some() };
        let method = problems.note(method::method(&asked));
        let selector = problems.note(selector(&device.device));
        if writing.quiet && writing.verbose {
            problems.add("--quiet and --verbose contradict each other");
        }
        if writing.quiet && writing.progress == Progress::Json {
            problems.add("--quiet and --progress json contradict each other");
        }
        check_log(args, source.as_ref().and_then(Source::path), outputs, problems);
        weights::check(how, source.as_ref(), feature_file.write_feature.is_some(), problems);
        quadrics::check(&how.shape, problems);
        let write_feature = weights::feature_sink(args, source.as_ref(), outputs, problems);
        Some(Self {
            source: source?,
            method: method?,
            weight: how.weights.weight.clone(),
            lock: weights::lock_file(how),
            write_feature: write_feature.map(|path| (path, weights::feature(&how.weights))),
            selector: selector?,
            threads: device.threads.into(),
            memory_limit: device.memory_limit,
            writing: WriteOptions { ascii: writing.ascii },
            log: writing.write_log.clone(),
            measure: measure(&writing.measuring),
            json: writing.json,
            verbosity: match (writing.quiet, writing.verbose) {
                (true, _) => Verbosity::Quiet,
                (_, true) => Verbosity::Verbose,
                _ => Verbosity::Normal,
            },
            progress: writing.progress,
        })
    }

    /// Opens the device, and tells what there is to know of it.
    ///
    /// # Errors
    /// As [`Device::open_here`].
    pub fn open(&self) -> anyhow::Result<Device> {
        let timing = GpuOptions { time_kernels: self.verbosity == Verbosity::Verbose, ..GpuOptions::default() };
        let device = Device::open_here(self.selector_for_source(), self.threads, &timing)?;
        device.notes().iter().for_each(|note| console::note(self.verbosity, note));
        Ok(device)
    }

    /// What is opened: a GPU is not even looked for where the CPU is done before it would be open, or the method makes no use of
    /// it unasked. Measuring, which would, is no reason to.
    fn selector_for_source(&self) -> &Selector {
        let threads = if self.threads > 0 { self.threads } else { available_parallelism().map_or(1, usize::from) };
        let is_large = self.source.faces() >= GAIN_FACES_A_THREAD * threads as u64;
        let gains = is_large && matches!(self.method, Method::Contract(_));
        if self.selector == Selector::Auto && !gains { &Selector::Cpu } else { &self.selector }
    }

    /// Reads the input, and has a GPU load its kernels in the meantime; also returns the seconds that it took.
    ///
    /// # Errors
    /// As [`Source::read_scene`], and a compressed file whose content is above the memory limit.
    pub fn read(&self, device: &Device) -> anyhow::Result<(Scene, f64)> {
        if let Some(path) = self.source.path() {
            memory::check_reading(path, self.memory_limit)?;
        }
        let (input, secs) = std::thread::scope(|scope| {
            if device.is_gpu() {
                // What fails here fails again in the run, which then tells.
                scope.spawn(|| coarsen::warm_up(&self.method, device));
            }
            timed(|| device.install(|| self.source.read_scene()))
        });
        let input = input?;
        // Without materials nobody can tell afterwards what of it the nodes show again.
        Ok((if self.method.drops_materials(&input.mesh) { input.with_instances().0 } else { input }, secs))
    }

    /// The device, or the CPU where the limit is too low for an adapter.
    ///
    /// # Errors
    /// A mesh that is estimated to need more memory than the limit on its way to the levels of `budgets`.
    pub fn within_limit(&self, input: &Mesh, budgets: &[Budget], device: Device) -> anyhow::Result<Device> {
        let faces = input.faces.len();
        memory::check(faces, budgets, false, self.memory_limit)?;
        match memory::check(faces, budgets, device.is_gpu(), self.memory_limit) {
            Ok(()) => Ok(device),
            Err(reason) => {
                console::note(self.verbosity, &format!("the CPU does the work: on an adapter {reason}"));
                Ok(Device::cpu(self.threads)?)
            }
        }
    }

    /// Lets `solve` tell how far it is, and stop when it is asked to; also returns the seconds that it took.
    ///
    /// # Errors
    /// Those of `solve`, with the name of the input in front.
    pub fn solve<R>(&self, solve: impl FnOnce(&mut OnProgress<'_>) -> coarsen::Result<R>) -> anyhow::Result<(R, f64)> {
        let meter = Meter::new(self.progress, self.verbosity);
        let mut on_round = |step| {
            meter.show(step);
            if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let (solved, secs) = timed(|| interrupt::shielded(|| solve(&mut on_round)));
        meter.clear();
        let solved = solved.map_err(|error| at(self.source.to_string().as_ref(), error))?;
        Ok((solved, secs))
    }
}

/// Whether to measure, and how.
pub fn measure(args: &args::Measuring) -> Option<metrics::Options> {
    args.measure.then(|| metrics::Options { samples: args.samples, ..metrics::Options::default() })
}

/// Does `work`; also returns the seconds that it took.
pub fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let clock = Instant::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64())
}

/// Checks the file that the log goes to.
fn check_log(args: Shared<'_>, input: Option<&Path>, outputs: &[&Path], problems: &mut Problems) {
    let Some(log) = &args.writing.write_log else { return };
    if args.how.shape.fit > 0 {
        problems.add("--write-log and --fit contradict each other: fitted positions are in no record");
    }
    if args.how.shape.flips > 0 {
        problems.add("--write-log and --flips contradict each other: turned edges are in no record");
    }
    check_beside("--write-log", log, input, outputs, args.writing.overwrite, problems);
}
