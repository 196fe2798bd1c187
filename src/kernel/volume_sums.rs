//! What the `volume` metric needs of every vertex: sums over its star of n nᵀ/|n| and n, and the border term. Twin:
//! `shaders/volume_sums.wgsl`, line for line, but that the host learns in one pass what each corner is asked there ([`Rim`]).
//!
//! Gathers: one invocation a vertex, its ring in ascending face order, so the sums are repeatable. \[LT98\] section 4:
//! volume and boundary terms; the sums make a pair cost O(1).

use rayon::prelude::*;

use super::rows::{BORDER, BorderSum, FLAGS, Face, HUB, Normal, Position, VolumeSum};
use super::split::{CHUNK, rows_each};
use super::stars::{Rim, Stars};
use super::warm::{faces_near, warm_up};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, Switch};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, Sym3, add3, dot3, flush3, outer, sub3, sym_add, sym_sub};

/// Vertices of a task of the host, at least and at most.
const VERTICES_EACH: [usize; 2] = [1 << 9, CHUNK];

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
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// V.
    pub vertex_count: u32,
    /// Writes V sums; a hub's are zero.
    pub sums: &'a mut Buffer<VolumeSum>,
    /// Writes V border terms where the mesh has a border; otherwise one unused row.
    pub borders: &'a mut Buffer<BorderSum>,
}

/// |e|²·I − e eᵀ: the squared distance to a line along e, times |e|².
#[inline(always)]
pub fn border_term(edge: Vec3) -> Sym3 {
    let e = flush3(edge, LEAST_FACTOR);
    let length_sq = dot3(e, e);
    let diagonal = Sym3 { xx: length_sq, xy: 0.0, xz: 0.0, yy: length_sq, yz: 0.0, zz: length_sq };
    sym_sub(diagonal, outer(e))
}

#[inline(always)]
fn volume_sum(vertex: u32, stars: &Stars<'_>, normals: &[Normal]) -> VolumeSum {
    let mut matrix = Sym3::default();
    let mut normal = Vec3::ZERO;
    for &f in stars.ring(vertex) {
        let n = normals[f as usize];
        matrix = sym_add(matrix, outer(n.weighted()));
        normal = add3(normal, n.doubled_area());
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
fn border_sum(vertex: u32, stars: &Stars<'_>) -> BorderSum {
    let rim = Rim::around(vertex, stars);
    let mut matrix = Sym3::default();
    for (place, &f) in stars.ring(vertex).iter().enumerate() {
        for other in stars.faces[f as usize].corners() {
            if other != vertex && rim.is_lone(place, other) {
                let e = sub3(stars.positions[other as usize].xyz(), stars.positions[vertex as usize].xyz());
                matrix = sym_add(matrix, border_term(e));
            }
        }
    }
    BorderSum { xx: matrix.xx, xy: matrix.xy, xz: matrix.xz, yy: matrix.yy, yz: matrix.yz, zz: matrix.zz }
}

impl Kernel for VolumeSums<'_> {
    const NAME: &'static str = "volume_sums";
    const SOURCE: &'static str = include_str!("../../shaders/volume_sums.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/stars.wgsl"), include_str!("../../shaders/shared/border_term.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;

    fn params(&self) {}

    fn switches(&self) -> Vec<Switch> {
        vec![("HAS_BORDER", self.borders.len() > 1)]
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("sums", Access::Write, self.sums),
            Binding::new("borders", Access::Write, self.borders),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let normals = self.normals.host();
        let vertices = ..self.vertex_count as usize;
        let each = rows_each(vertices.end, VERTICES_EACH);
        let sums = self.sums.host_mut()[vertices].par_chunks_mut(each).enumerate();
        if self.borders.len() <= 1 {
            sums.for_each(|(chunk, sums)| fill_sums(chunk * each, &stars, normals, sums));
            return;
        }
        let borders = self.borders.host_mut()[vertices].par_chunks_mut(each);
        sums.zip(borders).for_each(|((chunk, sums), borders)| {
            fill_sums(chunk * each, &stars, normals, sums);
            fill_borders(chunk * each, &stars, borders);
        });
    }
}

/// Writes the sums of the vertices from `first` on.
fn fill_sums(first: usize, stars: &Stars<'_>, normals: &[Normal], sums: &mut [VolumeSum]) {
    let vertices = first..first + sums.len();
    warm_up(&normals[faces_near(vertices.clone(), stars.ring_starts, stars.ring_faces, normals.len())]);
    for (vertex, sum) in vertices.zip(sums) {
        *sum = VolumeSum::default();
        if stars.positions[vertex].flags & HUB == 0 {
            *sum = volume_sum(vertex as u32, stars, normals);
        }
    }
}

/// The same of the border terms.
fn fill_borders(first: usize, stars: &Stars<'_>, borders: &mut [BorderSum]) {
    for (vertex, border) in (first..).zip(borders) {
        *border = BorderSum::default();
        if stars.positions[vertex].flags & (BORDER | HUB) == BORDER {
            *border = border_sum(vertex as u32, stars);
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
        let (ring_starts, ring_faces) = ([0, 2, 3, 5, 6], [0, 1, 0, 0, 1, 1]);
        let stars = Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
        let sum = volume_sum(0, &stars, &[Normal { x: 0.0, y: 0.0, z: 1.0, root: 1.0 }; 2]);
        assert_eq!(sum, VolumeSum { zz: 2.0, nz: 2.0, ..VolumeSum::default() });
        // The borders at vertex 0 run along x and y, one unit long; the diagonal is shared.
        let border = border_sum(0, &stars);
        assert_eq!(border, BorderSum { xx: 1.0, yy: 1.0, zz: 2.0, ..BorderSum::default() });
    }
}
