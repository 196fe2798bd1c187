//! Where the vertices of every cell go: to the least of the cell's quadric, or to the mean of its corners. Twin:
//! `shaders/representatives.wgsl`, line for line.
//!
//! # Reference
//! \[Lin00\]: the least point by the pseudoinverse, taken from the mean, so that what the planes leave open stays
//! there; eigenvalues below 10⁻³ of the greatest are dropped. \[LS01\]: one outside gives way to the best in the cell, here
//! by descent along the axes from where the cell holds it.

use rayon::prelude::*;

use super::cells::{CellBox, LEAST_COMPONENT, cell_box, sum_add};
use super::eigen::{NEGLIGIBLE, SWEEPS, eigen};
use super::rows::{CellSum, Site};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{
    LEAST_FACTOR, Sym3, add, add3, divide, dot3, flush, flush3, mul, scale3, sub, sub3, sym_mul, sym_scale,
};

/// Eigenvalues below this share of the greatest are dropped.
pub const DROPPED: f32 = 1e-3;
/// Sweeps over the axes that seek the best point in a cell: over five models they lower the deviation by 6 % at a tenth of
/// the faces against clamping alone, and ten sweeps by no more.
pub const HELD_SWEEPS: u32 = 3;
/// Along an axis of less than this curvature, in a matrix of trace 1, a point stays.
pub const FLAT: f32 = f32::from_bits((127 - 20) << 23);
/// Weights below this are of a cell without planes.
pub const NO_WEIGHT: f32 = f32::from_bits((127 - 48) << 23);

/// One invocation a cell.
pub struct Representatives<'a> {
    /// The site of the first vertex of every cell.
    pub origins: &'a Buffer<Site>,
    /// Where the pieces of every cell start, and the end.
    pub cell_pieces: &'a Buffer<u32>,
    /// What the pieces tell.
    pub sums: &'a Buffer<CellSum>,
    /// C.
    pub cell_count: u32,
    /// Steps to the side of a cell.
    pub steps: u32,
    /// Units a step: a power of two.
    pub unit: f32,
    /// Whether to take the mean.
    pub at_mean: bool,
    /// Writes C points about the origins, in units, each with its mean squared distance to the cell's planes.
    pub representatives: &'a mut Buffer<[f32; 4]>,
}

params! {
    /// The uniform block.
    pub struct Params {
        steps: u32,
        unit: f32,
        at_mean: u32,
    }
}

#[inline(always)]
fn sym_flush(m: Sym3, least: f32) -> Sym3 {
    Sym3::new(
        flush(m.xx, least),
        flush(m.xy, least),
        flush(m.xz, least),
        flush(m.yy, least),
        flush(m.yz, least),
        flush(m.zz, least),
    )
}

/// How far a point moves along an eigenvector towards the least.
#[inline(always)]
fn step_along(v: Vec3, value: f32, greatest: f32, pull: Vec3) -> Vec3 {
    if value > mul(DROPPED, greatest) {
        return scale3(v, divide(dot3(v, pull), value));
    }
    Vec3::ZERO
}

#[inline(always)]
fn held(x: Vec3, cell: CellBox) -> Vec3 {
    x.max(cell.low).min(cell.high)
}

/// Where the quadric is least along an axis, between `low` and `high`.
#[inline(always)]
fn least_along(x: f32, curvature: f32, pull: f32, low: f32, high: f32) -> f32 {
    if curvature < FLAT {
        return x;
    }
    flush(divide(pull, curvature), LEAST_COMPONENT).max(low).min(high)
}

/// The best point of a cell, from one near it.
#[inline(always)]
fn best_held(a: Sym3, b: Vec3, start: Vec3, cell: CellBox) -> Vec3 {
    let mut x = start;
    for _ in 0..HELD_SWEEPS {
        x.x = least_along(x.x, a.xx, sub(b.x, add(mul(a.xy, x.y), mul(a.xz, x.z))), cell.low.x, cell.high.x);
        x.y = least_along(x.y, a.yy, sub(b.y, add(mul(a.xy, x.x), mul(a.yz, x.z))), cell.low.y, cell.high.y);
        x.z = least_along(x.z, a.zz, sub(b.z, add(mul(a.xz, x.x), mul(a.yz, x.y))), cell.low.z, cell.high.z);
    }
    x
}

