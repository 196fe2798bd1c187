//! One file from reading to its records.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Event;
use super::beside::{self, Standing};
use super::estimate;
use super::failure::{Failure, Reason};
use super::input::Origin;
use super::ledger::{Deviation, Hash, Known, Ledger, Made, Record, Seconds, Stamp, Status};
use super::plan::{Job, Plan};
use super::schedule::{Lease, Schedule};
use super::{Ended, Observe, make_folder};
use crate::backend::Device;
use crate::error::{Error, Result};
use crate::formats::{self, Document, Format, Scene};
use crate::mesh::{Mesh, samples};
use crate::metrics;
use crate::progressive::sum_of_bytes;
use crate::simplify::{Budget, Method, OnProgress, Outcome, Progress, StopReason};

/// Makes the levels of a mesh, as [`simplify_levels`](crate::simplify_levels) does.
pub(super) type Solve =
    dyn Fn(&Mesh, &Method, &[Budget], &Device, Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> + Sync;

/// What all lanes share.
pub(super) struct Shop<'a> {
    pub plan: &'a Plan,
    pub schedule: &'a Schedule,
    pub ledger: &'a Ledger,
    pub known: &'a Known,
    /// All threads, and the GPU if there is one.
    pub device: &'a Device,
    pub memory_limit: Option<u64>,
    pub solve: &'a Solve,
    pub observe: &'a Observe<'a>,
}

/// The bytes of an input, or the name of a sample, and their sum.
struct Stored {
    bytes: Vec<u8>,
    hash: Hash,
}

