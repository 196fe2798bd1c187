//! What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
//! `shaders/attribute_spreads.wgsl`, line for line.
//!
//! # Reference
//! \[HO99\]: the faces of a wedge agree in its numbers at its place v, and with the gradients g and their mean ḡ differ at x
//! by (x−v)ᵀ S (x−v), squared and weighted by |n|, where S = Σ |n| (g−ḡ)(g−ḡ)ᵀ over all numbers: a quadric about the vertex,
//! as that of its planes is. Departs: memoryless as the geometry is, and a pair costs the spreads of both ends instead of
//! that of all their faces together. Ends share faces, so that what is linear around either is linear around both; those
//! faces count twice.
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.

use multiversion::multiversion;
use rayon::prelude::*;

use super::pair_quadric::NO_AREA;
use super::rows::{Face, HUB_FACES, Normal, VolumeSum};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST_FACTOR, Sym3, add, divide, flush, mul, sub, sym_add, sym_scale};

/// What spreads count: with 1 colors of a scan are 10 % farther off, with 3 its surface is by 4 %.
const SPREAD_FACTOR: f32 = 1.5;

/// One invocation a vertex.
pub struct AttributeSpreads<'a> {
    /// F normals.
    pub normals: &'a Buffer<Normal>,
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a Buffer<u32>,
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a Buffer<u32>,
    /// The wedges of the corners of F faces.
    pub corners: &'a Buffer<Face>,
    /// The first wedge of each of V vertices, and the end.
    pub wedge_starts: &'a Buffer<u32>,
    /// √|n| times the gradients of `costed` numbers for each of F faces: x of all, y of all, z of all.
    pub gradients: &'a Buffer<f32>,
    /// V.
    pub vertex_count: u32,
    /// Numbers of a wedge.
    pub costed: u32,
    /// Adds to the sums of V vertices; not to a hub's.
    pub sums: &'a mut Buffer<VolumeSum>,
}

params! {
    /// The uniform block.
    pub struct Params {
        costed: u32,
    }
}

/// Numbers at a time.
const LANES: usize = 8;
type Lanes = [f32; LANES];

/// What spreads are found from, on the host.
#[derive(Clone, Copy)]
struct Rows<'a> {
    normals: &'a [Normal],
    gradients: &'a [f32],
    costed: usize,
}

/// The faces around vertices, on the host.
#[derive(Clone, Copy)]
struct Rings<'a> {
    starts: &'a [u32],
    faces: &'a [u32],
}

/// The wedges of vertices and of corners, on the host.
#[derive(Clone, Copy)]
struct Wedges<'a> {
    starts: &'a [u32],
    corners: &'a [Face],
}

/// √|n| times the gradients of a face, of the numbers from `first` on: x, y and z, where they stand or, at the end of the
/// buffer, in `spare`. Lanes past the last number hold anything.
#[inline(always)]
fn gradients_of<'a>(f: u32, first: usize, rows: Rows<'a>, spare: &'a mut [Lanes; 3]) -> [&'a Lanes; 3] {
    let Rows { gradients, costed, .. } = rows;
    let start = 3 * f as usize * costed + first;
    let row = gradients.get(start..start + 2 * costed + LANES);
    let along = |axis: usize| row.and_then(|row| row.get(axis * costed..)).and_then(<[f32]>::first_chunk);
    match (along(0), along(1), along(2)) {
        (Some(x), Some(y), Some(z)) => [x, y, z],
        _ => last_gradients(start, rows, spare),
    }
}

/// Apart, or vectors would be put together number by number everywhere.
#[cold]
#[inline(never)]
fn last_gradients<'a>(start: usize, rows: Rows<'_>, spare: &'a mut [Lanes; 3]) -> [&'a Lanes; 3] {
    let at = |axis: usize, j: usize| rows.gradients.get(start + axis * rows.costed + j).copied().unwrap_or(0.0);
    *spare = std::array::from_fn(|axis| std::array::from_fn(|j| at(axis, j)));
    spare.each_ref()
}

#[inline(always)]
fn add_scaled(sum: &mut Lanes, g: &Lanes, scale: f32) {
    for j in 0..LANES {
        sum[j] = add(sum[j], mul(g[j], scale));
    }
}

#[inline(always)]
fn mean_of(sum: Lanes, inverse: f32) -> Lanes {
    sum.map(|sum| flush(mul(sum, inverse), LEAST_FACTOR))
}

#[inline(always)]
fn off_mean(g: &Lanes, mean: &Lanes, root: f32) -> Lanes {
    let mut off = [0.0; LANES];
    for j in 0..LANES {
        off[j] = flush(sub(g[j], mul(mean[j], root)), LEAST_FACTOR);
    }
    off
}

#[inline(always)]
fn add_products(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for j in 0..LANES {
        sum[j] = add(sum[j], mul(a[j], b[j]));
    }
}

