//! What a run will do: every input with its outputs, checked before any work starts.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::estimate;
use super::input::{self, Input, Origin, Request};
use super::pattern::Pattern;
use crate::contract::{self, Weighting};
use crate::error::{Error, Result};
use crate::formats::{Format, Weights, WriteOptions, file_beside};
use crate::metrics;
use crate::progressive::sum_of_bytes;
use crate::simplify::{Budget, Method};

/// What becomes of an input: its levels, how they are made and written, what they are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// How to simplify.
    pub method: Method,
    /// What the vertices count, where that is no matter of the method alone: for contraction.
    pub weights: Option<Weights>,
    /// When to stop, a level each, from fine to coarse.
    pub budgets: Vec<Budget>,
    /// How to write.
    pub writing: WriteOptions,
    /// What the outputs are called.
    pub pattern: Pattern,
    /// How long a file may take; no end without it.
    pub timeout: Option<Duration>,
    /// How to measure what is written against the input, if at all; what was done before is not.
    pub measure: Option<metrics::Options>,
}

impl Recipe {
    /// A sum of all that decides about the bytes of the outputs, but the input.
    ///
    /// # Errors
    /// [`Error::Read`] for a file of weights that cannot be read.
    pub(super) fn fingerprint(&self) -> Result<u64> {
        let Self { method, budgets, writing, weights, pattern: _, timeout: _, measure: _ } = self;
        let mut text = format!("{method:?} {budgets:?} {writing:?}").into_bytes();
        match weights {
            Some(Weights::Property(name)) => text.extend_from_slice(name.as_bytes()),
            Some(Weights::File(path)) => {
                text.extend(fs::read(path).map_err(|source| Error::Read { path: path.clone(), source })?);
            }
            None => {}
        }
        Ok(sum_of_bytes(&text))
    }

    /// The method with its weights, some of which are in the content of the input.
    ///
    /// # Errors
    /// Those of [`Weights::read`].
    pub(super) fn weighted(&self, content: Option<(&[u8], Format)>) -> Result<Method> {
        match (&self.weights, &self.method) {
            (Some(weights), Method::Contract(options)) => {
                let weighting = Weighting::Given(weights.read(content)?.into());
                Ok(Method::Contract(contract::Options { weighting, ..options.clone() }))
            }
            _ => Ok(self.method.clone()),
        }
    }
}

/// A part of all inputs: the `index`-th of `count`, from 0.
///
/// An input belongs to a shard by a hash of its name, so that it stays there whatever comes and goes beside it, and no shard
/// needs to see what the others see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// All inputs.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// The shard `number` of `count`, counted from 1.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless `number` is in 1 … `count`.
    pub fn new(number: usize, count: usize) -> Result<Self> {
        match number {
            1.. if number <= count => Ok(Self { index: number - 1, count }),
            _ => Err(Error::Parameter(format!("there is no shard {number} of {count}: they count from 1/{count}"))),
        }
    }

    /// Whether the input called `name` belongs to it.
    pub fn holds(self, name: &str) -> bool {
        // The upper half of the sum is the better mixed.
        ((sum_of_bytes(name.as_bytes()) >> 32) as usize) % self.count == self.index
    }

    /// The name of its file of records.
    pub fn ledger_name(self) -> String {
        match self {
            Self::WHOLE => "coarsen.jsonl".into(),
            Self { index, count } => format!("coarsen-{}-of-{count}.jsonl", index + 1),
        }
    }

    /// The shard whose file of records has this name.
    pub(super) fn of_ledger(name: &str) -> Option<Self> {
        let shard = name.strip_prefix("coarsen")?.strip_suffix(".jsonl")?;
        if shard.is_empty() {
            return Some(Self::WHOLE);
        }
        let (number, count) = shard.strip_prefix('-')?.split_once("-of-")?;
        Self::new(number.parse().ok()?, count.parse().ok()?).ok()
    }

    /// Whether an input can be in both: some number is the `index`-th of each when counted off by their `count`.
    pub(super) fn may_share(self, other: Self) -> bool {
        let (mut a, mut b) = (self.count, other.count);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        self.index % a == other.index % a
    }
}

/// An input and its outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// What to read.
    pub input: Input,
    /// Where the levels go, below the folder of the plan, with slashes.
    pub outputs: Vec<String>,
    /// Faces that the input is estimated to have, by its size.
    pub faces: u64,
    /// Bytes of levels that wait for others, at most.
    pub(super) bytes_kept: u64,
}

impl Job {
    /// The format of the input, where it is a file.
    pub(super) fn input_format(&self) -> Option<Format> {
        match &self.input.origin {
            Origin::File(path) => Format::from_path(path).ok().map(|(format, _)| format),
            Origin::Sample(_) => None,
        }
    }

    /// The outputs and what is written beside them.
    pub(super) fn files(&self) -> impl Iterator<Item = String> {
        let format = self.input_format();
        self.outputs.iter().flat_map(move |output| {
            let beside = file_beside(Path::new(output), format).map(|file| file.to_string_lossy().into_owned());
            [Some(output.clone()), beside].into_iter().flatten()
        })
    }
}