/// The point of a cell, and its mean squared distance to the planes.
#[inline(always)]
fn representative(sum: CellSum, cell: CellBox, at_mean: bool) -> [f32; 4] {
    let mean = flush3(scale3(sum.position(), divide(1.0, sum.corners)), LEAST_COMPONENT);
    if sum.weight < NO_WEIGHT {
        let x = held(mean, cell);
        return [x.x, x.y, x.z, 0.0];
    }
    let share = divide(1.0, sum.weight);
    let a = sym_flush(sym_scale(sum.matrix(), share), LEAST_FACTOR);
    let b = flush3(scale3(sum.linear(), share), LEAST_FACTOR);
    let mut x = mean;
    if !at_mean {
        let pull = flush3(sub3(b, sym_mul(a, mean)), LEAST_FACTOR);
        let e = eigen(a);
        let greatest = e.values.x.max(e.values.y).max(e.values.z);
        x = add3(x, step_along(e.x, e.values.x, greatest, pull));
        x = add3(x, step_along(e.y, e.values.y, greatest, pull));
        x = add3(x, step_along(e.z, e.values.z, greatest, pull));
        x = flush3(x, LEAST_COMPONENT);
    }
    let inside = held(x, cell);
    x = if at_mean || (inside.x == x.x && inside.y == x.y && inside.z == x.z) {
        inside
    } else {
        best_held(a, b, inside, cell)
    };
    let square = add(sub(dot3(x, sym_mul(a, x)), mul(2.0, dot3(b, x))), flush(mul(sum.c, share), LEAST_FACTOR));
    [x.x, x.y, x.z, flush(square.max(0.0), LEAST_FACTOR)]
}

