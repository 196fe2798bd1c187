//! `coarsen bench`: the same job on every device and by meshoptimizer, side by side.
//!
//! Contenders take turns, so that a machine that slows down slows all of them. What is timed is geometry only, from mesh
//! in memory to mesh in memory.

mod baseline;
mod case;
mod contender;
mod contest;
mod deviation;
mod machine;
mod markdown;
mod numbers;
mod papers;
mod peak;
mod plan;
mod plot;
mod record;
mod statistics;
mod table;
mod ticker;

use coarsen::{Device, formats};

use self::case::Case;
use self::contender::Contender;
use self::contest::contest;
use self::plan::Plan;
use self::record::{CaseRecord, Entrant, Figures, JobRecord, Record};
use self::ticker::Ticker;
use super::failure::refuse;
use super::{Exit, args, console, interrupt};

/// Measures what the arguments ask for and prints it.
///
/// # Errors
/// Contradictions in the arguments, an input that cannot be read, an output that cannot be written, no device at all. A
/// single device that cannot be opened or fails is a line in the table.
pub fn run(args: &args::Bench) -> anyhow::Result<Exit> {
    if let Some(job) = peak::job() {
        return peak::serve(&job);
    }
    if args.job.papers {
        return papers::run(args);
    }
    let plan = Plan::new(args)?;
    let (entrants, contenders) = open(&plan)?;
    let mut record = Record::new(&plan, entrants);
    for source in &plan.sources {
        let case = Case::read(source)?;
        let mut jobs = Vec::new();
        for target in &plan.targets {
            jobs.push(measure(&plan, &case, *target, &contenders)?);
        }
        record.cases.push(CaseRecord::new(&case, jobs));
    }
    record.finish();
    tell(&plan, &record)
}

/// Opens what can be opened; the list also has what cannot, and why.
///
/// # Errors
/// The reasons, where nothing can be opened.
fn open(plan: &Plan) -> anyhow::Result<(Vec<Entrant>, Vec<Contender>)> {
    let (mut entrants, mut contenders, mut reasons) = (Vec::new(), Vec::new(), Vec::new());
    for wish in &plan.wishes {
        console::note(plan.verbosity, &format!("opening {wish}"));
        match Contender::open(wish, plan.adapter_threads) {
            Ok(contender) => {
                entrants.push(Entrant::of(&contender));
                contenders.push(contender);
            }
            Err(reason) => {
                reasons.push(format!("{wish}: {reason}"));
                entrants.push(Entrant::absent(wish, reason));
            }
        }
    }
    if contenders.is_empty() {
        return Err(refuse(Exit::Device, format!("nothing to run: {}", reasons.join("; "))));
    }
    Ok((entrants, contenders))
}

/// One job by all contenders: times, then memory, then how far the results are from the input.
fn measure(plan: &Plan, case: &Case, target: plan::Target, contenders: &[Contender]) -> anyhow::Result<JobRecord> {
    let faces = target.faces(case.mesh.faces.len())?;
    let ticker = Ticker::new(plan.verbosity, format!("{} to {faces} faces", case.name));
    let mut job = JobRecord::new(target, faces);
    let mut outputs = Vec::new();
    for (contender, series) in contenders.iter().zip(contest(case, faces, contenders, plan.repeats, &ticker)) {
        match series {
            Ok(series) => {
                job.results.push(Figures::new(contender, case, &series));
                outputs.push(series.output);
            }
            Err(reason) => job.failures.push(Entrant::failed(contender, reason)),
        }
    }
    for figures in &mut job.results {
        ticker.show(&format!("memory of {}", figures.device));
        match peak::peak_bytes(&figures.device, plan.adapter_threads, case, faces) {
            Ok(bytes) => figures.peak_bytes = bytes,
            Err(reason) => figures.warnings.push(format!("its memory was not measured: {reason}")),
        }
    }
    job.compare(&outputs);
    if let Some(samples) = plan.samples {
        let device = Device::cpu(plan.adapter_threads)?;
        deviation::measure(&mut job, case, &outputs, samples, &device, &ticker);
    }
    Ok(job)
}

/// The picture before the text, so that nothing is printed when it cannot be written.
fn tell(plan: &Plan, record: &Record) -> anyhow::Result<Exit> {
    if let Some(path) = &plan.plot {
        let picture = plot::svg(record)?;
        interrupt::shielded(|| formats::write_file(path, picture.as_bytes()))?;
    }
    if plan.json {
        console::print_json(record)?;
    } else {
        console::print(markdown::text(record).as_bytes())?;
    }
    Ok(Exit::Done)
}
