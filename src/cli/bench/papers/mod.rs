//! `coarsen bench --papers`: the papers' tables, with what is measured beside what they print.

mod light;
mod regions;

use std::path::Path;

use coarsen::metrics::{self, Deviation};
use coarsen::papers::{Trial, average, features, survey};
use coarsen::{Device, Mesh, formats};

use super::case::Case;
use super::machine::Machine;
use super::numbers::{grouped, millis, percent, relative, three_digits};
use super::table::Table;
use super::ticker::Ticker;
use super::{plan, plot};
use crate::cli::console::{self, Verbosity};
use crate::cli::failure::refuse;
use crate::cli::resolve::Problems;
use crate::cli::source::Source;
use crate::cli::{Exit, args, interrupt};

/// Faces of the samples when no mesh is named: few enough for minutes on two cores.
const SAMPLE_FACES: usize = 20_000;
/// The mesh that finding quadrics is timed on, unless a large one is named.
const TIMED_SAMPLE: &str = "sample:statue@200k";

/// What the tables are of.
struct Tables<'a> {
    /// Judged by their shape.
    cases: &'a [Case],
    /// With light, judged by that.
    scenes: &'a [Case],
    device: Device,
    repeats: usize,
    verbosity: Verbosity,
}

/// Runs the papers' jobs and prints their tables.
///
/// # Errors
/// Contradictions in the arguments, a mesh that cannot be read, a run that fails.
pub fn run(args: &args::Bench) -> anyhow::Result<Exit> {
    let mut problems = Problems::default();
    let sources = plan::sources(args, SAMPLE_FACES, &mut problems);
    if let Some(path) = &args.writing.plot {
        plan::check_picture(path, args.writing.overwrite, &mut problems);
    }
    if !problems.is_empty() {
        return Err(problems.into_error());
    }
    let threads = args.contenders.threads.iter().copied().max().unwrap_or(0);
    let verbosity = if args.writing.quiet { Verbosity::Quiet } else { Verbosity::Normal };
    let all = sources.iter().map(Case::read_lit).collect::<anyhow::Result<Vec<_>>>()?;
    let is_lit = |case: &Case| case.mesh.colors.is_some() || case.mesh.face_colors.is_some();
    let (scenes, cases): (Vec<Case>, Vec<Case>) = all.into_iter().partition(is_lit);
    if scenes.is_empty() && args.writing.plot.is_some() {
        let message = "--papers draws the curves of meshes with light, and there is none: name sample:room";
        return Err(refuse(Exit::Usage, message));
    }
    let device = Device::cpu(threads.into())?;
    let tables = Tables { cases: &cases, scenes: &scenes, device, repeats: args.job.repeats.into(), verbosity };
    let mut parts = vec![tables.heading()];
    if !cases.is_empty() {
        parts.extend([tables.survey()?, tables.features()?, tables.formats()?, tables.initialization()?]);
        parts.push(tables.regions()?);
    }
    let curves = tables.curves()?;
    if let Some(path) = &args.writing.plot {
        let picture = plot::curves(&light::lines(&curves))?;
        interrupt::shielded(|| formats::write_file(path, picture.as_bytes()))?;
    }
    parts.push(tables.light(&curves)?);
    console::print((parts.concat().trim_end().to_string() + "\n").as_bytes())?;
    Ok(Exit::Done)
}

/// A deviation in percent of the diagonal.
fn of_diagonal(length: f64, deviation: &Deviation) -> String {
    few_digits(100.0 * relative(length, deviation.diagonal))
}

/// Three digits that count, down to four after the point.
fn few_digits(number: f64) -> String {
    if number < 0.09995 { format!("{number:.4}") } else { three_digits(number) }
}

/// A mesh without the folder that it lies in.
fn short_name(case: &Case) -> String {
    let file = Path::new(&case.name).file_name();
    file.map_or_else(|| case.name.clone(), |name| name.to_string_lossy().into_owned())
}

/// The symmetric greatest and the forward mean deviation.
fn deviations(trial: &Trial) -> [String; 2] {
    [trial.deviation.symmetric().max, trial.deviation.forward.distance.mean]
        .map(|length| of_diagonal(length, &trial.deviation))
}

