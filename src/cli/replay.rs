//! `coarsen replay`: read a mesh and its log, follow it, write, tell.

use std::fmt;
use std::path::PathBuf;
use std::time::Instant;

use coarsen::formats::{Scene, WriteOptions};
use coarsen::progressive::{CollapseLog, Replay};
use coarsen::{Budget, Error};
use serde::Serialize;

use super::console::{self, Verbosity};
use super::failure::{at, refuse};
use super::resolve::{Problems, face_budget};
use super::simplify::warn_about;
use super::sink::{Sink, same_file};
use super::source::Source;
use super::{Exit, args, interrupt, memory};

/// Everything `replay` needs to know.
#[derive(Debug)]
pub struct Job {
    source: Source,
    log: PathBuf,
    sink: Sink,
    budget: Budget,
    writing: WriteOptions,
    json: bool,
    verbosity: Verbosity,
}

impl Job {
    /// Makes a job of the arguments.
    ///
    /// # Errors
    /// All that is wrong with them, one a line; the first decides the exit code.
    pub fn new(args: &args::Replay) -> anyhow::Result<Self> {
        let mut problems = Problems::default();
        let target = &args.target;
        let budget = face_budget(target.faces, target.ratio, target.reduction);
        if budget == Budget::default() {
            problems.add("no target: give --faces, --ratio or --reduction");
        }
        let pipes = [&args.input, &args.output].map(|name| name == "-");
        let format = problems.format(args.writing.format.as_deref(), pipes);
        if pipes[1] && args.writing.json {
            problems.add("standard output cannot carry both the mesh ('-') and --json: name a file");
        }
        let source = problems.source(&args.input, format);
        let sink = problems.sink(&args.output, format);
        if let Err(source) = std::fs::metadata(&args.log) {
            problems.note::<(), _>(Err(Error::Read { path: args.log.clone(), source }));
        }
        if let Some(sink) = &sink {
            let inputs = source.as_ref().and_then(Source::path).into_iter().chain([args.log.as_path()]);
            let input = sink.path().and_then(|path| inputs.into_iter().find(|input| same_file(input, path)));
            problems.note(sink.check(input, args.writing.overwrite));
        }
        let (Some(source), Some(sink), true) = (source, sink, problems.is_empty()) else {
            return Err(problems.into_error());
        };
        Ok(Self {
            source,
            log: args.log.clone(),
            sink,
            budget,
            writing: WriteOptions { ascii: args.writing.ascii },
            json: args.writing.json,
            verbosity: if args.writing.quiet { Verbosity::Quiet } else { Verbosity::Normal },
        })
    }
}

/// A replay, as `--json` prints it. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
struct Record {
    schema: u32,
    version: &'static str,
    input: String,
    log: String,
    output: String,
    faces_in: usize,
    faces_out: usize,
    vertices_in: usize,
    vertices_out: usize,
    target: usize,
    /// Contractions that were followed, and that there are.
    contractions: usize,
    contractions_in_log: usize,
    seconds: Seconds,
    /// Bytes resident at most; null where the system does not tell.
    peak_memory: Option<u64>,
}

#[derive(Debug, Serialize)]
struct Seconds {
    read: f64,
    replay: f64,
    write: f64,
    total: f64,
}

/// Runs the job.
///
/// # Errors
/// An input or a log that cannot be read or do not belong together, a target that the log does not reach, an output that
/// cannot be written.
pub fn run(job: &Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let Scene { mesh: input, document, warnings } = job.source.read_scene()?;
    job.sink.check_against(&document)?;
    let log = CollapseLog::read(&job.log).map_err(|error| at(&job.log, error))?;
    let read = clock.elapsed().as_secs_f64();

    let target = job.budget.target_faces(input.faces.len())?;
    let mut replay = Replay::new(&input, &log).map_err(|error| at(&job.log, error))?;
    let faces = replay.to_faces(target);
    if faces > target {
        let message = format!("'{}' ends at {faces} faces, above the {target} asked for", job.log.display());
        return Err(refuse(Exit::TargetNotReached, message));
    }
    let mesh = replay.mesh();
    let replayed = clock.elapsed().as_secs_f64();
    let losses = interrupt::shielded(|| job.sink.write(&mesh, &document, &job.writing))?;
    warn_about(job.verbosity, &job.source, &[warnings, losses].concat());
    let total = clock.elapsed().as_secs_f64();

    let record = Record {
        schema: 1,
        version: env!("CARGO_PKG_VERSION"),
        input: job.source.to_string(),
        log: job.log.display().to_string(),
        output: job.sink.to_string(),
        faces_in: input.faces.len(),
        faces_out: faces,
        vertices_in: input.positions.len(),
        vertices_out: mesh.positions.len(),
        target,
        contractions: replay.step(),
        contractions_in_log: log.contractions().len(),
        seconds: Seconds { read, replay: replayed - read, write: total - replayed, total },
        peak_memory: memory::peak(),
    };
    if job.json {
        console::print_json(&record)?;
    }
    if job.verbosity > Verbosity::Quiet {
        console::say(record);
    }
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Seconds { read, replay, write, .. } = self.seconds;
        write!(
            f,
            "{} → {} faces by {} of {} contractions, read {read:.2} replay {replay:.2} write {write:.2} s",
            self.faces_in, self.faces_out, self.contractions, self.contractions_in_log
        )
    }
}
