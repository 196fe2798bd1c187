//! Going over a table in pieces.

use std::ops::Range;

use crate::error::Result;

/// Rows that are read at a time: some megabytes.
const CHUNK: usize = 1 << 17;

/// Calls `work` for one piece of `count` rows after another.
///
/// # Errors
/// The first of `work`.
pub fn each_chunk(count: usize, mut work: impl FnMut(Range<usize>) -> Result<()>) -> Result<()> {
    (0..count).step_by(CHUNK).try_for_each(|start| work(start..count.min(start + CHUNK)))
}