fn verdict(is_held: bool) -> String {
    if is_held { "held" } else { "not held" }.into()
}

impl Tables<'_> {
    fn heading(&self) -> String {
        let machine = Machine::here();
        let names: Vec<String> = self
            .cases
            .iter()
            .chain(self.scenes)
            .map(|case| format!("{} ({} faces)", short_name(case), grouped(case.mesh.faces.len())))
            .collect();
        format!(
            "# The papers' tables by coarsen {}\n\n{}, {} cores; {}; {}\n\nMeshes: {}.\n\n\
             Deviations are in percent of the diagonal, at vertices, along edges and at ten points a face: the greatest of \
             both sides, and the mean from the input to the result. Times are medians of {} runs, \
             those of features of one. Meshes with colors stand among the superfaces only.\n\n",
            env!("CARGO_PKG_VERSION"),
            machine.cpu,
            machine.cores,
            machine.os,
            self.device.description(),
            names.join(", "),
            self.repeats,
        )
    }

    fn survey(&self) -> anyhow::Result<String> {
        let columns =
            ["mesh", "faces", "quadrics", "verdict", "ms", "paper's", "greatest", "expected", "mean", "expected"];
        let mut table = Table::new(columns);
        let own: Vec<&Case> = self.cases.iter().filter(|case| survey::is_cow(&case.mesh)).collect();
        let is_own = !own.is_empty();
        let known = |text: Option<String>| text.filter(|_| is_own).unwrap_or_else(|| "-".into());
        for case in if is_own { own } else { self.cases.iter().collect() } {
            for published in &survey::ROWS {
                let ticker = self.ticker(&case.name, "pair contraction");
                ticker.show(&format!("to {} faces", survey::faces_of(published, &case.mesh)));
                let trials =
                    survey::row(&case.mesh, published, self.repeats, &metrics::Options::default(), &self.device)?;
                for (i, ((name, _), trial)) in survey::contenders().into_iter().zip(&trials).enumerate() {
                    let expected = |k: usize| known(published.expected.get(i).map(|pair| few_digits(pair[k])));
                    let [greatest, mean] = deviations(trial);
                    let verdict = known(Some(verdict(published.is_held(i, trial))));
                    let paper = known(published.millis.map(|millis| millis.to_string()));
                    let words = [short_name(case), grouped(trial.faces), name.into(), verdict];
                    let numbers = [millis(trial.seconds.total), paper, greatest, expected(0), mean, expected(1)];
                    table.rows.push(words.into_iter().chain(numbers).collect());
                }
            }
        }
        Ok(format!(
            "## [Wu12] Quadric pair contraction\n\nThe paper prints two times for a cow of 5,804 faces and no deviation; the \
             share beside its second time is that of 366 faces, not of 326. Expected deviations are those of a serial prototype \
             in double precision; held is up to {} of them, in the paper's time. Other meshes are taken to the same shares, where \
             the cow is not among them.\n\n{}",
            percent(survey::BAND),
            table.lines(4)
        ))
    }

    fn features(&self) -> anyhow::Result<String> {
        let mut rows = Vec::new();
        for case in self.cases {
            let ticker = self.ticker(&case.name, "features");
            for kept in features::KEPT {
                ticker.show(&format!("to {}", percent(kept)));
                rows.push(features::row(&case.mesh, kept, &metrics::Options::default(), &self.device)?);
            }
        }
        let means = features::means(&rows);
        let mut table = Table::new(["method", "claim", "Hausdorff", "mean", "RMS", "start", "rounds", "total"]);
        for (i, ((name, _), mean)) in features::contenders().into_iter().zip(&means).enumerate() {
            let is_claimed = features::CLAIMED.contains(&i);
            let claim = if is_claimed { verdict(mean.max <= 1.0 && mean.mean <= 1.02) } else { "-".into() };
            let ratios = [mean.max, mean.mean, mean.rms, mean.start_secs, mean.rounds_secs, mean.total_secs];
            table
                .rows
                .push([name.into(), claim].into_iter().chain(ratios.map(|ratio| format!("{ratio:.3}"))).collect());
        }
        let fair = rows.iter().filter(|row| row.is_fair()).count();
        Ok(format!(
            "## [Yang13] Visual features\n\nThe paper's tables are lost. Its claim: closer than plain half-edges by Metro, in about \
             their time. Deviations and times over those of plain half-edges, as geometric means over {fair} of {} rows at 20, 10, 5 \
             and 2.5 % of the faces, the others stuck; held is a Hausdorff distance of at most 1 and a mean of at most 1.02.\n\n{}",
            rows.len(),
            table.lines(2)
        ))
    }

    fn formats(&self) -> anyhow::Result<String> {
        let names = average::contenders().into_iter().map(|(name, _)| name);
        let mut of_meshes = Table::new(["mesh", "Maxd2"].into_iter().chain(names));
        let mut rows = Vec::new();
        for case in self.cases {
            self.ticker(&case.name, "formats").show("as found, then stored");
            let trials = average::row(&case.mesh, &metrics::Options::default(), &self.device)?;
            let raw = trials.iter().find_map(|trial| trial.quadrics).map_or(0.0, |record| record.max_d2);
            let mut row = vec![short_name(case), three_digits(raw.into())];
            row.extend(trials.iter().map(|trial| deviations(trial).join(", ")));
            of_meshes.rows.push(row);
            rows.push(trials);
        }
        let mut table = Table::new(["format", "bytes a vertex", "bound", "× greatest", "× mean", "worst × mean"]);
        for (i, loss) in average::losses(&rows).iter().enumerate() {
            let format = average::contenders()[i].1.quadrics.format;
            table.rows.push(vec![
                average::contenders()[i].0.into(),
                format.map_or_else(|| "-".into(), |format| format.bytes().to_string()),
                format.map_or_else(|| "-".into(), |format| format!("{:.1e}", format.entry_bound())),
                format!("{:.2}", loss.max),
                format!("{:.2}", loss.mean),
                format!("{:.2}", loss.worst_mean),
            ]);
        }
        Ok(format!(
            "## [Yu14] Average quadrics\n\nThe patent has no results. To {} faces by half-edges, planes counting alike, with initial \
             quadrics in each format: deviations over those of quadrics as found, as geometric means over {} meshes, and the worst. \
             The bound is that of an entry of the average quadric.\n\n{}\
             The greatest and the mean deviation of each, and Maxd2 in raw coordinates:\n\n{}",
            average::FACES,
            rows.iter().filter(|row| average::is_fair(row)).count(),
            table.lines(1),
            of_meshes.lines(1)
        ))
    }

    fn initialization(&self) -> anyhow::Result<String> {
        let large = |mesh: &Mesh| mesh.faces.len() >= average::TIMED_FACES;
        let sample;
        let case = match self.cases.iter().filter(|case| large(&case.mesh)).min_by_key(|case| case.mesh.faces.len()) {
            Some(case) => case,
            None => {
                sample = Case::read(&Source::new(TIMED_SAMPLE, None)?)?;
                &sample
            }
        };
        self.ticker(&case.name, "initial quadrics").show("in turns");
        let mut table = Table::new(["format", "claim", "ms", "ms of the run", "share"]);
        for timed in average::initializations(&case.mesh, self.repeats, &self.device)? {
            table.rows.push(vec![
                timed.format.name().into(),
                verdict(timed.secs <= average::MOST_SECS),
                millis(timed.secs),
                millis(timed.total_secs),
                format!("{:.1} %", 100.0 * timed.secs / timed.total_secs),
            ]);
        }
        Ok(format!(
            "Finding and storing the quadrics of {}, {} faces, and a run to 10 %. The patent tells 10.6 s for {} faces by others and \
             a share of a fifth or more; held is up to {} ms.\n\n{}",
            short_name(case),
            grouped(case.mesh.faces.len()),
            grouped(average::TIMED_FACES),
            millis(average::MOST_SECS),
            table.lines(2)
        ))
    }

    fn ticker(&self, name: &str, what: &str) -> Ticker {
        Ticker::new(self.verbosity, format!("{what}, {name}"))
    }
}