/// Adds the spread over the faces of a wedge. What a number adds is summed in a lane of its own, before what the next does.
#[inline(always)]
fn add_wedge(mut spread: Sym3, faces: &[u32], rows: Rows<'_>) -> Sym3 {
    let root_of = |f: u32| rows.normals[f as usize].root;
    let mut spare = [[0.0; LANES]; 3];
    for first in (0..rows.costed).step_by(LANES) {
        let mut weight = 0.0;
        let [mut x_sum, mut y_sum, mut z_sum] = [[0.0; LANES]; 3];
        for &f in faces {
            let (root, [x, y, z]) = (root_of(f), gradients_of(f, first, rows, &mut spare));
            weight = add(weight, mul(root, root));
            add_scaled(&mut x_sum, x, root);
            add_scaled(&mut y_sum, y, root);
            add_scaled(&mut z_sum, z, root);
        }
        let inverse = if weight > NO_AREA { divide(1.0, weight) } else { 0.0 };
        let [x_mean, y_mean, z_mean] = [x_sum, y_sum, z_sum].map(|sum| mean_of(sum, inverse));
        let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz] = [[0.0; LANES]; 6];
        for &f in faces {
            let (root, [x, y, z]) = (root_of(f), gradients_of(f, first, rows, &mut spare));
            let (x, y, z) = (off_mean(x, &x_mean, root), off_mean(y, &y_mean, root), off_mean(z, &z_mean, root));
            add_products(&mut xx, &x, &x);
            add_products(&mut xy, &x, &y);
            add_products(&mut xz, &x, &z);
            add_products(&mut yy, &y, &y);
            add_products(&mut yz, &y, &z);
            add_products(&mut zz, &z, &z);
        }
        for j in 0..LANES.min(rows.costed - first) {
            let own = Sym3 { xx: xx[j], xy: xy[j], xz: xz[j], yy: yy[j], yz: yz[j], zz: zz[j] };
            spread = sym_add(spread, own);
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
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn add_spreads(first: usize, rings: Rings<'_>, wedges: Wedges<'_>, rows: Rows<'_>, sums: &mut [VolumeSum]) {
    let mut own = Vec::new();
    for (vertex, sum) in (first..).zip(sums) {
        let ring = &rings.faces[rings.starts[vertex] as usize..rings.starts[vertex + 1] as usize];
        let ring = if ring.len() > HUB_FACES as usize { &[] } else { ring };
        let all = wedges.starts[vertex]..wedges.starts[vertex + 1];
        let mut spread = Sym3::default();
        if all.len() == 1 {
            spread = add_wedge(spread, ring, rows);
        } else {
            for wedge in all {
                own.clear();
                own.extend(ring.iter().filter(|&&f| has_wedge(wedges.corners[f as usize], wedge)));
                spread = add_wedge(spread, &own, rows);
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
        Params { costed: self.costed }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("ring_starts", Access::Read, self.ring_starts),
            Binding::new("ring_faces", Access::Read, self.ring_faces),
            Binding::new("corners", Access::Read, self.corners),
            Binding::new("wedge_starts", Access::Read, self.wedge_starts),
            Binding::new("gradients", Access::Read, self.gradients),
            Binding::new("sums", Access::Write, self.sums),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let rings = Rings { starts: self.ring_starts.host(), faces: self.ring_faces.host() };
        let wedges = Wedges { starts: self.wedge_starts.host(), corners: self.corners.host() };
        let (normals, gradients) = (self.normals.host(), self.gradients.host());
        let rows = Rows { normals, gradients, costed: self.costed as usize };
        let sums = self.sums.host_mut()[..self.vertex_count as usize].par_chunks_mut(CHUNK).enumerate();
        sums.for_each(|(chunk, sums)| add_spreads(chunk * CHUNK, rings, wedges, rows, sums));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One number that is bent along x: its gradients are (±2, 1, 0) on faces of |n| 4 and 1.
    #[test]
    fn gradients_spread_about_their_mean() {
        let normals = [2.0, 1.0].map(|root| Normal { root, ..Normal::default() });
        let gradients = [4.0, 2.0, 0.0, -2.0, 1.0, 0.0];
        let rows = Rows { normals: &normals, gradients: &gradients, costed: 1 };
        // The mean is (6/5, 1, 0).
        let spread = add_wedge(Sym3::default(), &[0, 1], rows);
        assert!((spread.xx - (4.0 * 0.64 + 10.24)).abs() < 1e-5 && spread.yy < 1e-12, "{spread:?}");
        assert_eq!([spread.xz, spread.yz, spread.zz], [0.0; 3]);
        // What is linear on all faces does not spread.
        assert!(add_wedge(Sym3::default(), &[0, 0], rows).xx < 1e-10);
        assert_eq!(add_wedge(Sym3::default(), &[], rows), Sym3::default());
    }

    #[test]
    fn every_number_of_any_block_counts_once() {
        let costed = 11;
        let normals = [Normal { root: 1.0, ..Normal::default() }; 2];
        let row = |sign: f32| (0..3 * costed).map(move |k| if k < costed { sign * k as f32 } else { 0.0 });
        let gradients: Vec<f32> = row(1.0).chain(row(-1.0)).collect();
        let spread = add_wedge(Sym3::default(), &[0, 1], Rows { normals: &normals, gradients: &gradients, costed });
        let squares: usize = (0..costed).map(|j| 2 * j * j).sum();
        assert_eq!(spread, Sym3 { xx: squares as f32, ..Sym3::default() });
    }
}
