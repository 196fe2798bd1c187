//! What the kernels of vertex clustering share. In WGSL: `shaders/shared/cells.wgsl`.

use super::rows::{CellSum, Face, Site};
use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{add3, mul};

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

/// The cell of a site that is its origin.
#[inline(always)]
pub fn cell_box(origin: Site, steps: u32, unit: f32) -> CellBox {
    let lowest = Site { x: origin.x / steps * steps, y: origin.y / steps * steps, z: origin.z / steps * steps };
    let low = about(lowest, origin, unit);
    CellBox { low, high: add3(low, Vec3::splat(mul(steps as f32, unit))) }
}

/// Whether a corner lies in a cell; no number is rounded on the way here.
#[inline(always)]
pub fn is_in(p: Vec3, cell: CellBox) -> bool {
    p.cmpge(cell.low).all() && p.cmplt(cell.high).all()
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
