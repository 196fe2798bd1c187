//! What the faces near consecutive vertices add to the sums of their wedges, on the host: found once for each face, not for
//! each of its corners.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::rows::{Face, GradientOperator};
use crate::math::exact::LEAST_FACTOR;
use crate::math::lanes::{NUMBERS, Numbers, numbers_at};

/// The lane of |n|, in the first of [`Terms`].
pub const WEIGHT: usize = NUMBERS - 1;
/// Numbers of a wedge that are side by side, beside |n|.
pub const PART: usize = WEIGHT;

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

/// [`Terms`] in memory.
#[repr(align(32))]
#[derive(Debug, Clone, Copy, Default)]
struct Row([Numbers<f32>; 9]);

/// |n| g of a part of the numbers, along each axis, and |n| g gᵀ, its upper half row by row. Past the last number a lane holds
/// anything, but for that of |n|.
#[derive(Debug, Clone, Copy)]
pub struct Terms<S: Simd>(pub [f32x8<S>; 9]);

impl<S: Simd> Terms<S> {
    /// Of a face, for the numbers from `first` on. Written out: a closure given to `map` would be a call.
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
        let mut weighted: Numbers<f32> = (x * root).into();
        weighted[WEIGHT] = root * root;
        Self([weighted.simd_into(simd), y * root, z * root, x * x, x * y, x * z, y * y, y * z, z * z])
    }

    #[inline(always)]
    fn load(simd: S, Row([a, b, c, d, e, f, g, h, i]): &Row) -> Self {
        let load = |numbers: &Numbers<f32>| f32x8::simd_from(simd, *numbers);
        Self([load(a), load(b), load(c), load(d), load(e), load(f), load(g), load(h), load(i)])
    }

    #[inline(always)]
    fn store(self) -> Row {
        let [a, b, c, d, e, f, g, h, i] = self.0;
        Row([a.into(), b.into(), c.into(), d.into(), e.into(), f.into(), g.into(), h.into(), i.into()])
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c, d, e, f, g, h, i], o) = (self.0, other.0);
        Self([a + o[0], b + o[1], c + o[2], d + o[3], e + o[4], f + o[5], g + o[6], h + o[7], i + o[8]])
    }
}

/// Numbers of a wedge, from `first` on.
#[inline(always)]
fn numbers_of<S: Simd>(simd: S, wedge: u32, first: usize, rows: Rows<'_>) -> f32x8<S> {
    numbers_at(rows.values, wedge as usize * rows.width + first).simd_into(simd)
}

/// As [`crate::math::exact::flush`] does at [`LEAST_FACTOR`].
#[inline(always)]
pub fn flush<S: Simd>(simd: S, numbers: f32x8<S>) -> f32x8<S> {
    let zero = f32x8::splat(simd, 0.0);
    numbers.abs().simd_lt(f32x8::splat(simd, LEAST_FACTOR)).select(zero, numbers)
}

/// What each of consecutive faces adds.
#[derive(Debug, Default)]
pub struct GradientTable {
    faces: Range<usize>,
    /// Of each part of the numbers those of every face.
    terms: Vec<Row>,
}

impl GradientTable {
    /// Finds what these faces add.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, faces: Range<usize>, rows: Rows<'_>) {
        let (count, parts) = (faces.len(), rows.costed.div_ceil(PART));
        self.terms.resize(self.terms.len().max(count * parts), Row::default());
        for (part, terms) in self.terms.chunks_exact_mut(count.max(1)).take(parts).enumerate() {
            for (f, terms) in faces.clone().zip(terms) {
                *terms = Terms::of(simd, f, part * PART, rows).store();
            }
        }
        self.faces = faces;
    }

    /// What faces, of which some may be others than those filled in, add for a part of their numbers.
    #[inline(always)]
    pub fn sum<S: Simd>(&self, simd: S, faces: &[u32], part: usize, rows: Rows<'_>) -> Terms<S> {
        let terms = &self.terms[part * self.faces.len()..][..self.faces.len()];
        let mut sums = Terms([f32x8::splat(simd, 0.0); 9]);
        for &f in faces {
            sums = match terms.get((f as usize).wrapping_sub(self.faces.start)) {
                Some(row) => sums.add(Terms::load(simd, row)),
                None => sums.add(Terms::of(simd, f as usize, part * PART, rows)),
            };
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn what_was_found_before_is_what_is_found_when_asked() {
        let (width, costed, faces) = (12, 11, 40_u32);
        let number = |i: usize| ((i * 2_654_435_761) % 1000) as f32 * 1e-3 - 0.5;
        let operator = |f: usize| {
            let [bx, by, bz, cx, cy, cz, root] = std::array::from_fn(|k| number(7 * f + k));
            GradientOperator { bx, by, bz, cx, cy, cz, root }
        };
        let operators: Vec<_> = (0..faces as usize).map(operator).collect();
        let corners: Vec<_> = (0..faces).map(|f| Face { a: f, b: (f + 1) % faces, c: (f + 7) % faces }).collect();
        let values: Vec<f32> = (0..faces as usize * width).map(number).collect();
        let rows = Rows { operators: &operators, corners: &corners, values: &values, width, costed };
        let ring: Vec<u32> = (0..faces).step_by(3).collect();
        let sums = |table: &GradientTable| {
            [0, 1].map(|part| {
                dispatch!(Level::new(), simd => {
                    let Terms(sums) = table.sum(simd, &ring, part, rows);
                    sums.map(|lanes| -> Numbers<f32> { lanes.into() })
                })
            })
        };
        let (mut table, asked) = (GradientTable::default(), sums(&GradientTable::default()));
        // Of both parts, and of fewer faces in the room of more.
        for found in [0..40, 10..23, 30..40, 5..5] {
            dispatch!(Level::new(), simd => table.fill(simd, found.clone(), rows));
            assert_eq!(sums(&table), asked, "{found:?}");
        }
        assert!(asked.iter().flatten().flatten().any(|&number| number != 0.0));
    }
}
