//! Adds the quadrics of both ends of every accepted contraction, about the new position. Twin:
//! `shaders/contract_quadrics.wgsl`, line for line.

use super::plane_quadric::{moved, sum_moved};
use super::rows::{Contraction, PlaneQuadric, Position};
use crate::backend::{Access, Binding, Buffer, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_SUM, add, flush, flush3, sub3};

/// One invocation a contraction. Runs before the positions change.
pub struct ContractQuadrics<'a> {
    /// Accepted contractions; no vertex occurs twice.
    pub contractions: &'a Buffer<Contraction>,
    /// How many.
    pub contraction_count: u32,
    /// V positions of before.
    pub positions: &'a Buffer<Position>,
    /// V quadrics, changed in place.
    pub quadrics: &'a mut Buffer<PlaneQuadric>,
}

/// The sum of two quadrics, about `x`; `a` and `b` are where they stand.
#[inline(always)]
pub fn contracted(first: PlaneQuadric, second: PlaneQuadric, a: Vec3, b: Vec3, x: Vec3) -> PlaneQuadric {
    let q = sum_moved(moved(first, sub3(x, a)), moved(second, sub3(x, b)));
    let linear = flush3(q.b, LEAST_SUM);
    PlaneQuadric {
        xx: q.a.xx,
        xy: q.a.xy,
        xz: q.a.xz,
        yy: q.a.yy,
        yz: q.a.yz,
        zz: q.a.zz,
        bx: linear.x,
        by: linear.y,
        bz: linear.z,
        c: flush(q.c, LEAST_SUM),
        weight: add(first.weight, second.weight),
    }
}

impl Kernel for ContractQuadrics<'_> {
    const NAME: &'static str = "contract_quadrics";
    const SOURCE: &'static str = include_str!("../../shaders/contract_quadrics.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/plane_quadric.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("contractions", Access::Read, self.contractions),
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("quadrics", Access::Write, self.quadrics),
        ]
    }

    fn invocations(&self) -> u32 {
        self.contraction_count
    }

    fn run_cpu(&mut self) {
        let (positions, quadrics) = (self.positions.host(), self.quadrics.host_mut());
        for c in &self.contractions.host()[..self.contraction_count as usize] {
            let (keep, gone) = (c.keep as usize, c.gone as usize);
            let x = Vec3::new(c.x, c.y, c.z);
            quadrics[keep] =
                contracted(quadrics[keep], quadrics[gone], positions[keep].xyz(), positions[gone].xyz(), x);
        }
    }
}
