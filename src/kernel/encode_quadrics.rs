//! Average quadrics as codes, those of two vertices together. Twin: `shaders/encode_quadrics.wgsl`, line for line.
//!
//! # Reference
//! \[Yu14\]: Q' = Σ p'p'ᵀ/`MaxNum` with p' = p/√max(1, `Maxd2`) and the planes p = (n, d) with unit normals, so that every
//! entry is in −1 ..= 1. Departs: found from the quadric about the vertex, moved to the origin; planes may have weights, and
//! their lists are not padded to one length, for planes of zeros add nothing.

use rayon::prelude::*;

use super::format_frame::{FormatFrame, in_format};
use super::plane_quadric::moved;
use super::quadric_format::{CONSTANTS, PAIR_WORDS, code_count, code_entry, code_width, divisor, to_code};
use super::rows::{PlaneQuadric, Position, QuadricBound};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{LEAST_SUM, divide, flush, mul, scale3};

/// One invocation for two vertices.
pub struct EncodeQuadrics<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// One row: the greatest of all.
    pub bound: &'a Buffer<QuadricBound>,
    /// V.
    pub vertex_count: u32,
    /// The coordinates of the stored quadrics.
    pub frame: FormatFrame,
    /// One of the formats of [`super::quadric_format`].
    pub format: u32,
    /// Writes the codes of V quadrics one after the other, of an even number of them.
    pub words: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        origin_x: f32,
        origin_y: f32,
        origin_z: f32,
        unit: f32,
        format: u32,
        vertex_count: u32,
    }
}

/// Words that the codes of so many quadrics take.
pub fn word_count(format: u32, vertices: usize) -> usize {
    vertices.div_ceil(2) * (2 * code_count(format) * code_width(format) / 32) as usize
}

/// The ten entries of an average quadric.
#[inline(always)]
pub fn averaged(q: PlaneQuadric, p: Vec3, bound: QuadricBound, frame: FormatFrame, format: u32) -> [f32; 10] {
    let by = divisor(format, bound);
    let x = in_format(p, frame);
    let unit_sq = mul(frame.unit, frame.unit);
    let linear = scale3(q.linear(), frame.unit);
    let own = PlaneQuadric { bx: linear.x, by: linear.y, bz: linear.z, c: mul(q.c, unit_sq), ..q };
    let m = moved(own, scale3(x, -1.0));
    let part = |x: f32| divide(flush(x, LEAST_SUM), by).clamp(-1.0, 1.0);
    [
        part(m.a.xx),
        part(m.a.xy),
        part(m.a.xz),
        part(m.b.x),
        part(m.a.yy),
        part(m.a.yz),
        part(m.b.y),
        part(m.a.zz),
        part(m.b.z),
        part(m.c),
    ]
}

/// The words of two quadrics, whose entries these are; zeros for one that is not there.
#[inline(always)]
fn encoded(pair: [Option<[f32; 10]>; 2], format: u32) -> [u32; PAIR_WORDS as usize] {
    let codes = code_count(format);
    let width = code_width(format);
    let per_word = 32 / width;
    let mut words = [0; PAIR_WORDS as usize];
    for (side, entries) in (0..).zip(pair) {
        let Some(entries) = entries else { continue };
        for k in 0..codes {
            let entry = code_entry(format, k);
            let at = side * codes + k;
            words[(at / per_word) as usize] |=
                to_code(format, entry, entries[entry as usize]) << (width * (at % per_word));
        }
    }
    words
}

impl Kernel for EncodeQuadrics<'_> {
    const NAME: &'static str = "encode_quadrics";
    const SOURCE: &'static str = include_str!("../../shaders/encode_quadrics.wgsl");
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
        Params { origin_x, origin_y, origin_z, unit, format: self.format, vertex_count: self.vertex_count }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("bound", Access::Read, self.bound),
            Binding::new("words", Access::Write, self.words),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count.div_ceil(2)
    }

    fn run_cpu(&mut self) {
        let (frame, format) = (self.frame, self.format);
        let Some(&bound) = self.bound.host().first() else { return };
        let vertices = ..self.vertex_count as usize;
        let rows = self.quadrics.host()[vertices].par_chunks(2).zip(self.positions.host()[vertices].par_chunks(2));
        let words = self.words.host_mut().par_chunks_mut(word_count(format, 2));
        rows.zip(words).with_min_len(CHUNK).for_each(|((quadrics, positions), words)| {
            let entries = |side: usize| {
                let quadric = quadrics.get(side)?;
                Some(averaged(*quadric, positions[side].xyz(), bound, frame, format))
            };
            words.copy_from_slice(&encoded([entries(0), entries(1)], format)[..words.len()]);
        });
    }
}
