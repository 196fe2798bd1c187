//! Files beside an input that its outputs are made of: what a record says of them, and whether that still holds.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::input::Origin;
use super::ledger::Hash;
use super::plan::Job;
use crate::formats::{Document, Format};
use crate::progressive::sum_of_bytes;

/// The sums of these files, by their names from the input's folder; none of one that was looked for and is not there.
pub(super) type Beside = BTreeMap<String, Option<Hash>>;

/// Those of a file that was read as `document`. Every level has the same, since names of levels differ in numbers alone.
pub(super) fn of(document: &Document, job: &Job) -> Beside {
    let (Some(folder), Some(output)) = (folder(job), job.outputs.first()) else { return Beside::new() };
    let Ok((format, _)) = Format::from_path(Path::new(output)) else { return Beside::new() };
    // A name that is not UTF-8 becomes another, at which nothing is found: its input is done again.
    let name = |path: &Path| path.strip_prefix(folder).unwrap_or(path).to_string_lossy().into_owned();
    document.files_beside(format).iter().map(|path| (name(path), hash_of(path))).collect()
}

/// The files beside one input as they stand, each read once.
pub(super) struct Standing<'a> {
    folder: Option<&'a Path>,
    known: HashMap<PathBuf, Option<Hash>>,
}

impl<'a> Standing<'a> {
    pub fn of(job: &'a Job) -> Self {
        Self { folder: folder(job), known: HashMap::new() }
    }

    /// Whether all of them are as a record says.
    pub fn agrees(&mut self, beside: &Beside) -> bool {
        beside.iter().all(|(name, hash)| {
            let path = self.folder.unwrap_or(Path::new("")).join(name);
            *hash == *self.known.entry(path).or_insert_with_key(|path| hash_of(path))
        })
    }
}

fn folder(job: &Job) -> Option<&Path> {
    match &job.input.origin {
        Origin::File(path) => path.parent(),
        Origin::Sample(_) => None,
    }
}

/// None where nothing can be read.
fn hash_of(path: &Path) -> Option<Hash> {
    // Only regular files are read: a pipe would wait.
    let bytes = Some(path).filter(|path| path.is_file()).and_then(|path| std::fs::read(path).ok());
    bytes.map(|bytes| Hash(sum_of_bytes(&bytes)))
}
