//! One error type, sorted by whose fault it is.
//!
//! Messages start in lower case, have no full stop, quote user text, and name the way out where there is one.

use std::fmt;
use std::path::PathBuf;

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, by whose fault.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened or read.
    #[error("cannot read '{}': {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file could not be created, written or renamed. Nothing is left at its final name.
    #[error("cannot write '{}': {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The bytes are not what the format demands.
    #[error("{format} {place}: {message}")]
    Format {
        /// The format's name, such as `PLY`.
        format: &'static str,
        /// Where in the file.
        place: Place,
        /// What was found and what was expected.
        message: String,
    },
    /// Valid content that this program does not handle.
    #[error("unsupported: {0}")]
    Unsupported(String),
    /// The mesh itself breaks a rule: an index out of range, a coordinate that is not finite, no faces.
    #[error("invalid mesh: {0}")]
    Mesh(String),
    /// A parameter is out of its range or contradicts another.
    #[error("invalid parameter: {0}")]
    Parameter(String),
    /// The asked-for device is missing, refused the work or was lost.
    #[error("device: {0}")]
    Device(String),
    /// The job needs more memory or larger indices than allowed.
    #[error("limit: {0}")]
    Limit(String),
}

/// Where in a file an error was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A byte offset, counted from 0 (after decompression).
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => f.write_str("file"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

impl Error {
    /// A [`Error::Format`] at `place`.
    pub fn format(format: &'static str, place: Place, message: impl Into<String>) -> Self {
        Self::Format { format, place, message: message.into() }
    }
}
