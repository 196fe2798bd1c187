//! `coarsen simplify` of a mesh above the memory limit: in parts, from the file.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use coarsen::out_of_core::{self, Input, Options, Outcome};
use coarsen::{Device, Error, StopReason};

use super::console;
use super::failure::{at, refuse};
use super::memory::{self, Size};
use super::progress::Meter;
use super::record::{Clocks, InputSize, Record};
use super::resolve::Job;
use super::simplify::{tell, timed, write};
use super::{Exit, interrupt};

/// The input, where the job needs parts to stay within its limit. What cannot be read in pieces is left to be read at once.
///
/// # Errors
/// A job above its limit that asks for what parts cannot do.
pub fn needed(job: &Job) -> anyhow::Result<Option<(Input, Options)>> {
    let (Some(limit), Some(path)) = (job.memory_limit, job.source.path()) else { return Ok(None) };
    let Ok(input) = Input::open(path) else { return Ok(None) };
    if memory::estimate(input.faces(), false) <= limit {
        return Ok(None);
    }
    let asked = [
        (job.measure.is_some(), "--measure"),
        (job.weight.is_some(), "--weight"),
        (job.write_feature.is_some(), "--write-feature"),
    ];
    let whole = asked
        .iter()
        .find(|(is_given, _)| *is_given)
        .map(|(_, option)| Error::Unsupported(format!("{option} needs the whole mesh in memory")));
    if let Some(reason) = whole.or_else(|| out_of_core::check(&job.method).err()) {
        let (need, limit) = (Size(memory::estimate(input.faces(), false)), Size(limit));
        let message = format!(
            "'{}': {} faces need about {need}, more than the memory limit of {limit}, and parts will not do: {reason}",
            job.source,
            input.faces()
        );
        return Err(refuse(Exit::Limit, message));
    }
    Ok(Some((input, Options { scratch: scratch(job), ..Options::new(limit) })))
}

/// The folder that was asked for, or that of the output, or the system's.
fn scratch(job: &Job) -> std::path::PathBuf {
    let beside = |path: &Path| match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => ".".into(),
        Some(folder) => folder.into(),
        None => std::env::temp_dir(),
    };
    job.temp_dir.clone().unwrap_or_else(|| job.sink.path().map_or_else(std::env::temp_dir, beside))
}

/// Runs the job in parts.
///
/// # Errors
/// As when it is run at once.
pub fn run(job: &Job, input: &Input, options: &Options, device: &Device) -> anyhow::Result<Exit> {
    let clock = Instant::now();
    let (outcome, solve) = timed(|| interrupt::shielded(|| solve(job, input, options, device)));
    let Outcome { outcome, diagonal, passes } = outcome?;
    if outcome.stop == StopReason::Cancelled {
        return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
    }
    for warning in &outcome.warnings {
        console::warning(job.verbosity, &format!("'{}': {warning}", job.source));
    }
    let (written, write) = timed(|| interrupt::shielded(|| device.install(|| write(job, &outcome))));
    written?;
    let clocks = Clocks { solve, write, total: clock.elapsed().as_secs_f64(), ..Clocks::default() };
    let size = InputSize { vertices: input.vertices(), diagonal };
    tell(job, &Record::new(job, size, &outcome, device, &clocks).with_passes(passes))
}

fn solve(job: &Job, input: &Input, options: &Options, device: &Device) -> anyhow::Result<Outcome> {
    let meter = Meter::new(job.progress, job.verbosity);
    let mut on_round = |step| {
        meter.show(step);
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = out_of_core::simplify(input, &job.method, &job.budget, options, device, Some(&mut on_round));
    meter.clear();
    outcome.map_err(|error| at(job.source.to_string().as_ref(), error))
}
