//! From the arguments of `batch` to requests and recipes.

use std::ffi::OsString;
use std::path::PathBuf;

use coarsen::Budget;
use coarsen::backend::Selector;
use coarsen::batch::{Pattern, Recipe, Request, Shard};
use coarsen::formats::WriteOptions;

use super::manifest;
use crate::cli::args::{self, Progress};
use crate::cli::console::Verbosity;
use crate::cli::failure::refuse;
use crate::cli::method::{self, Asked};
use crate::cli::resolve::{Problems, selector};
use crate::cli::setup::measure;
use crate::cli::{Exit, quadrics, weights};

/// Everything `batch` needs to know.
#[derive(Debug)]
pub struct Job {
    pub requests: Vec<Request>,
    pub recipes: Vec<Recipe>,
    pub folder: PathBuf,
    pub shard: Shard,
    pub resume: bool,
    pub overwrite: bool,
    pub selector: Selector,
    pub threads: usize,
    pub memory_limit: Option<u64>,
    pub json: bool,
    pub verbosity: Verbosity,
    pub progress: Progress,
}

impl Job {
    /// Makes a job of the arguments, and of the whole command line, over which lines of a manifest are laid.
    ///
    /// # Errors
    /// All that is wrong with them, one a line; the first decides the exit code.
    pub fn new(args: &args::Batch, line: &[OsString]) -> anyhow::Result<Self> {
        let mut problems = Problems::default();
        let selector = problems.note(selector(&args.device.device));
        if args.telling.quiet && args.telling.progress == Progress::Json {
            problems.add("--quiet and --progress json contradict each other");
        }
        let mut requests = Vec::new();
        let mut recipes = Vec::new();
        if !args.inputs.is_empty() {
            recipes.extend(problems.note(recipe(&args.each)));
            requests.extend(args.inputs.iter().map(|text| Request::new(text, 0)));
        }
        if let Some(path) = &args.files.manifest {
            for entry in problems.note(manifest::read(path, line)).into_iter().flatten() {
                requests.push(Request::literal(entry.input, recipes.len()));
                recipes.push(entry.recipe);
            }
        }
        let (Some(selector), true) = (selector, problems.is_empty()) else { return Err(problems.into_error()) };
        Ok(Self {
            requests,
            recipes,
            folder: args.files.dir.clone(),
            shard: args.files.shard.unwrap_or(Shard::WHOLE),
            resume: args.files.resume,
            overwrite: args.files.overwrite,
            selector,
            threads: args.device.threads.into(),
            memory_limit: args.device.memory_limit,
            json: args.telling.json,
            verbosity: if args.telling.quiet { Verbosity::Quiet } else { Verbosity::Normal },
            progress: args.telling.progress,
        })
    }
}

/// The recipe of the options that go for each file.
///
/// # Errors
/// All that is wrong with them.
pub fn recipe(each: &args::Each) -> anyhow::Result<Recipe> {
    let mut problems = Problems::default();
    let args::Each { levels, how, measuring } = each;
    let by_error = levels.error.is_some() || levels.error_abs.is_some();
    let method = problems.note(method::method(&Asked { how, grid: None, by_error, with_log: false }));
    let method =
        method.and_then(|method| problems.note(weights::with_lock(method, weights::lock_file(how).as_deref())));
    weights::check(how, None, false, &mut problems);
    quadrics::check(&how.shape, &mut problems);
    let budgets = problems.note(budgets(levels, how.shape.method));
    let count = budgets.as_ref().map_or(1, Vec::len);
    let pattern = match &levels.pattern {
        Some(text) => problems.note(Pattern::new(text)),
        None => Some(Pattern::for_levels(count)),
    };
    match (method, budgets, pattern) {
        (Some(method), Some(budgets), Some(pattern)) if problems.is_empty() => Ok(Recipe {
            method,
            weights: how.weights.weight.clone(),
            budgets,
            writing: WriteOptions { ascii: levels.ascii },
            pattern,
            timeout: levels.timeout,
            measure: measure(measuring),
        }),
        _ => Err(problems.into_error()),
    }
}

/// A budget a level, from fine to coarse.
fn budgets(levels: &args::BatchLevels, method: args::Method) -> anyhow::Result<Vec<Budget>> {
    let limit = Budget { error: levels.error, error_abs: levels.error_abs, ..Budget::default() };
    let mut budgets: Vec<Budget> = match (levels.ratios.is_empty(), levels.faces.is_empty()) {
        (false, _) => levels.ratios.iter().map(|&ratio| Budget { keep: Some(ratio), ..limit }).collect(),
        (true, false) => levels.faces.iter().map(|&faces| Budget { faces: Some(faces), ..limit }).collect(),
        // Regions are what they are, or have goals of their own.
        (true, true) if limit != Budget::default() || method.makes_regions() => vec![limit],
        (true, true) => {
            return Err(refuse(Exit::Usage, "no levels: give --ratios, --faces, --error or --error-abs"));
        }
    };
    let size = |budget: &Budget| budget.keep.or(budget.faces.map(|faces| faces as f64)).unwrap_or(0.0);
    budgets.sort_by(|a, b| size(b).total_cmp(&size(a)));
    if budgets.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(refuse(Exit::Usage, "a level is given twice: give each of --ratios or --faces once"));
    }
    Ok(budgets)
}
