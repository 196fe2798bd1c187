//! What is missing to a full turn around every vertex: its Gaussian curvature times its area. Twin:
//! `shaders/angle_defects.wgsl`, line for line.
//!
//! # Reference
//! \[MDSB03\] section 4. Over a closed surface the defects add up to 2π times its Euler characteristic; on a border what is
//! missing to a half turn counts, which leaves that true.

use rayon::prelude::*;

use super::rows::{BORDER, Corners, Face, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::exact::{LEAST_SUM, add, arccot, flush, sub};

/// One invocation a vertex.
pub struct AngleDefects<'a> {
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
    /// Writes V angles in radians; a full turn for a vertex without a face, a half one on a border.
    pub defects: &'a mut Buffer<f32>,
}

/// A full and a half turn, in radians.
const TURNS: [f32; 2] = [std::f32::consts::TAU, std::f32::consts::PI];

/// The angle at this corner of a face; none of a face without area.
#[inline(always)]
fn angle_at(vertex: u32, face: Face, row: Corners) -> f32 {
    let seen = spoke(face, vertex);
    let cot = [row.cot_a, row.cot_b, row.cot_c][seen.corner as usize];
    let has_area = (row.area_a > 0.0) | (row.area_b > 0.0) | (row.area_c > 0.0);
    if has_area { arccot(cot) } else { 0.0 }
}

#[inline(always)]
fn angle_defect(vertex: u32, stars: &Stars<'_>, corners: &[Corners]) -> f32 {
    let mut sum = 0.0;
    for &f in stars.ring(vertex) {
        sum = add(sum, angle_at(vertex, stars.faces[f as usize], corners[f as usize]));
    }
    let on_border = stars.positions[vertex as usize].flags & BORDER != 0;
    flush(sub(if on_border { TURNS[1] } else { TURNS[0] }, sum), LEAST_SUM)
}

impl Kernel for AngleDefects<'_> {
    const NAME: &'static str = "angle_defects";
    const SOURCE: &'static str = include_str!("../../shaders/angle_defects.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("BORDER", Constant::U32(BORDER)),
        ("FULL_TURN", Constant::F32(TURNS[0])),
        ("HALF_TURN", Constant::F32(TURNS[1])),
    ];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("defects", Access::Write, self.defects),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let corners = self.corners.host();
        let rows = self.defects.host_mut()[..self.vertex_count as usize].par_iter_mut().enumerate();
        rows.with_min_len(CHUNK).for_each(|(vertex, row)| *row = angle_defect(vertex as u32, &stars, corners));
    }
}
