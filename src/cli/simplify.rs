//! `coarsen simplify`: read, simplify, write, tell.

use std::ops::ControlFlow;
use std::time::Instant;

use coarsen::backend::{GpuOptions, Selector};
use coarsen::metrics::deviation;
use coarsen::{Device, Mesh, Method, Outcome, StopReason};

use super::console::{self, Verbosity};
use super::failure::{at, refuse};
use super::progress::Meter;
use super::record::{Clocks, Record};
use super::resolve::Job;
use super::{Exit, interrupt, memory, parts, regions, weights};

/// Runs the job.
///
/// # Errors
/// Whatever kept the output from being written, and a target that was required and not reached.
pub fn run(job: Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let timing = GpuOptions { time_kernels: job.verbosity == Verbosity::Verbose, ..GpuOptions::default() };
    let device = Device::open_with(&job.selector, job.threads, &timing)?;
    for note in device.notes() {
        console::note(job.verbosity, note);
    }
    if let Some((input, options)) = parts::needed(&job)? {
        return parts::run(&job, &input, &options, &device);
    }
    let (input, read) = read(&job, &device);
    let input = input?;
    memory::check(input.faces.len(), false, job.memory_limit)?;
    let device = match memory::check(input.faces.len(), device.is_gpu(), job.memory_limit) {
        Ok(()) => device,
        Err(reason) => {
            console::note(job.verbosity, &format!("the CPU does the work: on an adapter {reason}"));
            Device::cpu(job.threads)?
        }
    };

    let method = weights::method(&job)?;
    weights::write_features(&job, &input, &device)?;
    let (outcome, solve) = timed(|| interrupt::shielded(|| solve(&job, &method, &input, &device)));
    let outcome = outcome?;
    if outcome.stop == StopReason::Cancelled {
        return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
    }
    for warning in &outcome.warnings {
        console::warning(job.verbosity, &format!("'{}': {warning}", job.source));
    }
    let (written, write) = timed(|| interrupt::shielded(|| device.install(|| write(&job, &outcome))));
    written?;
    // The result is safe by now, whatever happens to the measuring.
    let (measured, measure) = timed(|| job.measure.map(|options| deviation(&input, &outcome.mesh, &options, &device)));
    let measured = measured.transpose().map_err(|error| at(job.source.to_string().as_ref(), error))?;
    let clocks = Clocks { read, solve, write, measure, total: clock.elapsed().as_secs_f64() };
    tell(&job, &Record::new(&job, &input, &outcome, &device, &clocks).with_measured(measured.as_ref()))
}

/// What `work` makes, and the seconds it takes.
pub fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let clock = Instant::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64())
}

/// Reads the input, and has a GPU that is sure to be used load its kernels in the meantime.
fn read(job: &Job, device: &Device) -> (anyhow::Result<Mesh>, f64) {
    std::thread::scope(|scope| {
        if job.selector != Selector::Auto || job.source.is_large() {
            // What fails here fails again in the run, which then tells.
            scope.spawn(|| coarsen::warm_up(&job.method, device));
        }
        timed(|| device.install(|| job.source.read()))
    })
}

fn solve(job: &Job, method: &Method, input: &Mesh, device: &Device) -> anyhow::Result<Outcome> {
    let meter = Meter::new(job.progress, job.verbosity);
    let mut on_round = |step| {
        meter.show(step);
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = coarsen::simplify(input, method, &job.budget, device, Some(&mut on_round));
    meter.clear();
    outcome.map_err(|error| at(job.source.to_string().as_ref(), error))
}

/// Writes the result, and its log and its regions where they are asked for.
pub fn write(job: &Job, outcome: &Outcome) -> anyhow::Result<()> {
    let polygons = outcome.regions.as_ref().filter(|_| job.polygons).map(|regions| &regions.polygons);
    job.sink.write(&outcome.mesh, polygons, &job.writing)?;
    regions::write(job, outcome)?;
    match (&job.log, &outcome.log) {
        (Some(path), Some(log)) => Ok(log.write(path)?),
        _ => Ok(()),
    }
}

/// Says what was done; a target that was required and missed is an error though the result stands.
pub fn tell(job: &Job, record: &Record) -> anyhow::Result<Exit> {
    if job.json {
        console::print_json(record)?;
    }
    if job.verbosity == Verbosity::Verbose {
        let rounds = (!record.rounds.is_empty()).then(|| record.round_table());
        rounds.into_iter().chain(record.kernel_table()).for_each(console::say);
    }
    if job.verbosity > Verbosity::Quiet {
        console::say(record);
    }
    if job.require_target && !record.reached {
        return Err(refuse(Exit::TargetNotReached, record.shortfall()));
    }
    // The file was complete before the interruption could be heeded; the shell is to know of it all the same.
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}