impl Shop<'_> {
    /// Works on one file; `thread` is the lane's own device of one thread.
    pub fn work(&self, job: &Job, lease: &mut Lease<'_>, thread: &Device) -> std::result::Result<Ended, Failure> {
        let recipe = self.plan.recipe(job);
        let options = Hash(recipe.fingerprint()?);
        self.check_reading(job)?;
        let (stored, mut read) = timed(|| stored(job));
        let Stored { bytes, hash } = stored?;
        if self.is_done(job, hash, options) {
            return Ok(Ended::Skipped);
        }

        let cores = self.schedule.cores(false);
        let (parsed, parse) = timed(|| thread.install(|| self.parse(job, bytes)));
        let (Scene { mesh, document, warnings }, method) = parsed?;
        // What is read when levels are written is summed before: if it changes meanwhile, a run that goes on finds out.
        let (beside, sum) = timed(|| beside::of(&document, job));
        read += parse + sum;
        let faces = mesh.faces.len() as u64;
        let is_for_gpu = self.schedule.is_for_gpu(faces);
        let needed = estimate::bytes_needed(faces, is_for_gpu) + estimate::bytes_of_levels(faces, &recipe.budgets);
        self.check_memory(faces, needed)?;
        lease.correct(faces, needed);

        let is_wide = self.schedule.is_wide(faces);
        let cores = if is_wide {
            drop(cores);
            self.schedule.cores(true)
        } else {
            cores
        };
        let device = if is_wide { self.device } else { thread };
        let (outcomes, solve) = timed(|| self.solve(job, (&mesh, &method), device, recipe.timeout, read));
        drop(cores);
        let Some(outcomes) = outcomes? else { return Ok(Ended::Dropped) };

        let mut records = Vec::with_capacity(outcomes.len());
        for (level, outcome) in outcomes.iter().enumerate() {
            let path = self.plan.folder().join(&job.outputs[level]);
            let scene = (&outcome.mesh, &document);
            let (written, write) = timed(|| device.install(|| self.write(job, scene, &path)));
            let (output_hash, losses) = written?;
            let seconds = Seconds { read, solve, write, measure: 0.0 };
            let mut made = made(&mesh, outcome, &recipe.budgets[level], seconds);
            made.warnings = [warnings.as_slice(), &made.warnings, &losses].concat();
            records.push(Record {
                status: Status::Done,
                input_hash: Some(hash),
                output_hash: Some(output_hash),
                beside: beside.clone(),
                made: Some(made),
                ..blank(job, level, options)
            });
        }
        if let Some(options) = &recipe.measure {
            let _cores = self.schedule.cores(is_wide);
            for (record, outcome) in records.iter_mut().zip(&outcomes) {
                let (measured, seconds) = timed(|| metrics::deviation(&mesh, &outcome.mesh, options, device));
                let measured = measured?;
                record.made.iter_mut().for_each(|made| {
                    made.error.measured = Some((&measured).into());
                    made.seconds.measure = seconds;
                });
            }
        }
        self.sync_folders(job)?;
        self.ledger.append(&records)?;
        Ok(Ended::Done(records))
    }

    /// Puts the names of the outputs on the disk, as far as the system lets: a record that outlives them would be untrue.
    fn sync_folders(&self, job: &Job) -> Result<()> {
        if !cfg!(unix) {
            return Ok(());
        }
        let folder = |output: &String| self.plan.folder().join(output).parent().map(Path::to_path_buf);
        let folders: std::collections::BTreeSet<PathBuf> = job.outputs.iter().filter_map(folder).collect();
        folders.into_iter().try_for_each(|path| {
            let synced = File::open(&path).and_then(|folder| folder.sync_all());
            synced.map_err(|source| Error::Write { path, source })
        })
    }

    /// Writes down that a file failed, a record a level.
    pub fn note(&self, job: &Job, failure: &Failure) -> Result<()> {
        // That of a failure is never looked at.
        let options = Hash(self.plan.recipe(job).fingerprint().unwrap_or_default());
        let record = |level| Record { failure: Some(failure.clone()), ..blank(job, level, options) };
        self.ledger.append(&(0..job.outputs.len()).map(record).collect::<Vec<_>>())
    }

    /// Whether every level stands as a record says, from this input and what lies beside it, with these options and this version.
    fn is_done(&self, job: &Job, input_hash: Hash, options: Hash) -> bool {
        let mut standing = Standing::of(job);
        (1..).zip(&job.outputs).all(|(level, output)| {
            let path = self.plan.folder().join(output);
            let has = |output_hash| {
                let version = env!("CARGO_PKG_VERSION").into();
                let stamp = Stamp { level, input_hash, output_hash, options, version };
                self.known.has(output, &stamp, |beside| standing.agrees(beside))
            };
            self.known.mentions(output) && hash_of(&path, job.input_format()).is_ok_and(has)
        })
    }

    /// Refuses a file that does not fit the memory while it is read, before it is; what may be done already is read to tell.
    fn check_reading(&self, job: &Job) -> std::result::Result<(), Failure> {
        let size = job.input.size;
        let needed = size.bytes_to_read() + estimate::BYTES_ALWAYS;
        match self.memory_limit {
            Some(limit) if needed > limit && !job.outputs.iter().all(|output| self.known.mentions(output)) => {
                let [needed, limit] = [needed, limit].map(|bytes| bytes.div_ceil(1 << 20));
                let message = format!("reading it takes about {needed} MiB, more than the limit of {limit} MiB");
                Err(Failure::new(Reason::Memory, message))
            }
            _ => Ok(()),
        }
    }

    /// The mesh of an input's bytes, which go as soon as they can, and the method with the weights that it lacks.
    fn parse(&self, job: &Job, stored: Vec<u8>) -> Result<(Scene, Method)> {
        let recipe = self.plan.recipe(job);
        let Origin::File(path) = &job.input.origin else {
            let text = String::from_utf8_lossy(&stored);
            let missing = || Error::Parameter(format!("'{text}' is no sample"));
            let (name, faces) = samples::parse_sample(&text).ok_or_else(missing)?;
            let scene = Scene { mesh: samples::sample(name, faces)?, ..Scene::default() };
            return Ok((scene, recipe.weighted(None)?));
        };
        let (format, compression) = Format::from_path(path)?;
        let fixed = estimate::BYTES_ALWAYS + stored.len() as u64;
        let most = self.memory_limit.map_or(u64::MAX, |limit| limit.saturating_sub(fixed) / 5 * 2);
        let content = match formats::unpack(&stored, format, compression, most)? {
            Some(content) => {
                drop(stored);
                content
            }
            None => stored,
        };
        let mut scene = formats::read_scene_bytes(&content, format, path.parent())?;
        if recipe.method.drops_materials(&scene.mesh) {
            scene = scene.with_instances().0;
        }
        Ok((scene, recipe.weighted(Some((&content, format)))?))
    }

    fn check_memory(&self, faces: u64, needed: u64) -> std::result::Result<(), Failure> {
        let needed = needed + estimate::BYTES_ALWAYS;
        match self.memory_limit {
            Some(limit) if needed > limit => {
                let [needed, limit] = [needed, limit].map(|bytes| bytes.div_ceil(1 << 20));
                let message = format!("{faces} faces need about {needed} MiB, more than the limit of {limit} MiB");
                Err(Failure::new(Reason::Memory, message))
            }
            _ => Ok(()),
        }
    }

    /// The levels; none when the run is to end.
    fn solve(
        &self,
        job: &Job,
        (mesh, method): (&Mesh, &Method),
        device: &Device,
        timeout: Option<Duration>,
        read: f64,
    ) -> std::result::Result<Option<Vec<Outcome>>, Failure> {
        let clock = Instant::now();
        let is_late = || timeout.is_some_and(|timeout| read + clock.elapsed().as_secs_f64() > timeout.as_secs_f64());
        let mut on_round = |progress: Progress| {
            let goes_on = (self.observe)(Event::Progress { job, progress });
            if is_late() { ControlFlow::Break(()) } else { goes_on }
        };
        let outcomes = (self.solve)(mesh, method, &self.plan.recipe(job).budgets, device, Some(&mut on_round))?;
        match outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled) {
            true if is_late() => {
                let seconds = timeout.unwrap_or_default().as_secs_f64();
                Err(Failure::new(Reason::Timeout, format!("it took longer than {seconds} s")))
            }
            true => Ok(None),
            false if outcomes.len() != job.outputs.len() => {
                let message = format!("{} levels of {}", outcomes.len(), job.outputs.len());
                Err(Failure::new(Reason::Panicked, message))
            }
            false => Ok(Some(outcomes)),
        }
    }

    /// Writes a level and sums what was written; also returns what could not be.
    fn write(&self, job: &Job, (mesh, document): (&Mesh, &Document), path: &Path) -> Result<(Hash, Vec<String>)> {
        if let Some(folder) = path.parent() {
            make_folder(folder)?;
        }
        let losses = formats::write_scene(mesh, document, path, &self.plan.recipe(job).writing)?;
        // What a later run will read: the sum of the file as it stands.
        let hash =
            hash_of(path, job.input_format()).map_err(|source| Error::Write { path: path.to_path_buf(), source })?;
        Ok((hash, losses))
    }
}

