//! The nearest triangle of every sample, in single precision. Twin: `shaders/sample_distances.wgsl`, line for line.
//!
//! What it finds is a proposal: the host looks again in double precision and starts from there. So a sliver whose regions
//! cannot be told apart, or a tree that takes more than [`MOST_VISITS`], costs time and no accuracy.

use rayon::prelude::*;

use super::rows::{Face, Position, TreeNode};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, divide, dot3, flush, flush3, mul, scale3, sub, sub3};

/// Nodes that may wait: as many as the tree has levels.
pub const STACK: u32 = 64;

/// Nodes looked at for one sample. With their triangles and what waits, it stays below the 65,535 turns that some
/// software adapters give the loops of an invocation.
pub const MOST_VISITS: u32 = 10_000;

/// No node.
const NO_NODE: u32 = u32::MAX;

/// Farther than anything within −1 .. 1.
const FARTHEST: f32 = 1e30;

/// Samples a thread takes at a time.
const CHUNK: usize = 1 << 10;

/// One invocation a sample. All coordinates lie within −1 .. 1.
pub struct SampleDistances<'a> {
    /// S samples.
    pub samples: &'a Buffer<Position>,
    /// S.
    pub sample_count: u32,
    /// The tree, its root first, its leaves of up to four triangles.
    pub nodes: &'a Buffer<TreeNode>,
    /// The triangles, leaf by leaf.
    pub faces: &'a Buffer<Face>,
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// Writes S: the triangle, and the bits of its squared distance.
    pub nearest: &'a mut Buffer<[u32; 2]>,
}

#[inline(always)]
fn box_distance_sq(p: Vec3, node: TreeNode) -> f32 {
    let below = sub3(Vec3::new(node.low_x, node.low_y, node.low_z), p);
    let above = sub3(p, Vec3::new(node.high_x, node.high_y, node.high_z));
    let outside = flush3(below.max(above).max(Vec3::ZERO), LEAST_FACTOR);
    dot3(outside, outside)
}

/// The regions are told apart by products of dots: below this a dot is zero, for their products must not underflow.
#[inline(always)]
fn flushed_dot(a: Vec3, b: Vec3) -> f32 {
    flush(dot3(a, b), LEAST_FACTOR)
}

/// Where the closest point is, in shares of the edges e and f from the first corner, by the region of the point.
#[inline(always)]
fn nearest_shares(e: Vec3, f: Vec3, from_a: Vec3) -> [f32; 2] {
    let e_a = flushed_dot(e, from_a);
    let f_a = flushed_dot(f, from_a);
    if e_a <= 0.0 && f_a <= 0.0 {
        return [0.0, 0.0];
    }
    let from_b = flush3(sub3(from_a, e), LEAST_FACTOR);
    let e_b = flushed_dot(e, from_b);
    let f_b = flushed_dot(f, from_b);
    if e_b >= 0.0 && f_b <= e_b {
        return [1.0, 0.0];
    }
    let from_c = flush3(sub3(from_a, f), LEAST_FACTOR);
    let e_c = flushed_dot(e, from_c);
    let f_c = flushed_dot(f, from_c);
    if f_c >= 0.0 && e_c <= f_c {
        return [0.0, 1.0];
    }
    let at_c = sub(mul(e_a, f_b), mul(e_b, f_a));
    if at_c <= 0.0 && e_a >= 0.0 && e_b <= 0.0 {
        return [divide(e_a, sub(e_a, e_b)), 0.0];
    }
    let at_b = sub(mul(e_c, f_a), mul(e_a, f_c));
    if at_b <= 0.0 && f_a >= 0.0 && f_c <= 0.0 {
        return [0.0, divide(f_a, sub(f_a, f_c))];
    }
    let at_a = sub(mul(e_b, f_c), mul(e_c, f_b));
    let toward_c = sub(f_b, e_b);
    let toward_b = sub(e_c, f_c);
    if at_a <= 0.0 && toward_c >= 0.0 && toward_b >= 0.0 {
        let t = divide(toward_c, add(toward_c, toward_b));
        return [sub(1.0, t), t];
    }
    let total = add(add(at_a, at_b), at_c);
    [divide(at_b, total), divide(at_c, total)]
}

#[inline(always)]
fn triangle_distance_sq(p: Vec3, face: Face, positions: &[Position]) -> f32 {
    let a = positions[face.a as usize].xyz();
    let e = flush3(sub3(positions[face.b as usize].xyz(), a), LEAST_FACTOR);
    let f = flush3(sub3(positions[face.c as usize].xyz(), a), LEAST_FACTOR);
    let from_a = flush3(sub3(p, a), LEAST_FACTOR);
    let shares = nearest_shares(e, f, from_a);
    let along_e = scale3(e, flush(shares[0], LEAST_FACTOR));
    let along_f = scale3(f, flush(shares[1], LEAST_FACTOR));
    let offset = flush3(sub3(sub3(from_a, along_e), along_f), LEAST_FACTOR);
    dot3(offset, offset)
}

/// The triangle and the bits of its squared distance.
fn nearest_triangle(p: Vec3, nodes: &[TreeNode], faces: &[Face], positions: &[Position]) -> [u32; 2] {
    let mut stack = [0u32; STACK as usize];
    let mut distances = [0f32; STACK as usize];
    let mut top = 0;
    let mut node = nodes[0];
    let mut nearest = 0;
    let mut least = FARTHEST;
    for _ in 0..MOST_VISITS {
        for i in node.first..node.first + node.count {
            let distance = triangle_distance_sq(p, faces[i as usize], positions);
            if distance < least {
                least = distance;
                nearest = i;
            }
        }
        let mut next = NO_NODE;
        if node.count == 0 {
            let left = node.first;
            let right = node.first + 1;
            let to_left = box_distance_sq(p, nodes[left as usize]);
            let to_right = box_distance_sq(p, nodes[right as usize]);
            let is_right = to_right < to_left;
            if to_left.max(to_right) < least && top < STACK as usize {
                stack[top] = if is_right { left } else { right };
                distances[top] = to_left.max(to_right);
                top += 1;
            }
            if to_left.min(to_right) < least {
                next = if is_right { right } else { left };
            }
        }
        while next == NO_NODE && top > 0 {
            top -= 1;
            if distances[top] < least {
                next = stack[top];
            }
        }
        if next == NO_NODE {
            break;
        }
        node = nodes[next as usize];
    }
    [nearest, least.to_bits()]
}

impl Kernel for SampleDistances<'_> {
    const NAME: &'static str = "sample_distances";
    const SOURCE: &'static str = include_str!("../../shaders/sample_distances.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("STACK", Constant::U32(STACK)),
        ("MOST_VISITS", Constant::U32(MOST_VISITS)),
        ("NO_NODE", Constant::U32(NO_NODE)),
        ("FARTHEST", Constant::F32(FARTHEST)),
    ];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("samples", Access::Read, self.samples),
            Binding::new("nodes", Access::Read, self.nodes),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("nearest", Access::Write, self.nearest),
        ]
    }

    fn invocations(&self) -> u32 {
        self.sample_count
    }

    fn run_cpu(&mut self) {
        let (samples, nodes) = (self.samples.host(), self.nodes.host());
        let (faces, positions) = (self.faces.host(), self.positions.host());
        let nearest = &mut self.nearest.host_mut()[..self.sample_count as usize];
        nearest.par_iter_mut().zip(samples).with_min_len(CHUNK).for_each(|(nearest, sample)| {
            *nearest = nearest_triangle(sample.xyz(), nodes, faces, positions);
        });
    }
}
