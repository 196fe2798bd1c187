//! What a run's end means to a shell: the exit codes, and the errors that are the command line's own.

use std::io;
use std::path::Path;
use std::process::ExitCode;

use coarsen::Error;

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    Done = 0,
    Unexpected = 1,
    Usage = 2,
    TargetNotReached = 3,
    BadInput = 4,
    Unsupported = 5,
    Limit = 6,
    Device = 7,
    NotWritten = 8,
    FilesFailed = 9,
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error of the command line itself.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Refusal {
    pub exit: Exit,
    pub message: String,
}

/// An error to return with `Err(…)`.
pub fn refuse(exit: Exit, message: impl Into<String>) -> anyhow::Error {
    Refusal { exit, message: message.into() }.into()
}

/// What to print: the error behind the names put in front of it. Causes below it are told in its own text.
pub fn message(error: &anyhow::Error) -> String {
    let own = error.chain().position(|cause| cause.is::<Refusal>() || cause.is::<Error>());
    let parts: Vec<String> = error.chain().take(own.map_or(usize::MAX, |at| at + 1)).map(ToString::to_string).collect();
    parts.join(": ")
}

/// The exit code of an error: done for a reader of standard output that went away.
pub fn exit_of(error: &anyhow::Error) -> Exit {
    for cause in error.chain() {
        if let Some(refusal) = cause.downcast_ref::<Refusal>() {
            return refusal.exit;
        }
        if let Some(error) = cause.downcast_ref::<Error>() {
            return exit_of_library(error);
        }
    }
    Exit::Unexpected
}

fn exit_of_library(error: &Error) -> Exit {
    match error {
        Error::Write { source, .. } if source.kind() == io::ErrorKind::BrokenPipe => Exit::Done,
        Error::Read { source, .. } | Error::Write { source, .. } if source.kind() == io::ErrorKind::OutOfMemory => {
            Exit::Limit
        }
        Error::Read { .. } | Error::Format { .. } | Error::Mesh(_) => Exit::BadInput,
        Error::Write { .. } => Exit::NotWritten,
        Error::Unsupported(_) => Exit::Unsupported,
        Error::Parameter(_) => Exit::Usage,
        Error::Device(_) => Exit::Device,
        Error::Limit(_) => Exit::Limit,
        _ => Exit::Unexpected,
    }
}

/// Puts the path in front of an error that does not name it.
pub fn at(name: &Path, error: Error) -> anyhow::Error {
    match error {
        Error::Format { .. } | Error::Mesh(_) | Error::Limit(_) | Error::Unsupported(_) => {
            anyhow::Error::new(error).context(format!("'{}'", name.display()))
        }
        error => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn codes_follow_whose_fault_it_is() {
        let write = |kind: io::ErrorKind| Error::Write { path: PathBuf::from("-"), source: kind.into() };
        for (error, exit) in [
            (Error::Read { path: PathBuf::new(), source: io::ErrorKind::NotFound.into() }, Exit::BadInput),
            (Error::Mesh(String::new()), Exit::BadInput),
            (Error::Unsupported(String::new()), Exit::Unsupported),
            (Error::Parameter(String::new()), Exit::Usage),
            (Error::Device(String::new()), Exit::Device),
            (Error::Limit(String::new()), Exit::Limit),
            (write(io::ErrorKind::StorageFull), Exit::NotWritten),
            (write(io::ErrorKind::BrokenPipe), Exit::Done),
        ] {
            let text = error.to_string();
            assert_eq!(exit_of(&at(Path::new("x"), error)), exit, "{text}");
        }
        assert_eq!(exit_of(&anyhow::anyhow!("?")), Exit::Unexpected);
        assert_eq!(exit_of(&refuse(Exit::TargetNotReached, "")), Exit::TargetNotReached);
    }

    #[test]
    fn the_path_is_named_once() {
        let missing = Error::Read { path: PathBuf::from("a.ply"), source: io::ErrorKind::NotFound.into() };
        assert_eq!(message(&at(Path::new("a.ply"), missing)), "cannot read 'a.ply': entity not found");
        let empty = Error::Mesh("it has no faces".into());
        assert_eq!(message(&at(Path::new("a.ply"), empty)), "'a.ply': invalid mesh: it has no faces");
        let foreign = Error::Unsupported("version 3".into());
        assert_eq!(message(&at(Path::new("a.ply"), foreign)), "'a.ply': unsupported: version 3");
    }
}
