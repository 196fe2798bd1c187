//! Why a file has no result, by reasons that a table can count.

use std::any::Any;
use std::fmt;

use serde::Serialize;

use crate::error::Error;

/// Why a file failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The system cannot open or read it.
    Unreadable,
    /// Its bytes are not what its format demands, or its mesh breaks a rule.
    Malformed,
    /// Its format or content is not handled.
    Unsupported,
    /// An option does not suit it.
    Options,
    /// It needs more memory than allowed.
    Memory,
    /// It took longer than allowed.
    Timeout,
    /// The device failed.
    Device,
    /// Its result, or the record of it, could not be written.
    NotWritten,
    /// The program has a fault: its work panicked.
    Panicked,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unreadable => "unreadable",
            Self::Malformed => "malformed",
            Self::Unsupported => "unsupported",
            Self::Options => "options",
            Self::Memory => "memory",
            Self::Timeout => "timeout",
            Self::Device => "device",
            Self::NotWritten => "not written",
            Self::Panicked => "panicked",
        })
    }
}

/// A reason, and what exactly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// What to count it under.
    pub reason: Reason,
    /// What exactly.
    pub message: String,
}

impl Failure {
    /// A failure.
    pub(super) fn new(reason: Reason, message: impl Into<String>) -> Self {
        Self { reason, message: message.into() }
    }

    /// Of work that panicked, with what it said.
    pub(super) fn of_panic(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Self::new(Reason::Panicked, text.unwrap_or("no message"))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let reason = match &error {
            Error::Read { source, .. } if source.kind() == std::io::ErrorKind::OutOfMemory => Reason::Memory,
            Error::Read { .. } => Reason::Unreadable,
            Error::Format { .. } | Error::Mesh(_) => Reason::Malformed,
            Error::Unsupported(_) => Reason::Unsupported,
            Error::Parameter(_) => Reason::Options,
            Error::Limit(_) => Reason::Memory,
            Error::Device(_) => Reason::Device,
            Error::Write { .. } => Reason::NotWritten,
        };
        Self::new(reason, error.to_string())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_have_one_name() {
        let names = |reason: Reason| (serde_json::to_value(reason).ok(), reason.to_string().replace(' ', "_"));
        for reason in [Reason::Unreadable, Reason::Malformed, Reason::Memory, Reason::NotWritten, Reason::Panicked] {
            let (serialized, shown) = names(reason);
            assert_eq!(serialized, Some(shown.into()));
        }
    }

    #[test]
    fn a_panic_tells_what_it_said() {
        for (panic, message) in [
            (Box::new("a text") as Box<dyn Any + Send>, "a text"),
            (Box::new(String::from("a string")), "a string"),
            (Box::new(7), "no message"),
        ] {
            assert_eq!(Failure::of_panic(panic.as_ref()), Failure::new(Reason::Panicked, message));
        }
    }
}
