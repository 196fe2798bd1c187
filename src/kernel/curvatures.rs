//! The mean curvature and the mixed area of every vertex. Twin: `shaders/curvatures.wgsl`, line for line.
//!
//! # Reference
//! \[MDSB03\] sections 3.3 and 4: half the length of the mean curvature normal, over the mixed Voronoi area. Departs: at
//! a border, where the operator would measure how the border bends, the curvature is left at zero.

use rayon::prelude::*;

use super::rows::{BORDER, Corners, Face, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, LEAST_SUM, add, add3, divide, dot3, flush, flush3, mul, root, scale3, sub3};

/// Areas up to this, in the normalized frame, are of stars without area: no curvature.
pub const NO_STAR: f32 = 1e-12;
/// Greatest curvature: a radius of a millionth of the mean edge. What passes it is noise on a needle.
pub const SHARPEST: f32 = 1e6;

/// One invocation a vertex.
pub struct Curvatures<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// F rows.
    pub corners: &'a Buffer<Corners>,
    /// V.
    pub vertex_count: u32,
    /// Writes V mixed areas, whose sum is the area of the surface.
    pub areas: &'a mut Buffer<f32>,
    /// Writes V mean curvatures without their sign, in one over the frame's length; zero on a border.
    pub curvatures: &'a mut Buffer<f32>,
}

/// Σ (cot α + cot β)(p − q) over the edges at a vertex: four times its mean curvature and area, along the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Star {
    turn: Vec3,
    area: f32,
}

/// Adds a face of which this vertex is a corner.
#[inline(always)]
fn with_face(star: Star, vertex: u32, p: Vec3, face: Face, row: Corners, positions: &[Position]) -> Star {
    let seen = spoke(face, vertex);
    let is_b = seen.corner == 1;
    let is_c = seen.corner == 2;
    let of_corner = |[a, b, c]: [f32; 3]| {
        if is_c {
            c
        } else if is_b {
            b
        } else {
            a
        }
    };
    let area = of_corner([row.area_a, row.area_b, row.area_c]);
    let cot_next = of_corner([row.cot_b, row.cot_c, row.cot_a]);
    let cot_last = of_corner([row.cot_c, row.cot_a, row.cot_b]);
    let from_next = sub3(p, positions[seen.next as usize].xyz());
    let from_last = sub3(p, positions[seen.last as usize].xyz());
    Star {
        turn: add3(star.turn, add3(scale3(from_next, cot_last), scale3(from_last, cot_next))),
        area: add(star.area, area),
    }
}

#[inline(always)]
fn star_of(vertex: u32, stars: &Stars<'_>, corners: &[Corners]) -> Star {
    let p = stars.positions[vertex as usize].xyz();
    let mut star = Star { turn: Vec3::ZERO, area: 0.0 };
    for &f in stars.ring(vertex) {
        star = with_face(star, vertex, p, stars.faces[f as usize], corners[f as usize], stars.positions);
    }
    Star { turn: flush3(star.turn, LEAST_FACTOR), area: flush(star.area, LEAST_SUM) }
}

#[inline(always)]
fn curvature(star: Star) -> f32 {
    if star.area <= NO_STAR {
        return 0.0;
    }
    divide(root(dot3(star.turn, star.turn)), mul(4.0, star.area)).min(SHARPEST)
}

impl Kernel for Curvatures<'_> {
    const NAME: &'static str = "curvatures";
    const SOURCE: &'static str = include_str!("../../shaders/curvatures.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("areas", Access::Write, self.areas),
            Binding::new("curvatures", Access::Write, self.curvatures),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let (vertices, corners) = (..self.vertex_count as usize, self.corners.host());
        let areas = self.areas.host_mut()[vertices].par_iter_mut();
        let rows = areas.zip(&mut self.curvatures.host_mut()[vertices]).enumerate();
        rows.with_min_len(CHUNK).for_each(|(vertex, (area, row))| {
            let star = star_of(vertex as u32, &stars, corners);
            *area = star.area;
            *row = if stars.positions[vertex].flags & BORDER == 0 { curvature(star) } else { 0.0 };
        });
    }
}

/// The flags, and what else the shader names.
const CONSTANTS: &[(&str, Constant)] =
    &[("BORDER", Constant::U32(BORDER)), ("NO_STAR", Constant::F32(NO_STAR)), ("SHARPEST", Constant::F32(SHARPEST))];
