//! Multiplies the quadric of every vertex by its weight. Twin: `shaders/weigh_quadrics.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::PlaneQuadric;
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Kernel};
use crate::math::exact::{LEAST, flush, mul};

/// One invocation a vertex.
pub struct WeighQuadrics<'a> {
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// V weights.
    pub weights: &'a Buffer<f32>,
    /// V.
    pub vertex_count: u32,
    /// Writes V quadrics.
    pub weighed_quadrics: &'a mut Buffer<PlaneQuadric>,
}

/// A quadric whose value is `weight` times that of `q`. Its weight grows as well: the deviation that it tells stays a length.
#[inline(always)]
pub fn weighed(q: PlaneQuadric, weight: f32) -> PlaneQuadric {
    let w = flush(weight, LEAST);
    PlaneQuadric {
        xx: flush(mul(q.xx, w), LEAST),
        xy: flush(mul(q.xy, w), LEAST),
        xz: flush(mul(q.xz, w), LEAST),
        yy: flush(mul(q.yy, w), LEAST),
        yz: flush(mul(q.yz, w), LEAST),
        zz: flush(mul(q.zz, w), LEAST),
        bx: flush(mul(q.bx, w), LEAST),
        by: flush(mul(q.by, w), LEAST),
        bz: flush(mul(q.bz, w), LEAST),
        c: flush(mul(q.c, w), LEAST),
        weight: flush(mul(q.weight, w), LEAST),
    }
}

impl Kernel for WeighQuadrics<'_> {
    const NAME: &'static str = "weigh_quadrics";
    const SOURCE: &'static str = include_str!("../../shaders/weigh_quadrics.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("weights", Access::Read, self.weights),
            Binding::new("weighed_quadrics", Access::Write, self.weighed_quadrics),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let rows = self.quadrics.host().par_iter().zip(self.weights.host());
        let out = &mut self.weighed_quadrics.host_mut()[..self.vertex_count as usize];
        out.par_iter_mut().zip(rows).with_min_len(CHUNK).for_each(|(out, (&quadric, &weight))| {
            *out = weighed(quadric, weight);
        });
    }
}
