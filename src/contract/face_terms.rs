//! What makes gradients of the numbers at the corners of faces around a pair, four of these side by side: found in double
//! precision, and kept in the single precision of the numbers.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};

use crate::kernel::gradient_operators::LEAST_HEIGHT;
use crate::math::wide::{WIDE, WideVec3};
use crate::math::{DVec3, Vec3};

use super::quads::{Quad, Quads};

/// A face about the middle: what its numbers change by along two of its edges is multiplied by c1 and c2 to be their gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceTerm {
    pub c1: Vec3,
    pub c2: Vec3,
    /// c1 and c2 times the first corner; 0 for a face that holds both ends, which has the means of their numbers at the middle.
    pub c1_at: f32,
    pub c2_at: f32,
    /// |n|, of the normal that is twice its area long.
    pub weight: f32,
    /// How far its first corner is from these means, in halves of the ends' difference: −1, 1, or 0 for a face that holds both.
    pub side: f32,
}

/// Four faces.
#[derive(Debug, Clone, Copy, Default)]
struct TermQuad {
    c1: [[f32; WIDE]; 3],
    c2: [[f32; WIDE]; 3],
    c1_at: [f32; WIDE],
    c2_at: [f32; WIDE],
    weights: [f32; WIDE],
    sides: [f32; WIDE],
}

/// The terms of all faces of a star, by their numbers there.
#[derive(Debug, Default)]
pub struct FaceTerms {
    /// Longer than there are faces, where more were needed before.
    rows: Vec<TermQuad>,
}

impl FaceTerms {
    /// Finds those of faces whose ends stand at `-h` and `h`; the first so many have one end alone.
    pub fn find(&mut self, quads: &Quads, h: DVec3, survivors: usize) {
        let count = quads.rows().len();
        if self.rows.len() < count {
            self.rows.resize(count, TermQuad::default());
        }
        let rows = &mut self.rows[..count];
        dispatch!(quads.level, simd => find(simd, quads.rows(), h, survivors, rows));
    }

    /// That of a face.
    #[inline(always)]
    pub fn get(&self, face: usize) -> FaceTerm {
        let (TermQuad { c1, c2, c1_at, c2_at, weights, sides }, lane) = (&self.rows[face / WIDE], face % WIDE);
        let vector = |rows: &[[f32; WIDE]; 3]| Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]);
        FaceTerm {
            c1: vector(c1),
            c2: vector(c2),
            c1_at: c1_at[lane],
            c2_at: c2_at[lane],
            weight: weights[lane],
            side: sides[lane],
        }
    }
}

#[inline(always)]
fn find<S: Simd>(simd: S, quads: &[Quad], h: DVec3, survivors: usize, terms: &mut [TermQuad]) {
    let splat = |number: f64| f64x4::splat(simd, number);
    let (zero, one) = (splat(0.0), splat(1.0));
    let lanes: f64x4<S> = [0.0, 1.0, 2.0, 3.0].simd_into(simd);
    let (h, survivors) = (WideVec3::splat(simd, h), splat(survivors as f64));
    for ((quad, term), first) in quads.iter().zip(terms).zip((0..).step_by(WIDE)) {
        let n = quad.normals.load(simd);
        let p0 = h.scaled(quad.sides.simd_into(simd));
        let (e1, e2) = (quad.points[0].load(simd) - p0, quad.points[1].load(simd) - p0);
        let weights = n.length_squared().sqrt();
        let sides_sq = e1.length_squared() + e2.length_squared();
        let is_flat = weights.simd_le(splat(f64::from(LEAST_HEIGHT)) * sides_sq);
        let inverse = is_flat.select(zero, one / (weights * weights));
        let (c1, c2) = (e2.cross(n).scaled(inverse), n.cross(e1).scaled(inverse));
        let number = lanes + splat(f64::from(first));
        let alone = number.simd_lt(survivors).select(one, zero);
        let sides: f64x4<S> = quad.sides.simd_into(simd);
        *term = TermQuad {
            c1: [single(c1.x), single(c1.y), single(c1.z)],
            c2: [single(c2.x), single(c2.y), single(c2.z)],
            c1_at: single(c1.dot(p0) * alone),
            c2_at: single(c2.dot(p0) * alone),
            weights: single(weights),
            sides: single(sides * alone),
        };
    }
}

/// To memory, in single precision.
#[inline(always)]
fn single<S: Simd>(numbers: f64x4<S>) -> [f32; WIDE] {
    <[f64; WIDE]>::from(numbers).map(|number| number as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_make_gradients_of_what_is_linear() {
        let h = DVec3::new(1.0, 0.25, -0.5);
        let points = |i: f64| [DVec3::new(i, 2.0, i * i), DVec3::new(-0.5, i, 1.0 - i)];
        // Five faces, of which the last two have both ends, and the third has no area.
        let faces = [0.0, 1.0, 2.0, 3.0, 4.0].map(|i| match i {
            2.0 => ([h * 2.0, h * 3.0], 1.0),
            i => (points(i), if i < 2.0 { -1.0 } else { 1.0 }),
        });
        let mut terms = FaceTerms::default();
        terms.find(&Quads::of(&faces, h), h, 3);
        let slope = DVec3::new(3.0, -1.0, 0.5);
        for (number, ([p1, p2], side)) in faces.into_iter().enumerate() {
            let p0 = h * side;
            let normal = (p1 - p0).cross(p2 - p0);
            let FaceTerm { c1, c2, c1_at, c2_at, weight, side: own_side } = terms.get(number);
            assert_eq!((weight, own_side), (normal.length() as f32, if number < 3 { side as f32 } else { 0.0 }));
            let [c1, c2] = [c1, c2].map(Vec3::as_dvec3);
            let at = [(c1_at, c1), (c2_at, c2)].map(|(at, c)| f64::from(at) - if number < 3 { c.dot(p0) } else { 0.0 });
            assert!(at.iter().all(|off| off.abs() < 1e-6), "{number}: {at:?}");
            if number == 2 {
                assert_eq!((c1, c2), (DVec3::ZERO, DVec3::ZERO));
                continue;
            }
            // Of a number that is linear, what lies in the plane of the face.
            let gradient = c1 * slope.dot(p1 - p0) + c2 * slope.dot(p2 - p0);
            let n = normal.normalize();
            assert!((gradient - (slope - n * n.dot(slope))).length() < 1e-6, "{number}: {gradient}");
        }
    }
}
