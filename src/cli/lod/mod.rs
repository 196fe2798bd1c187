//! `coarsen lod`: read once, simplify once, write every level, tell.

mod job;
mod pattern;
mod record;
mod write;

use std::borrow::Cow;
use std::time::Instant;

use coarsen::formats::{self, Scene};
use coarsen::metrics::{self, deviation};
use coarsen::simplify::Phases;
use coarsen::{Device, Mesh, Method, Outcome, StopReason, simplify_levels};

use super::console::{self, Verbosity};
use super::failure::{at, refuse};
use super::record::Clocks;
use super::setup::timed;
use super::verbose::{kernel_table, round_table};
use super::{Exit, interrupt, weights};
pub use job::Job;
use record::Record;

/// Runs the job.
///
/// # Errors
/// Whatever kept a level from being written, and a level that was required and not reached.
pub fn run(job: &Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let setup = &job.setup;
    let device = setup.open()?;
    let (Scene { mesh: input, document, warnings }, read) = setup.read(&device)?;
    job.outputs.paths().into_iter().try_for_each(|path| document.check_output(path))?;
    let device = setup.within_limit(&input, &job.budgets, device)?;
    let method = weights::method(setup)?;
    weights::write_features(setup, &input, &device)?;
    let (mut outcomes, solve) =
        setup.solve(|on_round| simplify_levels(&input, &method, &job.budgets, &device, Some(on_round)))?;
    if outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled) {
        return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
    }
    if let Some(outcome) = outcomes.first_mut() {
        outcome.warnings.splice(0..0, warnings);
    }
    let (written, write) = timed(|| interrupt::shielded(|| device.install(|| write::write(job, &document, &outcomes))));
    let ranges = written?;
    let (measured, measure) = timed(|| measure(job, &input, &outcomes, &device));
    let measured = measured?;
    let clocks = Clocks { read, solve, write, measure, total: clock.elapsed().as_secs_f64() };
    let record = Record::new(job, &input, &outcomes, (&ranges, &measured), &device, &clocks);
    // Last: where it is, everything that it names is complete.
    if let Some(path) = &job.manifest {
        // What shares its vertices is a file without nodes, which has it once.
        let is_once = matches!(job.outputs, job::Outputs::Shared { .. });
        let shown = if is_once { Cow::Borrowed(&input) } else { document.all_shown(&input).0 };
        formats::write_file(path, &record.manifest([&input, &shown], &job.outputs, path)?)?;
    }
    tell(job, &record, &outcomes, &device)
}

/// Measures every level against the input, where that is asked for.
fn measure(job: &Job, input: &Mesh, outcomes: &[Outcome], device: &Device) -> anyhow::Result<Vec<metrics::Deviation>> {
    let Some(options) = &job.setup.measure else { return Ok(Vec::new()) };
    let of = |outcome: &Outcome| deviation(input, &outcome.mesh, options, device);
    let measured: coarsen::Result<_> = outcomes.iter().map(of).collect();
    measured.map_err(|error| at(job.setup.source.to_string().as_ref(), error))
}

/// The outcomes that tell of a whole run: all, or the last where one run made all levels.
fn runs<'a>(method: &Method, outcomes: &'a [Outcome]) -> &'a [Outcome] {
    if is_one_run(method) { &outcomes[outcomes.len().saturating_sub(1)..] } else { outcomes }
}

/// What a chain spent on each phase: a run tells of all of its levels but for what is turned after it.
fn phases(method: &Method, outcomes: &[Outcome]) -> Phases {
    let flip = outcomes.iter().map(|outcome| outcome.seconds.flip).sum();
    Phases { flip, ..runs(method, outcomes).iter().map(|run| run.seconds).sum() }
}

/// Contraction makes all levels in one run.
fn is_one_run(method: &Method) -> bool {
    matches!(method, Method::Contract(_))
}

/// The tables of rounds and kernels.
fn tables(method: &Method, outcomes: &[Outcome], device: &Device) -> impl Iterator<Item = String> {
    let one_run = is_one_run(method);
    let rounds = runs(method, outcomes).iter().enumerate().filter_map(move |(number, outcome)| {
        let table = round_table(&outcome.rounds)?;
        Some(if one_run { table } else { format!("level {}:\n{table}", number + 1) })
    });
    rounds.chain(kernel_table(&device.kernel_times()))
}

/// Says what was done; a level that was required and missed is an error though all are written.
fn tell(job: &Job, record: &Record, outcomes: &[Outcome], device: &Device) -> anyhow::Result<Exit> {
    let verbosity = job.setup.verbosity;
    for warning in &record.warnings {
        console::warning(verbosity, &format!("'{}': {warning}", job.setup.source));
    }
    if job.setup.json {
        console::print_json(record)?;
    }
    if verbosity == Verbosity::Verbose {
        tables(&job.setup.method, outcomes, device).for_each(console::say);
    }
    if verbosity > Verbosity::Quiet {
        console::say(record);
    }
    if let Some(shortfall) = record.shortfall().filter(|_| job.require_target) {
        return Err(refuse(Exit::TargetNotReached, shortfall));
    }
    // The files were complete before the interruption could be heeded; the shell is to know of it all the same.
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}

#[cfg(test)]
mod tests {
    use coarsen::backend::Selector;
    use coarsen::{Budget, cluster, contract};

    use super::*;

    #[test]
    fn phases_are_those_of_one_run_or_of_all() {
        let (mesh, device) = (coarsen::mesh::shapes::icosphere(2), Device::open(&Selector::Cpu, 1).expect("a CPU"));
        let contraction = Method::Contract(contract::Options::default());
        let budgets = [0.5, 0.25].map(Budget::keep);
        let mut levels = simplify_levels(&mesh, &contraction, &budgets, &device, None).expect("a chain");
        for (outcome, secs) in levels.iter_mut().zip([1.0, 3.0]) {
            outcome.seconds = Phases { cost: secs, restore: 10.0 * secs, flip: secs, ..Phases::default() };
        }
        let of = |method: &Method| {
            let Phases { cost, restore, flip, .. } = phases(method, &levels);
            [cost, restore, flip]
        };
        assert_eq!(of(&contraction), [3.0, 30.0, 4.0]);
        assert_eq!(of(&Method::Cluster(cluster::Options::default())), [4.0, 40.0, 4.0]);
    }
}
