//! What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
//! `shaders/attribute_spreads.wgsl`, number by number: the same operations in the same order, eight numbers side by side here
//! and four there, and here the gradients of a face are found once ([`super::gradient_table`]).
//!
//! # Reference
//! \[HO99\]: the faces of a wedge agree in its numbers at its place v, and with the gradients g and their mean ḡ differ at x
//! by (x−v)ᵀ S (x−v), squared and weighted by |n|, where S = Σ |n| (g−ḡ)(g−ḡ)ᵀ over all numbers: a quadric about the vertex,
//! as that of its planes is. Departs: memoryless as the geometry is, and a pair costs the spreads of both ends instead of
//! that of all their faces together. Ends share faces, so that what is linear around either is linear around both; those
//! faces count twice.
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rayon::prelude::*;

use super::gradient_table::{GradientTable, Gradients, Rows, flush};
use super::pair_quadric::NO_AREA;
use super::rows::{Face, GradientOperator, HUB_FACES, VolumeSum};
use super::split::rows_each;
use super::warm::faces_near;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{Sym3, add, divide, mul, sym_add, sym_scale};
use crate::math::lanes::{NUMBERS, Numbers};

/// Most numbers of a wedge that decide.
pub const MOST_COSTED: usize = 16;

/// What spreads count: with 1 colors of a scan are 10 % farther off, with 3 its surface is by 4 %.
const SPREAD_FACTOR: f32 = 1.5;

/// One invocation a vertex.
pub struct AttributeSpreads<'a> {
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// The first wedge of each of V vertices, and the end.
    pub wedge_starts: &'a Buffer<u32>,
    /// `width` numbers for each wedge, first those that decide.
    pub values: &'a Buffer<f32>,
    /// What makes gradients of the numbers at the corners of F faces.
    pub operators: &'a Buffer<GradientOperator>,
    /// V.
    pub vertex_count: u32,
    /// Numbers of a wedge.
    pub width: u32,
    /// Those that decide.
    pub costed: u32,
    /// Adds to the sums of V vertices; not to a hub's.
    pub sums: &'a mut Buffer<VolumeSum>,
}

params! {
    /// The uniform block.
    pub struct Params {
        width: u32,
        costed: u32,
    }
}

/// Vertices of a task on the host, at least and at most: the gradients of the faces near so many, 256 KiB for every eight numbers, fit a
/// core's second cache.
const VERTICES_EACH: [usize; 2] = [1 << 8, 1 << 10];

/// The faces around vertices, on the host.
#[derive(Clone, Copy)]
struct Rings<'a> {
    starts: &'a [u32],
    faces: &'a [u32],
    /// The first wedge of each vertex, and the end.
    wedge_starts: &'a [u32],
}

/// What spreads are found with, on the host.
struct Scratch<'a> {
    table: GradientTable<'a>,
    /// The faces of a wedge, and their gradients.
    own: Vec<u32>,
    gradients: Vec<Gradients>,
}

#[inline(always)]
fn mean_of<S: Simd>(simd: S, sum: f32x8<S>, inverse: f32) -> f32x8<S> {
    flush(simd, sum * inverse)
}

#[inline(always)]
fn off_mean<S: Simd>(simd: S, g: f32x8<S>, mean: f32x8<S>, root: f32) -> f32x8<S> {
    flush(simd, g - mean * root)
}

