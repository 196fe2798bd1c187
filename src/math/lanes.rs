//! The same pure function of many rows at once, in the widest vectors that the processor has.
//!
//! A kernel's twin is written for one row. What it reads is gathered into columns, one lane a row; a loop over the lanes
//! then calls the twin, and the compiler turns the loop into vector instructions: every branch of a twin is cheap enough
//! to become a selection, and nothing is fused or reordered, so that a lane's bits are those of the scalar call. The loop
//! is compiled for several instruction sets, and the processor chooses when it runs.

use std::marker::PhantomData;

use bytemuck::Pod;
use multiversion::multiversion;

/// Rows to a block: enough to hide a loop's ends, few enough for the first cache.
pub const LANES: usize = 64;

/// A block of rows of `WORDS` 32-bit scalars, each scalar in a column of its own.
#[derive(Debug, Clone)]
pub struct Columns<T, const WORDS: usize> {
    words: [[u32; LANES]; WORDS],
    rows: PhantomData<T>,
}

impl<T: Pod, const WORDS: usize> Columns<T, WORDS> {
    /// Columns of zeros.
    pub fn new() -> Self {
        const { assert!(size_of::<T>() == 4 * WORDS, "a row is so many words") };
        Self { words: [[0; LANES]; WORDS], rows: PhantomData }
    }

    /// Puts a row into a lane.
    #[expect(clippy::inline_always, reason = "a row falls apart into its words, in registers")]
    #[inline(always)]
    pub fn set(&mut self, lane: usize, row: T) {
        let words: [u32; WORDS] = bytemuck::cast(row);
        for (column, word) in self.words.iter_mut().zip(words) {
            column[lane] = word;
        }
    }

    /// The row of a lane.
    #[expect(clippy::inline_always, reason = "a row falls apart into its words, in registers")]
    #[inline(always)]
    pub fn get(&self, lane: usize) -> T {
        let mut words = [0; WORDS];
        for (word, column) in words.iter_mut().zip(&self.words) {
            *word = column[lane];
        }
        bytemuck::cast(words)
    }
}

impl<T: Pod, const WORDS: usize> Default for Columns<T, WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

/// A row of which something is computed. `load`, `compute` and all that they call must be `inline(always)`, to be
/// compiled for each instruction set.
pub trait Lane: Pod {
    /// What rows are gathered from.
    type Source<'a>: Copy;
    /// What is the same for all rows.
    type Params: Copy;
    /// What comes out.
    type Output: Copy;

    /// The row of an index: all that touches memory.
    fn load(index: usize, source: Self::Source<'_>) -> Self;

    /// The twin.
    fn compute(self, params: Self::Params) -> Self::Output;
}

/// Computes the rows from index `first` on, one for each of at most [`LANES`] outputs. `rows` is left with what was loaded.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub fn compute<T: Lane, const WORDS: usize>(
    first: usize,
    source: T::Source<'_>,
    params: T::Params,
    rows: &mut Columns<T, WORDS>,
    outputs: &mut [T::Output],
) {
    for lane in 0..outputs.len().min(LANES) {
        rows.set(lane, T::load(first + lane, source));
    }
    // A block at the end computes what its other lanes hold as well: the loop has one length.
    let block: [T::Output; LANES] = std::array::from_fn(|lane| rows.get(lane).compute(params));
    outputs.copy_from_slice(&block[..outputs.len()]);
}
