//! How far every vertex lies from what its removal would leave: the plane or the line of its neighborhood. Twin:
//! `shaders/removal_costs.wgsl`, line for line.
//!
//! # Reference
//! \[SZL92\] section 3: the distance to the average plane of a simple vertex, to the line between the two neighbors along a
//! border or a feature; vertices where features meet or end stay. Departs: how far those that went before are off is
//! added, and such corners may count as simple.

use rayon::prelude::*;

use super::rows::{BORDER, FLAGS, Face, HUB, LOCKED, Normal, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST, LEAST_FACTOR, LEAST_SUM, add, add3, cross3, divide, dot3, flush, flush3, mul, root, scale3, sub3,
};

/// The key of a vertex that stays; those of all others are less.
pub const STAYS: u32 = 0x7f80_0000;
/// Greatest distance, so that its bits are less than [`STAYS`].
pub const FARTHEST: f32 = 1e37;
/// The normals of a star whose sum is shorter than this share of theirs cancel out: it has no average plane.
pub const FOLDED: f32 = 1e-3;

/// One invocation a vertex.
pub struct RemovalCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// F distances of what each face stands for.
    pub deviations: &'a Buffer<f32>,
    /// V.
    pub vertex_count: u32,
    /// Edges whose faces' normals have a lesser cosine are features; none with −2.
    pub crease_cos: f32,
    /// Whether vertices where features meet or end stay; else they are as those without features.
    pub keeps_corners: bool,
    /// Writes V keys: the distances' bits, which order as the distances do, or [`STAYS`].
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        crease_cos: f32,
        keeps_corners: u32,
    }
}

/// Whether the edge between two faces is a feature.
#[inline(always)]
pub fn is_crease(first: Normal, second: Normal, crease_cos: f32) -> bool {
    dot3(first.weighted(), second.weighted()) < mul(crease_cos, mul(first.root, second.root))
}

/// How often the edges at a vertex are borders or features, and the far ends of the first two of each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Lines {
    borders: u32,
    creases: u32,
    border_ends: [u32; 2],
    crease_ends: [u32; 2],
}

/// With one more; the third and later ones are only counted.
#[inline(always)]
fn with_end(ends: [u32; 2], count: u32, end: u32) -> [u32; 2] {
    [if count == 0 { end } else { ends[0] }, if count == 1 { end } else { ends[1] }]
}

fn lines_at(vertex: u32, crease_cos: f32, stars: &Stars<'_>, normals: &[Normal]) -> Lines {
    let mut lines = Lines::default();
    let ring = stars.ring(vertex);
    for &f in ring {
        let seen = spoke(stars.faces[f as usize], vertex);
        let mut goes_on = false;
        let mut is_entered = false;
        for &g in ring {
            let other = spoke(stars.faces[g as usize], vertex);
            if other.last == seen.next {
                goes_on = true;
                if is_crease(normals[f as usize], normals[g as usize], crease_cos) {
                    lines.crease_ends = with_end(lines.crease_ends, lines.creases, seen.next);
                    lines.creases += 1;
                }
            }
            is_entered = is_entered || other.next == seen.last;
        }
        if !goes_on {
            lines.border_ends = with_end(lines.border_ends, lines.borders, seen.next);
            lines.borders += 1;
        }
        if !is_entered {
            lines.border_ends = with_end(lines.border_ends, lines.borders, seen.last);
            lines.borders += 1;
        }
    }
    lines
}

/// The distance of `p` to the line through `a` and `b`; to the point where they are one.
#[inline(always)]
fn line_distance(p: Vec3, a: Vec3, b: Vec3) -> f32 {
    let along = flush3(sub3(b, a), LEAST_FACTOR);
    let from_a = flush3(sub3(p, a), LEAST_FACTOR);
    let length = root(dot3(along, along));
    if length == 0.0 {
        return root(dot3(from_a, from_a));
    }
    let doubled_area = flush3(cross3(from_a, along), LEAST_FACTOR);
    divide(root(dot3(doubled_area, doubled_area)), length)
}