/// A run: what to do and where it goes.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(super) folder: PathBuf,
    pub(super) recipes: Vec<Recipe>,
    pub(super) jobs: Vec<Job>,
    pub(super) shard: Shard,
}

impl Plan {
    /// Lists the inputs of `requests` and names their outputs in `folder`, for those of `shard`.
    ///
    /// # Errors
    /// Those of [`list`](super::list); [`Error::Parameter`] for a recipe without levels, a name of no mesh format, and two
    /// outputs, or an output and an input, of one name: in any shard, so that all agree.
    pub fn new(requests: &[Request], recipes: Vec<Recipe>, folder: &Path, shard: Shard) -> Result<Self> {
        if recipes.iter().any(|recipe| recipe.budgets.is_empty()) {
            return Err(Error::Parameter("no levels: give ratios, numbers of faces or an error limit".into()));
        }
        let inputs = input::list(requests, folder)?;
        let mut jobs = Vec::with_capacity(inputs.len());
        for input in inputs {
            let Some(recipe) = recipes.get(input.recipe) else {
                return Err(Error::Parameter(format!("no recipe {} for '{}'", input.recipe, input.name)));
            };
            let outputs = outputs(&input, recipe)?;
            let bytes_kept = estimate::bytes_of_levels(estimate::most_faces(&input), &recipe.budgets);
            jobs.push(Job { faces: estimate::faces(&input), bytes_kept, input, outputs });
        }
        check_names(&jobs, folder)?;
        jobs.retain(|job| shard.holds(&job.input.name));
        Ok(Self { folder: folder.to_path_buf(), recipes, jobs, shard })
    }

    /// What is to be done, by the names of the inputs.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// Where the outputs go.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the records go.
    pub fn ledger(&self) -> PathBuf {
        self.folder.join(self.shard.ledger_name())
    }

    pub(super) fn recipe(&self, job: &Job) -> &Recipe {
        &self.recipes[job.input.recipe]
    }
}

fn outputs(input: &Input, recipe: &Recipe) -> Result<Vec<String>> {
    // Reading tells of an input in no known format.
    let is_known = !matches!(&input.origin, Origin::File(path) if Format::from_path(path).is_err());
    let name = |(level, budget)| {
        let name = recipe.pattern.fill(&input.name, level, budget)?;
        if is_known {
            Format::from_path(Path::new(&name))?;
        }
        Ok(name)
    };
    recipe.budgets.iter().enumerate().map(name).collect()
}

/// Refuses two outputs of one name, and an output in the place of an input.
fn check_names(jobs: &[Job], folder: &Path) -> Result<()> {
    let files = jobs.iter().filter_map(|job| match &job.input.origin {
        Origin::File(path) => Some(resolved(path)),
        Origin::Sample(_) => None,
    });
    let inputs: BTreeSet<PathBuf> = files.collect();
    let mut names = BTreeMap::new();
    for job in jobs {
        for output in job.files() {
            if let Some(other) = names.insert(output.clone(), job) {
                let (a, b) = (&other.input.name, &job.input.name);
                let way = "put {dir}, {stem}, {level}, {ratio} or {faces} into the pattern";
                return Err(Error::Parameter(format!("'{output}' is the output of both '{a}' and '{b}': {way}")));
            }
            if inputs.contains(&resolved(&folder.join(&output))) {
                let way = "give another folder or pattern";
                return Err(Error::Parameter(format!("the output '{output}' is an input as well: {way}")));
            }
        }
    }
    Ok(())
}

