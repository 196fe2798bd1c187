//! What bounds the average quadric of every vertex: the weight of its planes, and how far off one of them is at most.
//! Twin: `shaders/quadric_bounds.wgsl`, line for line.
//!
//! The planes are those of [`PlaneSums`](super::plane_sums::PlaneSums).
//!
//! # Reference
//! \[Yu14\]: the greatest weight is `MaxNum` where each plane counts 1, the greatest squared distance `Maxd2`.

use rayon::prelude::*;

use super::format_frame::{FormatFrame, in_format};
use super::pair_quadric::{CONSTANTS, NO_AREA};
use super::rows::{BORDER, Face, HUB, Normal, PlaneQuadric, Position, QuadricBound};
use super::split::CHUNK;
use super::stars::{Stars, faces_with, unit};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, cross3, dot3, flush, mul, root, sub3};

/// One invocation a vertex.
pub struct QuadricBounds<'a> {
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
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// V.
    pub vertex_count: u32,
    /// The coordinates that distances are found in.
    pub frame: FormatFrame,
    /// Writes V bounds.
    pub bounds: &'a mut Buffer<QuadricBound>,
}

#[inline(always)]
fn quadric_bound(
    vertex: u32,
    stars: &Stars<'_>,
    normals: &[Normal],
    quadric: PlaneQuadric,
    params: FormatFrame,
) -> QuadricBound {
    let position = stars.positions[vertex as usize];
    let p0 = position.xyz();
    let on_border = position.flags & (BORDER | HUB) == BORDER;
    let x = in_format(p0, params);
    let mut offset_sq = 0.0_f32;
    for &f in stars.ring(vertex) {
        let n = normals[f as usize];
        let length = mul(n.root, n.root);
        if mul(length, length) > NO_AREA {
            offset_sq = offset_sq.max(distance_sq(unit(n.weighted(), n.root), x));
            if on_border {
                let face = stars.faces[f as usize];
                for other in [face.a, face.b, face.c] {
                    if other != vertex && faces_with(other, vertex, stars) == 1 {
                        let e = sub3(stars.positions[other as usize].xyz(), p0);
                        let across = unit(cross3(e, n.weighted()), n.root);
                        offset_sq = offset_sq.max(distance_sq(unit(across, root(dot3(e, e))), x));
                    }
                }
            }
        }
    }
    QuadricBound { weight: quadric.weight, offset_sq }
}

/// Of a plane through x from the origin.
#[inline(always)]
fn distance_sq(n: Vec3, x: Vec3) -> f32 {
    let d = flush(dot3(n, x), LEAST_FACTOR);
    mul(d, d)
}

impl Kernel for QuadricBounds<'_> {
    const NAME: &'static str = "quadric_bounds";
    const SOURCE: &'static str = include_str!("../../shaders/quadric_bounds.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/stars.wgsl"), include_str!("../../shaders/shared/format_frame.wgsl")];
    type Params = FormatFrame;
    const PARAMS: &'static [(&'static str, &'static str)] = FormatFrame::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> FormatFrame {
        self.frame
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("bounds", Access::Write, self.bounds),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let params = self.params();
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let (normals, quadrics) = (self.normals.host(), self.quadrics.host());
        let bounds = &mut self.bounds.host_mut()[..self.vertex_count as usize];
        bounds.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(vertex, bound)| {
            *bound = quadric_bound(vertex as u32, &stars, normals, quadrics[vertex], params);
        });
    }
}
