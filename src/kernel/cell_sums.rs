//! What the faces of every piece tell its cell: their quadrics and the corners inside. Twin: `shaders/cell_sums.wgsl`,
//! line for line.
//!
//! A face counts once in every cell that it touches, and each of its corners in the cell where it lies: a soup has the
//! sums of the same mesh welded.
//!
//! # Reference
//! \[Lin00\]: quadrics of faces summed at the cells of their corners. Departs: weighted by area instead of its
//! square, like the metric `plane`, and once for a face with several corners in a cell.

use rayon::prelude::*;

use super::cells::{CONSTANTS, CellBox, LEAST_COMPONENT, NO_PLANE, Pieces, cell_box, is_in};
use super::rows::{CellSum, Face, Site};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, add, add3, cross3, divide, dot3, flush, flush3, mul, outer, root, scale3, sub3, sym_add, sym_scale,
};

/// One invocation a piece.
pub struct CellSums<'a> {
    /// V sites.
    pub sites: &'a Buffer<Site>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// The site of the first vertex of every cell.
    pub origins: &'a Buffer<Site>,
    /// The cell of every piece and where its faces start; one more that ends the last.
    pub pieces: &'a Buffer<[u32; 2]>,
    /// The faces of every cell, ascending.
    pub piece_faces: &'a Buffer<u32>,
    /// P.
    pub piece_count: u32,
    /// Steps to the side of a cell.
    pub steps: u32,
    /// Units a step: a power of two.
    pub unit: f32,
    /// Writes P sums.
    pub sums: &'a mut Buffer<CellSum>,
}

params! {
    /// The uniform block.
    pub struct Params {
        steps: u32,
        unit: f32,
    }
}

/// The sum with a face that has a corner in the cell.
#[inline(always)]
fn with_face(sum: CellSum, cell: CellBox, a: Vec3, b: Vec3, c: Vec3) -> CellSum {
    let mut next = sum;
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    if n_sq > NO_PLANE {
        let length = root(n_sq);
        let u = flush3(scale3(n, divide(1.0, length)), LEAST_COMPONENT);
        let weight = mul(0.5, length);
        // From a corner in the cell: it is near, and the distance to the plane loses no digits.
        let inside = if is_in(a, cell) {
            a
        } else if is_in(b, cell) {
            b
        } else {
            c
        };
        let d = flush(dot3(u, inside), LEAST_COMPONENT);
        let matrix = sym_add(sum.matrix(), sym_scale(outer(u), weight));
        let linear = add3(sum.linear(), scale3(u, mul(weight, d)));
        (next.xx, next.xy, next.xz) = (matrix.xx, matrix.xy, matrix.xz);
        (next.yy, next.yz, next.zz) = (matrix.yy, matrix.yz, matrix.zz);
        (next.bx, next.by, next.bz) = (linear.x, linear.y, linear.z);
        next.c = add(sum.c, mul(weight, mul(d, d)));
        next.weight = add(sum.weight, weight);
    }
    let mut position = sum.position();
    for corner in [a, b, c] {
        if is_in(corner, cell) {
            position = add3(position, corner);
            next.corners = add(next.corners, 1.0);
        }
    }
    (next.x, next.y, next.z) = (position.x, position.y, position.z);
    next
}

impl Kernel for CellSums<'_> {
    const NAME: &'static str = "cell_sums";
    const SOURCE: &'static str = include_str!("../../shaders/cell_sums.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/cells.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params { steps: self.steps, unit: self.unit }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("sites", Access::Read, self.sites),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("origins", Access::Read, self.origins),
            Binding::new("pieces", Access::Read, self.pieces),
            Binding::new("piece_faces", Access::Read, self.piece_faces),
            Binding::new("sums", Access::Write, self.sums),
        ]
    }

    fn invocations(&self) -> u32 {
        self.piece_count
    }

    fn run_cpu(&mut self) {
        let mesh = Pieces {
            sites: self.sites.host(),
            faces: self.faces.host(),
            origins: self.origins.host(),
            pieces: self.pieces.host(),
            piece_faces: self.piece_faces.host(),
        };
        let Self { steps, unit, .. } = *self;
        let sums = &mut self.sums.host_mut()[..self.piece_count as usize];
        sums.par_iter_mut().enumerate().with_min_len(16).for_each(|(piece, sum)| {
            let origin = mesh.origins[mesh.pieces[piece][0] as usize];
            let cell = cell_box(origin, steps, unit);
            *sum = mesh.faces_of(piece).iter().fold(CellSum::default(), |sum, &face| {
                let [a, b, c] = mesh.corners_about(face, origin, unit);
                with_face(sum, cell, a, b, c)
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: CellBox = CellBox { low: Vec3::splat(-1.0), high: Vec3::splat(2.5) };

    #[test]
    fn a_face_adds_its_plane_and_its_corners() {
        // x = 2 with area 1½, and one corner beyond the cell.
        let [a, b, c] = [Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 3.0, 0.0), Vec3::new(2.0, 0.0, 1.0)];
        let sum = with_face(CellSum::default(), CELL, a, b, c);
        let plane = CellSum { xx: 1.5, bx: 3.0, c: 6.0, weight: 1.5, ..CellSum::default() };
        assert_eq!(sum, CellSum { x: 4.0, y: 0.0, z: 1.0, corners: 2.0, ..plane });
        let twice = with_face(sum, CellBox { low: Vec3::new(0.0, 3.0, 0.0), high: Vec3::splat(4.0) }, a, b, c);
        assert_eq!((twice.xx, twice.bx, twice.c, twice.weight), (3.0, 6.0, 12.0, 3.0));
        assert_eq!((twice.position(), twice.corners), (Vec3::new(6.0, 3.0, 1.0), 3.0));
    }

    #[test]
    fn a_face_without_area_adds_its_corners_only() {
        let sum = with_face(CellSum::default(), CELL, Vec3::ZERO, Vec3::X, Vec3::X * 2.0);
        assert_eq!(sum, CellSum { x: 3.0, corners: 3.0, ..CellSum::default() });
    }
}