/// The record of a level of which nothing is known.
fn blank(job: &Job, level: usize, options: Hash) -> Record {
    Record {
        schema: 1,
        status: Status::Failed,
        input: job.input.name.clone(),
        output: job.outputs[level].clone(),
        level: level + 1,
        levels: job.outputs.len(),
        input_hash: None,
        output_hash: None,
        beside: BTreeMap::new(),
        options,
        version: env!("CARGO_PKG_VERSION").into(),
        made: None,
        failure: None,
    }
}

/// Reads the bytes of an input. They are not mapped: a file that another program cuts short meanwhile would end the whole run.
fn stored(job: &Job) -> Result<Stored> {
    let bytes = match &job.input.origin {
        Origin::File(path) => {
            Format::from_path(path)?;
            fs::read(path).map_err(|source| Error::Read { path: path.clone(), source })?
        }
        Origin::Sample(text) => text.clone().into_bytes(),
    };
    Ok(Stored { hash: Hash(sum_of_bytes(&bytes)), bytes })
}

/// The sum of an output as it stands, of an input of this format, with what is written beside it.
fn hash_of(path: &Path, input: Option<Format>) -> io::Result<Hash> {
    let sum = sum_of_bytes(&fs::read(path)?);
    let beside = formats::file_beside(path, input).filter(|beside| beside.exists());
    let Some(beside) = beside else { return Ok(Hash(sum)) };
    let both = [sum, sum_of_bytes(&fs::read(beside)?)].map(u64::to_le_bytes);
    Ok(Hash(sum_of_bytes(both.as_flattened())))
}

fn made(mesh: &Mesh, outcome: &Outcome, budget: &Budget, seconds: Seconds) -> Made {
    Made {
        device: outcome.device.clone(),
        faces_in: outcome.faces_in,
        faces_out: outcome.mesh.faces.len(),
        vertices_in: mesh.positions.len(),
        vertices_out: outcome.mesh.positions.len(),
        target: budget.counts_faces().then_some(outcome.target),
        reached: budget.is_reached(outcome.stop),
        stop_reason: outcome.stop,
        blocked: outcome.blocked,
        error: Deviation::new(outcome.error_estimate, mesh.diagonal(), None),
        seconds,
        warnings: outcome.warnings.clone(),
    }
}

fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let clock = Instant::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64())
}
