//! How the attributes change over every face. Twin: `shaders/face_gradients.wgsl`, line for line.
//!
//! # Reference
//! \[HO99\]: an attribute is a linear function on a face, v0 + g·(p − p0), with g in its plane. With the edges e1 and e2 from
//! p0, n = e1×e2, g = ((v1−v0) e2×n + (v2−v0) n×e1)/|n|². Found as √|n| g, whose outer product is |n| g gᵀ.

use bytemuck::{Pod, Zeroable};
use multiversion::multiversion;
use rayon::prelude::*;

use super::rows::{Face, Normal, Position};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, add, cross3, divide, dot3, flush, mul, scale3, sub, sub3};
use crate::math::lanes::{self, Columns, LANES, Lane};

/// Most numbers of a wedge that decide.
pub const MOST_COSTED: usize = 16;

/// Least |n| of a face over the squares of its edges for its attributes to have a gradient: about its height over its length.
pub const LEAST_HEIGHT: f32 = 1e-4;

/// One invocation a face.
pub struct FaceGradients<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// `costed` numbers for each wedge.
    pub values: &'a Buffer<f32>,
    /// F.
    pub face_count: u32,
    /// Numbers of a wedge.
    pub costed: u32,
    /// Writes √|n| times the gradients of `costed` numbers for each of F faces: x of all, y of all, z of all.
    pub gradients: &'a mut Buffer<f32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        costed: u32,
    }
}

/// A face without its numbers.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
struct Shape {
    corners: [Vec3; 3],
    normal: Normal,
}

const SHAPE_WORDS: usize = size_of::<Shape>() / 4;

impl Lane for Shape {
    type Source<'a> = (&'a [Position], &'a [Face], &'a [Normal]);
    type Params = ();
    type Output = [Vec3; 2];

    #[inline(always)]
    fn load(index: usize, (positions, faces, normals): Self::Source<'_>) -> Self {
        let corners = faces[index].corners().map(|v| positions[v as usize].xyz());
        Self { corners, normal: normals[index] }
    }

    #[inline(always)]
    fn compute(self, (): ()) -> [Vec3; 2] {
        edge_factors(self.corners, self.normal)
    }
}

/// What the differences of a number along the edges from the first corner are multiplied by.
#[inline(always)]
fn edge_factors([a, b, c]: [Vec3; 3], normal: Normal) -> [Vec3; 2] {
    let e1 = sub3(b, a);
    let e2 = sub3(c, a);
    let weight = mul(normal.root, normal.root);
    let sides_sq = add(dot3(e1, e1), dot3(e2, e2));
    if weight <= mul(LEAST_HEIGHT, sides_sq) {
        return [Vec3::ZERO, Vec3::ZERO];
    }
    let inverse = divide(1.0, weight);
    let n = normal.weighted();
    [scale3(cross3(e2, n), inverse), scale3(cross3(n, e1), inverse)]
}

/// The component of a gradient along an axis, of a number at the three corners.
#[inline(always)]
fn slope([first, second]: [f32; 2], a: f32, b: f32, c: f32) -> f32 {
    flush(add(mul(first, sub(b, a)), mul(second, sub(c, a))), LEAST_FACTOR)
}

/// Numbers at a time.
const NUMBERS: usize = 8;

/// The numbers of a wedge from `start` on; past the end 0.
#[inline(always)]
fn lanes_at(values: &[f32], start: usize) -> [f32; NUMBERS] {
    let from = values.get(start..).unwrap_or_default();
    match from.first_chunk() {
        Some(lanes) => *lanes,
        None => std::array::from_fn(|lane| from.get(lane).copied().unwrap_or_default()),
    }
}

