//! Files that a killed run left beside the outputs it had begun to write.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

use super::plan::{Job, Plan};
use crate::error::{Error, Result};
use crate::formats::is_temporary_of;

/// Removes the temporary files of the outputs of `plan`, which is locked, so that no run is writing them: those of other shards, and whatever else
/// is there, stays.
///
/// # Errors
/// [`Error::Read`] for a folder that cannot be listed, [`Error::Write`] for a file that cannot be removed.
pub(super) fn remove(plan: &Plan) -> Result<()> {
    let files: Vec<String> = plan.jobs().iter().flat_map(Job::files).collect();
    let mut folders: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for output in &files {
        let (folder, name) = output.rsplit_once('/').unwrap_or(("", output));
        folders.entry(folder).or_default().insert(name);
    }
    for (folder, names) in folders {
        remove_in(&plan.folder().join(folder), &names)?;
    }
    Ok(())
}

fn remove_in(folder: &Path, outputs: &BTreeSet<&str>) -> Result<()> {
    let failed = |source| Error::Read { path: folder.to_path_buf(), source };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(failed)?,
    };
    for entry in entries {
        let entry = entry.map_err(failed)?;
        if is_temporary_of(&entry.file_name().to_string_lossy()).is_some_and(|output| outputs.contains(output)) {
            fs::remove_file(entry.path()).map_err(|source| Error::Write { path: entry.path(), source })?;
        }
    }
    Ok(())
}
