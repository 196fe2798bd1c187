//! The quadric of every vertex at the start: squared distances to the planes of its faces, and to planes through its border
//! edges. Twin: `shaders/plane_sums.wgsl`, line for line, but that the host learns in one pass what each corner is asked there
//! ([`Rim`]).
//!
//! About the vertex itself b and c are zero, since it lies on all these planes.
//!
//! # Reference
//! \[GH97\] sections 4 and 6. Departs: planes weighted by area, unless all are to count alike, which divides the error at
//! equal face count by 1.2 to 1.5; border planes then weighted by their edge's squared length.

use rayon::prelude::*;

use super::pair_quadric::{CONSTANTS, NO_AREA};
use super::rows::{BORDER, Face, HUB, Normal, PlaneQuadric, Position};
use super::split::CHUNK;
use super::stars::{Rim, Stars, unit};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{Sym3, add, cross3, dot3, mul, outer, root, sub3, sym_add, sym_scale};

/// One invocation a vertex.
pub struct PlaneSums<'a> {
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
    /// V.
    pub vertex_count: u32,
    /// Weight of a border plane, times its edge's squared length if planes count by area.
    pub border_weight: f32,
    /// 1 if a face's plane counts by its area, 0 if each counts 1.
    pub by_area: u32,
    /// Writes V quadrics; a hub's counts its faces, not its borders.
    pub quadrics: &'a mut Buffer<PlaneQuadric>,
}

params! {
    /// The uniform block.
    pub struct Params {
        border_weight: f32,
        by_area: u32,
    }
}

#[inline(always)]
fn plane_sum(vertex: u32, stars: &Stars<'_>, normals: &[Normal], params: Params) -> PlaneQuadric {
    let mut matrix = Sym3::default();
    let mut weight = 0.0;
    let on_border = stars.positions[vertex as usize].flags & (BORDER | HUB) == BORDER;
    let rim = on_border.then(|| Rim::around(vertex, stars));
    for (place, &f) in stars.ring(vertex).iter().enumerate() {
        let n = normals[f as usize];
        let length = mul(n.root, n.root);
        if mul(length, length) > NO_AREA {
            if params.by_area == 1 {
                // |n| is twice the area: area·(n/|n|)(n/|n|)ᵀ = n nᵀ/(2|n|).
                matrix = sym_add(matrix, sym_scale(outer(n.weighted()), 0.5));
                weight = add(weight, mul(0.5, length));
            } else {
                matrix = sym_add(matrix, outer(unit(n.weighted(), n.root)));
                weight = add(weight, 1.0);
            }
            if let Some(rim) = &rim {
                let face = stars.faces[f as usize];
                for other in [face.a, face.b, face.c] {
                    if other != vertex && rim.is_lone(place, other) {
                        let e = sub3(stars.positions[other as usize].xyz(), stars.positions[vertex as usize].xyz());
                        let e_sq = dot3(e, e);
                        // The plane holds the edge and the normal; |e×n/|n|| = |e| since they are perpendicular.
                        let across = unit(cross3(e, n.weighted()), n.root);
                        if params.by_area == 1 {
                            matrix = sym_add(matrix, sym_scale(outer(across), params.border_weight));
                            weight = add(weight, mul(params.border_weight, e_sq));
                        } else {
                            let normal = unit(across, root(e_sq));
                            matrix = sym_add(matrix, sym_scale(outer(normal), params.border_weight));
                            weight = add(weight, params.border_weight);
                        }
                    }
                }
            }
        }
    }
    let Sym3 { xx, xy, xz, yy, yz, zz } = matrix;
    PlaneQuadric { xx, xy, xz, yy, yz, zz, weight, ..PlaneQuadric::default() }
}

impl Kernel for PlaneSums<'_> {
    const NAME: &'static str = "plane_sums";
    const SOURCE: &'static str = include_str!("../../shaders/plane_sums.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params { border_weight: self.border_weight, by_area: self.by_area }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("quadrics", Access::Write, self.quadrics),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let params = self.params();
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let normals = self.normals.host();
        let quadrics = &mut self.quadrics.host_mut()[..self.vertex_count as usize];
        quadrics.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, quadrics)| {
            for (vertex, quadric) in (chunk * CHUNK..).zip(quadrics) {
                *quadric = plane_sum(vertex as u32, &stars, normals, params);
            }
        });
    }
}
