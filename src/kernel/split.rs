//! Splitting outputs among threads.

/// Indices a thread takes at a time.
pub const CHUNK: usize = 1 << 12;

/// Tasks that few rows are split into: more than threads, so that the last ones end at about the same time.
const TASKS: usize = 16;

/// Rows of a task, where there are so many in all: fewer for few rows, but no fewer than `least`, and `most` for many.
pub fn rows_each(rows: usize, [least, most]: [usize; 2]) -> usize {
    rows.div_ceil(TASKS).clamp(least, most)
}

/// Does both: side by side where there are many rows, for waking a thread takes as long as thousands of them.
pub fn join<A: Send, B: Send>(rows: usize, a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    if rows >= CHUNK { rayon::join(a, b) } else { (a(), b()) }
}

/// Splits `rows` at `bounds`: piece `i` is `rows[bounds[i]..bounds[i + 1]]`. Bounds must ascend and end in range.
pub fn split_at_bounds<'a, T>(mut rows: &'a mut [T], bounds: &[u32]) -> Vec<&'a mut [T]> {
    let mut start = 0;
    let mut pieces = Vec::with_capacity(bounds.len());
    for &bound in bounds {
        let (piece, rest) = rows.split_at_mut(bound as usize - start);
        start = bound as usize;
        pieces.push(piece);
        rows = rest;
    }
    pieces.remove(0);
    pieces
}

/// The first index of every chunk of `0..len`, and `len`.
pub fn chunk_bounds(len: usize) -> impl Iterator<Item = usize> {
    (0..len).step_by(CHUNK).chain([len])
}
