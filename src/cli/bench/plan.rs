//! From arguments to a plan: which meshes, which jobs, who takes part.

use std::path::{Path, PathBuf};
use std::thread;

use coarsen::Budget;
use coarsen::backend::{Device, Selector, adapters};
use coarsen::mesh::SAMPLES;

use super::baseline::Rival;
use super::contender::Wish;
use super::numbers::short;
use crate::cli::Exit;
use crate::cli::args;
use crate::cli::console::Verbosity;
use crate::cli::failure::refuse;
use crate::cli::resolve::{Problems, selector};
use crate::cli::sink::Sink;
use crate::cli::source::Source;

/// The faces of the samples when no mesh is named: few enough for two minutes on two cores.
const SAMPLE_FACES: usize = 100_000;
/// What is kept when no target is named.
const KEEP: [f64; 2] = [0.1, 0.01];

/// Everything `bench` needs to know.
#[derive(Debug)]
pub struct Plan {
    pub sources: Vec<Source>,
    pub targets: Vec<Target>,
    pub wishes: Vec<Wish>,
    /// Threads beside an adapter, 0 for one a core.
    pub adapter_threads: usize,
    pub repeats: usize,
    /// Points of each surface to measure the deviation at; `None` measures none.
    pub samples: Option<usize>,
    /// Whether the cases are one mesh in several sizes.
    pub scales: bool,
    pub plot: Option<PathBuf>,
    pub json: bool,
    pub verbosity: Verbosity,
}

/// What to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    Keep(f64),
    Faces(usize),
}

impl Target {
    /// The faces to keep of `faces_in`.
    ///
    /// # Errors
    /// As [`Budget::target_faces`].
    pub fn faces(self, faces_in: usize) -> coarsen::Result<usize> {
        match self {
            Self::Keep(fraction) => Budget::keep(fraction).target_faces(faces_in),
            Self::Faces(faces) => Ok(faces),
        }
    }
}

impl Plan {
    /// Makes a plan of the arguments.
    ///
    /// # Errors
    /// All that is wrong with them, one a line; the first decides the exit code.
    pub fn new(args: &args::Bench) -> anyhow::Result<Self> {
        let mut problems = Problems::default();
        let sources = sources(args, SAMPLE_FACES, &mut problems);
        let threads: Vec<usize> = args.contenders.threads.iter().map(|&n| n.into()).collect();
        let wishes = wishes(&args.contenders.device, &threads, &mut problems);
        if let Some(path) = &args.writing.plot {
            check_picture(path, args.writing.overwrite, &mut problems);
        }
        if !problems.is_empty() {
            return Err(problems.into_error());
        }
        Ok(Self {
            sources,
            targets: targets(&args.job),
            wishes,
            adapter_threads: threads.iter().copied().max().unwrap_or(0),
            repeats: args.job.repeats.into(),
            samples: args.job.scale.is_none().then_some(args.job.samples),
            scales: args.job.scale.is_some(),
            plot: args.writing.plot.clone(),
            json: args.writing.json,
            verbosity: if args.writing.quiet { Verbosity::Quiet } else { Verbosity::Normal },
        })
    }
}

/// The meshes that are named, or every sample with so many faces.
pub fn sources(args: &args::Bench, sample_faces: usize, problems: &mut Problems) -> Vec<Source> {
    let sample = |name: &str, faces| format!("sample:{name}@{}", short(faces));
    let names = match &args.job.scale {
        Some(name) => {
            let name = name.strip_prefix("sample:").unwrap_or(name);
            args.job.sizes.iter().map(|&faces| sample(name, faces)).collect()
        }
        None if args.meshes.is_empty() => SAMPLES.iter().map(|(name, ..)| sample(name, sample_faces)).collect(),
        None => args.meshes.clone(),
    };
    if names.iter().any(|name| name == "-") {
        problems.add("`bench` reads no standard input: name a file or a sample");
    }
    names.iter().filter(|name| *name != "-").filter_map(|name| problems.note(Source::new(name, None))).collect()
}

fn targets(job: &args::BenchJob) -> Vec<Target> {
    let keep = if job.ratio.is_empty() && job.faces.is_empty() { &KEEP[..] } else { &job.ratio };
    keep.iter().map(|&r| Target::Keep(r)).chain(job.faces.iter().map(|&n| Target::Faces(n))).collect()
}

