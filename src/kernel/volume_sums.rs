//! What the `volume` metric needs of every vertex: sums over its star of n nᵀ and n, and the border term. Twin:
//! `shaders/volume_sums.wgsl`, line for line.
//!
//! Gathers: one invocation a vertex, its ring in ascending face order, so the sums are repeatable. \[LT98\] section 4:
//! volume and boundary terms; the sums make a pair cost O(1).

use rayon::prelude::*;

use super::pairs::HUB;
use super::rows::{BORDER, BorderSum, Face, Position, VolumeSum};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{Sym3, add3, cross3, dot3, outer, sub3, sym_add, sym_sub};

/// One invocation a vertex.
pub struct VolumeSums<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// V.
    pub vertex_count: u32,
    /// Writes V sums; a hub's are zero.
    pub sums: &'a mut Buffer<VolumeSum>,
    /// Writes V border terms where the mesh has a border; otherwise one unused row.
    pub borders: &'a mut Buffer<BorderSum>,
}

params!(count: u32, has_border: u32);

/// n = (p1−p0)×(p2−p0): twice the area, along the normal.
#[inline(always)]
pub fn face_normal(face: Face, positions: &[Position]) -> Vec3 {
    let p0 = positions[face.a as usize].xyz();
    let p1 = positions[face.b as usize].xyz();
    let p2 = positions[face.c as usize].xyz();
    cross3(sub3(p1, p0), sub3(p2, p0))
}

/// |e|²·I − e eᵀ: the squared distance to a line along e, times |e|².
#[inline(always)]
pub fn border_term(e: Vec3) -> Sym3 {
    let length_sq = dot3(e, e);
    let diagonal = Sym3 { xx: length_sq, xy: 0.0, xz: 0.0, yy: length_sq, yz: 0.0, zz: length_sq };
    sym_sub(diagonal, outer(e))
}

/// How many faces of a ring have this vertex as a corner.
#[inline(always)]
pub fn faces_with(vertex: u32, ring: &[u32], faces: &[Face]) -> u32 {
    let mut count = 0;
    for &f in ring {
        let face = faces[f as usize];
        if face.a == vertex || face.b == vertex || face.c == vertex {
            count += 1;
        }
    }
    count
}

#[inline(always)]
fn volume_sum(ring: &[u32], faces: &[Face], positions: &[Position]) -> VolumeSum {
    let mut matrix = Sym3::default();
    let mut normal = Vec3::ZERO;
    for &f in ring {
        let n = face_normal(faces[f as usize], positions);
        matrix = sym_add(matrix, outer(n));
        normal = add3(normal, n);
    }
    VolumeSum {
        xx: matrix.xx,
        xy: matrix.xy,
        xz: matrix.xz,
        yy: matrix.yy,
        yz: matrix.yz,
        zz: matrix.zz,
        nx: normal.x,
        ny: normal.y,
        nz: normal.z,
    }
}

#[inline(always)]
fn border_sum(vertex: u32, ring: &[u32], faces: &[Face], positions: &[Position]) -> BorderSum {
    let mut matrix = Sym3::default();
    for &f in ring {
        let face = faces[f as usize];
        for other in [face.a, face.b, face.c] {
            if other != vertex && faces_with(other, ring, faces) == 1 {
                let e = sub3(positions[other as usize].xyz(), positions[vertex as usize].xyz());
                matrix = sym_add(matrix, border_term(e));
            }
        }
    }
    BorderSum { xx: matrix.xx, xy: matrix.xy, xz: matrix.xz, yy: matrix.yy, yz: matrix.yz, zz: matrix.zz }
}

impl Kernel for VolumeSums<'_> {
    const NAME: &'static str = "volume_sums";
    const SOURCE: &'static str = include_str!("../../shaders/volume_sums.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] =
        &[("BORDER", Constant::U32(BORDER)), ("HUB", Constant::U32(HUB))];

    fn params(&self) -> Params {
        Params { count: self.vertex_count, has_border: u32::from(self.borders.len() > 1) }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("sums", Access::Write, self.sums),
            Binding::new("borders", Access::Write, self.borders),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let count = self.vertex_count as usize;
        let (positions, faces) = (self.positions.host(), self.faces.host());
        let (starts, ring_faces) = (self.ring_starts.host(), self.ring_faces.host());
        let ring = |vertex: usize| &ring_faces[starts[vertex] as usize..starts[vertex + 1] as usize];
        let sums = &mut self.sums.host_mut()[..count];
        sums.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(vertex, sum)| {
            let ring = ring(vertex);
            *sum = VolumeSum::default();
            if ring.len() as u32 <= HUB {
                *sum = volume_sum(ring, faces, positions);
            }
        });
        if self.borders.len() > 1 {
            let borders = &mut self.borders.host_mut()[..count];
            borders.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(vertex, border)| {
                let ring = ring(vertex);
                *border = BorderSum::default();
                if ring.len() as u32 <= HUB && positions[vertex].flags & BORDER != 0 {
                    *border = border_sum(vertex as u32, ring, faces, positions);
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn border_term_is_the_squared_distance_to_a_line() {
        let m = border_term(Vec3::new(2.0, 0.0, 0.0));
        assert_eq!(m, Sym3 { yy: 4.0, zz: 4.0, ..Sym3::default() });
    }

    #[test]
    fn sums_of_a_right_corner() {
        // Two unit right triangles in z = 0 around vertex 0: n = (0, 0, 1) each.
        let positions =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Position { x, y, z: 0.0, flags: BORDER });
        let faces = [Face { a: 0, b: 1, c: 2 }, Face { a: 0, b: 2, c: 3 }];
        let sum = volume_sum(&[0, 1], &faces, &positions);
        assert_eq!(sum, VolumeSum { zz: 2.0, nz: 2.0, ..VolumeSum::default() });
        // The borders at vertex 0 run along x and y, one unit long; the diagonal is shared.
        let border = border_sum(0, &[0, 1], &faces, &positions);
        assert_eq!(border, BorderSum { xx: 1.0, yy: 1.0, zz: 2.0, ..BorderSum::default() });
    }
}
