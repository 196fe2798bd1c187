//! From arguments to a job: domain values, files that are there, and every contradiction at once.

use std::f64;
use std::path::{Path, PathBuf};

use coarsen::Budget;
use coarsen::backend::Selector;
use coarsen::formats::Format;

use super::failure::{exit_of, message, refuse};
use super::setup::{Setup, Shared};
use super::sink::{Sink, same_file};
use super::source::Source;
use super::{Exit, args, regions};

/// Everything `simplify` needs to know.
#[derive(Debug)]
pub struct Job {
    pub setup: Setup,
    pub sink: Sink,
    pub budget: Budget,
    pub require_target: bool,
    /// Whether regions are written as polygons, and where what they are goes, if anywhere.
    pub polygons: bool,
    pub write_regions: Option<PathBuf>,
    /// Where parts are kept, if it was said.
    pub temp_dir: Option<PathBuf>,
}

/// Makes a job of the arguments of `simplify`.
///
/// # Errors
/// All that is wrong with them, one a line; the first decides the exit code.
pub fn simplify(args: &args::Simplify) -> anyhow::Result<Job> {
    let mut problems = Problems::default();
    let budget = problems.note(budget(&args.target, args.how.shape.method));
    let pipes = [&args.input, &args.output].map(|name| name == "-");
    let format = problems.format(args.writing.format.as_deref(), pipes);
    if pipes[1] && args.writing.json {
        problems.add("standard output cannot carry both the mesh ('-') and --json: name a file");
    }
    let source = problems.source(&args.input, format);
    let sink = problems.sink(&args.output, format);
    if let Some(sink) = &sink {
        let input = source.as_ref().and_then(Source::path);
        problems.note(sink.check(input, args.writing.overwrite));
    }
    regions::check_files(args, source.as_ref(), sink.as_ref(), &mut problems);
    let outputs: Vec<&Path> = sink.as_ref().and_then(Sink::path).into_iter().collect();
    let setup = Setup::new(shared(args), source, &outputs, &mut problems);
    let (Some(budget), Some(setup), Some(sink), true) = (budget, setup, sink, problems.is_empty()) else {
        return Err(problems.into_error());
    };
    Ok(Job {
        setup,
        sink,
        budget,
        require_target: args.target.require_target,
        polygons: args.region_files.polygons,
        write_regions: args.region_files.write_regions.clone(),
        temp_dir: args.temp_dir.clone(),
    })
}

/// The arguments that `simplify` shares with other verbs.
pub fn shared(args: &args::Simplify) -> Shared<'_> {
    Shared {
        how: &args.how,
        feature_file: &args.feature_file,
        device: &args.device,
        writing: &args.writing,
        grid: args.target.grid,
        by_error: args.target.error.is_some() || args.target.error_abs.is_some(),
    }
}

/// Checks the file that `option` writes beside the outputs.
pub fn check_beside(
    option: &str,
    file: &Path,
    input: Option<&Path>,
    outputs: &[&Path],
    overwrite: bool,
    problems: &mut Problems,
) {
    if file.as_os_str() == "-" {
        problems.add(format!("{option} writes a file: '-' is none"));
    } else if outputs.iter().any(|&output| output == file || same_file(output, file)) {
        problems.add(format!("'{}' is the output as well: give {option} another name", file.display()));
    } else {
        problems.note(Sink::File(file.to_path_buf()).check(input, overwrite));
    }
}

/// Makes an input of the arguments of `inspect`.
///
/// # Errors
/// As [`simplify`].
pub fn inspect(args: &args::Inspect) -> anyhow::Result<Source> {
    let mut problems = Problems::default();
    let format = problems.format(args.format.as_deref(), [args.input == "-", false]);
    match problems.source(&args.input, format) {
        Some(source) if problems.is_empty() => Ok(source),
        _ => Err(problems.into_error()),
    }
}

/// What was found wrong so far.
#[derive(Debug, Default)]
pub struct Problems(Vec<anyhow::Error>);

/// The format of the pipes.
#[derive(Debug, Clone, Copy)]
pub enum PipeFormat {
    Known(Format),
    Absent,
    /// Named wrongly, which is told already.
    Unknown,
}

impl Problems {
    /// One more problem of usage.
    pub fn add(&mut self, text: impl Into<String>) {
        self.push(refuse(Exit::Usage, text));
    }

    /// The same fault of two arguments is told once.
    fn push(&mut self, problem: anyhow::Error) {
        if self.0.iter().all(|other| message(other) != message(&problem)) {
            self.0.push(problem);
        }
    }

    /// The value, or `None` and one more problem.
    pub fn note<T, E: Into<anyhow::Error>>(&mut self, result: Result<T, E>) -> Option<T> {
        result.map_err(|error| self.push(error.into())).ok()
    }

    /// The format that `--format` names for those of two names that are `-`.
    pub fn format(&mut self, name: Option<&str>, pipes: [bool; 2]) -> PipeFormat {
        let Some(name) = name else { return PipeFormat::Absent };
        if pipes == [false, false] {
            self.add("--format is for '-': the format of a file follows from its extension");
        }
        self.note(Format::from_name(name)).map_or(PipeFormat::Unknown, PipeFormat::Known)
    }

