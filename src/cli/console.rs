//! The two streams: data on standard output, words on standard error.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;

use coarsen::Error;
use serde::Serialize;

/// How much to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Warnings and one line about the result.
    Normal,
    /// Also a line a round.
    Verbose,
}

/// Says what went wrong, always.
pub fn error(message: &str) {
    say(format_args!("coarsen: error: {message}"));
}

/// Warns of something that did not stop the run.
pub fn warning(verbosity: Verbosity, message: &str) {
    if verbosity > Verbosity::Quiet {
        say(format_args!("coarsen: warning: {message}"));
    }
}

/// Tells a fact.
pub fn note(verbosity: Verbosity, message: &str) {
    if verbosity > Verbosity::Quiet {
        say(format_args!("coarsen: {message}"));
    }
}

/// Writes a line to standard error.
pub fn say(line: impl Display) {
    // Nobody is left to tell when the stream is gone.
    let _ = writeln!(io::stderr(), "{line}");
}

/// Writes `data` to standard output.
///
/// # Errors
/// [`Error::Write`] for `-`.
pub fn print(data: &[u8]) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(data)
        .and_then(|()| out.flush())
        .map_err(|source| Error::Write { path: PathBuf::from("-"), source }.into())
}

/// Writes `record` as one line of JSON to standard output.
///
/// # Errors
/// As [`print`].
pub fn print_json(record: &impl Serialize) -> anyhow::Result<()> {
    let mut line = serde_json::to_vec(record)?;
    line.push(b'\n');
    print(&line)
}
