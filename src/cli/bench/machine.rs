//! The machine, as far as it tells.

use std::env::consts::{ARCH, OS};
use std::fs;

use serde::Serialize;

use super::plan::cores;

/// What the numbers were measured on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// The model, or the architecture where the system does not tell.
    pub cpu: String,
    /// Those that this process may use.
    pub cores: usize,
    pub os: String,
}

impl Machine {
    /// This machine.
    pub fn here() -> Self {
        let file = |name| fs::read_to_string(name).unwrap_or_default();
        let cpu = field(&file("/proc/cpuinfo"), "model name", ':').unwrap_or_else(|| ARCH.into());
        let system = field(&file("/etc/os-release"), "PRETTY_NAME", '=').unwrap_or_else(|| OS.into());
        let kernel = file("/proc/sys/kernel/osrelease");
        let os = if kernel.is_empty() { system } else { format!("{system}, {OS} {}", kernel.trim()) };
        Self { cpu, cores: cores(), os }
    }
}

/// The first value of `name` in lines of names and values, without quotes.
fn field(text: &str, name: &str, separator: char) -> Option<String> {
    let (_, value) = text.lines().filter_map(|line| line.split_once(separator)).find(|(key, _)| key.trim() == name)?;
    let value = value.trim().trim_matches('"');
    (!value.is_empty()).then(|| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found() {
        let cpu = "processor\t: 0\nmodel name\t: AMD EPYC 9755\nflags\t\t: fpu\nmodel name\t: other\n";
        assert_eq!(field(cpu, "model name", ':').as_deref(), Some("AMD EPYC 9755"));
        assert_eq!(
            field("NAME=\"Debian\"\nPRETTY_NAME=\"Debian 12\"\n", "PRETTY_NAME", '=').as_deref(),
            Some("Debian 12")
        );
        assert_eq!(field("model name:\n", "model name", ':'), None);
        assert_eq!(field("", "model name", ':'), None);
    }

    #[test]
    fn something_is_known_of_every_machine() {
        let machine = Machine::here();
        assert!(!machine.cpu.is_empty() && !machine.os.is_empty() && machine.cores > 0, "{machine:?}");
    }
}
