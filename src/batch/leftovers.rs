//! Files that a killed run left beside the outputs it had begun to write.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::Path;

use super::plan::{Job, Plan};
use crate::error::{Error, Result};
use crate::formats::{stem_of_temporary, temporary_stem};

/// Removes the temporary files of the outputs of `plan`, which is locked, so that no run is writing them: those of other shards, and whatever else
/// is there, stays.
///
/// # Errors
/// [`Error::Read`] for a folder that cannot be listed, [`Error::Write`] for a file that cannot be removed.
pub(super) fn remove(plan: &Plan) -> Result<()> {
    let files: Vec<String> = plan.jobs().iter().flat_map(Job::files).collect();
    let mut folders: BTreeMap<&str, BTreeSet<OsString>> = BTreeMap::new();
    for output in &files {
        let (folder, name) = output.rsplit_once('/').unwrap_or(("", output));
        folders.entry(folder).or_default().insert(temporary_stem(OsStr::new(name)).into_owned());
    }
    for (folder, stems) in folders {
        remove_in(&plan.folder().join(folder), &stems)?;
    }
    Ok(())
}

fn remove_in(folder: &Path, stems: &BTreeSet<OsString>) -> Result<()> {
    let failed = |source| Error::Read { path: folder.to_path_buf(), source };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(failed)?,
    };
    for entry in entries {
        let entry = entry.map_err(failed)?;
        if stem_of_temporary(&entry.file_name().to_string_lossy()).is_some_and(|stem| stems.contains(OsStr::new(stem)))
        {
            fs::remove_file(entry.path()).map_err(|source| Error::Write { path: entry.path(), source })?;
        }
    }
    Ok(())
}
