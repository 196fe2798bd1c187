//! Which region every face would rather belong to. Twin: `shaders/boundary_gains.wgsl`, line for line.
//!
//! A face goes to the region beside it whose direction is nearer to its normal, if the region it leaves stays in one piece.
//!
//! # Rounds never raise the energy
//! With N = Σ ρ n over a region the energy is 2 (Σ ρ − Σ |N|), so Σ |N| must not fall. Take the directions u = N/|N| of the
//! regions before a round, and any set of faces moved in it, f from region k to l. As |u| ≤ 1, every region has
//! |N'| ≥ u·N' after it, and u·N = |N| before; summed over the regions,
//!
//! Σ |N'| ≥ Σ |N| + Σ ρ n·(uₗ − uₖ) over the moved faces.
//!
//! So it is enough that each moved face has n·(uₗ − uₖ) > 0, however many move at once. Here n and u are rounded to `f32` and
//! so are the products. With ϵ = 2⁻²⁴, half a unit in the last place of numbers from ½ to 1: rounding moves n and u by less
//! than 0.9 ϵ each in length (three components off by at most ϵ/2), the dot product of two such vectors is off by less than
//! 3.1 ϵ (three roundings of products, two of sums, all of magnitudes whose total is at most 1), and the difference of two dot
//! products by another ϵ. In all 2·(0.9 + 0.9 + 3.1) ϵ + ϵ < 11 ϵ; a face moves only for more than [`LEAST_GAIN`] = 16 ϵ.

use rayon::prelude::*;

use super::rows::{Face, HUB_FACES};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel};
use crate::math::Vec3;
use crate::math::exact::{dot3, sub};

/// The gain that a move must exceed.
pub const LEAST_GAIN: f32 = 9.536_743e-7;
/// No face, and no region.
pub const NONE: u32 = u32::MAX;

/// One invocation a face.
pub struct BoundaryGains<'a> {
    /// F faces; neighbors agree in orientation.
    pub faces: &'a Buffer<Face>,
    /// F rows: the faces across the edges `ab`, `bc` and `ca`, or [`NONE`].
    pub neighbors: &'a Buffer<Face>,
    /// F unit normals, the fourth number unused; zero for a face without area. No component is below
    /// [`LEAST_FACTOR`](crate::math::exact::LEAST_FACTOR) but zero.
    pub normals: &'a Buffer<[f32; 4]>,
    /// R unit directions, likewise; zero where normals cancel.
    pub directions: &'a Buffer<[f32; 4]>,
    /// F labels, below R.
    pub labels: &'a Buffer<u32>,
    /// F.
    pub face_count: u32,
    /// Writes F: the region a face would go to, or [`NONE`].
    pub targets: &'a mut Buffer<u32>,
}

/// What a face sees.
#[derive(Debug, Clone, Copy)]
pub struct Labeled<'a> {
    /// F faces.
    pub faces: &'a [Face],
    /// F rows.
    pub neighbors: &'a [Face],
    /// F labels.
    pub labels: &'a [u32],
}

/// The edge of a face that ends at this vertex.
#[inline(always)]
fn edge_to(face: Face, vertex: u32) -> u32 {
    if face.b == vertex {
        return 0;
    }
    if face.c == vertex { 1 } else { 2 }
}

/// The face across an edge.
#[inline(always)]
fn across(row: Face, edge: u32) -> u32 {
    if edge == 0 {
        return row.a;
    }
    if edge == 1 { row.b } else { row.c }
}

/// Whether one goes from the face `from` around `vertex` to the face `to` and meets only faces with this label, a few hundred
/// at most.
#[inline(always)]
fn goes_around(vertex: u32, from: u32, to: u32, label: u32, seen: &Labeled<'_>) -> bool {
    let mut at = from;
    for _ in 0..HUB_FACES {
        if at == to {
            return true;
        }
        at = across(seen.neighbors[at as usize], edge_to(seen.faces[at as usize], vertex));
        if at == NONE {
            return false;
        }
        if seen.labels[at as usize] != label {
            return false;
        }
    }
    false
}