/// Adds the spread over the faces of a wedge, which is none over one. What a number adds is summed in a lane of its own,
/// before what the next does. `gradients` is overwritten.
///
/// Written out along the axes: a closure given to `map` would be compiled for any processor.
#[inline(always)]
fn add_wedge<S: Simd>(
    simd: S,
    mut spread: Sym3,
    faces: &[u32],
    table: &GradientTable<'_>,
    gradients: &mut Vec<Gradients>,
) -> Sym3 {
    if faces.len() < 2 {
        return spread;
    }
    gradients.resize(gradients.len().max(faces.len()), Gradients::default());
    let gradients = &mut gradients[..faces.len()];
    let ([_, costed], zero) = (table.counts(), f32x8::splat(simd, 0.0));
    for first in (0..costed).step_by(NUMBERS) {
        let (mut weight, mut x_sum, mut y_sum, mut z_sum) = (0.0, zero, zero, zero);
        for (own, &f) in gradients.iter_mut().zip(faces) {
            let g = table.get(simd, f, first);
            *own = g.store();
            weight = add(weight, mul(g.root, g.root));
            x_sum += g.x * g.root;
            y_sum += g.y * g.root;
            z_sum += g.z * g.root;
        }
        let inverse = if weight > NO_AREA { divide(1.0, weight) } else { 0.0 };
        let x_mean = mean_of(simd, x_sum, inverse);
        let y_mean = mean_of(simd, y_sum, inverse);
        let z_mean = mean_of(simd, z_sum, inverse);
        let (mut xx, mut xy, mut xz, mut yy, mut yz, mut zz) = (zero, zero, zero, zero, zero, zero);
        for own in &*gradients {
            let g = own.load(simd);
            let x = off_mean(simd, g.x, x_mean, g.root);
            let y = off_mean(simd, g.y, y_mean, g.root);
            let z = off_mean(simd, g.z, z_mean, g.root);
            xx += x * x;
            xy += x * y;
            xz += x * z;
            yy += y * y;
            yz += y * z;
            zz += z * z;
        }
        let (xx, xy, xz): (Numbers<f32>, Numbers<f32>, Numbers<f32>) = (xx.into(), xy.into(), xz.into());
        let (yy, yz, zz): (Numbers<f32>, Numbers<f32>, Numbers<f32>) = (yy.into(), yz.into(), zz.into());
        for j in 0..NUMBERS.min(costed - first) {
            spread.xx = add(spread.xx, xx[j]);
            spread.xy = add(spread.xy, xy[j]);
            spread.xz = add(spread.xz, xz[j]);
            spread.yy = add(spread.yy, yy[j]);
            spread.yz = add(spread.yz, yz[j]);
            spread.zz = add(spread.zz, zz[j]);
        }
    }
    spread
}

/// What a vertex sums to with the spread of its wedges.
#[inline(always)]
fn with_spread(sum: VolumeSum, spread: Sym3) -> VolumeSum {
    let Sym3 { xx, xy, xz, yy, yz, zz } = sym_add(sum.matrix(), sym_scale(spread, SPREAD_FACTOR));
    VolumeSum { xx, xy, xz, yy, yz, zz, ..sum }
}

/// Adds to the sums of the vertices from `first` on.
#[inline(always)]
fn add_spreads<S: Simd>(
    simd: S,
    first: usize,
    rings: Rings<'_>,
    Scratch { table, own, gradients }: &mut Scratch<'_>,
    sums: &mut [VolumeSum],
) {
    let (vertices, [face_count, _]) = (first..first + sums.len(), table.counts());
    table.fill(simd, faces_near(vertices.clone(), rings.starts, rings.faces, face_count));
    for (vertex, sum) in vertices.zip(sums) {
        let ring = &rings.faces[rings.starts[vertex] as usize..rings.starts[vertex + 1] as usize];
        let ring = if ring.len() > HUB_FACES as usize { &[] } else { ring };
        let wedges = rings.wedge_starts[vertex]..rings.wedge_starts[vertex + 1];
        let mut spread = Sym3::default();
        if wedges.len() == 1 {
            spread = add_wedge(simd, spread, ring, table, gradients);
        } else if wedges.len() < ring.len() {
            // Between rounds each has a face (`contract::wedges`), so that here some have more than one.
            for wedge in wedges {
                // Written whether it is one or not: a branch would be misjudged at every second.
                own.resize(ring.len(), 0);
                let mut count = 0;
                for &f in ring {
                    own[count] = f;
                    count += usize::from(table.has_wedge(f, wedge));
                }
                spread = add_wedge(simd, spread, &own[..count], table, gradients);
            }
        }
        *sum = with_spread(*sum, spread);
    }
}