impl Kernel for Representatives<'_> {
    const NAME: &'static str = "representatives";
    const SOURCE: &'static str = include_str!("../../shaders/representatives.wgsl");
    const SHARED: &'static [&'static str] =
        &[include_str!("../../shaders/shared/cells.wgsl"), include_str!("../../shaders/shared/eigen.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("LEAST_COMPONENT", Constant::F32(LEAST_COMPONENT)),
        ("SWEEPS", Constant::U32(SWEEPS)),
        ("NEGLIGIBLE", Constant::F32(NEGLIGIBLE)),
        ("DROPPED", Constant::F32(DROPPED)),
        ("HELD_SWEEPS", Constant::U32(HELD_SWEEPS)),
        ("FLAT", Constant::F32(FLAT)),
        ("NO_WEIGHT", Constant::F32(NO_WEIGHT)),
    ];

    fn params(&self) -> Params {
        Params { steps: self.steps, unit: self.unit, at_mean: u32::from(self.at_mean) }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("origins", Access::Read, self.origins),
            Binding::new("cell_pieces", Access::Read, self.cell_pieces),
            Binding::new("sums", Access::Read, self.sums),
            Binding::new("representatives", Access::Write, self.representatives),
        ]
    }

    fn invocations(&self) -> u32 {
        self.cell_count
    }

    fn run_cpu(&mut self) {
        let Self { steps, unit, at_mean, .. } = *self;
        let (origins, starts, sums) = (self.origins.host(), self.cell_pieces.host(), self.sums.host());
        let rows = &mut self.representatives.host_mut()[..self.cell_count as usize];
        rows.par_iter_mut().enumerate().with_min_len(64).for_each(|(cell, row)| {
            let pieces = &sums[starts[cell] as usize..starts[cell + 1] as usize];
            let sum = pieces.iter().fold(CellSum::default(), |sum, &piece| sum_add(sum, piece));
            *row = representative(sum, cell_box(origins[cell], steps, unit), at_mean);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::exact::outer;

    const CELL: CellBox = CellBox { low: Vec3::splat(-0.5), high: Vec3::splat(0.5) };

    /// Planes n·x = d of weight 2, and one corner.
    fn sum(planes: &[([f32; 3], f32)], corner: [f32; 3]) -> CellSum {
        let [x, y, z] = corner;
        planes.iter().fold(CellSum { x, y, z, corners: 1.0, ..CellSum::default() }, |sum, &(n, d)| {
            let (m, b) = (sym_scale(outer(Vec3::from(n)), 2.0), Vec3::from(n) * 2.0 * d);
            let [xx, xy, xz, yy, yz, zz] = [m.xx, m.xy, m.xz, m.yy, m.yz, m.zz];
            let plane = CellSum { xx, xy, xz, yy, yz, zz, bx: b.x, by: b.y, bz: b.z, ..CellSum::default() };
            sum_add(sum, CellSum { c: 2.0 * d * d, weight: 2.0, ..plane })
        })
    }

    const X: [f32; 3] = [1.0, 0.0, 0.0];
    const Y: [f32; 3] = [0.0, 1.0, 0.0];
    const Z: [f32; 3] = [0.0, 0.0, 1.0];

    #[test]
    fn three_planes_meet_in_their_corner() {
        let cube = sum(&[(X, 0.25), (Y, -0.125), (Z, 0.375)], [0.1, 0.1, 0.1]);
        assert_eq!(representative(cube, CELL, false), [0.25, -0.125, 0.375, 0.0]);
        assert_eq!(representative(cube, CELL, true)[..3], [0.1; 3]);
    }

    #[test]
    fn what_the_planes_leave_open_stays_at_the_mean() {
        let edge = sum(&[(X, 0.25), (Y, -0.25)], [0.1, 0.2, 0.3]);
        let [x, y, z, _] = representative(edge, CELL, false);
        assert!((x - 0.25).abs() < 1e-6 && (y + 0.25).abs() < 1e-6 && z == 0.3, "{x} {y} {z}");
        let flat = sum(&[(Z, 0.125), (Z, 0.375)], [0.1, 0.2, 0.3]);
        let [x, y, z, square] = representative(flat, CELL, false);
        assert_eq!([x, y, z], [0.1, 0.2, 0.25]);
        assert!((square - 0.125 * 0.125).abs() < 1e-6, "{square}");
        assert_eq!(representative(sum(&[], [0.1, 0.2, 0.3]), CELL, false), [0.1, 0.2, 0.3, 0.0]);
    }

    #[test]
    fn nearly_parallel_planes_do_not_send_it_far_away() {
        // They meet at x = −10 or beyond: their common direction is the only one that counts.
        let tilted = [0.01, 0.0, 0.999_95];
        let [x, ..] = representative(sum(&[(Z, 0.0), (tilted, 0.1)], [0.1, 0.2, 0.0]), CELL, false);
        assert!((x - 0.1).abs() < 1e-3, "{x}");
    }

    #[test]
    fn the_cell_holds_it() {
        let outside = sum(&[(X, 3.0), (Y, -2.0), (Z, 0.25)], [0.1, 0.2, 0.3]);
        assert_eq!(representative(outside, CELL, false)[..3], [0.5, -0.5, 0.25]);
        // On the side x = ½ the least of ½(x + y − 4)² + (y + 1¼)² is at ⅓; clamping the least of all gives −½.
        let half = 0.5_f32.sqrt();
        let planes = [([half, half, 0.0], 4.0 * half), (X, 3.0), (Y, -1.25)];
        let [x, y, z, _] = representative(sum(&planes, [0.1, 0.2, 0.3]), CELL, false);
        assert!(x == 0.5 && (y - 1.0 / 3.0).abs() < 1e-5 && (z - 0.3).abs() < 1e-6, "{x} {y} {z}");
        let cell = cell_box(Site { x: 29, y: 30, z: 31 }, 10, 0.0625);
        assert_eq!((cell.low, cell.high), (Vec3::new(-9.0, 0.0, -1.0) / 16.0, Vec3::new(1.0, 10.0, 9.0) / 16.0));
    }
}
