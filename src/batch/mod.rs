//! Many files in one run that can be left alone: planned before it starts, recorded as it goes, resumed after any end.
//!
//! ```text
//! requests, recipes ─▶ Plan (inputs, outputs, shard) ─▶ run: lanes take files, the largest first ─▶ outputs, records ─▶ Summary
//!                                                         read → simplify_levels → write → record, for each file by itself
//! ```
//!
//! Invariants:
//! - an output stands under its name whole or not at all, and its record is written after it;
//! - a record says done only of an output that has its hash; a run that goes on checks that of input, output and the files that
//!   the input is read with, the options and the version, and does again what does not agree;
//! - what is written depends on a file, those that it names, and its recipe alone: not on the order, the threads, the device, the
//!   shards, or other files, failures and panics included;
//! - one process at a time works on a file: shards are locked while they are at work.

mod beside;
mod estimate;
mod failure;
mod input;
mod ledger;
mod leftovers;
mod lock;
mod pattern;
mod plan;
mod schedule;
mod worker;

use std::fs;
use std::io;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::backend::Device;
use crate::error::{Error, Result};
use crate::simplify::{Progress, simplify_levels};

pub use estimate::{BYTES_ALWAYS, bytes_needed, bytes_of_levels, faces_in_file};
pub use failure::{Failure, Reason};
pub use input::{Input, Origin, Request, list};
pub use ledger::{Deviation, Hash, Made, Measured, Record, Seconds, Status};
pub use pattern::{Pattern, Words};
pub use plan::{Job, Plan, Recipe, Shard};

use ledger::{Known, Ledger, ledgers};
use lock::Lock;
use schedule::Schedule;
use worker::{Shop, Solve};

/// How to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// Go on with what an earlier run left: skip what is done, do the rest.
    pub resume: bool,
    /// Start anew in the place of an earlier run, and replace files that are there.
    pub overwrite: bool,
    /// Fail files that need more memory than this by themselves.
    pub memory_limit: Option<u64>,
    /// Start no file while those at work and it are estimated to need more than this together; as much as `memory_limit`
    /// without it.
    pub memory_shared: Option<u64>,
}

/// What happens on the way.
#[derive(Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A file is being read.
    Started {
        /// Which.
        job: &'a Job,
    },
    /// A round of a file is done.
    Progress {
        /// Which.
        job: &'a Job,
        /// How far it is.
        progress: Progress,
    },
    /// A file is through.
    Finished {
        /// Which.
        job: &'a Job,
        /// How it ended.
        ended: &'a Ended,
    },
}

/// How a file ended.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Ended {
    /// Its levels are written, and so are these records of them.
    Done(Vec<Record>),
    /// An earlier run had done it.
    Skipped,
    /// It has no result.
    Failed(Failure),
    /// The run was ended before it was through; nothing is written.
    Dropped,
}

/// Told of every [`Event`], from several threads; break to end the run: files at work are dropped, none is started.
pub type Observe<'a> = dyn Fn(Event<'_>) -> ControlFlow<()> + Sync + 'a;

/// What a run did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// Files done in this run.
    pub done: usize,
    /// Files that an earlier run had done.
    pub skipped: usize,
    /// Of these, those with a level that has more faces than it was asked for, or is farther off.
    pub missed: usize,
    /// And those that their records have a warning about.
    pub warned: usize,
    /// The names of files that failed, sorted, and why.
    pub failed: Vec<(String, Failure)>,
    /// Files that were not begun or not ended.
    pub left: usize,
    /// Faces read and written in this run.
    pub faces_in: u64,
    /// Of all levels.
    pub faces_out: u64,
}

/// Does what `plan` says, on the threads of `device`, and on its GPU where a mesh is large enough.
///
/// A file that fails is in the summary and stops no other; neither does one whose work panics.
///
/// # Errors
/// [`Error::Write`] where the folder cannot be made or its records cannot be opened, where another process is at work on
/// them, and where something is there already that is neither to be resumed nor replaced; [`Error::Read`] for records that cannot be read; [`Error::Device`] when threads
/// cannot be started.
pub fn run(plan: &Plan, device: &Device, options: &Options, observe: &Observe<'_>) -> Result<Summary> {
    run_with(plan, device, options, observe, &simplify_levels)
}

