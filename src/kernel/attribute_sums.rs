//! What the attributes need of every wedge: sums over its faces of |n| g gᵀ, |n| and |n| g, the last beside its numbers.
//! Twin: `shaders/attribute_sums.wgsl`, line for line.
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.
//! About the wedge's own place and numbers the other terms of its quadric are zero, as those of the `volume` metric are.

use rayon::prelude::*;

use super::rows::{AttributeSum, FLAGS, Face, HUB, Position, Slope};
use super::split::{CHUNK, split_at_bounds};
use super::stars::spoke;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{add, sym_add};

/// One invocation a vertex.
pub struct AttributeSums<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// The first wedge of each of V vertices, and the end.
    pub wedge_starts: &'a Buffer<u32>,
    /// `costed` numbers for each wedge.
    pub values: &'a Buffer<f32>,
    /// |n| g gᵀ and |n| of F faces.
    pub face_sums: &'a Buffer<AttributeSum>,
    /// |n| g of `costed` numbers for each face.
    pub gradients: &'a Buffer<Slope>,
    /// V.
    pub vertex_count: u32,
    /// Numbers of a wedge.
    pub costed: u32,
    /// Writes a sum for each wedge; those of a hub are zero.
    pub sums: &'a mut Buffer<AttributeSum>,
    /// Writes the numbers of each wedge, with the sums of |n| g.
    pub slopes: &'a mut Buffer<Slope>,
}

params! {
    /// The uniform block.
    pub struct Params {
        costed: u32,
    }
}

/// What sums are gathered from, on the host.
#[derive(Clone, Copy)]
struct Rows<'a> {
    faces: &'a [Face],
    corners: &'a [Face],
    face_sums: &'a [AttributeSum],
    gradients: &'a [Slope],
    values: &'a [f32],
    costed: usize,
}

/// Whether a face's corner at a vertex has this wedge.
#[inline(always)]
fn has_wedge(f: u32, vertex: u32, wedge: u32, rows: Rows<'_>) -> bool {
    let corner = spoke(rows.faces[f as usize], vertex).corner;
    rows.corners[f as usize].corners()[corner as usize] == wedge
}

#[inline(always)]
fn with_face(sum: AttributeSum, face: AttributeSum) -> AttributeSum {
    AttributeSum::new(sym_add(sum.matrix(), face.matrix()), add(sum.weight, face.weight))
}

/// The sum over the faces of a wedge; writes its numbers with the sums of |n| g.
#[inline(always)]
fn wedge_sum(wedge: usize, own: impl Iterator<Item = u32>, rows: Rows<'_>, slopes: &mut [Slope]) -> AttributeSum {
    let costed = rows.costed;
    let mut sum = AttributeSum::default();
    slopes.fill(Slope::default());
    for f in own {
        sum = with_face(sum, rows.face_sums[f as usize]);
        // All components of all numbers in one loop over scalars; `at` is 0 so far.
        let gradients: &[f32] = bytemuck::cast_slice(&rows.gradients[f as usize * costed..][..costed]);
        let slopes: &mut [f32] = bytemuck::cast_slice_mut(slopes);
        slopes.iter_mut().zip(gradients).for_each(|(sum, &g)| *sum = add(*sum, g));
    }
    let values = &rows.values[wedge * costed..][..costed];
    slopes.iter_mut().zip(values).for_each(|(slope, &at)| slope.at = at);
    sum
}

impl Kernel for AttributeSums<'_> {
    const NAME: &'static str = "attribute_sums";
    const SOURCE: &'static str = include_str!("../../shaders/attribute_sums.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;

    fn params(&self) -> Params {
        Params { costed: self.costed }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("wedge_starts", Access::Read, self.wedge_starts),
            Binding::new("values", Access::Read, self.values),
            Binding::new("face_sums", Access::Read, self.face_sums),
            Binding::new("gradients", Access::Read, self.gradients),
            Binding::new("sums", Access::Write, self.sums),
            Binding::new("slopes", Access::Write, self.slopes),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let (vertices, costed) = (self.vertex_count as usize, self.costed as usize);
        let (positions, wedge_starts) = (self.positions.host(), self.wedge_starts.host());
        let (ring_starts, ring_faces) = (self.ring_starts.host(), self.ring_faces.host());
        let rows = Rows {
            faces: self.faces.host(),
            corners: self.corners.host(),
            face_sums: self.face_sums.host(),
            gradients: self.gradients.host(),
            values: self.values.host(),
            costed,
        };
        let wedges = wedge_starts[vertices];
        let bounds: Vec<usize> = (0..vertices).step_by(CHUNK).chain([vertices]).collect();
        let ends: Vec<u32> = bounds.iter().map(|&vertex| wedge_starts[vertex]).collect();
        let slope_ends: Vec<u32> = ends.iter().map(|end| end * self.costed).collect();
        let sums = split_at_bounds(&mut self.sums.host_mut()[..wedges as usize], &ends);
        let slopes = split_at_bounds(&mut self.slopes.host_mut()[..wedges as usize * costed], &slope_ends);
        bounds.par_windows(2).zip(sums).zip(slopes).for_each(|((bounds, sums), slopes)| {
            let first = wedge_starts[bounds[0]];
            for vertex in bounds[0]..bounds[1] {
                let is_hub = positions[vertex].flags & HUB != 0;
                let ring = &ring_faces[ring_starts[vertex] as usize..ring_starts[vertex + 1] as usize];
                let ring = if is_hub { &[] } else { ring };
                let wedges = wedge_starts[vertex]..wedge_starts[vertex + 1];
                let is_whole = wedges.len() == 1;
                for wedge in wedges {
                    let place = (wedge - first) as usize;
                    let slopes = &mut slopes[place * costed..][..costed];
                    let all = ring.iter().copied();
                    sums[place] = if is_whole {
                        wedge_sum(wedge as usize, all, rows, slopes)
                    } else {
                        let own = all.filter(|&f| has_wedge(f, vertex as u32, wedge, rows));
                        wedge_sum(wedge as usize, own, rows, slopes)
                    };
                }
            }
        });
    }
}
