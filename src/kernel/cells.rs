//! What the kernels of vertex clustering share. In WGSL: `shaders/shared/cells.wgsl`.

use super::rows::{CellSum, Face, Site};
use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{add, add3, mul, sym_add};

/// Faces of a cell that one invocation takes at most; the loops over pieces of a cell stay short as well.
pub const PIECE_FACES: u32 = 1024;
/// Faces below this squared doubled area, in units of about a cell's side, have no plane.
pub const NO_PLANE: f32 = f32::from_bits((127 - 80) << 23);
/// Components of a unit normal, and distances along one, below this are zero, so that no product with one underflows.
pub const LEAST_COMPONENT: f32 = f32::from_bits((127 - 24) << 23);
/// The constants above under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] =
    &[("NO_PLANE", Constant::F32(NO_PLANE)), ("LEAST_COMPONENT", Constant::F32(LEAST_COMPONENT))];

/// A site about another, in units: exact, for it has 24 digits and the unit is a power of two.
#[inline(always)]
pub fn about(site: Site, origin: Site, unit: f32) -> Vec3 {
    Vec3::new(
        mul(site.x.wrapping_sub(origin.x) as i32 as f32, unit),
        mul(site.y.wrapping_sub(origin.y) as i32 as f32, unit),
        mul(site.z.wrapping_sub(origin.z) as i32 as f32, unit),
    )
}

/// A cell about its origin: its lowest and its highest corner, in units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellBox {
    /// The lowest corner, which belongs to the cell.
    pub low: Vec3,
    /// The highest corner, which belongs to others.
    pub high: Vec3,
}

/// The site where the cell of a site begins.
#[inline(always)]
pub fn lowest_site(site: Site, steps: u32) -> Site {
    Site { x: site.x / steps * steps, y: site.y / steps * steps, z: site.z / steps * steps }
}

/// The cell whose lowest corner is given.
#[inline(always)]
pub fn box_from(low: Vec3, steps: u32, unit: f32) -> CellBox {
    CellBox { low, high: add3(low, Vec3::splat(mul(steps as f32, unit))) }
}

/// The cell of a site that is its origin.
#[inline(always)]
pub fn cell_box(origin: Site, steps: u32, unit: f32) -> CellBox {
    box_from(about(lowest_site(origin, steps), origin, unit), steps, unit)
}

/// Whether a corner lies in a cell; no number is rounded on the way here.
#[inline(always)]
pub fn is_in(p: Vec3, cell: CellBox) -> bool {
    (p.x >= cell.low.x)
        & (p.y >= cell.low.y)
        & (p.z >= cell.low.z)
        & (p.x < cell.high.x)
        & (p.y < cell.high.y)
        & (p.z < cell.high.z)
}

/// A mesh and its cells as the kernels of a piece see them on the host.
#[derive(Debug, Clone, Copy)]
pub struct Pieces<'a> {
    /// V sites.
    pub sites: &'a [Site],
    /// F faces.
    pub faces: &'a [Face],
    /// The site of the first vertex of every cell.
    pub origins: &'a [Site],
    /// The cell of every piece and where its faces start; one more that ends the last.
    pub pieces: &'a [[u32; 2]],
    /// The faces of every cell, ascending.
    pub piece_faces: &'a [u32],
}

impl Pieces<'_> {
    /// The faces of a piece.
    #[inline(always)]
    pub fn faces_of(&self, piece: usize) -> &[u32] {
        &self.piece_faces[self.pieces[piece][1] as usize..self.pieces[piece + 1][1] as usize]
    }

    /// The corners of a face about an origin.
    #[inline(always)]
    pub fn corners_about(&self, face: u32, origin: Site, unit: f32) -> [Vec3; 3] {
        self.faces[face as usize].corners().map(|v| about(self.sites[v as usize], origin, unit))
    }
}

impl CellSum {
    /// The linear term.
    #[inline(always)]
    pub fn linear(self) -> Vec3 {
        Vec3::new(self.bx, self.by, self.bz)
    }

    /// The sum of the corners.
    #[inline(always)]
    pub fn position(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }
}

/// The sum of two, about the same origin.
#[inline(always)]
pub fn sum_add(a: CellSum, b: CellSum) -> CellSum {
    let matrix = sym_add(a.matrix(), b.matrix());
    let linear = add3(a.linear(), b.linear());
    let position = add3(a.position(), b.position());
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
        c: add(a.c, b.c),
        weight: add(a.weight, b.weight),
        x: position.x,
        y: position.y,
        z: position.z,
        corners: add(a.corners, b.corners),
    }
}
