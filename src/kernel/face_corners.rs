//! The cotangent at every corner of every face, and the corner's share of its area. Twin: `shaders/face_corners.wgsl`,
//! line for line.
//!
//! Once a face instead of once for each corner: what the curvatures of its vertices are made of. \[MDSB03\] section 3.3:
//! the shares are those of the Voronoi regions, or parts of the area where those would reach out of an obtuse face.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::rows::{Corners, Face, Position};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, cross3, divide, dot3, flush, flush3, mul, root, sub3};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// A face whose height is below this share of its longest edge counts as a line: no angles, no area. Its cotangents would
/// be rounding noise of up to the inverse.
pub const NEEDLE: f32 = 1e-6;

/// One invocation a face.
pub struct FaceCorners<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes F rows; zeros for a face without area.
    pub corners: &'a mut Buffer<Corners>,
}

/// The corners of a face.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct Triangle {
    a: Vec3,
    b: Vec3,
    c: Vec3,
}

const TRIANGLE_WORDS: usize = size_of::<Triangle>() / 4;

/// The area nearer to a corner than to the others, by the edges from it and the cotangents across them; where the face is
/// obtuse, half of it at the wide corner and a quarter at the others.
#[inline(always)]
fn share(own: f32, least: f32, doubled: f32, nearer: f32) -> f32 {
    let of_obtuse = mul(if own < 0.0 { 0.25 } else { 0.125 }, doubled);
    if least < 0.0 { of_obtuse } else { mul(0.125, nearer) }
}

#[inline(always)]
fn corners_of(a: Vec3, b: Vec3, c: Vec3) -> Corners {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let bc = flush3(sub3(c, b), LEAST_FACTOR);
    let ab_sq = dot3(ab, ab);
    let ac_sq = dot3(ac, ac);
    let bc_sq = dot3(bc, bc);
    let n = flush3(cross3(ab, ac), LEAST_FACTOR);
    let doubled = root(dot3(n, n));
    if doubled <= mul(NEEDLE, ab_sq.max(ac_sq.max(bc_sq))) {
        return Corners::default();
    }
    let inverse = divide(1.0, doubled);
    let cot_a = flush(mul(dot3(ab, ac), inverse), LEAST_FACTOR);
    let cot_b = flush(mul(-dot3(ab, bc), inverse), LEAST_FACTOR);
    let cot_c = flush(mul(dot3(ac, bc), inverse), LEAST_FACTOR);
    let least = cot_a.min(cot_b.min(cot_c));
    Corners {
        cot_a,
        cot_b,
        cot_c,
        area_a: share(cot_a, least, doubled, add(mul(ab_sq, cot_c), mul(ac_sq, cot_b))),
        area_b: share(cot_b, least, doubled, add(mul(bc_sq, cot_a), mul(ab_sq, cot_c))),
        area_c: share(cot_c, least, doubled, add(mul(ac_sq, cot_b), mul(bc_sq, cot_a))),
    }
}

impl Lane for Triangle {
    type Source<'a> = (&'a [Position], &'a [Face]);
    type Params = ();
    type Output = Corners;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (positions, faces): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let faces = indices.map(|index| &faces[index]);
        lanes.put::<_, 3>(faces.map(|face| &positions[face.a as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.b as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.c as usize]));
    }

    #[inline(always)]
    fn compute(self, (): ()) -> Corners {
        corners_of(self.a, self.b, self.c)
    }
}

impl Kernel for FaceCorners<'_> {
    const NAME: &'static str = "face_corners";
    const SOURCE: &'static str = include_str!("../../shaders/face_corners.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("NEEDLE", Constant::F32(NEEDLE))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("corners", Access::Write, self.corners),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let source = (self.positions.host(), self.faces.host());
        let blocks = self.corners.host_mut()[..self.face_count as usize].par_chunks_mut(LANES).enumerate();
        blocks.with_min_len(CHUNK / LANES).for_each_init(
            Columns::<Triangle, TRIANGLE_WORDS>::new,
            |block, (i, corners)| {
                lanes::compute(i * LANES, source, (), block, corners);
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_triangle() {
        let [a, b, c] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3::from);
        let corners = Corners { cot_a: 0.0, cot_b: 2.0, cot_c: 0.5, area_a: 0.5, area_b: 0.25, area_c: 0.25 };
        assert_eq!(corners_of(a, b, c), corners);
    }

    #[test]
    fn shares_add_up_to_the_area() {
        let [a, b] = [Vec3::ZERO, Vec3::X * 2.0];
        // Acute, obtuse at c, obtuse at a.
        for (c, area, of_c) in
            [([1.0, 2.0, 0.0], 2.0, 0.625), ([1.0, 0.5, 0.0], 0.5, 0.25), ([-1.0, 1.0, 0.0], 1.0, 0.25)]
        {
            let Corners { area_a, area_b, area_c, .. } = corners_of(a, b, Vec3::from(c));
            assert_eq!((area_a + area_b + area_c, area_c), (area, of_c), "{c:?}");
        }
    }

    #[test]
    fn lines_and_points_have_no_angles() {
        let [a, b] = [Vec3::ZERO, Vec3::X];
        for c in [a, b, Vec3::X * 0.5, Vec3::new(0.5, 9e-7, 0.0)] {
            assert_eq!(corners_of(a, b, c), Corners::default(), "{c}");
        }
        assert!(corners_of(a, b, Vec3::new(0.5, 2e-6, 0.0)).area_c > 0.0);
    }
}
