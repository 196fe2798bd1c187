//! What turns the numbers at the corners of a face into their gradient. Twin: `shaders/gradient_operators.wgsl`, line for line.
//!
//! # Reference
//! \[HO99\]: an attribute is a linear function on a face, va + g·(p − pa), with g in its plane. With the edges e1 and e2 from
//! a to b and c, n = e1×e2, g = ((vb−va) e2×n + (vc−va) n×e1)/|n|². Found as √|n| g, whose outer product is |n| g gᵀ.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::rows::{Face, GradientOperator, Normal, Position};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST, LEAST_SUM, add, cross3, divide, dot3, flush3, mul, scale3, sub3};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// Least |n| of a face over the squares of its edges for its attributes to have a gradient: about its height over its length.
pub const LEAST_HEIGHT: f32 = 1e-4;

/// One invocation a face.
pub struct GradientOperators<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// F.
    pub face_count: u32,
    /// Writes F operators.
    pub operators: &'a mut Buffer<GradientOperator>,
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
    type Output = GradientOperator;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (positions, faces, normals): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let faces = indices.map(|index| &faces[index]);
        lanes.put::<_, 3>(faces.map(|face| &positions[face.a as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.b as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.c as usize]));
        lanes.put::<_, 4>(indices.map(|index| &normals[index]));
    }

    #[inline(always)]
    fn compute(self, (): ()) -> GradientOperator {
        gradient_operator(self.corners, self.normal)
    }
}

/// Of a face with these corners, times √|n|; zero where it has none.
#[inline(always)]
fn gradient_operator([a, b, c]: [Vec3; 3], normal: Normal) -> GradientOperator {
    let e1 = sub3(b, a);
    let e2 = sub3(c, a);
    let weight = mul(normal.root, normal.root);
    let sides_sq = add(dot3(e1, e1), dot3(e2, e2));
    if weight <= mul(LEAST_HEIGHT, sides_sq) {
        return GradientOperator { root: normal.root, ..GradientOperator::default() };
    }
    let inverse = divide(1.0, weight);
    let n = normal.weighted();
    let along_b = flush3(scale3(flush3(cross3(e2, n), LEAST_SUM), inverse), LEAST);
    let along_c = flush3(scale3(flush3(cross3(n, e1), LEAST_SUM), inverse), LEAST);
    GradientOperator {
        bx: along_b.x,
        by: along_b.y,
        bz: along_b.z,
        cx: along_c.x,
        cy: along_c.y,
        cz: along_c.z,
        root: normal.root,
    }
}

impl Kernel for GradientOperators<'_> {
    const NAME: &'static str = "gradient_operators";
    const SOURCE: &'static str = include_str!("../../shaders/gradient_operators.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[("LEAST_HEIGHT", Constant::F32(LEAST_HEIGHT))];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("operators", Access::Write, self.operators),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let source = (self.positions.host(), self.faces.host(), self.normals.host());
        let blocks = self.operators.host_mut()[..self.face_count as usize].par_chunks_mut(LANES).enumerate();
        blocks
            .with_min_len(CHUNK / LANES)
            .for_each_init(Columns::<Shape, SHAPE_WORDS>::new, |block, (i, operators)| {
                lanes::compute(i * LANES, source, (), block, operators)
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
        let normal = Normal { x: 0.0, y: 0.0, z: root, root };
        let GradientOperator { bx, by, bz, cx, cy, cz, .. } = gradient_operator(points, normal);
        let [a, b, c] = points.map(|p| 2.0 * p.x - p.y);
        let g = (Vec3::new(bx, by, bz) * (b - a) + Vec3::new(cx, cy, cz) * (c - a)) / root;
        assert!((g - Vec3::new(2.0, -1.0, 0.0)).length() < 1e-6, "{g}");
    }

    #[test]
    fn slivers_have_none() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-5, 0.0)];
        let root = 1e-5_f32.sqrt();
        let operator = gradient_operator(points, Normal { x: 0.0, y: 0.0, z: root, root });
        assert_eq!(operator, GradientOperator { root, ..GradientOperator::default() });
    }
}
