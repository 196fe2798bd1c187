//! What turning an edge to the other diagonal of its two faces gains. Twin: `shaders/flip_gains.wgsl`, line for line.
//!
//! ```text
//!       k              k         u, v   the ends, of which the edge is taken from
//!      / \            /|\        k, l   the corners across, which the new edge joins
//!     / f \          / | \
//!    u-----v   →    u a|b v
//!     \ g /          \ | /
//!      \ /            \|/
//!       l              l
//! ```
//!
//! # Reference
//! \[HDD93\] section 4: edge swaps by the distance of samples. \[Wu12\]: when an edge may be flipped.

use rayon::prelude::*;

use super::nearest_point::{nearest_weights, point_at};
use super::pairs::{NO_FACE, half_edge_corners};
use super::rows::{Edge, Face, Position};
use super::split::CHUNK;
use super::stars::{Stars, faces_with, has, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, LEAST_SUM, add, add3, cross3, divide, dot3, flush, flush3, mul, root, sub, sub3,
};

/// The gain is that of the weighted squared distances of samples to the faces.
pub const BY_DISTANCE: u32 = 0;
/// The gain is that of lengths of edges times one less the cosine between their faces.
pub const BY_BEND: u32 = 1;
/// The gain is by how much the opposite angles exceed π, where both faces are flat to each other.
pub const BY_SHAPE: u32 = 2;

/// Least cosine between the new normals and the mean of the old ones: as of contractions.
pub const LEAST_COS: f32 = 0.2;
/// Least area of a new face, doubled, over the sum of the squares of its sides: about its height over its length.
pub const LEAST_HEIGHT: f32 = 1e-3;
/// Least gain as a share of what there was: rounding gains less, and would turn edges to and fro.
pub const LEAST_SHARE: f32 = 1e-3;
/// Least gains, in the normalized frame: on flats rounding gains less.
pub const LEAST_GAIN: f32 = 1e-10;
/// The same of [`BY_BEND`].
pub const LEAST_BEND: f32 = 1e-5;
/// Least cosine between faces that are flat to each other.
pub const FLAT_COS: f32 = 0.996;

/// One invocation an edge.
pub struct FlipGains<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// P edges.
    pub pairs: &'a Buffer<Edge>,
    /// P.
    pub pair_count: u32,
    /// F + 1 starts into `samples`.
    pub sample_starts: &'a Buffer<u32>,
    /// Points nearest to every face, with their weights.
    pub samples: &'a Buffer<[f32; 4]>,
    /// What counts: one of the constants above.
    pub objective: u32,
    /// Writes P gains: zero where there is none, or the flip is illegal.
    pub gains: &'a mut Buffer<f32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        objective: u32,
    }
}

/// (b − a)×(c − a).
#[inline(always)]
fn doubled_area_of(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR)
}

#[inline(always)]
fn length_sq(a: Vec3) -> f32 {
    let flushed = flush3(a, LEAST_FACTOR);
    dot3(flushed, flushed)
}

/// Whether a new face with this normal keeps its side and is no sliver.
#[inline(always)]
fn is_sound(n: Vec3, old: Vec3, a: Vec3, b: Vec3, c: Vec3) -> bool {
    let length = root(dot3(n, n));
    let keeps_side = dot3(n, old) > mul(LEAST_COS, mul(length, root(dot3(old, old))));
    let sides_sq = add(add(length_sq(sub3(b, a)), length_sq(sub3(c, b))), length_sq(sub3(a, c)));
    keeps_side && length > mul(LEAST_HEIGHT, sides_sq)
}

/// The squared distance of `p` to a triangle.
#[inline(always)]
fn distance_sq(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let (from_a, from_b, from_c) = (sub3(a, p), sub3(b, p), sub3(c, p));
    length_sq(point_at(nearest_weights(from_a, from_b, from_c), from_a, from_b, from_c))
}

/// The corners of an edge's two faces: the ends, the one across, and that on the other side.
#[derive(Debug, Clone, Copy)]
struct Diamond {
    u: Vec3,
    v: Vec3,
    k: Vec3,
    l: Vec3,
}

/// What the samples of a face are off, before and after.
#[derive(Debug, Clone, Copy)]
struct Change {
    before: f32,
    after: f32,
}

/// Samples and where those of every face start.
#[derive(Debug, Clone, Copy)]
struct Sampled<'a> {
    sample_starts: &'a [u32],
    samples: &'a [[f32; 4]],
}

#[inline(always)]
fn with_samples(before: Change, f: u32, at: Diamond, sampled: Sampled<'_>) -> Change {
    let mut change = before;
    for i in sampled.sample_starts[f as usize]..sampled.sample_starts[f as usize + 1] {
        let [x, y, z, weight] = sampled.samples[i as usize];
        let p = Vec3::new(x, y, z);
        let old = distance_sq(p, at.u, at.v, at.k).min(distance_sq(p, at.v, at.u, at.l));
        let new = distance_sq(p, at.u, at.l, at.k).min(distance_sq(p, at.l, at.v, at.k));
        change.before = add(change.before, flush(mul(weight, flush(old, LEAST_FACTOR)), LEAST_SUM));
        change.after = add(change.after, flush(mul(weight, flush(new, LEAST_FACTOR)), LEAST_SUM));
    }
    change
}

/// The length of an edge times one less the cosine between its faces.
#[inline(always)]
fn bend(first: Vec3, second: Vec3, along: Vec3) -> f32 {
    let lengths = mul(root(dot3(first, first)), root(dot3(second, second)));
    mul(
        root(length_sq(along)),
        sub(1.0, divide(flush(dot3(first, second), LEAST_FACTOR), flush(lengths, LEAST_FACTOR))),
    )
}