/// The contenders that `names` stand for, each once.
fn wishes(names: &[String], threads: &[usize], problems: &mut Problems) -> Vec<Wish> {
    let mut wishes: Vec<Wish> = Vec::new();
    for name in names {
        let meant = match name.as_str() {
            "cpu" if threads.is_empty() => thread_counts(cores()).into_iter().map(Wish::Cpu).collect(),
            "cpu" => threads.iter().map(|&n| Wish::Cpu(n)).collect(),
            "gpu" => hardware(),
            "baseline" => Rival::ALL.map(Wish::Rival).to_vec(),
            name => problems.note(wish(name)).into_iter().collect(),
        };
        for wish in meant {
            if !wishes.contains(&wish) {
                wishes.push(wish);
            }
        }
    }
    wishes
}

/// The one contender that `name` names.
///
/// # Errors
/// A name that cannot be one.
pub fn wish(name: &str) -> anyhow::Result<Wish> {
    if let Some(rival) = Rival::ALL.into_iter().find(|rival| rival.name() == name) {
        return Ok(Wish::Rival(rival));
    }
    match name.strip_prefix("cpu:").map(str::parse) {
        Some(Ok(threads)) if (1..=Device::MOST_THREADS).contains(&threads) => Ok(Wish::Cpu(threads)),
        Some(_) => {
            let most = Device::MOST_THREADS;
            let message = format!("'{name}' names no device: write cpu:N with a number of threads up to {most}");
            Err(refuse(Exit::Usage, message))
        }
        None => Ok(Wish::Adapter(name.into(), selector(name)?)),
    }
}

/// Every hardware adapter, or the wish for one, which says why there is none.
fn hardware() -> Vec<Wish> {
    let found: Vec<Wish> = adapters()
        .into_iter()
        .filter(|adapter| adapter.kind != "software")
        .map(|adapter| Wish::Adapter(format!("gpu:{}", adapter.index), Selector::Index(adapter.index)))
        .collect();
    if found.is_empty() { vec![Wish::Adapter("gpu".into(), Selector::Gpu)] } else { found }
}

/// 1, 2, 4 … below `cores`, and `cores`.
fn thread_counts(cores: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = std::iter::successors(Some(1), |n| Some(n * 2)).take_while(|&n| n < cores).collect();
    counts.push(cores);
    counts
}

/// Cores that this process may use.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Notes what keeps a picture from being written.
pub fn check_picture(path: &Path, overwrite: bool, problems: &mut Problems) {
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("svg")) {
        problems.add(format!("'{}' is no SVG: give the picture a name that ends in .svg", path.display()));
    }
    problems.note(Sink::File(path.into()).check(None, overwrite));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str, threads: &[usize]) -> anyhow::Result<Vec<String>> {
        let mut problems = Problems::default();
        let list: Vec<String> = text.split(',').map(str::to_string).collect();
        let wishes = wishes(&list, threads, &mut problems);
        if problems.is_empty() {
            Ok(wishes.iter().map(ToString::to_string).collect())
        } else {
            Err(problems.into_error())
        }
    }

    #[test]
    fn threads_double_up_to_the_cores() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(2), [1, 2]);
        assert_eq!(thread_counts(6), [1, 2, 4, 6]);
        assert_eq!(thread_counts(16), [1, 2, 4, 8, 16]);
    }

    #[test]
    fn contenders_are_named_once() {
        assert_eq!(names("cpu,cpu:2,software", &[2, 4]).ok().unwrap_or_default(), ["cpu:2", "cpu:4", "software"]);
        assert_eq!(names("baseline,meshopt", &[]).ok().unwrap_or_default(), ["meshopt", "meshopt-update"]);
        assert_eq!(names("gpu:3,Radeon", &[]).ok().unwrap_or_default(), ["gpu:3", "Radeon"]);
        for wrong in ["", "cpu,,software", "cpu:0", "cpu:x", "cpu:2000", "gpu:x"] {
            assert!(names(wrong, &[]).is_err(), "{wrong}");
        }
    }

    #[test]
    fn targets_are_fractions_or_counts() {
        assert_eq!(Target::Keep(0.1).faces(1006).ok(), Some(101));
        assert_eq!(Target::Faces(20).faces(1006).ok(), Some(20));
    }
}
