//! The cotangent at every corner of every face, and its area. Twin: `shaders/face_cotangents.wgsl`, line for line.
//!
//! Once a face instead of once for each corner: what the curvature of its three vertices is made of.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::rows::{Cotangents, Face, Position};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, cross3, divide, dot3, flush, flush3, mul, root, sub3};
use crate::math::lanes::{self, Columns, LANES, Lane};

/// A face whose height is below this share of its longest edge counts as a line: no angles, no area. Its cotangents would
/// be rounding noise of up to the inverse.
pub const NEEDLE: f32 = 1e-6;

/// One invocation a face.
pub struct FaceCotangents<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes F rows; zeros for a face without area.
    pub cotangents: &'a mut Buffer<Cotangents>,
}

/// The corners of a face.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct Corners {
    a: Vec3,
    b: Vec3,
    c: Vec3,
}

const CORNER_WORDS: usize = size_of::<Corners>() / 4;

#[inline(always)]
fn cotangents(a: Vec3, b: Vec3, c: Vec3) -> Cotangents {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let bc = flush3(sub3(c, b), LEAST_FACTOR);
    let n = flush3(cross3(ab, ac), LEAST_FACTOR);
    let doubled = root(dot3(n, n));
    let longest_sq = dot3(ab, ab).max(dot3(ac, ac).max(dot3(bc, bc)));
    if doubled <= mul(NEEDLE, longest_sq) {
        return Cotangents::default();
    }
    let inverse = divide(1.0, doubled);
    Cotangents {
        a: flush(mul(dot3(ab, ac), inverse), LEAST_FACTOR),
        b: flush(mul(-dot3(ab, bc), inverse), LEAST_FACTOR),
        c: flush(mul(dot3(ac, bc), inverse), LEAST_FACTOR),
        area: mul(0.5, doubled),
    }
}

impl Lane for Corners {
    type Source<'a> = (&'a [Position], &'a [Face]);
    type Params = ();
    type Output = Cotangents;

    #[inline(always)]
    fn load(index: usize, (positions, faces): Self::Source<'_>) -> Self {
        let [a, b, c] = faces[index].corners().map(|corner| positions[corner as usize].xyz());
        Self { a, b, c }
    }

    #[inline(always)]
    fn compute(self, (): ()) -> Cotangents {
        cotangents(self.a, self.b, self.c)
    }
}

impl Kernel for FaceCotangents<'_> {
    const NAME: &'static str = "face_cotangents";
    const SOURCE: &'static str = include_str!("../../shaders/face_cotangents.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("NEEDLE", Constant::F32(NEEDLE))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("cotangents", Access::Write, self.cotangents),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let source = (self.positions.host(), self.faces.host());
        let blocks = self.cotangents.host_mut()[..self.face_count as usize].par_chunks_mut(LANES).enumerate();
        blocks.with_min_len(CHUNK / LANES).for_each_init(Columns::<Corners, CORNER_WORDS>::new, |block, (i, rows)| {
            lanes::compute(i * LANES, source, (), block, rows);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_triangle() {
        let [a, b, c] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3::from);
        assert_eq!(cotangents(a, b, c), Cotangents { a: 0.0, b: 2.0, c: 0.5, area: 1.0 });
    }

    #[test]
    fn lines_and_points_have_no_angles() {
        let [a, b] = [Vec3::ZERO, Vec3::X];
        for c in [a, b, Vec3::X * 0.5, Vec3::new(0.5, 9e-7, 0.0)] {
            assert_eq!(cotangents(a, b, c), Cotangents::default(), "{c}");
        }
        assert!(cotangents(a, b, Vec3::new(0.5, 2e-6, 0.0)).area > 0.0);
    }
}