/// [`run`] with a stand-in for the work on a mesh.
fn run_with(plan: &Plan, device: &Device, options: &Options, observe: &Observe<'_>, solve: &Solve) -> Result<Summary> {
    let folder = plan.folder();
    make_folder(folder)?;
    let _lock = Lock::take(plan)?;
    let known = if options.resume { Known::read(folder)? } else { Known::default() };
    // Without a record there is nothing to go on with: what is there is somebody else's.
    if !options.overwrite && (!options.resume || ledgers(folder)?.is_empty()) {
        refuse_to_replace(plan, options.resume)?;
    }
    if options.resume || options.overwrite {
        leftovers::remove(plan)?;
    }
    let ledger = Ledger::open(&plan.ledger(), options.resume)?;
    let cores = device.install(rayon::current_num_threads);
    let memory = options.memory_shared.or(options.memory_limit);
    let schedule = Schedule::new(plan.jobs(), cores, device.is_gpu(), memory);
    let observe = |event: Event<'_>| {
        let flow = observe(event);
        if flow.is_break() {
            schedule.end();
        }
        flow
    };
    let shop = Shop {
        plan,
        schedule: &schedule,
        ledger: &ledger,
        known: &known,
        device,
        memory_limit: options.memory_limit,
        solve,
        observe: &observe,
    };
    let summary = Mutex::new(Summary { left: plan.jobs().len(), ..Summary::default() });
    let threads: Vec<Device> = (0..schedule.lanes(plan.jobs())).map(|_| Device::cpu(1)).collect::<Result<_>>()?;
    thread::scope(|scope| {
        for thread in &threads {
            scope.spawn(|| lane(&shop, thread, &summary));
        }
    });
    let mut summary = summary.into_inner().unwrap_or_else(PoisonError::into_inner);
    summary.failed.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(summary)
}

/// Takes one file after the other.
fn lane(shop: &Shop<'_>, thread: &Device, summary: &Mutex<Summary>) {
    let jobs = shop.plan.jobs();
    while let Some(mut lease) = shop.schedule.next(jobs) {
        let job = &jobs[lease.job];
        let mut ended = Ended::Dropped;
        if (shop.observe)(Event::Started { job }).is_continue() {
            // What the work leaves behind when it panics is its own: guards give back cores, the file is not renamed.
            let worked = catch_unwind(AssertUnwindSafe(|| shop.work(job, &mut lease, thread)));
            ended = match worked {
                Ok(Ok(ended)) => ended,
                Ok(Err(failure)) => Ended::Failed(failure),
                Err(panic) => Ended::Failed(Failure::of_panic(panic.as_ref())),
            };
        }
        if let Ended::Failed(failure) = &ended {
            // Where not even this can be written, the summary still has the failure, and a run that goes on tries again.
            let _ = shop.note(job, failure);
        }
        summary.lock().unwrap_or_else(PoisonError::into_inner).add(job, &ended);
        // Who breaks here ends the run, which `observe` sees to.
        let _ = (shop.observe)(Event::Finished { job, ended: &ended });
    }
}

impl Summary {
    fn add(&mut self, job: &Job, ended: &Ended) {
        self.left -= usize::from(*ended != Ended::Dropped);
        match ended {
            Ended::Done(records) => {
                self.done += 1;
                let made = || records.iter().filter_map(|record| record.made.as_ref());
                self.missed += usize::from(made().any(|made| !made.reached));
                self.warned += usize::from(made().any(|made| !made.warnings.is_empty()));
                self.faces_in += made().next().map_or(0, |made| made.faces_in as u64);
                self.faces_out += made().map(|made| made.faces_out as u64).sum::<u64>();
            }
            Ended::Skipped => self.skipped += 1,
            Ended::Failed(failure) => self.failed.push((job.input.name.clone(), failure.clone())),
            Ended::Dropped => {}
        }
    }

    /// How many files failed for each reason.
    pub fn reasons(&self) -> Vec<(Reason, usize)> {
        let mut reasons = std::collections::BTreeMap::new();
        for (_, failure) in &self.failed {
            *reasons.entry(failure.reason).or_insert(0) += 1;
        }
        reasons.into_iter().collect()
    }
}

/// Makes a folder for outputs, and those that it is in.
fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|source| {
        // A folder that is there is no error: this is something else.
        let source = match source.kind() {
            io::ErrorKind::AlreadyExists => {
                io::Error::new(io::ErrorKind::NotADirectory, "a file, where a folder is needed")
            }
            _ => source,
        };
        Error::Write { path: path.to_path_buf(), source }
    })
}

/// Refuses a folder in which an earlier run left records of this shard, or in which an output is there already; there are none to go
/// on with where that is asked for.
fn refuse_to_replace(plan: &Plan, resumes: bool) -> Result<()> {
    let exists = |path: PathBuf| {
        let why = match resumes {
            true => "it exists, and no records of a run: `overwrite` replaces it",
            false => "it exists: `resume` goes on with that run, `overwrite` replaces it",
        };
        Error::Write { path, source: io::Error::new(io::ErrorKind::AlreadyExists, why) }
    };
    let ledger = plan.ledger();
    if ledgers(plan.folder())?.contains(&ledger) {
        return Err(exists(ledger));
    }
    let outputs = plan.jobs().iter().flat_map(Job::files);
    match outputs.map(|output| plan.folder().join(output)).find(|path| path.exists()) {
        Some(path) => Err(exists(path)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
