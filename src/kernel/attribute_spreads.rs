//! What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
//! `shaders/attribute_spreads.wgsl`, number by number: the same operations in the same order, eight numbers side by side here
//! and four there.
//!
//! # Reference
//! \[HO99\]: the faces of a wedge agree in its numbers at its place v, and with the gradients g and their mean ḡ differ at x
//! by (x−v)ᵀ S (x−v), squared and weighted by |n|, where S = Σ |n| (g−ḡ)(g−ḡ)ᵀ over all numbers: a quadric about the vertex,
//! as that of its planes is. Departs: memoryless as the geometry is, and a pair costs the spreads of both ends instead of
//! that of all their faces together. Ends share faces, so that what is linear around either is linear around both; those
//! faces count twice.
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.

use std::ops::Range;

use multiversion::multiversion;
use rayon::prelude::*;

use super::pair_quadric::NO_AREA;
use super::rows::{Face, GradientOperator, HUB_FACES, VolumeSum};
use super::warm::{faces_near, warm_up};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST_FACTOR, Sym3, add, divide, flush, mul, sub, sym_add, sym_scale};
use crate::math::lanes::{NUMBERS, Numbers, numbers_at};

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

type Lanes = Numbers<f32>;

/// Vertices of a task on the host: the rows around them fit a core's second cache.
const VERTICES_EACH: usize = 1 << 11;

/// What spreads are found from, on the host.
#[derive(Clone, Copy)]
struct Rows<'a> {
    operators: &'a [GradientOperator],
    corners: &'a [Face],
    values: &'a [f32],
    width: usize,
    costed: usize,
}

impl Rows<'_> {
    /// Reads the rows of the wedges of consecutive vertices once, and those of faces near them.
    fn warm_up(&self, vertices: Range<usize>, rings: Rings<'_>, wedge_starts: &[u32]) {
        let [first, end] = [vertices.start, vertices.end].map(|vertex| wedge_starts[vertex] as usize * self.width);
        let faces = faces_near(vertices, rings.starts, rings.faces, self.corners.len().min(self.operators.len()));
        warm_up(&self.values[first..end]);
        warm_up(&self.operators[faces.clone()]);
        warm_up(&self.corners[faces]);
    }
}

/// The faces around vertices, on the host.
#[derive(Clone, Copy)]
struct Rings<'a> {
    starts: &'a [u32],
    faces: &'a [u32],
}

/// √|n| times the gradients of a face, and √|n|.
#[derive(Clone, Copy, Default)]
struct Gradients {
    root: f32,
    along: [Lanes; 3],
}

/// Of the numbers from `first` on. Lanes past the last number hold anything.
#[inline(always)]
fn gradients_of(f: u32, first: usize, rows: Rows<'_>) -> Gradients {
    let row = rows.operators[f as usize];
    let wedges = rows.corners[f as usize].corners();
    let [a, b, c] = wedges.map(|wedge| numbers_at(rows.values, wedge as usize * rows.width + first));
    let (b, c) = (less(&b, &a), less(&c, &a));
    let GradientOperator { bx, by, bz, cx, cy, cz, root } = row;
    Gradients { root, along: [sum_of(bx, &b, cx, &c), sum_of(by, &b, cy, &c), sum_of(bz, &b, cz, &c)] }
}

#[inline(always)]
fn less(numbers: &Lanes, base: &Lanes) -> Lanes {
    let mut difference = [0.0; NUMBERS];
    for j in 0..NUMBERS {
        difference[j] = sub(numbers[j], base[j]);
    }
    difference
}

#[inline(always)]
fn sum_of(along_b: f32, b: &Lanes, along_c: f32, c: &Lanes) -> Lanes {
    let mut sum = [0.0; NUMBERS];
    for j in 0..NUMBERS {
        sum[j] = flush(add(mul(along_b, b[j]), mul(along_c, c[j])), LEAST_FACTOR);
    }
    sum
}

#[inline(always)]
fn add_scaled(sum: &mut Lanes, g: &Lanes, scale: f32) {
    for j in 0..NUMBERS {
        sum[j] = add(sum[j], mul(g[j], scale));
    }
}

#[inline(always)]
fn mean_of(sum: &Lanes, inverse: f32) -> Lanes {
    let mut mean = [0.0; NUMBERS];
    for j in 0..NUMBERS {
        mean[j] = flush(mul(sum[j], inverse), LEAST_FACTOR);
    }
    mean
}

#[inline(always)]
fn off_mean(g: &Lanes, mean: &Lanes, root: f32) -> Lanes {
    let mut off = [0.0; NUMBERS];
    for j in 0..NUMBERS {
        off[j] = flush(sub(g[j], mul(mean[j], root)), LEAST_FACTOR);
    }
    off
}

#[inline(always)]
fn add_products(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for j in 0..NUMBERS {
        sum[j] = add(sum[j], mul(a[j], b[j]));
    }
}

