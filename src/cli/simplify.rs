//! `coarsen simplify`: read, simplify, write, tell.

use std::slice;
use std::time::Instant;

use coarsen::formats::{Document, Scene};
use coarsen::metrics::deviation;
use coarsen::{Outcome, StopReason};

use super::console::{self, Verbosity};
use super::failure::{at, refuse};
use super::record::{Clocks, Record};
use super::resolve::Job;
use super::setup::timed;
use super::source::Source;
use super::verbose::{kernel_table, round_table};
use super::{Exit, interrupt, parts, regions, weights};

/// Runs the job.
///
/// # Errors
/// Whatever kept the output from being written, and a target that was required and not reached.
pub fn run(job: Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let setup = &job.setup;
    let device = setup.open()?;
    if let Some((input, options)) = parts::needed(&job)? {
        return parts::run(&job, &input, &options, &device);
    }
    let (Scene { mesh: input, document, warnings }, read) = setup.read(&device)?;
    job.sink.check_against(&document)?;
    let device = setup.within_limit(&input, slice::from_ref(&job.budget), device)?;
    let method = weights::method(setup)?;
    weights::write_features(setup, &input, &device)?;
    let (mut outcome, solve) =
        setup.solve(|on_round| coarsen::simplify(&input, &method, &job.budget, &device, Some(on_round)))?;
    if outcome.stop == StopReason::Cancelled {
        return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
    }
    outcome.warnings.splice(0..0, warnings);
    for warning in &outcome.warnings {
        console::warning(setup.verbosity, &format!("'{}': {warning}", setup.source));
    }
    let (written, write) = timed(|| interrupt::shielded(|| device.install(|| write(&job, &document, &outcome))));
    let losses = written?;
    // The result is safe by now, whatever happens to the measuring.
    let (measured, measure) =
        timed(|| setup.measure.map(|options| deviation(&input, &outcome.mesh, &options, &device)));
    let measured = measured.transpose().map_err(|error| at(setup.source.to_string().as_ref(), error))?;
    let clocks = Clocks { read, solve, write, measure, total: clock.elapsed().as_secs_f64() };
    tell(
        &job,
        &Record::new(&job, &input, &outcome, &device, &clocks).with_losses(losses).with_measured(measured.as_ref()),
    )
}

/// Writes the result with what the input said beside its mesh, and its log and its regions where they are asked for; returns what
/// is lost, which is told.
pub fn write(job: &Job, document: &Document, outcome: &Outcome) -> anyhow::Result<Vec<String>> {
    let Job { setup, sink, .. } = job;
    let losses = match outcome.regions.as_ref().filter(|_| job.polygons) {
        Some(regions) => sink.write_polygons(&outcome.mesh, &regions.polygons, document, &setup.writing)?,
        None => sink.write(&outcome.mesh, document, &setup.writing)?,
    };
    warn_about(setup.verbosity, &setup.source, &losses);
    regions::write(job, outcome)?;
    if let (Some(path), Some(log)) = (&job.setup.log, &outcome.log) {
        log.write(path)?;
    }
    Ok(losses)
}

/// Warns of these, a line each: what was not read or not written as it stands in the input.
pub fn warn_about(verbosity: Verbosity, source: &Source, warnings: &[String]) {
    warnings.iter().for_each(|warning| console::warning(verbosity, &format!("'{source}': {warning}")));
}

/// Says what was done; a target that was required and missed is an error though the result stands.
pub fn tell(job: &Job, record: &Record) -> anyhow::Result<Exit> {
    if job.setup.json {
        console::print_json(record)?;
    }
    if job.setup.verbosity == Verbosity::Verbose {
        [round_table(&record.rounds), kernel_table(&record.kernels)].into_iter().flatten().for_each(console::say);
    }
    if job.setup.verbosity > Verbosity::Quiet {
        console::say(record);
    }
    if job.require_target && !record.reached {
        return Err(refuse(Exit::TargetNotReached, record.shortfall()));
    }
    // The file was complete before the interruption could be heeded; the shell is to know of it all the same.
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}
