//! The gradients of attributes on faces, on the host: found once for each of the faces near consecutive vertices, not for each of
//! its corners.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::rows::{Face, GradientOperator};
use crate::math::exact::LEAST_FACTOR;
use crate::math::lanes::{NUMBERS, Numbers, numbers_at};

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
    /// Of the numbers of a face from `first` on.
    #[inline(always)]
    fn of(simd: S, f: usize, first: usize, rows: Rows<'_>) -> Self {
        let GradientOperator { bx, by, bz, cx, cy, cz, root } = rows.operators[f];
        let Face { a, b, c } = rows.corners[f];
        let a = numbers_of(simd, a, first, rows);
        let b = numbers_of(simd, b, first, rows) - a;
        let c = numbers_of(simd, c, first, rows) - a;
        let x = flush(simd, b * bx + c * cx);
        let y = flush(simd, b * by + c * cy);
        let z = flush(simd, b * bz + c * cz);
        Self { x, y, z, root }
    }

    /// In memory.
    #[inline(always)]
    pub fn store(self) -> Gradients {
        Gradients { along: [self.x.into(), self.y.into(), self.z.into()], root: self.root }
    }
}

/// Numbers of a wedge, from `first` on.
#[inline(always)]
fn numbers_of<S: Simd>(simd: S, wedge: u32, first: usize, rows: Rows<'_>) -> f32x8<S> {
    numbers_at::<NUMBERS>(rows.values, wedge as usize * rows.width + first).simd_into(simd)
}

/// As [`crate::math::exact::flush`] does at [`LEAST_FACTOR`].
#[inline(always)]
pub fn flush<S: Simd>(simd: S, numbers: f32x8<S>) -> f32x8<S> {
    let zero = f32x8::splat(simd, 0.0);
    numbers.abs().simd_lt(f32x8::splat(simd, LEAST_FACTOR)).select(zero, numbers)
}

/// The gradients of consecutive faces.
#[derive(Debug, Default)]
pub struct GradientTable {
    faces: Range<usize>,
    /// [`NUMBERS`] of each face at a time, those of all faces before the next.
    gradients: Vec<Gradients>,
}

impl GradientTable {
    /// Finds those of these faces, in place of others.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, faces: Range<usize>, rows: Rows<'_>) {
        let (count, blocks) = (faces.len(), rows.costed.div_ceil(NUMBERS));
        self.gradients.resize(self.gradients.len().max(count * blocks), Gradients::default());
        for block in 0..blocks {
            let gradients = &mut self.gradients[block * count..][..count];
            for (f, gradients) in faces.clone().zip(gradients) {
                *gradients = WideGradients::of(simd, f, block * NUMBERS, rows).store();
            }
        }
        self.faces = faces;
    }

    /// Those of the numbers of a face from `first` on, a multiple of [`NUMBERS`], whether it is one of the table's or not.
    #[inline(always)]
    pub fn get<S: Simd>(&self, simd: S, f: u32, first: usize, rows: Rows<'_>) -> WideGradients<S> {
        let (f, count) = (f as usize, self.faces.len());
        let place = f.wrapping_sub(self.faces.start);
        match self.gradients.get(first / NUMBERS * count + place).filter(|_| place < count) {
            Some(gradients) => gradients.load(simd),
            None => WideGradients::of(simd, f, first, rows),
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn faces_have_the_same_gradients_in_the_table_and_beside_it() {
        let (width, costed, face_count) = (12, 11, 7);
        let operators: Vec<GradientOperator> = (0..face_count)
            .map(|f| GradientOperator { bx: f as f32, cy: 0.5 * f as f32, cz: -1.0, root: 2.0, ..Default::default() })
            .collect();
        let corners: Vec<Face> = (0..face_count as u32).map(|f| Face { a: f, b: f + 1, c: f + 2 }).collect();
        let values: Vec<f32> = (0..(face_count + 2) * width).map(|i| ((i * i) % 31) as f32).collect();
        let rows = Rows { operators: &operators, corners: &corners, values: &values, width, costed };
        let numbers = |wedge: u32, j: usize| values[wedge as usize * width + j];
        let mut table = GradientTable::default();
        // Also after more of them.
        for faces in [0..face_count, 2..5, 4..4, 6..7] {
            dispatch!(Level::new(), simd => table.fill(simd, faces.clone(), rows));
            for (f, Face { a, b, c }) in corners.iter().enumerate() {
                for j in 0..costed {
                    let first = j / NUMBERS * NUMBERS;
                    let found = dispatch!(Level::new(), simd => table.get(simd, f as u32, first, rows).store());
                    let (along_b, along_c) = (numbers(*b, j) - numbers(*a, j), numbers(*c, j) - numbers(*a, j));
                    let expected = [f as f32 * along_b, 0.5 * f as f32 * along_c, -along_c];
                    assert_eq!(found.along.map(|numbers| numbers[j - first]), expected, "{f}, {j}");
                    assert_eq!(found.root, 2.0);
                }
            }
        }
    }
}
