//! One run at a time works on a file: each locks a file of its shard, and looks at those of shards that may hold the same.
//!
//! The system takes a lock back when its process ends, however it does. The files stay, hidden, and tell who had them last.
//! They are not the records themselves: where a lock keeps others from reading, shards could not read each other's.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::Path;

use super::plan::{Plan, Shard};
use crate::error::{Error, Result};

/// Holds the shard of a plan until it is dropped.
#[derive(Debug)]
pub(super) struct Lock(#[expect(dead_code, reason = "closing it gives the lock back")] File);

impl Lock {
    /// Takes the shard of `plan`, whose folder is there.
    ///
    /// A file system without locks is trusted.
    ///
    /// # Errors
    /// [`Error::Write`] where another process has it, or a shard that may hold the same files, and when the system refuses.
    pub fn take(plan: &Plan) -> Result<Self> {
        let failed = |source| Error::Write { path: plan.ledger(), source };
        let path = plan.folder().join(name(plan.shard));
        let mut own =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
        if is_held(own.try_lock()) {
            return Err(failed(busy(&own, plan.shard)));
        }
        // Who has it tells the others, who know nothing worse for its absence.
        let _ = own.set_len(0).and_then(|()| own.rewind()).and_then(|()| write!(own, "{}", this_process()));
        for (shard, other) in others(plan).map_err(failed)? {
            if is_held(other.try_lock_shared()) {
                return Err(failed(busy(&other, shard)));
            }
        }
        Ok(Self(own))
    }
}

/// The name of the file that is locked for a shard.
fn name(shard: Shard) -> String {
    format!(".{}.lock", shard.ledger_name())
}

/// The files of other shards that may hold the same inputs as that of `plan`.
fn others(plan: &Plan) -> io::Result<Vec<(Shard, File)>> {
    let mut others = Vec::new();
    for entry in fs::read_dir(plan.folder())? {
        let file_name = entry?.file_name();
        let text = file_name.to_string_lossy();
        let ledger = text.strip_prefix('.').and_then(|text| text.strip_suffix(".lock"));
        if let Some(shard) = ledger.and_then(Shard::of_ledger)
            && shard != plan.shard
            && shard.may_share(plan.shard)
        {
            others.push((shard, File::open(plan.folder().join(Path::new(&file_name)))?));
        }
    }
    Ok(others)
}

fn is_held(locked: std::result::Result<(), TryLockError>) -> bool {
    matches!(locked, Err(TryLockError::WouldBlock))
}

fn busy(mut file: &File, shard: Shard) -> io::Error {
    let mut who = String::new();
    if file.read_to_string(&mut who).is_err() || who.is_empty() {
        who = "another process".into();
    }
    let name = shard.ledger_name();
    io::Error::new(io::ErrorKind::ResourceBusy, format!("{who} is at work on '{name}': wait for it, or end it"))
}

/// Its number, and where the system tells its machine: folders are shared.
fn this_process() -> String {
    let machine = fs::read_to_string("/proc/sys/kernel/hostname");
    let machine = machine.map_or_else(|_| String::new(), |name| format!(" on '{}'", name.trim()));
    format!("process {}{machine}", std::process::id())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::Recipe;
    use crate::batch::{Pattern, Request};
    use crate::formats::WriteOptions;
    use crate::simplify::{Budget, Method};

    fn plan(dir: &Path, shard: Shard) -> Plan {
        let recipe = Recipe {
            method: Method::default(),
            budgets: vec![Budget::keep(0.5)],
            writing: WriteOptions::default(),
            pattern: Pattern::for_levels(1),
            timeout: None,
            weights: None,
            measure: None,
        };
        let requests = [Request::new("sample:part@5k", 0)];
        Plan::new(&requests, vec![recipe], dir, shard).expect("a plan")
    }

    #[test]
    fn shards_that_may_hold_one_file_exclude_each_other() {
        let dir = tempfile::tempdir().expect("a folder");
        let take = |number, count| {
            Lock::take(&plan(dir.path(), Shard::new(number, count).expect("a shard")))
                .map_err(|error| error.to_string())
        };
        let held = take(1, 4).expect("the first");
        let error = take(1, 4).expect_err("it is held");
        let who = format!("process {}", std::process::id());
        assert!(error.contains("coarsen-1-of-4.jsonl': ") && error.contains(&who) && error.contains("wait"), "{error}");
        let other = take(2, 4).expect("no file is in both");
        assert!(take(2, 2).is_err() && take(1, 1).is_err() && take(1, 3).is_err());
        drop(other);
        assert!(take(2, 2).is_ok() && take(1, 2).is_err());
        drop(held);
        assert!(take(1, 1).is_ok() && take(1, 4).is_ok());
    }
}
