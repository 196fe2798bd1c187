//! Memory: what a job is estimated to need, what the process has used at most.

use std::fmt;
use std::fs;
use std::path::Path;

use coarsen::Budget;
use coarsen::formats::FileSize;
pub use coarsen::out_of_core::estimate;
use coarsen::out_of_core::{BYTES_ALWAYS, bytes_of_levels};

use super::Exit;
use super::failure::refuse;

/// Refuses a job that is estimated to need more than `limit`, its levels included.
///
/// # Errors
/// The estimate beside the limit.
pub fn check(faces: usize, budgets: &[Budget], on_gpu: bool, limit: Option<u64>) -> anyhow::Result<()> {
    let need = estimate(faces, on_gpu) + bytes_of_levels(faces as u64, budgets);
    refuse_above(limit, need, || match budgets.len() {
        0 | 1 => format!("{faces} faces need"),
        levels => format!("{faces} faces and {levels} levels of them need"),
    })
}

/// Refuses a compressed file whose content alone needs more than `limit`, as far as it tells.
///
/// # Errors
/// As [`check`].
pub fn check_reading(path: &Path, limit: Option<u64>) -> anyhow::Result<()> {
    let size = FileSize::of(path);
    match size.unpacked {
        Some(_) => {
            refuse_above(limit, BYTES_ALWAYS + size.bytes_to_read(), || format!("reading '{}' takes", path.display()))
        }
        None => Ok(()),
    }
}

fn refuse_above(limit: Option<u64>, need: u64, what: impl FnOnce() -> String) -> anyhow::Result<()> {
    match limit {
        Some(limit) if need > limit => {
            let (need, limit) = (Size(need), Size(limit));
            Err(refuse(Exit::Limit, format!("{} about {need}, more than the memory limit of {limit}", what())))
        }
        _ => Ok(()),
    }
}

/// The most bytes that were resident in this process so far, where the system tells.
pub fn peak() -> Option<u64> {
    status("VmHWM:")
}

/// The bytes that are free now, or that the limit of the container leaves; none where the system does not tell.
pub fn available() -> Option<u64> {
    let free = fs::read_to_string("/proc/meminfo").ok().and_then(|text| kilobytes(&text, "MemAvailable:"));
    let bytes = |name| fs::read_to_string(name).ok()?.trim().parse::<u64>().ok();
    let limit = bytes("/sys/fs/cgroup/memory.max");
    let used = bytes("/sys/fs/cgroup/memory.current").unwrap_or(0);
    free.into_iter().chain(limit.map(|limit| limit.saturating_sub(used))).min()
}

/// The bytes that are resident in this process now, where the system tells.
pub fn resident() -> Option<u64> {
    status("VmRSS:")
}

/// A size of this process by its name in Linux's status file.
fn status(name: &str) -> Option<u64> {
    kilobytes(&fs::read_to_string("/proc/self/status").ok()?, name)
}

/// The bytes of a line such as `VmRSS:  1234 kB`.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let kilobytes = text.lines().find_map(|line| line.strip_prefix(name))?;
    kilobytes.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|n| n * 1024)
}

/// Bytes for people: `1.5 GiB`.
pub struct Size(pub u64);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
        let step = (self.0.max(1).ilog2() / 10) as usize;
        // One decimal, unless it is a zero.
        let size = (self.0 as f64 / (1_u64 << (10 * step)) as f64 * 10.0).round() / 10.0;
        write!(f, "{size} {}", units[step])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_well() {
        let texts = [0, 1023, 1024, 1536, 128 << 20, (1 << 31) - 4, u64::MAX].map(|bytes| Size(bytes).to_string());
        assert_eq!(texts, ["0 bytes", "1023 bytes", "1 KiB", "1.5 KiB", "128 MiB", "2 GiB", "16 EiB"]);
    }

    #[test]
    fn a_limit_refuses_what_is_above_it() {
        let limit = Some(estimate(1_000_000, false));
        assert!(check(1_000_000, &[], false, limit).is_ok() && check(usize::MAX >> 20, &[], true, None).is_ok());
        assert!(check(1_000_000, &[], true, limit).is_err());
        let levels = [Budget::keep(0.5), Budget::keep(0.1)];
        assert!(check(1_000_000, &levels[..1], false, limit).is_ok());
        let error = check(1_000_000, &levels, false, limit).expect_err("one level too many").to_string();
        assert_eq!(
            error,
            "1000000 faces and 2 levels of them need about 357.7 MiB, more than the memory limit of 338.7 MiB"
        );
        let error = check(1_000_001, &[], false, limit).expect_err("one face too many").to_string();
        assert_eq!(error, "1000001 faces need about 338.7 MiB, more than the memory limit of 338.7 MiB");
    }

    #[test]
    fn what_is_free_is_plausible() {
        if let Some(free) = available() {
            assert!((1 << 20..1 << 50).contains(&free), "{free}");
        }
    }

    #[test]
    fn the_peak_is_plausible() {
        if let Some(peak) = peak() {
            assert!((1 << 20..1 << 40).contains(&peak), "{peak}");
        }
    }
}
