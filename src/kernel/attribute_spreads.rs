//! What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
//! `shaders/attribute_spreads.wgsl`, number by number: the same operations in the same order, seven numbers side by side here
//! and four there, and here what a face adds is found once (`gradient_table`).
//!
//! # Reference
//! \[HO99\]: the faces of a wedge agree in its numbers at its place v, and with the gradients g and their mean ḡ differ at x
//! by (x−v)ᵀ S (x−v), squared and weighted by |n|, where S = Σ |n| (g−ḡ)(g−ḡ)ᵀ over all numbers: a quadric about the vertex,
//! as that of its planes is. Found as Σ |n| g gᵀ − Σ|n|g (Σ|n|g)ᵀ / Σ|n|, in one pass over the faces. Departs: memoryless as
//! the geometry is, and a pair costs the spreads of both ends instead of that of all their faces together. Ends share faces, so
//! that what is linear around either is linear around both; those faces count twice. What hardly spreads spreads nothing
//! (`LEAST_SPREAD`).
//!
//! Gathers: one invocation a vertex, for each of its wedges the ring in ascending face order, so the sums are repeatable.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rayon::prelude::*;

use super::gradient_table::{GradientTable, PART, Rows, Terms, WEIGHT, flush};
use super::pair_quadric::NO_AREA;
use super::rows::{Face, GradientOperator, HUB_FACES, VolumeSum};
use super::warm::warm_up;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{Sym3, add, divide, sym_add, sym_scale};
use crate::math::lanes::Numbers;

/// Most numbers of a wedge that decide.
pub const MOST_COSTED: usize = 16;

/// What spreads count: with 1 colors of a scan are 10 % farther off, with 3 its surface is by 4 %.
const SPREAD_FACTOR: f32 = 1.5;

/// Spreads below this share of what the gradients square to count as none: the difference of both sums is off by some 2e-7 of them
/// around most vertices, and by up to 1.5e-5 around the largest. Gradients that differ by less than a two-hundredth count as one.
const LEAST_SPREAD: f32 = 2e-5;

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

/// Vertices of a task on the host: what the faces near them add, of up to seven numbers, fits a core's second cache.
const VERTICES_EACH: usize = 1 << 10;

/// The faces around vertices, on the host.
#[derive(Clone, Copy)]
struct Rings<'a> {
    starts: &'a [u32],
    faces: &'a [u32],
    /// The first wedge of each vertex, and the end.
    wedge_starts: &'a [u32],
}

impl Rings<'_> {
    /// The faces of which consecutive vertices are the lowest, where faces are in the order of those: most of the faces around
    /// them. At most four for each; none where no vertex is the lowest of any.
    fn faces_of(&self, vertices: Range<usize>, corners: &[Face]) -> Range<usize> {
        let count = vertices.len();
        let vertex_count = self.starts.len() - 1;
        let face_count = self.starts.last().map_or(0, |&end| end as usize / 3).min(corners.len());
        // Not to the end of the surface: a fan whose hub comes first has no other lowest vertex.
        let first_of = |mut vertices: Range<usize>| vertices.find_map(|vertex| self.first_face(vertex, corners));
        let first = first_of(vertices.clone()).unwrap_or(face_count).min(face_count);
        let next = first_of(vertices.end..vertex_count.min(vertices.end + count)).unwrap_or(face_count);
        first..next.clamp(first, face_count.min(first + 4 * count))
    }

    /// The first face around a vertex of which this is the lowest.
    fn first_face(&self, vertex: usize, corners: &[Face]) -> Option<usize> {
        let ring = &self.faces[self.starts[vertex] as usize..self.starts[vertex + 1] as usize];
        let wedge = self.wedge_starts[vertex];
        // Wedges are in the order of their vertices.
        let is_lowest = |f: usize| corners[f].corners().iter().all(|&other| other >= wedge);
        ring.iter().map(|&f| f as usize).find(|&f| is_lowest(f))
    }
}

/// Reads the rows of the wedges of consecutive vertices once, and those of faces near them.
fn warm_up_rows(vertices: Range<usize>, faces: Range<usize>, rings: Rings<'_>, rows: Rows<'_>) {
    let [first, end] = [vertices.start, vertices.end].map(|vertex| rings.wedge_starts[vertex] as usize * rows.width);
    warm_up(&rows.values[first..end]);
    warm_up(&rows.operators[faces.clone()]);
    warm_up(&rows.corners[faces]);
}