    /// The input that `text` names.
    pub fn source(&mut self, text: &str, format: PipeFormat) -> Option<Source> {
        match format {
            PipeFormat::Unknown if text == "-" => None,
            PipeFormat::Known(format) => self.note(Source::new(text, Some(format))),
            _ => self.note(Source::new(text, None)),
        }
    }

    /// The output that `text` names.
    pub fn sink(&mut self, text: &str, format: PipeFormat) -> Option<Sink> {
        match format {
            PipeFormat::Unknown if text == "-" => None,
            PipeFormat::Known(format) => self.note(Sink::new(text, Some(format))),
            _ => self.note(Sink::new(text, None)),
        }
    }

    /// Whether nothing is wrong.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them in one error; there is one at least.
    pub fn into_error(mut self) -> anyhow::Error {
        match self.0.len() {
            1 => self.0.remove(0),
            count => {
                let exit = self.0.first().map_or(Exit::Unexpected, exit_of);
                let lines: String = self.0.iter().map(|problem| format!("\n  - {}", message(problem))).collect();
                refuse(exit, format!("{count} problems:{lines}"))
            }
        }
    }
}

fn budget(target: &args::Target, method: args::Method) -> anyhow::Result<Budget> {
    let by_faces = face_budget(target.faces, target.ratio, target.reduction);
    let budget = Budget { error: target.error, error_abs: target.error_abs, ..by_faces };
    match (target.grid, budget == Budget::default()) {
        // Regions are what they are, or have goals of their own.
        (None, true) if method.makes_regions() => Ok(budget),
        (None, true) => {
            Err(refuse(Exit::Usage, "no target: give --faces, --ratio, --reduction, --error or --error-abs"))
        }
        (Some(_), false) => Err(refuse(Exit::Usage, "--grid and another target contradict each other")),
        _ => Ok(budget),
    }
}

/// The budget of `--faces`, `--ratio` and `--reduction`.
pub fn face_budget(faces: Option<usize>, ratio: Option<f64>, reduction: Option<f64>) -> Budget {
    // The larger of two face counts is reached first.
    let keep = ratio.into_iter().chain(reduction.map(|r| 1.0 - r)).reduce(f64::max);
    Budget { faces, keep, ..Budget::default() }
}

