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

/// Rows that are gathered at once: four numbers of a column are one store instead of four, which is what gathering waits for.
pub const QUAD: usize = 4;

/// Numbers of a row at a time, where a row has many.
pub const NUMBERS: usize = 8;

/// Numbers of a row side by side.
pub type Numbers<T> = [T; NUMBERS];

/// So many numbers from `start` on; past the end of the rows 0.
#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
pub fn numbers_at<const COUNT: usize>(rows: &[f32], start: usize) -> [f32; COUNT] {
    let last;
    *match rows.get(start..).and_then(<[f32]>::first_chunk) {
        Some(numbers) => numbers,
        None => {
            last = last_numbers(rows, start);
            &last
        }
    }
}

/// Apart, or vectors would be put together number by number everywhere.
#[cold]
#[inline(never)]
fn last_numbers<const COUNT: usize>(rows: &[f32], start: usize) -> [f32; COUNT] {
    std::array::from_fn(|j| start.checked_add(j).and_then(|place| rows.get(place)).copied().unwrap_or_default())
}

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

    /// The lanes from a multiple of [`QUAD`] on, to be filled from the first column on.
    #[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
    #[inline(always)]
    fn quad(&mut self, lane: usize) -> Quad<'_> {
        Quad { columns: &mut self.words, lane }
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

/// As many lanes as are filled at once.
#[derive(Debug)]
pub struct Quad<'a> {
    /// Those that are not filled yet.
    columns: &'a mut [[u32; LANES]],
    lane: usize,
}

impl Quad<'_> {
    /// Puts a part of a row into each lane: its first `WORDS` words, into the columns that follow those filled before. By
    /// reference, so that rows are read where they lie and four words become a vector.
    #[expect(clippy::inline_always, reason = "rows fall apart into their words, in registers")]
    #[inline(always)]
    pub fn put<R: Pod, const WORDS: usize>(&mut self, rows: [&R; QUAD]) {
        let [a, b, c, d] = rows.map(|row| &bytemuck::cast_slice::<R, u32>(std::slice::from_ref(row))[..WORDS]);
        let (columns, others) = std::mem::take(&mut self.columns).split_at_mut(WORDS);
        for (word, column) in columns.iter_mut().enumerate() {
            column[self.lane..][..QUAD].copy_from_slice(&[a[word], b[word], c[word], d[word]]);
        }
        self.columns = others;
    }
}

/// A row of which something is computed. `gather`, `compute` and all that they call must be `inline(always)`, to be
/// compiled for each instruction set.
pub trait Lane: Pod {
    /// What rows are gathered from.
    type Source<'a>: Copy;
    /// What is the same for all rows.
    type Params: Copy;
    /// What comes out.
    type Output: Copy;

    /// Puts the rows of four indices into as many lanes, word by word in their order: all that touches memory.
    fn gather(indices: [usize; QUAD], source: Self::Source<'_>, lanes: &mut Quad<'_>);

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
    let count = outputs.len().min(LANES);
    for lane in (0..count).step_by(QUAD) {
        // Where rows end amid a quad, the last is gathered again.
        let indices = std::array::from_fn(|i| first + (lane + i).min(count - 1));
        let mut quad = rows.quad(lane);
        T::gather(indices, source, &mut quad);
        debug_assert!(quad.columns.is_empty(), "a row has a number for each of its columns");
    }
    // A block at the end computes what its other lanes hold as well: the loop has one length.
    let block: [T::Output; LANES] = std::array::from_fn(|lane| rows.get(lane).compute(params));
    outputs.copy_from_slice(&block[..outputs.len()]);
}

#[cfg(test)]
mod tests {
    use super::super::exact::{LEAST, divide, flush, mul, root, sub};
    use super::*;

    /// Quotient, root and difference of two numbers.
    #[repr(C)]
    #[derive(Clone, Copy, bytemuck::Zeroable, Pod)]
    struct Operands {
        a: f32,
        b: f32,
    }

    impl Lane for Operands {
        type Source<'a> = &'a [Operands];
        type Params = f32;
        type Output = [u32; 4];

        #[inline(always)]
        fn gather(indices: [usize; QUAD], source: &[Operands], lanes: &mut Quad<'_>) {
            lanes.put::<_, 2>(indices.map(|index| &source[index]));
        }

        #[inline(always)]
        fn compute(self, scale: f32) -> [u32; 4] {
            let Self { a, b } = self;
            [divide(a, b), root(a), sub(mul(a, scale), b), flush(mul(a, b), LEAST)].map(f32::to_bits)
        }
    }

    /// Every pair of numbers at the edges of the range, of rounding and of zero.
    fn hostile() -> Vec<Operands> {
        let least = f32::MIN_POSITIVE;
        let edges = [0.0, 1e-45, least / 2.0, least, LEAST, 1e-20, 0.1, 1.0, 1.000_000_1, 3.0, 1e19, 1e30, f32::MAX];
        let signed: Vec<f32> = edges.into_iter().flat_map(|x| [x, -x]).collect();
        signed.iter().flat_map(|&a| signed.iter().map(move |&b| Operands { a, b })).collect()
    }

    #[test]
    fn lanes_have_the_bits_of_scalar_calls() {
        let numbers = hostile();
        let mut columns = Columns::<Operands, 2>::new();
        // Blocks of all lengths: whole ones, and ends that leave lanes unused.
        for len in (1..=9).chain([31, LANES - 1, LANES]) {
            for first in (0..numbers.len() - len).step_by(len) {
                let mut outputs = vec![[0; 4]; len];
                compute(first, &numbers[..], 1.7, &mut columns, &mut outputs);
                for (output, row) in outputs.iter().zip(&numbers[first..]) {
                    assert_eq!(*output, row.compute(1.7), "of {:e} and {:e}", row.a, row.b);
                }
            }
        }
    }

    #[test]
    fn no_outputs_need_no_rows() {
        compute(5, &[][..], 1.0, &mut Columns::<Operands, 2>::new(), &mut []);
    }

    #[test]
    fn numbers_past_the_end_are_zero() {
        let rows: Vec<f32> = (1..=10).map(|i| i as f32).collect();
        assert_eq!(numbers_at(&rows, 2), [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!(numbers_at(&rows, 7), [8.0, 9.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!([10, 99].map(|start| numbers_at(&rows, start)), [[0.0; NUMBERS]; 2]);
    }
}