/// The path with all links followed, as far as there is something.
fn resolved(path: &Path) -> PathBuf {
    let exists = path.ancestors().find_map(|part| Some((part, fs::canonicalize(part).ok()?)));
    match exists {
        Some((part, found)) => path.strip_prefix(part).map_or(found.clone(), |rest| found.join(rest)),
        None => std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(pattern: Pattern, budgets: &[Budget]) -> Recipe {
        Recipe {
            method: Method::default(),
            budgets: budgets.to_vec(),
            writing: WriteOptions::default(),
            pattern,
            timeout: None,
            weights: None,
            measure: None,
        }
    }

    fn requests(texts: &[&str]) -> Vec<Request> {
        texts.iter().map(|&text| Request::new(text, 0)).collect()
    }

    #[test]
    fn outputs_that_collide_are_refused_before_anything_is_read() {
        let dir = tempfile::tempdir().expect("a folder");
        let plan = |texts: &[&str], pattern: &str, budgets: &[Budget]| {
            let pattern = Pattern::new(pattern).expect("a pattern");
            let recipes = vec![recipe(pattern, budgets)];
            Plan::new(&requests(texts), recipes, dir.path(), Shard::WHOLE).map_err(|error| error.to_string())
        };
        let two = [Budget::keep(0.5), Budget::keep(0.1)];
        let samples = ["sample:part@5k", "sample:part@6k"];
        let done = plan(&samples, "{stem}-{ratio}.{ext}", &two).expect("a plan");
        let outputs: Vec<&str> = done.jobs().iter().flat_map(|job| &job.outputs).map(String::as_str).collect();
        assert_eq!(outputs, ["part@5k-50.ply", "part@5k-10.ply", "part@6k-50.ply", "part@6k-10.ply"]);
        let error = plan(&samples, "{stem}.{ext}", &two).expect_err("one name for two levels");
        assert!(error.contains("'part@5k.ply' is the output of both 'part@5k' and 'part@5k'"), "{error}");
        let error = plan(&samples, "{level}.ply", &two).expect_err("one name for two inputs");
        assert!(error.contains("'1.ply' is the output of both 'part@5k' and 'part@6k'"), "{error}");
        assert!(plan(&samples, "{stem}-{level}.fbx", &two).is_err() && plan(&samples, "{stem}.ply", &[]).is_err());

        fs::write(dir.path().join("x.ply"), "").expect("a file");
        let x = dir.path().join("x.ply").display().to_string();
        let error = plan(&[&x], "{stem}.{ext}", &two[..1]).expect_err("the input");
        assert!(error.contains("'x.ply' is an input as well"), "{error}");
    }

    #[test]
    fn equal_stems_in_different_folders_are_different_outputs() {
        let dir = tempfile::tempdir().expect("a folder");
        for folder in ["a", "b"] {
            fs::create_dir(dir.path().join(folder)).expect("a folder");
            fs::write(dir.path().join(folder).join("x.ply"), "").expect("a file");
        }
        let folders = ["a", "b"].map(|folder| dir.path().join(folder).display().to_string());
        let recipes = vec![recipe(Pattern::for_levels(1), &[Budget::keep(0.5)])];
        let plan = Plan::new(&requests(&[&folders[0], &folders[1]]), recipes, &dir.path().join("out"), Shard::WHOLE);
        let outputs: Vec<_> = plan.expect("a plan").jobs.into_iter().flat_map(|job| job.outputs).collect();
        assert_eq!(outputs, ["a/x.ply", "b/x.ply"]);
    }

    #[test]
    fn every_input_is_in_one_shard_whatever_is_beside_it() {
        let shards = [1, 2, 3].map(|number| Shard::new(number, 3).expect("a shard"));
        let mut sizes = [0; 3];
        for i in 0..3000 {
            let name = format!("scans/{i}.ply");
            let holders: Vec<usize> = (0..3).filter(|&shard| shards[shard].holds(&name)).collect();
            assert_eq!(holders.len(), 1, "{name}");
            sizes[holders[0]] += 1;
        }
        assert!(sizes.iter().all(|size| (900..1100).contains(size)), "{sizes:?}");
        assert!(Shard::new(0, 3).is_err() && Shard::new(4, 3).is_err() && Shard::new(1, 0).is_err());
        assert_eq!(
            (Shard::WHOLE.ledger_name(), shards[1].ledger_name()),
            ("coarsen.jsonl".into(), "coarsen-2-of-3.jsonl".into())
        );
        for shard in [Shard::WHOLE, shards[1]] {
            assert_eq!(Shard::of_ledger(&shard.ledger_name()), Some(shard));
        }
        for other in ["coarsen-x.jsonl", "coarsen-4-of-3.jsonl", "coarsen-1-of-.jsonl", "x.jsonl", "coarsen.json"] {
            assert_eq!(Shard::of_ledger(other), None, "{other}");
        }
    }

    #[test]
    fn a_fingerprint_is_of_what_decides_about_the_bytes() {
        let half = recipe(Pattern::for_levels(1), &[Budget::keep(0.5)]);
        let sum = half.fingerprint().ok();
        let timed = Recipe { timeout: Some(Duration::from_secs(1)), pattern: Pattern::for_levels(2), ..half.clone() };
        let measured = Recipe { measure: Some(metrics::Options::default()), ..timed };
        assert_eq!(measured.fingerprint().ok(), sum);
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("weights.txt");
        fs::write(&path, "1\n2\n").expect("a file");
        let weighted = Recipe { weights: Some(Weights::File(path.clone())), ..half.clone() };
        let of_file = weighted.fingerprint().ok();
        fs::write(&path, "1\n3\n").expect("a file");
        assert_ne!(weighted.fingerprint().ok(), of_file);
        fs::remove_file(&path).expect("a file gone");
        assert!(weighted.fingerprint().is_err());
        for other in [
            Recipe { budgets: vec![Budget::keep(0.25)], ..half.clone() },
            Recipe { writing: WriteOptions { ascii: true }, ..half.clone() },
            Recipe { weights: Some(Weights::Property("saliency".into())), ..half.clone() },
            Recipe { method: Method::Cluster(Default::default()), ..half },
        ] {
            assert_ne!(other.fingerprint().ok(), sum, "{other:?}");
        }
    }
}
