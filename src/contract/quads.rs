//! Where the faces of a star stand, four of them side by side: what a contraction's cost and its filters are computed from.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f64x4};

use crate::math::DVec3;
use crate::math::wide::{WIDE, WideRows, WideVec3};

use super::patch::Patch;
use super::star::StarFace;

/// Four faces, about the pair's midpoint. Lanes past the last face have a normal of zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quad {
    /// The corners after the end.
    pub points: [WideRows; 2],
    /// (p1−p0)×(p2−p0): twice the area, along the normal.
    pub normals: WideRows,
    /// Where the end stands, in half pairs: −1 at the first, 1 at the second.
    pub sides: [f64; WIDE],
}

/// Faces of which each was told from one of two ends, which stand half a pair before and behind the middle.
#[derive(Debug, Clone)]
pub struct Quads {
    /// The instructions that the processor has.
    pub level: Level,
    /// Longer than there are faces, where more were needed before.
    rows: Vec<Quad>,
    len: usize,
}

impl Default for Quads {
    fn default() -> Self {
        Self { level: Level::new(), rows: Vec::new(), len: 0 }
    }
}

impl Quads {
    /// The faces, the last lanes of which may be none.
    #[inline(always)]
    pub fn rows(&self) -> &[Quad] {
        &self.rows[..self.len.div_ceil(WIDE)]
    }

    /// One of the corners after the end of a face.
    #[inline(always)]
    pub fn point(&self, face: usize, corner: usize) -> DVec3 {
        self.rows[face / WIDE].points[corner].get(face % WIDE)
    }

    /// The normal of a face, as long as twice its area.
    #[inline(always)]
    pub fn normal(&self, face: usize) -> DVec3 {
        self.rows[face / WIDE].normals.get(face % WIDE)
    }

    /// Finds where `faces` stand about `middle`, from which the first end is at `-h`; those of `second` were told from the
    /// second, at `h`.
    pub fn locate(&mut self, faces: &[StarFace], second: Range<usize>, h: DVec3, middle: DVec3, patch: &Patch<'_>) {
        self.len = faces.len();
        let count = faces.len().div_ceil(WIDE);
        if self.rows.len() < count {
            self.rows.resize(count, Quad::default());
        }
        let rows = &mut self.rows[..count];
        dispatch!(self.level, simd => locate(simd, rows, faces, second, h, middle, patch));
    }

    /// These points and sides, whose normals follow.
    #[cfg(test)]
    pub fn of(faces: &[([DVec3; 2], f64)], h: DVec3) -> Self {
        let mut quads = Self { len: faces.len(), ..Self::default() };
        quads.rows.resize(faces.len().div_ceil(WIDE), Quad::default());
        for (number, &(points, side)) in faces.iter().enumerate() {
            let (quad, lane) = (&mut quads.rows[number / WIDE], number % WIDE);
            quad.points.iter_mut().zip(points).for_each(|(rows, point)| rows.set(lane, point));
            quad.normals.set(lane, (points[0] - h * side).cross(points[1] - h * side));
            quad.sides[lane] = side;
        }
        quads
    }
}

#[inline(always)]
fn locate<S: Simd>(
    simd: S,
    quads: &mut [Quad],
    faces: &[StarFace],
    second: Range<usize>,
    h: DVec3,
    middle: DVec3,
    patch: &Patch<'_>,
) {
    let lanes: f64x4<S> = [0.0, 1.0, 2.0, 3.0].simd_into(simd);
    let splat = |number: f64| f64x4::splat(simd, number);
    let (from, to, end) = (splat(second.start as f64), splat(second.end as f64), splat(faces.len() as f64));
    let (h, middle) = (WideVec3::splat(simd, h), WideVec3::splat(simd, middle));
    let Some(last) = faces.len().checked_sub(1) else { return };
    for (quad, first) in quads.iter_mut().zip((0..).step_by(WIDE)) {
        let number = lanes + splat(first as f64);
        let is_second = number.simd_ge(from) & number.simd_lt(to);
        let sides = is_second.select(splat(1.0), splat(-1.0));
        // Where faces end amid a quad, the last is read again, and has no area there.
        let four = [0, 1, 2, 3].map(|lane| faces[(first + lane).min(last)].others);
        let next = positions(simd, four.map(|others| others[0]), patch);
        let other = positions(simd, four.map(|others| others[1]), patch);
        let [x, y, z] = [0, 1, 2].map(|axis| simd.widen_f32x8(next[axis].combine(other[axis])));
        let p1 = WideVec3 { x: x.0, y: y.0, z: z.0 } - middle;
        let p2 = WideVec3 { x: x.1, y: y.1, z: z.1 } - middle;
        let at = h.scaled(sides);
        let normals = (p1 - at).cross(p2 - at);
        let is_face = number.simd_lt(end).select(splat(1.0), splat(0.0));
        *quad =
            Quad { points: [p1.store(), p2.store()], normals: normals.scaled(is_face).store(), sides: sides.into() };
    }
}

/// The coordinates of four vertices along each axis.
#[inline(always)]
fn positions<S: Simd>(simd: S, vertices: [u32; WIDE], patch: &Patch<'_>) -> [f32x4<S>; 3] {
    let row = |vertex: u32| -> f32x4<S> { bytemuck::cast::<_, [f32; 4]>(patch.position(vertex)).simd_into(simd) };
    let [a, b, c, d] = [row(vertices[0]), row(vertices[1]), row(vertices[2]), row(vertices[3])];
    let (ac, bd) = (a.zip_low(c), b.zip_low(d));
    [ac.zip_low(bd), ac.zip_high(bd), a.zip_high(c).zip_low(b.zip_high(d))]
}