/// Adds the spread over the faces of a wedge, which is none over one. What a number adds is summed in a lane of its own,
/// before what the next does. `gradients` is overwritten.
#[inline(always)]
fn add_wedge(mut spread: Sym3, faces: &[u32], rows: Rows<'_>, gradients: &mut Vec<Gradients>) -> Sym3 {
    if faces.len() < 2 {
        return spread;
    }
    for first in (0..rows.costed).step_by(NUMBERS) {
        // Filled by a loop: a closure given to `extend` would not be compiled for the caller's instruction set.
        gradients.resize(gradients.len().max(faces.len()), Gradients::default());
        let gradients = &mut gradients[..faces.len()];
        let mut weight = 0.0;
        let [mut x_sum, mut y_sum, mut z_sum] = [[0.0; NUMBERS]; 3];
        for (own, &f) in gradients.iter_mut().zip(faces) {
            *own = gradients_of(f, first, rows);
            let Gradients { root, along: [x, y, z] } = &*own;
            weight = add(weight, mul(*root, *root));
            add_scaled(&mut x_sum, x, *root);
            add_scaled(&mut y_sum, y, *root);
            add_scaled(&mut z_sum, z, *root);
        }
        let inverse = if weight > NO_AREA { divide(1.0, weight) } else { 0.0 };
        // A closure given to `map` would be compiled apart, without the instructions that this is compiled for.
        let (x_mean, y_mean, z_mean) = (mean_of(&x_sum, inverse), mean_of(&y_sum, inverse), mean_of(&z_sum, inverse));
        let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [[0.0; NUMBERS]; 6];
        for Gradients { root, along: [x, y, z] } in &*gradients {
            let (x, y, z) = (off_mean(x, &x_mean, *root), off_mean(y, &y_mean, *root), off_mean(z, &z_mean, *root));
            add_products(&mut xx, &x, &x);
            add_products(&mut xy, &x, &y);
            add_products(&mut xz, &x, &z);
            add_products(&mut yy, &y, &y);
            add_products(&mut yz, &y, &z);
            add_products(&mut zz, &z, &z);
        }
        for j in 0..NUMBERS.min(rows.costed - first) {
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

/// Adds to the sums of the vertices from `first` on. `wedge_starts` has the first wedge of each vertex, and the end.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn add_spreads(first: usize, rings: Rings<'_>, wedge_starts: &[u32], rows: Rows<'_>, sums: &mut [VolumeSum]) {
    let (mut own, mut gradients) = (Vec::new(), Vec::new());
    for (vertex, sum) in (first..).zip(sums) {
        let ring = &rings.faces[rings.starts[vertex] as usize..rings.starts[vertex + 1] as usize];
        let ring = if ring.len() > HUB_FACES as usize { &[] } else { ring };
        let wedges = wedge_starts[vertex]..wedge_starts[vertex + 1];
        let mut spread = Sym3::default();
        if wedges.len() == 1 {
            spread = add_wedge(spread, ring, rows, &mut gradients);
        } else if wedges.len() < ring.len() {
            // Between rounds each has a face (`contract::wedges`), so that here some have more than one.
            for wedge in wedges {
                // Written whether it is one or not: a branch would be misjudged at every second.
                own.resize(ring.len(), 0);
                let mut count = 0;
                for &f in ring {
                    own[count] = f;
                    count += usize::from(has_wedge(rows.corners[f as usize], wedge));
                }
                spread = add_wedge(spread, &own[..count], rows, &mut gradients);
            }
        }
        *sum = with_spread(*sum, spread);
    }
}

/// Whether a face is one of a wedge's.
#[inline(always)]
fn has_wedge(Face { a, b, c }: Face, wedge: u32) -> bool {
    (a == wedge) | (b == wedge) | (c == wedge)
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
        let rings = Rings { starts: self.ring_starts.host(), faces: self.ring_faces.host() };
        let rows = Rows {
            operators: self.operators.host(),
            corners: self.corners.host(),
            values: self.values.host(),
            width: self.width as usize,
            costed: self.costed as usize,
        };
        let wedge_starts = self.wedge_starts.host();
        let sums = self.sums.host_mut()[..self.vertex_count as usize].par_chunks_mut(VERTICES_EACH).enumerate();
        sums.for_each(|(chunk, sums)| {
            let vertices = chunk * VERTICES_EACH..chunk * VERTICES_EACH + sums.len();
            rows.warm_up(vertices.clone(), rings, wedge_starts);
            add_spreads(vertices.start, rings, wedge_starts, rows, sums);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One number that is bent along x: its gradients are (±2, 1, 0) on faces of |n| 4 and 1.
    #[test]
    fn gradients_spread_about_their_mean() {
        let operator = |root: f32, x: f32| GradientOperator { bx: root * x, cy: root, root, ..Default::default() };
        let operators = [operator(2.0, 2.0), operator(1.0, -2.0)];
        let corners = [Face { a: 0, b: 1, c: 2 }; 2];
        let rows = Rows { operators: &operators, corners: &corners, values: &[3.0, 4.0, 4.0], width: 1, costed: 1 };
        let spread_of = |faces: &[u32]| add_wedge(Sym3::default(), faces, rows, &mut Vec::new());
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
        let spread = add_wedge(Sym3::default(), &[0, 1], rows, &mut Vec::new());
        let squares: usize = (0..costed).map(|j| 2 * j * j).sum();
        assert_eq!(spread, Sym3 { xx: squares as f32, ..Sym3::default() });
    }
}
