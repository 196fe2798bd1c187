//! The gradients of attributes on faces, on the host: found once for each of the faces near consecutive vertices, not for each of
//! its corners.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::rows::{Face, GradientOperator};
use crate::math::exact::LEAST_FACTOR;
use crate::math::lanes::{self, NUMBERS, Numbers};

/// What gradients are found from.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// What makes gradients of the numbers at the corners of faces.
    pub operators: &'a [GradientOperator],
    /// The wedges of the corners of faces.
    pub corners: &'a [Face],
    /// `width` numbers for each wedge, first those that decide.
    pub values: &'a [f32],
    /// Numbers of a wedge.
    pub width: usize,
    /// Those that decide.
    pub costed: usize,
}

/// [`WideGradients`] in memory.
#[repr(C, align(32))]
#[derive(Debug, Clone, Copy, Default)]
pub struct Gradients {
    along: [Numbers<f32>; 3],
    root: f32,
}

impl Gradients {
    /// All of them.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> WideGradients<S> {
        let [x, y, z] = self.along;
        WideGradients { x: x.simd_into(simd), y: y.simd_into(simd), z: z.simd_into(simd), root: self.root }
    }
}

/// √|n| times the gradients of some numbers of a face, along each axis, and √|n|. Lanes past the last number hold anything.
#[derive(Debug, Clone, Copy)]
pub struct WideGradients<S: Simd> {
    /// Along the first axis.
    pub x: f32x8<S>,
    /// Along the second.
    pub y: f32x8<S>,
    /// Along the third.
    pub z: f32x8<S>,
    /// √|n|.
    pub root: f32,
}

impl<S: Simd> WideGradients<S> {
    /// In memory.
    #[inline(always)]
    pub fn store(self) -> Gradients {
        Gradients { along: [self.x.into(), self.y.into(), self.z.into()], root: self.root }
    }
}

/// Of the numbers of a face from `first` on.
#[inline(always)]
fn gradients_of<S: Simd>(simd: S, f: usize, first: usize, rows: Rows<'_>) -> WideGradients<S> {
    let (row, corners) = (&rows.operators[f], &rows.corners[f]);
    let a = numbers_at(simd, corners.a, first, rows);
    let b = numbers_at(simd, corners.b, first, rows) - a;
    let c = numbers_at(simd, corners.c, first, rows) - a;
    WideGradients {
        x: flush(simd, b * row.bx + c * row.cx),
        y: flush(simd, b * row.by + c * row.cy),
        z: flush(simd, b * row.bz + c * row.cz),
        root: row.root,
    }
}

/// Numbers of a wedge, from `first` on.
#[inline(always)]
fn numbers_at<S: Simd>(simd: S, wedge: u32, first: usize, rows: Rows<'_>) -> f32x8<S> {
    lanes::numbers_at::<NUMBERS>(rows.values, wedge as usize * rows.width + first).simd_into(simd)
}

/// As [`crate::math::exact::flush`] does at [`LEAST_FACTOR`].
#[inline(always)]
pub fn flush<S: Simd>(simd: S, numbers: f32x8<S>) -> f32x8<S> {
    let zero = f32x8::splat(simd, 0.0);
    numbers.abs().simd_lt(f32x8::splat(simd, LEAST_FACTOR)).select(zero, numbers)
}

/// The gradients of consecutive faces.
#[derive(Debug)]
pub struct GradientTable<'a> {
    rows: Rows<'a>,
    faces: Range<usize>,
    /// [`NUMBERS`] of each face at a time, those of all faces before the next.
    gradients: Vec<Gradients>,
}

impl<'a> GradientTable<'a> {
    /// Of no faces yet.
    pub fn new(rows: Rows<'a>) -> Self {
        Self { rows, faces: 0..0, gradients: Vec::new() }
    }

    /// How many faces there are, and numbers that decide.
    pub fn counts(&self) -> [usize; 2] {
        [self.rows.corners.len().min(self.rows.operators.len()), self.rows.costed]
    }

    /// Whether a face is one of a wedge's.
    #[inline(always)]
    pub fn has_wedge(&self, f: u32, wedge: u32) -> bool {
        let Face { a, b, c } = self.rows.corners[f as usize];
        (a == wedge) | (b == wedge) | (c == wedge)
    }

    /// Finds those of these faces, in place of others.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, faces: Range<usize>) {
        // Apart from the table, so that registers hold them.
        let rows = self.rows;
        let (count, blocks) = (faces.len(), rows.costed.div_ceil(NUMBERS));
        self.gradients.resize(self.gradients.len().max(count * blocks), Gradients::default());
        for block in 0..blocks {
            let gradients = &mut self.gradients[block * count..][..count];
            for (f, gradients) in faces.clone().zip(gradients) {
                *gradients = gradients_of(simd, f, block * NUMBERS, rows).store();
            }
        }
        self.faces = faces;
    }

    /// Those of the numbers of a face from `first` on, a multiple of [`NUMBERS`], whether it is one of the table's or not.
    #[inline(always)]
    pub fn get<S: Simd>(&self, simd: S, f: u32, first: usize) -> WideGradients<S> {
        let (f, count) = (f as usize, self.faces.len());
        let place = f.wrapping_sub(self.faces.start);
        if place < count {
            return self.gradients[first / NUMBERS * count + place].load(simd);
        }
        gradients_of(simd, f, first, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    const WIDTH: usize = 12;
    const COSTED: usize = 11;
    const FACES: usize = 7;

    #[test]
    fn faces_have_their_gradients_in_the_table_and_beside_it() {
        let operator = |f| GradientOperator { bx: f, cy: 0.5 * f, cz: -1.0, root: 2.0, ..Default::default() };
        let operators: Vec<_> = (0..FACES).map(|f| operator(f as f32)).collect();
        let corners: Vec<Face> = (0..FACES as u32).map(|f| Face { a: f, b: f + 1, c: f + 2 }).collect();
        let values: Vec<f32> = (0..(FACES + 2) * WIDTH).map(|i| ((i * i) % 31) as f32).collect();
        let rows = Rows { operators: &operators, corners: &corners, values: &values, width: WIDTH, costed: COSTED };
        // Those of the table stay what they were: they are twice as steep as those found now.
        let halves: Vec<f32> = values.iter().map(|x| 0.5 * x).collect();
        let mut table = GradientTable::new(rows);
        // Also after more of them.
        for faces in [0..FACES, 2..5, 4..4, 6..7] {
            dispatch!(Level::new(), simd => table.fill(simd, faces.clone()));
            let now = GradientTable {
                rows: Rows { values: &halves, ..rows },
                faces: table.faces.clone(),
                gradients: table.gradients.clone(),
            };
            for (f, corners) in corners.iter().enumerate() {
                let scale = if faces.contains(&f) { 1.0 } else { 0.5 };
                let [a, b, c] = corners.corners().map(|wedge| &values[wedge as usize * WIDTH..]);
                for j in 0..COSTED {
                    let first = j / NUMBERS * NUMBERS;
                    let found = dispatch!(Level::new(), simd => now.get(simd, f as u32, first).store());
                    let (along_b, along_c) = (scale * (b[j] - a[j]), scale * (c[j] - a[j]));
                    let expected = [f as f32 * along_b, 0.5 * f as f32 * along_c, -along_c];
                    assert_eq!(found.along.map(|numbers| numbers[j - first]), expected, "{f}, {j}");
                    assert_eq!(found.root, 2.0);
                }
            }
        }
    }
}
