//! What the faces of every piece tell its cell: their quadrics and the corners inside. Twin: `shaders/cell_sums.wgsl`,
//! line for line.
//!
//! A face counts once in every cell that it touches, and each of its corners in the cell where it lies: a soup has the
//! sums of the same mesh welded.
//!
//! # Reference
//! \[Lin00\]: quadrics of faces summed at the cells of their corners. Departs: weighted by area instead of its
//! square, like the metric `plane`, and once for a face with several corners in a cell.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::cells::{
    CONSTANTS, CellBox, LEAST_COMPONENT, NO_PLANE, Pieces, about, box_from, is_in, lowest_site, sum_add,
};
use super::rows::{CellSum, Face, Site};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, add3, cross3, divide, dot3, flush, flush3, mul, outer, root, scale3, sub3, sym_scale,
};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

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

/// What a face that has a corner in the cell tells it.
#[inline(always)]
fn face_sum(a: Vec3, b: Vec3, c: Vec3, cell: CellBox) -> CellSum {
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    let length = root(n_sq);
    let u = flush3(scale3(n, divide(1.0, length)), LEAST_COMPONENT);
    let weight = if n_sq > NO_PLANE { mul(0.5, length) } else { 0.0 };
    let a_in = is_in(a, cell);
    let b_in = is_in(b, cell);
    let c_in = is_in(c, cell);
    // From a corner in the cell: it is near, and the distance to the plane loses no digits.
    let inside = if a_in {
        a
    } else if b_in {
        b
    } else {
        c
    };
    let d = flush(dot3(u, inside), LEAST_COMPONENT);
    let matrix = sym_scale(outer(u), weight);
    let linear = scale3(u, mul(weight, d));
    let position = add3(
        add3(if a_in { a } else { Vec3::ZERO }, if b_in { b } else { Vec3::ZERO }),
        if c_in { c } else { Vec3::ZERO },
    );
    CellSum {
        xx: matrix.xx,
        xy: matrix.xy,
        xz: matrix.xz,
        yy: matrix.yy,
        yz: matrix.yz,
        zz: matrix.zz,
        bx: linear.x,
        by: linear.y,
        bz: linear.z,
        c: mul(weight, mul(d, d)),
        weight,
        x: position.x,
        y: position.y,
        z: position.z,
        corners: (u32::from(a_in) + u32::from(b_in) + u32::from(c_in)) as f32,
    }
}

/// A face of a piece: its corners, the origin of the cell, and the site where the cell begins.
#[repr(C)]
#[derive(Clone, Copy, Zeroable, Pod)]
struct PieceFace {
    a: Site,
    b: Site,
    c: Site,
    origin: Site,
    lowest: Site,
}

const FACE_WORDS: usize = size_of::<PieceFace>() / 4;

/// Faces of a few pieces on the host.
#[derive(Clone, Copy)]
struct Block<'a> {
    mesh: &'a Pieces<'a>,
    /// Where the faces start.
    first: usize,
    /// Their pieces, from the first of these.
    of_pieces: &'a [u32; LANES],
    /// Origin and lowest site of each piece.
    cells: &'a [[Site; 2]],
}

impl Lane for PieceFace {
    type Source<'a> = Block<'a>;
    type Params = Params;
    type Output = CellSum;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], block: Block<'_>, lanes: &mut Quad<'_>) {
        let Pieces { faces, sites, piece_faces, .. } = block.mesh;
        let faces = indices.map(|index| &faces[piece_faces[block.first + index] as usize]);
        lanes.put::<_, 3>(faces.map(|face| &sites[face.a as usize]));
        lanes.put::<_, 3>(faces.map(|face| &sites[face.b as usize]));
        lanes.put::<_, 3>(faces.map(|face| &sites[face.c as usize]));
        // Its origin and the lowest site.
        lanes.put::<_, 6>(indices.map(|index| &block.cells[block.of_pieces[index] as usize]));
    }

    #[inline(always)]
    fn compute(self, Params { steps, unit }: Params) -> CellSum {
        let [a, b, c] = [self.a, self.b, self.c].map(|site| about(site, self.origin, unit));
        face_sum(a, b, c, box_from(about(self.lowest, self.origin, unit), steps, unit))
    }
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
        let params = self.params();
        let sums = &mut self.sums.host_mut()[..self.piece_count as usize];
        // Gathered first and computed then: misses of the cache overlap, and no branch waits for one.
        sums.par_chunks_mut(PIECES_EACH).enumerate().for_each_init(Room::default, |room, (chunk, sums)| {
            room.sum(&mesh, chunk * PIECES_EACH, params, sums);
        });
    }
}

/// Pieces that a thread takes at a time.
const PIECES_EACH: usize = 16;

/// Room of a thread.
struct Room {
    cells: Vec<[Site; 2]>,
    columns: Columns<PieceFace, FACE_WORDS>,
    outputs: [CellSum; LANES],
}

impl Default for Room {
    fn default() -> Self {
        Self { cells: Vec::new(), columns: Columns::new(), outputs: [CellSum::default(); LANES] }
    }
}

impl Room {
    /// Sums pieces from `first` on, their faces in ascending order.
    fn sum(&mut self, mesh: &Pieces<'_>, first: usize, params: Params, sums: &mut [CellSum]) {
        let pieces = &mesh.pieces[first..=first + sums.len()];
        let origin = |&[cell, _]: &[u32; 2]| mesh.origins[cell as usize];
        self.cells.clear();
        self.cells.extend(pieces[..sums.len()].iter().map(origin).map(|site| [site, lowest_site(site, params.steps)]));
        sums.fill(CellSum::default());
        let (start, end) = (pieces[0][1] as usize, pieces[sums.len()][1] as usize);
        let mut piece = 0;
        let mut of_pieces = [0; LANES];
        for first in (start..end).step_by(LANES) {
            let count = LANES.min(end - first);
            for (face, of) in (first..).zip(&mut of_pieces[..count]) {
                while pieces[piece + 1][1] as usize <= face {
                    piece += 1;
                }
                *of = piece as u32;
            }
            let block = Block { mesh, first, of_pieces: &of_pieces, cells: &self.cells };
            lanes::compute(0, block, params, &mut self.columns, &mut self.outputs[..count]);
            for (&of, &output) in of_pieces[..count].iter().zip(&self.outputs) {
                sums[of as usize] = sum_add(sums[of as usize], output);
            }
        }
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
        let plane = CellSum { xx: 1.5, bx: 3.0, c: 6.0, weight: 1.5, ..CellSum::default() };
        assert_eq!(face_sum(a, b, c, CELL), CellSum { x: 4.0, y: 0.0, z: 1.0, corners: 2.0, ..plane });
        let other = CellBox { low: Vec3::new(0.0, 3.0, 0.0), high: Vec3::splat(4.0) };
        let both = sum_add(face_sum(a, b, c, CELL), face_sum(a, b, c, other));
        let plane = CellSum { xx: 3.0, bx: 6.0, c: 12.0, weight: 3.0, ..CellSum::default() };
        assert_eq!(both, CellSum { x: 6.0, y: 3.0, z: 1.0, corners: 3.0, ..plane });
    }

    #[test]
    fn a_face_without_area_adds_its_corners_only() {
        let sum = face_sum(Vec3::ZERO, Vec3::X, Vec3::X * 2.0, CELL);
        assert_eq!(sum, CellSum { x: 3.0, corners: 3.0, ..CellSum::default() });
    }
}