/// Writes the row of a face, of at most so many blocks of numbers an axis, whose corners' numbers start there.
#[inline(always)]
fn write_row<const BLOCKS: usize>(
    factors: [Vec3; 2],
    starts: [usize; 3],
    values: &[f32],
    costed: usize,
    rows: &mut [f32],
) {
    let [first, second] = factors.map(|factor| factor.to_array());
    let mut slopes = [[[0.0; NUMBERS]; 3]; BLOCKS];
    for (block, slopes) in slopes.iter_mut().enumerate() {
        let [a, b, c] = starts.map(|start| lanes_at(values, start + block * NUMBERS));
        for (axis, slopes) in slopes.iter_mut().enumerate() {
            let along = [first[axis], second[axis]];
            for j in 0..NUMBERS {
                slopes[j] = slope(along, a[j], b[j], c[j]);
            }
        }
    }
    // Lanes past the last number of an axis are written over by what follows.
    for axis in 0..3 {
        for (block, slopes) in slopes.iter().enumerate() {
            let out = &mut rows[axis * costed + block * NUMBERS..];
            match out.first_chunk_mut() {
                Some(lanes) => *lanes = slopes[axis],
                None => out.iter_mut().zip(slopes[axis]).for_each(|(out, slope)| *out = slope),
            }
        }
    }
}

/// Writes the rows of faces with these factors.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn write_rows(factors: &[[Vec3; 2]], corners: &[Face], values: &[f32], costed: usize, rows: &mut [f32]) {
    for (face, (&factors, corners)) in factors.iter().zip(corners).enumerate() {
        let (rows, starts) = (&mut rows[3 * face * costed..], corners.corners().map(|wedge| wedge as usize * costed));
        if costed <= NUMBERS {
            write_row::<1>(factors, starts, values, costed, rows);
        } else {
            write_row::<{ MOST_COSTED / NUMBERS }>(factors, starts, values, costed, rows);
        }
    }
}

impl Kernel for FaceGradients<'_> {
    const NAME: &'static str = "face_gradients";
    const SOURCE: &'static str = include_str!("../../shaders/face_gradients.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("LEAST_HEIGHT", Constant::F32(LEAST_HEIGHT))];

    fn params(&self) -> Params {
        Params { costed: self.costed }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("values", Access::Read, self.values),
            Binding::new("gradients", Access::Write, self.gradients),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let costed = self.costed as usize;
        let shapes = (self.positions.host(), self.faces.host(), self.normals.host());
        let (corners, values) = (self.corners.host(), self.values.host());
        let gradients = &mut self.gradients.host_mut()[..3 * costed * self.face_count as usize];
        let blocks = gradients.par_chunks_mut((3 * costed * CHUNK).max(1)).enumerate();
        let scratch = || (Columns::<Shape, SHAPE_WORDS>::new(), vec![[Vec3::ZERO; 2]; CHUNK]);
        blocks.for_each_init(scratch, |(block, factors), (i, rows)| {
            let factors = &mut factors[..rows.len() / (3 * costed)];
            for (group, factors) in factors.chunks_mut(LANES).enumerate() {
                lanes::compute(i * CHUNK + group * LANES, shapes, (), block, factors);
            }
            write_rows(factors, &corners[i * CHUNK..], values, costed, rows);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_function_has_its_gradient() {
        // 2x − y over a right triangle with sides of 2 and 4: n = (0, 0, 8).
        let points = [Vec3::new(1.0, 1.0, 0.0), Vec3::new(3.0, 1.0, 0.0), Vec3::new(1.0, 5.0, 0.0)];
        let root = 8.0_f32.sqrt();
        let factors = edge_factors(points, Normal { x: 0.0, y: 0.0, z: root, root });
        let of = |p: Vec3| 2.0 * p.x - p.y;
        let along = |axis: usize| factors.map(|factor| factor[axis]);
        let slope = |axis: usize| slope(along(axis), of(points[0]), of(points[1]), of(points[2]));
        let g = Vec3::new(slope(0), slope(1), slope(2)) / root;
        assert!((g - Vec3::new(2.0, -1.0, 0.0)).length() < 1e-6, "{g}");
    }

    #[test]
    fn slivers_have_none() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-5, 0.0)];
        let root = 1e-5_f32.sqrt();
        assert_eq!(edge_factors(points, Normal { x: 0.0, y: 0.0, z: root, root }), [Vec3::ZERO; 2]);
    }
}
