//! Quadrics about their vertices from the codes of average ones. Twin: `shaders/decode_quadrics.wgsl`, line for line.
//!
//! What was rounded off makes them no sums of squares any more: a value may be below zero, which costs take for zero.

use rayon::prelude::*;

use super::encode_quadrics::word_count;
use super::format_frame::{FormatFrame, in_format};
use super::plane_quadric::moved;
use super::quadric_format::{CONSTANTS, code_count, code_entry, code_width, divisor, from_code, is_local};
use super::rows::{PlaneQuadric, Position, QuadricBound};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{LEAST_SUM, Sym3, divide, flush, flush3, mul, trace};

/// One invocation a vertex.
pub struct DecodeQuadrics<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// What [`EncodeQuadrics`](super::encode_quadrics::EncodeQuadrics) wrote.
    pub words: &'a Buffer<u32>,
    /// One row: the greatest of all.
    pub bound: &'a Buffer<QuadricBound>,
    /// V.
    pub vertex_count: u32,
    /// The coordinates of the stored quadrics.
    pub frame: FormatFrame,
    /// One of the formats of [`super::quadric_format`].
    pub format: u32,
    /// Writes V quadrics.
    pub quadrics: &'a mut Buffer<PlaneQuadric>,
}

params! {
    /// The uniform block.
    pub struct Params {
        origin_x: f32,
        origin_y: f32,
        origin_z: f32,
        unit: f32,
        format: u32,
    }
}

/// The ten entries of the average quadric of a vertex; those that the format leaves out are zero.
#[inline(always)]
pub fn entries_of(vertex: u32, words: &[u32], format: u32) -> [f32; 10] {
    let codes = code_count(format);
    let width = code_width(format);
    let per_word = 32 / width;
    let mask = u32::MAX >> (32 - width);
    let first = vertex / 2 * (2 * codes / per_word);
    let mut entries = [0.0; 10];
    for k in 0..codes {
        let entry = code_entry(format, k);
        let at = vertex % 2 * codes + k;
        let code = (words[(first + at / per_word) as usize] >> (width * (at % per_word))) & mask;
        entries[entry as usize] = from_code(format, entry, code);
    }
    entries
}

#[inline(always)]
fn decoded(entries: [f32; 10], p: Vec3, bound: QuadricBound, frame: FormatFrame, format: u32) -> PlaneQuadric {
    let by = divisor(format, bound);
    let x = in_format(p, frame);
    let whole = |x: f32| flush(mul(x, by), LEAST_SUM);
    let a = Sym3 {
        xx: whole(entries[0]),
        xy: whole(entries[1]),
        xz: whole(entries[2]),
        yy: whole(entries[4]),
        yz: whole(entries[5]),
        zz: whole(entries[7]),
    };
    // The trace of unit normals' outer products: the weight of the planes.
    let weight = trace(a).max(0.0);
    let own = PlaneQuadric { xx: a.xx, xy: a.xy, xz: a.xz, yy: a.yy, yz: a.yz, zz: a.zz, weight, ..Default::default() };
    if is_local(format) {
        return own;
    }
    let b = Vec3::new(whole(entries[3]), whole(entries[6]), whole(entries[8]));
    let m = moved(PlaneQuadric { bx: b.x, by: b.y, bz: b.z, c: whole(entries[9]), ..own }, x);
    let linear = flush3(m.b, LEAST_SUM);
    let c = divide(divide(flush(m.c, LEAST_SUM), frame.unit), frame.unit);
    PlaneQuadric {
        bx: divide(linear.x, frame.unit),
        by: divide(linear.y, frame.unit),
        bz: divide(linear.z, frame.unit),
        c,
        ..own
    }
}

impl Kernel for DecodeQuadrics<'_> {
    const NAME: &'static str = "decode_quadrics";
    const SOURCE: &'static str = include_str!("../../shaders/decode_quadrics.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/format_frame.wgsl"),
        include_str!("../../shaders/shared/plane_quadric.wgsl"),
        include_str!("../../shaders/shared/quadric_format.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        let FormatFrame { origin_x, origin_y, origin_z, unit } = self.frame;
        Params { origin_x, origin_y, origin_z, unit, format: self.format }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("words", Access::Read, self.words),
            Binding::new("bound", Access::Read, self.bound),
            Binding::new("quadrics", Access::Write, self.quadrics),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let (frame, format) = (self.frame, self.format);
        let Some(&bound) = self.bound.host().first() else { return };
        let words = &self.words.host()[..word_count(format, self.vertex_count as usize)];
        let rows = self.quadrics.host_mut().par_iter_mut().zip(self.positions.host()).enumerate();
        rows.take(self.vertex_count as usize).with_min_len(CHUNK).for_each(|(vertex, (quadric, position))| {
            *quadric = decoded(entries_of(vertex as u32, words, format), position.xyz(), bound, frame, format);
        });
    }
}