/// The device that `--device` names.
///
/// # Errors
/// A text that names none.
pub fn selector(text: &str) -> anyhow::Result<Selector> {
    Ok(match (text, text.strip_prefix("gpu:")) {
        ("auto", _) => Selector::Auto,
        ("cpu", _) => Selector::Cpu,
        ("gpu", _) => Selector::Gpu,
        ("software", _) => Selector::Software,
        ("", _) => return Err(refuse(Exit::Usage, "the name of the device is empty: see `coarsen devices`")),
        (_, Some(index)) => match index.parse() {
            Ok(index) => Selector::Index(index),
            Err(_) => {
                let message = format!("'{text}' names no device: write gpu:N with an index from `coarsen devices`");
                return Err(refuse(Exit::Usage, message));
            }
        },
        (name, None) => Selector::Name(name.into()),
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use coarsen::contract::{Feature, FeatureMode, Update, Weighting};
    use coarsen::polish::Flips;
    use coarsen::{Method, cluster, contract};

    use super::*;
    use crate::cli::args::{Arguments, Verb};

    fn job(line: &str) -> anyhow::Result<Job> {
        let arguments = Arguments::try_parse_from(line.split_whitespace()).expect("arguments that parse");
        match arguments.verb {
            Verb::Simplify(args) => simplify(&args),
            verb => panic!("not the verb simplify: {verb:?}"),
        }
    }

    #[test]
    fn budgets_are_read() {
        let budget =
            |targets: &str| job(&format!("coarsen simplify sample:part - --format ply {targets}")).map(|j| j.budget);
        assert_eq!(budget("-f 20k").ok(), Some(Budget::faces(20_000)));
        assert_eq!(budget("--triangles 8").ok(), Some(Budget::faces(8)));
        assert_eq!(budget("-r 10%").ok(), Some(Budget::keep(0.1)));
        assert_eq!(budget("--reduction 0.75").ok(), Some(Budget::keep(0.25)));
        assert_eq!(budget("-r 10% --reduction 50%").ok(), Some(Budget::keep(0.5)));
        let both = Budget { error: Some(0.001), error_abs: Some(2.0), ..Budget::default() };
        assert_eq!(budget("-e 0.1% --error-abs 2").ok(), Some(both));
        assert!(budget("--require-target").is_err());
    }

    #[test]
    fn devices_are_read() {
        for (text, expected) in [
            ("auto", Selector::Auto),
            ("cpu", Selector::Cpu),
            ("gpu", Selector::Gpu),
            ("gpu:3", Selector::Index(3)),
            ("software", Selector::Software),
            ("RTX", Selector::Name("RTX".into())),
        ] {
            assert_eq!(selector(text).ok(), Some(expected), "{text}");
        }
        assert!(selector("gpu:x").is_err() && selector("").is_err());
    }

    #[test]
    fn shape_options_reach_the_engine() {
        let job = job(
            "coarsen simplify sample:part - --format ply -f 8 --metric plane --placement endpoint --max-flip 45 \
            --weld off --prune 1% --close-holes 2% --lock-border --border-weight 2 --join-within 0.5 --non-manifold hold --lock-seams \
            --lock pin",
        );
        let Method::Contract(options) = job.expect("a good line").setup.method else { panic!("another method") };
        let expected = contract::Options {
            metric: contract::Metric::Plane,
            candidates: contract::Candidates::Pairs,
            placement: contract::Placement::Endpoint,
            weighting: Weighting::Uniform,
            quadrics: contract::Quadrics::default(),
            border_weight: 2.0,
            lock_border: true,
            locked: None,
            lock: Some(contract::Lock::Channel("pin".into())),
            max_flip_rad: std::f32::consts::FRAC_PI_4,
            join_within: 0.5,
            non_manifold: contract::NonManifold::Hold,
            weld: None,
            flips: Flips::default(),
            fit: 0,
            prune: Some(0.01),
            close_holes: Some(0.02),
            attributes: contract::Attributes { lock_seams: true, ..contract::Attributes::default() },
            log: false,
        };
        assert_eq!(options, expected);
    }

    #[test]
    fn clustering_takes_its_own_options_only() {
        let job = |options: &str| job(&format!("coarsen simplify sample:part - --format ply {options}"));
        let job_of = |options: &str| job(options).map(|job| (job.setup.method, job.budget)).ok();
        let by_grid = cluster::Options {
            grid: Some(200),
            representative: cluster::Representative::Input,
            ..cluster::Options::default()
        };
        let expected = Some((Method::Cluster(by_grid), Budget::default()));
        assert_eq!(job_of("--method cluster --grid 200 --representative input"), expected);
        let expected = Some((Method::Cluster(cluster::Options::default()), Budget::keep(0.01)));
        assert_eq!(job_of("--method cluster -r 1%"), expected);
        for wrong in ["--grid 200", "-f 8 --representative mean", "--method cluster --grid 9 -f 8", "--method cluster"]
        {
            assert!(job(wrong).is_err(), "{wrong}");
        }
        for other in [
            "--metric plane",
            "--lock-border",
            "--fit 1",
            "--weld off",
            "--prune 1%",
            "--close-holes 1%",
            "--max-flip 45",
        ] {
            assert!(job(&format!("--method cluster -f 8 {other}")).is_err(), "{other}");
        }
    }

    #[test]
    fn features_reach_the_engine() {
        let line = |options: &str| {
            let job = job(&format!("coarsen simplify sample:part - --format ply -f 8 {options}"));
            job.map(|job| job.setup.method).map_err(|error| error.to_string())
        };
        let preset = contract::Options::feature_weighted();
        let with =
            |feature| Method::Contract(contract::Options { weighting: Weighting::Feature(feature), ..preset.clone() });
        assert_eq!(line("--method feature"), Ok(Method::Contract(preset.clone())));
        assert_eq!(
            line("--method feature --feature-lambda 2 --feature-floor 0.5 --feature-update recompute"),
            Ok(with(Feature {
                mode: FeatureMode::Affine { lambda: 2.0 },
                curvature_floor: 0.5,
                update: Update::Recompute
            }))
        );
        let gated = Feature { mode: FeatureMode::Gated { lambda: 16.0 }, ..Feature::default() };
        assert_eq!(line("--method feature --feature-mode gated"), Ok(with(gated)));
        let literal = Feature { mode: FeatureMode::Contrast, curvature_floor: 0.0, update: Update::Static };
        assert_eq!(line("--method feature --feature-mode contrast"), Ok(with(literal)));
        let optimal = contract::Options {
            metric: contract::Metric::Volume,
            placement: contract::Placement::Optimal,
            ..preset.clone()
        };
        assert_eq!(line("--method feature --metric volume --placement optimal"), Ok(Method::Contract(optimal)));

        for (options, part) in [
            ("--feature-mode affine", "--feature-mode is for --method feature"),
            ("--feature-floor 1", "--feature-floor is for --method feature"),
            ("--method feature --feature-mode entropy --feature-lambda 3", "'affine' and 'gated'"),
            ("--method feature --weight a.txt", "contradict"),
            ("--weight ply:saliency", "'sample:part' is no PLY file"),
            ("--write-feature a.obj", "'a.obj' is no PLY"),
        ] {
            let error = line(options).expect_err("a contradiction");
            assert!(error.contains(part), "{options}: {error}");
        }
    }

    #[test]
    fn the_default_angle_is_the_documented_one() {
        assert_eq!(format!("{:.1}", contract::Options::default().max_flip_rad.to_degrees()), "78.5");
    }

    #[test]
    fn every_contradiction_is_told_at_once() {
        let error =
            job("coarsen simplify missing.ply - --json -q -v -g gpu:x").expect_err("contradictions").to_string();
        for part in ["6 problems", "no target", "gpu:x", "both the mesh", "--verbose", "missing.ply", "needs --format"]
        {
            assert!(error.contains(part), "{part} is not in {error}");
        }
    }
}