/// With the edge between two vertices, beyond which a face may lie other than `own`.
#[inline(always)]
fn with_side(before: Change, own: u32, from: u32, to: u32, old: Vec3, new: Vec3, stars: &Stars<'_>) -> Change {
    let mut change = before;
    let at = |v: u32| stars.positions[v as usize].xyz();
    for &f in stars.ring(from) {
        let face = stars.faces[f as usize];
        if f != own && has(face, to) {
            let normal = doubled_area_of(at(face.a), at(face.b), at(face.c));
            let along = sub3(at(to), at(from));
            change.before = add(change.before, bend(old, normal, along));
            change.after = add(change.after, bend(new, normal, along));
        }
    }
    change
}

/// The cotangent of the angle at a corner, from the normal of the face.
#[inline(always)]
fn cotangent(tip: Vec3, a: Vec3, b: Vec3, normal: Vec3) -> f32 {
    divide(flush(dot3(sub3(a, tip), sub3(b, tip)), LEAST_FACTOR), root(dot3(normal, normal)))
}

#[inline(always)]
fn flip_gain(pair: Edge, objective: u32, stars: &Stars<'_>, sampled: Sampled<'_>) -> f32 {
    if pair.across == NO_FACE {
        return 0.0;
    }
    let f = pair.half_edge / 3;
    let g = pair.across;
    let [u, v, k] = half_edge_corners(pair.half_edge, stars.faces);
    let seen = spoke(stars.faces[g as usize], u);
    let l = seen.next;
    if seen.last != v || k == l || faces_with(l, k, stars) > 0 {
        return 0.0;
    }
    let position = |corner: u32| stars.positions[corner as usize].xyz();
    let at = Diamond { u: position(u), v: position(v), k: position(k), l: position(l) };
    let normal_f = doubled_area_of(at.u, at.v, at.k);
    let normal_g = doubled_area_of(at.v, at.u, at.l);
    let normal_a = doubled_area_of(at.u, at.l, at.k);
    let normal_b = doubled_area_of(at.l, at.v, at.k);
    let old = flush3(add3(normal_f, normal_g), LEAST_FACTOR);
    if !is_sound(normal_a, old, at.u, at.l, at.k) || !is_sound(normal_b, old, at.l, at.v, at.k) {
        return 0.0;
    }
    if objective == BY_SHAPE {
        let lengths = mul(root(dot3(normal_f, normal_f)), root(dot3(normal_g, normal_g)));
        if dot3(normal_f, normal_g) < mul(FLAT_COS, lengths) {
            return 0.0;
        }
        let cotangents = add(cotangent(at.k, at.u, at.v, normal_f), cotangent(at.l, at.u, at.v, normal_g));
        return if cotangents < -LEAST_SHARE { -cotangents } else { 0.0 };
    }
    let mut change = Change { before: 0.0, after: 0.0 };
    if objective == BY_BEND {
        change.before = bend(normal_f, normal_g, sub3(at.v, at.u));
        change.after = bend(normal_a, normal_b, sub3(at.l, at.k));
        change = with_side(change, f, v, k, normal_f, normal_b, stars);
        change = with_side(change, f, k, u, normal_f, normal_a, stars);
        change = with_side(change, g, u, l, normal_g, normal_a, stars);
        change = with_side(change, g, l, v, normal_g, normal_b, stars);
    } else {
        change = with_samples(change, f, at, sampled);
        change = with_samples(change, g, at, sampled);
    }
    let least = if objective == BY_BEND { LEAST_BEND } else { LEAST_GAIN };
    let gain = flush(sub(change.before, change.after), LEAST_SUM);
    if gain > mul(LEAST_SHARE, change.before) && gain > least { gain } else { 0.0 }
}

impl Kernel for FlipGains<'_> {
    const NAME: &'static str = "flip_gains";
    const SOURCE: &'static str = include_str!("../../shaders/flip_gains.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/half_edges.wgsl"),
        include_str!("../../shaders/shared/stars.wgsl"),
        include_str!("../../shaders/shared/nearest_point.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("NO_FACE", Constant::U32(NO_FACE)),
        ("BY_BEND", Constant::U32(BY_BEND)),
        ("BY_SHAPE", Constant::U32(BY_SHAPE)),
        ("LEAST_COS", Constant::F32(LEAST_COS)),
        ("LEAST_HEIGHT", Constant::F32(LEAST_HEIGHT)),
        ("LEAST_SHARE", Constant::F32(LEAST_SHARE)),
        ("LEAST_GAIN", Constant::F32(LEAST_GAIN)),
        ("LEAST_BEND", Constant::F32(LEAST_BEND)),
        ("FLAT_COS", Constant::F32(FLAT_COS)),
    ];

    fn params(&self) -> Params {
        Params { objective: self.objective }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("pairs", Access::Read, self.pairs),
            Binding::new("sample_starts", Access::Read, self.sample_starts),
            Binding::new("samples", Access::Read, self.samples),
            Binding::new("gains", Access::Write, self.gains),
        ]
    }

    fn invocations(&self) -> u32 {
        self.pair_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let sampled = Sampled { sample_starts: self.sample_starts.host(), samples: self.samples.host() };
        let (pairs, objective) = (&self.pairs.host()[..self.pair_count as usize], self.objective);
        let gains = self.gains.host_mut()[..pairs.len()].par_iter_mut().zip(pairs);
        gains.with_min_len(CHUNK).for_each(|(gain, &pair)| {
            *gain = flip_gain(pair, objective, &stars, sampled);
        });
    }
}
