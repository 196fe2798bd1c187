//! The curvature of every vertex on a border: the mean of its neighbors off the border. Twin:
//! `shaders/border_curvatures.wgsl`, line for line.

use rayon::prelude::*;

use super::rows::{BORDER, FLAGS, Face, Position};
use super::split::CHUNK;
use super::stars::{Stars, spoke};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::exact::{add, divide};

/// One invocation a vertex.
pub struct BorderCurvatures<'a> {
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
    /// V mean curvatures; those on a border are written and no other, zero where every neighbor is on one as well.
    pub curvatures: &'a mut Buffer<f32>,
}

#[inline(always)]
fn mean_around(vertex: u32, stars: &Stars<'_>, curvatures: &[f32]) -> f32 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for &f in stars.ring(vertex) {
        // A neighbor off the border is a corner of two faces here.
        let seen = spoke(stars.faces[f as usize], vertex);
        for end in [seen.next, seen.last] {
            if stars.positions[end as usize].flags & BORDER == 0 {
                sum = add(sum, curvatures[end as usize]);
                count = add(count, 1.0);
            }
        }
    }
    divide(sum, count)
}

impl Kernel for BorderCurvatures<'_> {
    const NAME: &'static str = "border_curvatures";
    const SOURCE: &'static str = include_str!("../../shaders/border_curvatures.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/stars.wgsl")];
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = FLAGS;

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("curvatures", Access::Write, self.curvatures),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let stars = Stars::on_host(self.positions, self.faces, self.ring_starts, self.ring_faces);
        let curvatures = self.curvatures.host_mut();
        let before = &*curvatures;
        let on_border = |&vertex: &u32| stars.positions[vertex as usize].flags & BORDER != 0;
        let means: Vec<(u32, f32)> = (0..self.vertex_count)
            .into_par_iter()
            .with_min_len(CHUNK)
            .filter(on_border)
            .map(|vertex| (vertex, mean_around(vertex, &stars, before)))
            .collect();
        means.into_iter().for_each(|(vertex, mean)| curvatures[vertex as usize] = mean);
    }
}