impl Kernel for AttributeSpreads<'_> {
    const NAME: &'static str = "attribute_spreads";
    const SOURCE: &'static str = include_str!("../../shaders/attribute_spreads.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("HUB_FACES", Constant::U32(HUB_FACES)),
        ("NO_AREA", Constant::F32(NO_AREA)),
        ("SPREAD_FACTOR", Constant::F32(SPREAD_FACTOR)),
    ];

    fn params(&self) -> Params {
        Params { width: self.width, costed: self.costed }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("wedge_starts", Access::Read, self.wedge_starts),
            Binding::new("values", Access::Read, self.values),
            Binding::new("operators", Access::Read, self.operators),
            Binding::new("sums", Access::Write, self.sums),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let rings = Rings {
            starts: self.ring_starts.host(),
            faces: self.ring_faces.host(),
            wedge_starts: self.wedge_starts.host(),
        };
        let rows = Rows {
            operators: self.operators.host(),
            corners: self.corners.host(),
            values: self.values.host(),
            width: self.width as usize,
            costed: self.costed as usize,
        };
        let level = Level::new();
        let scratch = || Scratch { table: GradientTable::new(rows), own: Vec::new(), gradients: Vec::new() };
        let vertices = ..self.vertex_count as usize;
        let each = rows_each(vertices.end, VERTICES_EACH);
        let sums = self.sums.host_mut()[vertices].par_chunks_mut(each).enumerate();
        sums.for_each_init(scratch, |scratch, (chunk, sums)| {
            dispatch!(level, simd => add_spreads(simd, chunk * each, rings, scratch, sums));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spread over faces, the first of which is in the table.
    fn spread_of(faces: &[u32], rows: Rows<'_>) -> Sym3 {
        let (mut table, mut gradients) = (GradientTable::new(rows), Vec::new());
        dispatch!(Level::new(), simd => {
            table.fill(simd, 0..1);
            add_wedge(simd, Sym3::default(), faces, &table, &mut gradients)
        })
    }

    /// One number that is bent along x: its gradients are (±2, 1, 0) on faces of |n| 4 and 1.
    #[test]
    fn gradients_spread_about_their_mean() {
        let operator = |root: f32, x: f32| GradientOperator { bx: root * x, cy: root, root, ..Default::default() };
        let operators = [operator(2.0, 2.0), operator(1.0, -2.0)];
        let corners = [Face { a: 0, b: 1, c: 2 }; 2];
        let rows = Rows { operators: &operators, corners: &corners, values: &[3.0, 4.0, 4.0], width: 1, costed: 1 };
        let spread_of = |faces: &[u32]| spread_of(faces, rows);
        // The mean is (6/5, 1, 0).
        let spread = spread_of(&[0, 1]);
        assert!((spread.xx - (4.0 * 0.64 + 10.24)).abs() < 1e-5 && spread.yy < 1e-12, "{spread:?}");
        assert_eq!([spread.xz, spread.yz, spread.zz], [0.0; 3]);
        // What is linear on all faces does not spread.
        assert!(spread_of(&[0, 0]).xx < 1e-10);
        assert_eq!(spread_of(&[1]), Sym3::default());
        assert_eq!(spread_of(&[]), Sym3::default());
    }

    #[test]
    fn every_number_of_any_block_counts_once() {
        let (width, costed) = (12, 11);
        let operators = [1.0, -1.0].map(|bx| GradientOperator { bx, root: 1.0, ..Default::default() });
        let corners = [Face { a: 0, b: 1, c: 0 }; 2];
        // Differences of 0, 1, 2 … between both wedges.
        let values: Vec<f32> = (0..2).flat_map(|wedge| (0..width).map(move |j| (wedge * j) as f32)).collect();
        let rows = Rows { operators: &operators, corners: &corners, values: &values, width, costed };
        let spread = spread_of(&[0, 1], rows);
        let squares: usize = (0..costed).map(|j| 2 * j * j).sum();
        assert_eq!(spread, Sym3 { xx: squares as f32, ..Sym3::default() });
    }
}