/// Whether the faces around `face` that have its label hang together without it; not if there is none.
///
/// Sufficient for the whole region to: a way through the face goes around it. With one such neighbor the face is a leaf; two
/// share the vertex that the face has with both, and the faces around that must lead from one to the other.
#[inline(always)]
pub fn stays_connected(face: u32, label: u32, seen: &Labeled<'_>) -> bool {
    let corners = seen.faces[face as usize];
    let row = seen.neighbors[face as usize];
    let over_ab = row.a != NONE && seen.labels[if row.a == NONE { face } else { row.a } as usize] == label;
    let over_bc = row.b != NONE && seen.labels[if row.b == NONE { face } else { row.b } as usize] == label;
    let over_ca = row.c != NONE && seen.labels[if row.c == NONE { face } else { row.c } as usize] == label;
    let count = u32::from(over_ab) + u32::from(over_bc) + u32::from(over_ca);
    if count != 2 {
        return count == 1;
    }
    if !over_ca {
        return goes_around(corners.b, row.a, row.b, label, seen);
    }
    if !over_ab {
        return goes_around(corners.c, row.b, row.c, label, seen);
    }
    goes_around(corners.a, row.c, row.a, label, seen)
}

/// A region, and how near its direction is to a normal.
#[derive(Debug, Clone, Copy)]
struct Choice {
    label: u32,
    nearness: f32,
}

/// The nearer of a choice and the region across an edge; the lower of two that are as near.
#[inline(always)]
fn nearer(best: Choice, across: u32, own: u32, normal: Vec3, labels: &[u32], directions: &[[f32; 4]]) -> Choice {
    if across == NONE {
        return best;
    }
    let label = labels[across as usize];
    if label == own {
        return best;
    }
    let nearness = dot3(normal, xyz(directions[label as usize]));
    if nearness > best.nearness || (nearness == best.nearness && label < best.label) {
        return Choice { label, nearness };
    }
    best
}

#[inline(always)]
fn xyz(row: [f32; 4]) -> Vec3 {
    Vec3::new(row[0], row[1], row[2])
}

#[inline(always)]
fn target_of(face: u32, seen: &Labeled<'_>, normals: &[[f32; 4]], directions: &[[f32; 4]]) -> u32 {
    let own = seen.labels[face as usize];
    let row = seen.neighbors[face as usize];
    let normal = xyz(normals[face as usize]);
    let mut best = Choice { label: NONE, nearness: -2.0 };
    best = nearer(best, row.a, own, normal, seen.labels, directions);
    best = nearer(best, row.b, own, normal, seen.labels, directions);
    best = nearer(best, row.c, own, normal, seen.labels, directions);
    if best.label == NONE {
        return NONE;
    }
    let gain = sub(best.nearness, dot3(normal, xyz(directions[own as usize])));
    if gain > LEAST_GAIN && stays_connected(face, own, seen) { best.label } else { NONE }
}