/// The distance of a vertex to the plane of its faces: through the mean of their middles, along the mean of their normals,
/// both weighted by area.
#[inline(always)]
fn plane_distance(vertex: u32, p: Vec3, stars: &Stars<'_>, normals: &[Normal]) -> f32 {
    let mut normal = Vec3::ZERO;
    let mut offset = Vec3::ZERO;
    let mut weight = 0.0;
    for &f in stars.ring(vertex) {
        let seen = spoke(stars.faces[f as usize], vertex);
        let row = normals[f as usize];
        let area = mul(row.root, row.root);
        let next = sub3(stars.positions[seen.next as usize].xyz(), p);
        let last = sub3(stars.positions[seen.last as usize].xyz(), p);
        normal = add3(normal, row.doubled_area());
        offset = add3(offset, scale3(add3(next, last), area));
        weight = add(weight, area);
    }
    weight = flush(weight, LEAST_SUM);
    // Three times the way from the vertex to the mean of the middles.
    offset = flush3(scale3(flush3(offset, LEAST_FACTOR), divide(1.0, weight)), LEAST_FACTOR);
    normal = flush3(normal, LEAST_FACTOR);
    let length = root(dot3(normal, normal));
    if length <= mul(FOLDED, weight) {
        return divide(root(dot3(offset, offset)), 3.0);
    }
    divide(dot3(normal, offset).abs(), mul(3.0, length))
}

/// The greatest distance of what the faces around a vertex stand for.
#[inline(always)]
fn deviation_at(vertex: u32, stars: &Stars<'_>, deviations: &[f32]) -> f32 {
    let mut greatest = 0.0_f32;
    for &f in stars.ring(vertex) {
        greatest = greatest.max(deviations[f as usize]);
    }
    greatest
}

#[inline(always)]
fn removal_key(vertex: u32, params: Params, stars: &Stars<'_>, normals: &[Normal], deviations: &[f32]) -> u32 {
    let row = stars.positions[vertex as usize];
    if (row.flags & (LOCKED | HUB)) != 0 {
        return STAYS;
    }
    let p = row.xyz();
    let at = |v: u32| stars.positions[v as usize].xyz();
    let on_border = (row.flags & BORDER) != 0;
    let mut lines = Lines::default();
    if on_border || params.crease_cos >= -1.0 {
        lines = lines_at(vertex, params.crease_cos, stars, normals);
    }
    let is_corner = lines.creases != 0 && (on_border || lines.creases != 2);
    if is_corner && params.keeps_corners != 0 {
        return STAYS;
    }
    let distance;
    if on_border {
        if lines.borders != 2 {
            return STAYS;
        }
        distance = line_distance(p, at(lines.border_ends[0]), at(lines.border_ends[1]));
    } else if lines.creases == 2 {
        distance = line_distance(p, at(lines.crease_ends[0]), at(lines.crease_ends[1]));
    } else {
        distance = plane_distance(vertex, p, stars, normals);
    }
    flush(add(distance, deviation_at(vertex, stars, deviations)).min(FARTHEST), LEAST).to_bits()
}

impl Kernel for RemovalCosts<'_> {
    const NAME: &'static str = "removal_costs";
    const SOURCE: &'static str = include_str!("../../shaders/removal_costs.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params { crease_cos: self.crease_cos, keeps_corners: u32::from(self.keeps_corners) }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("deviations", Access::Read, self.deviations),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let (normals, deviations, params) = (self.normals.host(), self.deviations.host(), self.params());
        let keys = self.keys.host_mut()[..self.vertex_count as usize].par_iter_mut().enumerate();
        keys.with_min_len(CHUNK).for_each(|(vertex, key)| {
            *key = removal_key(vertex as u32, params, &stars, normals, deviations);
        });
    }
}

/// The flags, and what else the shader names.
const CONSTANTS: &[(&str, Constant)] = &[
    FLAGS[0],
    FLAGS[1],
    FLAGS[2],
    ("STAYS", Constant::U32(STAYS)),
    ("FARTHEST", Constant::F32(FARTHEST)),
    ("FOLDED", Constant::F32(FOLDED)),
];
