//! `coarsen batch`: many files in one run.

mod board;
mod manifest;
mod resolve;

use std::ops::ControlFlow;
use std::time::Instant;

use coarsen::Device;
use coarsen::batch::{Event, Options, Plan, Reason, Summary, run as run_plan};
use serde::Serialize;

use super::console::{self, Verbosity};
use super::{Exit, interrupt, memory};
use board::Board;

pub use resolve::Job;

/// What a run did, as `--json` prints it.
#[derive(Serialize)]
struct Told {
    schema: u32,
    files: usize,
    done: usize,
    missed: usize,
    warned: usize,
    skipped: usize,
    failed: usize,
    left: usize,
    /// Failures by reason.
    reasons: serde_json::Map<String, serde_json::Value>,
    faces_in: u64,
    faces_out: u64,
    seconds: f64,
    peak_memory: Option<u64>,
    device: String,
    records: String,
    version: &'static str,
}

/// Runs the job.
///
/// # Errors
/// Whatever kept the run from starting; files that fail are told and make the exit code.
pub fn run(job: &Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let plan = Plan::new(&job.requests, job.recipes.clone(), &job.folder, job.shard)?;
    let device = Device::open(&job.selector, job.threads)?;
    for note in device.notes() {
        console::note(job.verbosity, note);
    }
    let board = Board::new(&plan, job.progress, job.verbosity);
    let observe = |event: Event<'_>| {
        board.show(&event);
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let options = Options {
        resume: job.resume,
        overwrite: job.overwrite,
        memory_limit: job.memory_limit,
        // Enough is left for what else the machine does.
        memory_shared: job.memory_limit.or_else(|| memory::available().map(|bytes| bytes / 4 * 3)),
    };
    let summary = interrupt::shielded(|| run_plan(&plan, &device, &options, &observe));
    board.clear();
    let summary = summary?;
    let seconds = clock.elapsed().as_secs_f64();
    if job.json {
        console::print_json(&told(&plan, &summary, &device, seconds))?;
    }
    if job.verbosity > Verbosity::Quiet {
        tell(&plan, &summary, seconds);
    }
    Ok(match (interrupt::asked(), summary.failed.is_empty()) {
        (true, _) => Exit::Interrupted,
        (false, true) => Exit::Done,
        (false, false) => Exit::FilesFailed,
    })
}

fn told(plan: &Plan, summary: &Summary, device: &Device, seconds: f64) -> Told {
    let reason = |(reason, count): (Reason, usize)| (reason.to_string().replace(' ', "_"), count.into());
    Told {
        schema: 1,
        files: plan.jobs().len(),
        done: summary.done,
        missed: summary.missed,
        warned: summary.warned,
        skipped: summary.skipped,
        failed: summary.failed.len(),
        left: summary.left,
        reasons: summary.reasons().into_iter().map(reason).collect(),
        faces_in: summary.faces_in,
        faces_out: summary.faces_out,
        seconds,
        peak_memory: memory::peak(),
        device: device.description(),
        records: plan.ledger().display().to_string(),
        version: env!("CARGO_PKG_VERSION"),
    }
}

/// The table of the failures by reason, and a line about the whole.
fn tell(plan: &Plan, summary: &Summary, seconds: f64) {
    if !summary.failed.is_empty() {
        console::say(failures(summary));
    }
    let Summary { done, missed, warned, skipped, failed, left, faces_in, faces_out } = summary;
    let mut line = format!("{done} of {} files done", plan.jobs().len());
    for (count, what) in [
        (*missed, "short of what was asked for"),
        (*warned, "with warnings"),
        (*skipped, "done before"),
        (failed.len(), "failed"),
        (*left, "left for --resume"),
    ] {
        if count > 0 {
            line += &format!(", {count} {what}");
        }
    }
    let speed = *faces_in as f64 / seconds / 1e6;
    line += &format!(", {faces_in} → {faces_out} faces in {seconds:.1} s ({speed:.2} M faces a second)");
    console::say(format_args!("{line}, records in '{}'", plan.ledger().display()));
}

/// A line a reason with its count and the first file of it.
fn failures(summary: &Summary) -> String {
    let mut table = format!("{:<12} {:>6}  such as", "failed", "files");
    for (reason, count) in summary.reasons() {
        let first = summary.failed.iter().find(|(_, failure)| failure.reason == reason);
        let first = first.map_or_else(String::new, |(name, failure)| format!("{name}: {failure}"));
        table += &format!("\n{:<12} {count:>6}  {first}", reason.to_string());
    }
    table
}
