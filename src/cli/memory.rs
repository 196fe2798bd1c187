//! Memory: what a job is estimated to need, what the process has used at most.

use std::fmt;
use std::fs;

use super::Exit;
use super::failure::Refusal;

/// Bytes a face that a job needs at its peak on the CPU, reading and writing included.
const BYTES_PER_FACE: u64 = 256;
/// Bytes of the program itself, its threads and its buffers of fixed size.
const BYTES_ALWAYS: u64 = 32 << 20;

/// The bytes that a job of `faces` faces is estimated to need.
pub fn estimate(faces: usize) -> u64 {
    BYTES_ALWAYS + faces as u64 * BYTES_PER_FACE
}

/// Refuses a job that is estimated to need more than `limit`.
pub fn check(faces: usize, limit: Option<u64>) -> anyhow::Result<()> {
    match limit {
        Some(limit) if estimate(faces) > limit => Err(Refusal::new(
            Exit::Limit,
            format!(
                "{faces} faces need about {}, more than the memory limit of {}",
                Size(estimate(faces)),
                Size(limit)
            ),
        )),
        _ => Ok(()),
    }
}

/// The most bytes that were resident in this process so far, where the system tells.
pub fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let kilobytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    kilobytes.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|n| n * 1024)
}

/// Bytes for people: `1.5 GiB`.
pub struct Size(pub u64);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = ["bytes", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
        let step = (self.0.max(1).ilog2() / 10) as usize;
        match self.0 as f64 / (1_u64 << (10 * step)) as f64 {
            size if size.fract() == 0.0 => write!(f, "{size} {}", units[step]),
            size => write!(f, "{size:.1} {}", units[step]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_well() {
        let texts = [0, 1023, 1024, 1536, 128 << 20, u64::MAX].map(|bytes| Size(bytes).to_string());
        assert_eq!(texts, ["0 bytes", "1023 bytes", "1 KiB", "1.5 KiB", "128 MiB", "16 EiB"]);
    }

    #[test]
    fn a_limit_refuses_what_is_above_it() {
        let limit = Some(estimate(1000));
        assert!(check(1000, limit).is_ok() && check(usize::MAX >> 20, None).is_ok());
        let error = check(1001, limit).expect_err("one face too many").to_string();
        assert!(error.starts_with("1001 faces need about 32.2 MiB, more than"), "{error}");
    }

    #[test]
    fn the_peak_is_plausible() {
        if let Some(peak) = peak() {
            assert!((1 << 20..1 << 40).contains(&peak), "{peak}");
        }
    }
}