/// Adds the spread over the faces of a wedge, which is none over one. What a number adds is summed in a lane of its own,
/// before what the next does.
#[inline(always)]
fn add_wedge<S: Simd>(simd: S, mut spread: Sym3, faces: &[u32], rows: Rows<'_>, table: &GradientTable) -> Sym3 {
    if faces.len() < 2 {
        return spread;
    }
    for (part, first) in (0..rows.costed).step_by(PART).enumerate() {
        let Terms([x, y, z, xx, xy, xz, yy, yz, zz]) = table.sum(simd, faces, part, rows);
        let weight = x.as_slice()[WEIGHT];
        let inverse = if weight > NO_AREA { divide(1.0, weight) } else { 0.0 };
        let (x, y, z) = (flush(simd, x), flush(simd, y), flush(simd, z));
        // Written out: a closure given to `map` would be a call.
        let (x_mean, y_mean, z_mean) = (flush(simd, x * inverse), flush(simd, y * inverse), flush(simd, z * inverse));
        let squares = xx + yy + zz;
        let (xx, xy, xz) = (xx - x * x_mean, xy - x * y_mean, xz - x * z_mean);
        let (yy, yz, zz) = (yy - y * y_mean, yz - y * z_mean, zz - z * z_mean);
        let spreads = (xx + yy + zz).simd_gt(squares * LEAST_SPREAD);
        let zero = f32x8::splat(simd, 0.0);
        let xx: Numbers<f32> = spreads.select(xx, zero).into();
        let xy: Numbers<f32> = spreads.select(xy, zero).into();
        let xz: Numbers<f32> = spreads.select(xz, zero).into();
        let yy: Numbers<f32> = spreads.select(yy, zero).into();
        let yz: Numbers<f32> = spreads.select(yz, zero).into();
        let zz: Numbers<f32> = spreads.select(zz, zero).into();
        for j in 0..PART.min(rows.costed - first) {
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
    rows: Rows<'_>,
    table: &mut GradientTable,
    sums: &mut [VolumeSum],
) {
    let vertices = first..first + sums.len();
    let faces = rings.faces_of(vertices.clone(), &rows.corners[..rows.corners.len().min(rows.operators.len())]);
    warm_up_rows(vertices.clone(), faces.clone(), rings, rows);
    table.fill(simd, faces, rows);
    let mut own = Vec::new();
    for (vertex, sum) in vertices.zip(sums) {
        let ring = &rings.faces[rings.starts[vertex] as usize..rings.starts[vertex + 1] as usize];
        let ring = if ring.len() > HUB_FACES as usize { &[] } else { ring };
        let wedges = rings.wedge_starts[vertex]..rings.wedge_starts[vertex + 1];
        let mut spread = Sym3::default();
        if wedges.len() == 1 {
            spread = add_wedge(simd, spread, ring, rows, table);
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
                spread = add_wedge(simd, spread, &own[..count], rows, table);
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
        ("LEAST_SPREAD", Constant::F32(LEAST_SPREAD)),
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
        let wedge_starts = self.wedge_starts.host();
        let starts = &self.ring_starts.host()[..=self.vertex_count as usize];
        let rings = Rings { starts, faces: self.ring_faces.host(), wedge_starts };
        let rows = Rows {
            operators: self.operators.host(),
            corners: self.corners.host(),
            values: self.values.host(),
            width: self.width as usize,
            costed: self.costed as usize,
        };
        let level = Level::new();
        let sums = self.sums.host_mut()[..self.vertex_count as usize].par_chunks_mut(VERTICES_EACH).enumerate();
        sums.for_each_init(GradientTable::default, |table, (chunk, sums)| {
            dispatch!(level, simd => add_spreads(simd, chunk * VERTICES_EACH, rings, rows, table, sums));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spread over faces, of which some were found before.
    fn spread(faces: &[u32], rows: Rows<'_>, found: Range<usize>) -> Sym3 {
        let mut table = GradientTable::default();
        dispatch!(Level::new(), simd => {
            table.fill(simd, found.clone(), rows);
            add_wedge(simd, Sym3::default(), faces, rows, &table)
        })
    }

    /// One number that is bent along x: its gradients are (±2, 1, 0) on faces of |n| 4 and 1.
    #[test]
    fn gradients_spread_about_their_mean() {
        let operator = |root: f32, x: f32| GradientOperator { bx: root * x, cy: root, root, ..Default::default() };
        let operators = [operator(2.0, 2.0), operator(1.0, -2.0)];
        let corners = [Face { a: 0, b: 1, c: 2 }; 2];
        let rows = Rows { operators: &operators, corners: &corners, values: &[3.0, 4.0, 4.0], width: 1, costed: 1 };
        let spread_of = |faces: &[u32]| spread(faces, rows, 1..2);
        // The mean is (6/5, 1, 0).
        let spread = spread_of(&[0, 1]);
        assert!((spread.xx - (4.0 * 0.64 + 10.24)).abs() < 1e-5 && spread.yy < 1e-12, "{spread:?}");
        assert_eq!([spread.xz, spread.yz, spread.zz], [0.0; 3]);
        // What is linear on all faces does not spread.
        assert_eq!(spread_of(&[0, 0]), Sym3::default());
        assert_eq!(spread_of(&[1]), Sym3::default());
        assert_eq!(spread_of(&[]), Sym3::default());
    }

    #[test]
    fn every_number_of_any_part_counts_once() {
        let (width, costed) = (12, 11);
        let operators = [1.0, -1.0].map(|bx| GradientOperator { bx, root: 1.0, ..Default::default() });
        let corners = [Face { a: 0, b: 1, c: 0 }; 2];
        // Differences of 0, 1, 2 … between both wedges.
        let values: Vec<f32> = (0..2).flat_map(|wedge| (0..width).map(move |j| (wedge * j) as f32)).collect();
        let rows = Rows { operators: &operators, corners: &corners, values: &values, width, costed };
        let spread = spread(&[0, 1], rows, 0..0);
        let squares: usize = (0..costed).map(|j| 2 * j * j).sum();
        assert_eq!(spread, Sym3 { xx: squares as f32, ..Sym3::default() });
    }

    /// A thousand times as steep as its faces are long, over faces of any shape: rounding is no spread.
    #[test]
    fn what_is_linear_does_not_spread_however_steep() {
        let at = |[x, y]: [f32; 2]| 1000.0 * (0.3 * x - 0.7 * y);
        let corners: [[[f32; 2]; 3]; 3] = [
            [[0.1, 0.2], [1.3, 0.1], [0.7, 1.1]],
            [[0.1, 0.2], [0.7, 1.1], [-0.9, 0.6]],
            [[0.1, 0.2], [-0.9, 0.6], [0.3, -1.7]],
        ];
        let operator = |[a, b, c]: [[f32; 2]; 3]| {
            let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
            let root = (bx * cy - by * cx).sqrt();
            GradientOperator {
                bx: cy / root,
                by: -cx / root,
                cx: -by / root,
                cy: bx / root,
                root,
                ..Default::default()
            }
        };
        let operators = corners.map(operator);
        let faces: Vec<Face> = (0..3).map(|f| Face { a: 3 * f, b: 3 * f + 1, c: 3 * f + 2 }).collect();
        let mut values: Vec<f32> = corners.iter().flatten().map(|&place| at(place)).collect();
        let of = |values: &[f32]| {
            spread(&[0, 1, 2], Rows { operators: &operators, corners: &faces, values, width: 1, costed: 1 }, 0..3)
        };
        assert_eq!(of(&values), Sym3::default());
        // Steeper by a twentieth on one of the faces.
        values[1] += 0.05 * (values[1] - values[0]);
        assert!(of(&values).xx > 1.0, "{:?}", of(&values));
    }

    #[test]
    fn faces_of_vertices_are_those_in_their_order() {
        // Two vertices above and below the edge from 0 to 1, twice: of vertices 2 and 3 none is the lowest.
        let corners = [[0, 1, 2], [0, 3, 1], [4, 5, 6], [4, 7, 5]].map(|[a, b, c]| Face { a, b, c });
        let faces = [0, 1, 0, 1, 0, 1, 2, 3, 2, 3, 2, 3];
        let rings = Rings {
            starts: &[0, 2, 4, 5, 6, 8, 10, 11, 12],
            faces: &faces,
            wedge_starts: &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        };
        let of = |vertices| rings.faces_of(vertices, &corners);
        assert_eq!([of(0..4), of(4..8), of(2..6), of(6..8), of(0..8)], [0..2, 2..4, 2..4, 4..4, 0..4]);
        // Of fewer faces than are said to be around vertices.
        assert_eq!(rings.faces_of(4..8, &corners[..3]), 2..3);
        // Nothing is looked for past as many vertices again.
        assert_eq!([of(0..1), of(0..2), of(2..3)], [0..4, 0..4, 4..4]);
    }
}
