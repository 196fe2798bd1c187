//! `coarsen simplify` of a mesh above the memory limit: in parts, from the file.

use std::path::Path;
use std::time::Instant;

use coarsen::formats::Document;
use coarsen::out_of_core::{self, Input, Options, Outcome};
use coarsen::{Device, Error, StopReason};

use super::console;
use super::failure::refuse;
use super::memory::{self, Size};
use super::record::{Clocks, InputSize, Record};
use super::resolve::Job;
use super::setup::timed;
use super::simplify::{tell, write};
use super::{Exit, interrupt};

/// The input, where the job needs parts to stay within its limit. What cannot be read in pieces is left to be read at once.
///
/// # Errors
/// A job above its limit that asks for what parts cannot do.
pub fn needed(job: &Job) -> anyhow::Result<Option<(Input, Options)>> {
    let (Some(limit), Some(path)) = (job.setup.memory_limit, job.setup.source.path()) else { return Ok(None) };
    let Ok(input) = Input::open(path) else { return Ok(None) };
    if memory::estimate(input.faces(), false) <= limit {
        return Ok(None);
    }
    let asked = [
        (job.setup.measure.is_some(), "--measure"),
        (job.setup.weight.is_some(), "--weight"),
        (job.setup.lock.is_some(), "--lock"),
        (job.setup.write_feature.is_some(), "--write-feature"),
    ];
    let whole = asked
        .iter()
        .find(|(is_given, _)| *is_given)
        .map(|(_, option)| Error::Unsupported(format!("{option} needs the whole mesh in memory")));
    if let Some(reason) = whole.or_else(|| out_of_core::check(&job.setup.method).err()) {
        let (need, limit) = (Size(memory::estimate(input.faces(), false)), Size(limit));
        let message = format!(
            "'{}': {} faces need about {need}, more than the memory limit of {limit}, and parts will not do: {reason}",
            job.setup.source,
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
    let (outcome, solve) = job.setup.solve(|on_round| {
        out_of_core::simplify(input, &job.setup.method, &job.budget, options, device, Some(on_round))
    })?;
    let Outcome { outcome, diagonal, passes } = outcome;
    if outcome.stop == StopReason::Cancelled {
        return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
    }
    for warning in &outcome.warnings {
        console::warning(job.setup.verbosity, &format!("'{}': {warning}", job.setup.source));
    }
    let (written, write) = timed(|| interrupt::shielded(|| device.install(|| write(job, &Document::None, &outcome))));
    let losses = written?;
    let clocks = Clocks { solve, write, total: clock.elapsed().as_secs_f64(), ..Clocks::default() };
    let size = InputSize { vertices: input.vertices(), diagonal };
    tell(job, &Record::new(job, size, &outcome, device, &clocks).with_losses(losses).with_passes(passes))
}
