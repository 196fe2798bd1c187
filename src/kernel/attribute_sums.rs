//! What the attributes need of every wedge: sums over its faces of |n| g gᵀ, |n| and |n| g. Twin:
//! `shaders/attribute_sums.wgsl`, line for line.
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.
//! About the wedge's own place and numbers the other terms of its quadric are zero, as those of the `volume` metric are.

use rayon::prelude::*;

use super::rows::{AttributeSum, FLAGS, Face, Gradient, HUB, Normal, Position};
use super::split::{CHUNK, split_at_bounds};
use super::stars::spoke;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{Sym3, add, add3, mul, outer, scale3, sym_add};

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
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// The first wedge of each of V vertices, and the end.
    pub wedge_starts: &'a Buffer<u32>,
    /// `costed` gradients for each face.
    pub gradients: &'a Buffer<Gradient>,
    /// V.
    pub vertex_count: u32,
    /// Numbers of a wedge.
    pub costed: u32,
    /// Writes a sum for each wedge; those of a hub are zero.
    pub sums: &'a mut Buffer<AttributeSum>,
    /// Writes `costed` sums of |n| g for each wedge.
    pub slopes: &'a mut Buffer<Gradient>,
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
    normals: &'a [Normal],
    corners: &'a [Face],
    gradients: &'a [Gradient],
    costed: usize,
}

/// Whether a face's corner at a vertex has this wedge.
#[inline(always)]
fn has_wedge(f: u32, vertex: u32, wedge: u32, rows: Rows<'_>) -> bool {
    let corner = spoke(rows.faces[f as usize], vertex).corner;
    rows.corners[f as usize].corners()[corner as usize] == wedge
}

/// The sum over the faces of a wedge.
fn attribute_sum(own: &[u32], rows: Rows<'_>) -> AttributeSum {
    let mut matrix = Sym3::default();
    let mut weight = 0.0;
    for &f in own {
        let root = rows.normals[f as usize].root;
        weight = add(weight, mul(root, root));
        for g in &rows.gradients[f as usize * rows.costed..][..rows.costed] {
            matrix = sym_add(matrix, outer(g.xyz()));
        }
    }
    let Sym3 { xx, xy, xz, yy, yz, zz } = matrix;
    AttributeSum { xx, xy, xz, yy, yz, zz, weight }
}

/// Adds |n| g of every number over the faces of a wedge.
fn add_slopes(own: &[u32], rows: Rows<'_>, slopes: &mut [Gradient]) {
    slopes.fill(Gradient::default());
    for &f in own {
        let root = rows.normals[f as usize].root;
        let gradients = &rows.gradients[f as usize * rows.costed..][..rows.costed];
        for (sum, g) in slopes.iter_mut().zip(gradients) {
            let Vec3 { x, y, z } = add3(sum.xyz(), scale3(g.xyz(), root));
            *sum = Gradient { x, y, z };
        }
    }
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
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("wedge_starts", Access::Read, self.wedge_starts),
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
            normals: self.normals.host(),
            corners: self.corners.host(),
            gradients: self.gradients.host(),
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
            let mut own = Vec::new();
            for vertex in bounds[0]..bounds[1] {
                let is_hub = positions[vertex].flags & HUB != 0;
                let ring = &ring_faces[ring_starts[vertex] as usize..ring_starts[vertex + 1] as usize];
                let ring = if is_hub { &[] } else { ring };
                let wedges = wedge_starts[vertex]..wedge_starts[vertex + 1];
                for wedge in wedges.clone() {
                    own.clear();
                    let is_own = |f: &&u32| wedges.len() == 1 || has_wedge(**f, vertex as u32, wedge, rows);
                    own.extend(ring.iter().filter(is_own));
                    let place = (wedge - first) as usize;
                    sums[place] = attribute_sum(&own, rows);
                    add_slopes(&own, rows, &mut slopes[place * costed..][..costed]);
                }
            }
        });
    }
}