impl Kernel for BoundaryGains<'_> {
    const NAME: &'static str = "boundary_gains";
    const SOURCE: &'static str = include_str!("../../shaders/boundary_gains.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        ("LEAST_GAIN", Constant::F32(LEAST_GAIN)),
        ("NONE", Constant::U32(NONE)),
        ("HUB_FACES", Constant::U32(HUB_FACES)),
    ];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("neighbors", Access::Read, self.neighbors),
            Binding::new("normals", Access::Read, self.normals),
            Binding::new("directions", Access::Read, self.directions),
            Binding::new("labels", Access::Read, self.labels),
            Binding::new("targets", Access::Write, self.targets),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let (normals, directions) = (self.normals.host(), self.directions.host());
        let seen = Labeled { faces: self.faces.host(), neighbors: self.neighbors.host(), labels: self.labels.host() };
        let targets = self.targets.host_mut()[..self.face_count as usize].par_iter_mut().enumerate();
        targets.with_min_len(CHUNK).for_each(|(face, target)| {
            *target = target_of(face as u32, &seen, normals, directions);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six faces around vertex 0: face k has the corners 0, k + 1 and the next. Across `ab` lies the face before, across `ca`
    /// the one after, and nothing lies outside.
    fn fan() -> (Vec<Face>, Vec<Face>) {
        let face = |k: u32| Face { a: 0, b: k + 1, c: (k + 1) % 6 + 1 };
        let across = |k: u32| Face { a: (k + 5) % 6, b: NONE, c: (k + 1) % 6 };
        ((0..6).map(face).collect(), (0..6).map(across).collect())
    }

    fn targets(labels: [u32; 6], normals: [[f32; 4]; 6], directions: &[[f32; 4]]) -> [u32; 6] {
        let (faces, neighbors) = fan();
        let seen = Labeled { faces: &faces, neighbors: &neighbors, labels: &labels };
        std::array::from_fn(|face| target_of(face as u32, &seen, &normals, directions))
    }

    const X: [f32; 4] = [1.0, 0.0, 0.0, 0.0];
    const Y: [f32; 4] = [0.0, 1.0, 0.0, 0.0];

    #[test]
    fn faces_go_where_they_face() {
        // Face 2 looks the way of the region beside it, and its own is whole without it. Face 4 does too, but lies among its own.
        let normals = [X, X, X, Y, X, Y];
        assert_eq!(targets([0, 0, 1, 1, 1, 1], normals, &[X, Y]), [NONE, NONE, 0, NONE, NONE, NONE]);
    }

    #[test]
    fn the_last_face_of_a_region_stays() {
        assert_eq!(targets([0, 1, 0, 0, 0, 0], [X; 6], &[X, Y])[1], NONE);
        assert_eq!(targets([0, 1, 1, 0, 0, 0], [X; 6], &[X, Y])[1..3], [0, 0]);
    }

    #[test]
    fn a_way_around_the_vertex_is_enough() {
        // All but face 0 are of region 1: any of its faces has two neighbors of its own, and face 0 cuts the way around but for
        // those beside it, which have one.
        assert_eq!(targets([0, 1, 1, 1, 1, 1], [X; 6], &[X, Y]), [NONE, 0, NONE, NONE, NONE, 0]);
        let (faces, neighbors) = fan();
        let labels = [1; 6];
        let seen = Labeled { faces: &faces, neighbors: &neighbors, labels: &labels };
        assert!((0..6).all(|face| stays_connected(face, 1, &seen)));
    }

    #[test]
    fn the_lower_of_regions_as_near_is_taken() {
        // Another face of its region lies outside of face 0, and a region on either side of it.
        let (mut faces, mut neighbors) = fan();
        faces.push(Face { a: 2, b: 1, c: 7 });
        neighbors.push(Face { a: 0, b: NONE, c: NONE });
        neighbors[0].b = 6;
        for labels in [[2, 0, 0, 1, 1, 1, 2], [2, 1, 1, 0, 0, 0, 2]] {
            let seen = Labeled { faces: &faces, neighbors: &neighbors, labels: &labels };
            assert_eq!(target_of(0, &seen, &[X; 7], &[X, X, Y]), 0);
            assert_eq!(target_of(0, &seen, &[X; 7], &[Y, X, Y]), 1);
        }
    }

    #[test]
    fn a_gain_must_exceed_the_least() {
        let off = |gain: f32| targets([0, 0, 1, 1, 1, 1], [X; 6], &[X, [1.0 - gain, 0.0, 0.0, 0.0]])[2];
        assert_eq!((off(LEAST_GAIN), off(2.0 * LEAST_GAIN)), (NONE, 0));
    }
}
