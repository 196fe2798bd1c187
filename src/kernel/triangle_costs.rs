//! The cost of every face as a triangle that becomes one vertex, by the `plane` metric. Twin:
//! `shaders/triangle_costs.wgsl`, line for line.
//!
//! # Reference
//! \[Wu12\]: the sum of the three corners' quadrics at its least point. All are moved to the center first, where single
//! precision suffices, and the solve is regularized towards it.

use rayon::prelude::*;

use super::pair_quadric::{
    AT_ENDS, AT_THREE, CONSTANTS, NO_KEY, NO_WEIGHT, NOISE, PairQuadric, REACH, THIRD, cost_key, half_exponent, least,
    scale_down, scale_up, scaled, value,
};
use super::pairs::NO_FACE;
use super::plane_costs::PLANE_REGULARIZATION;
use super::plane_quadric::{moved, sum_moved};
use super::rows::{Edge, Face, HUB, LOCKED, PlaneQuadric, Position, SEAM};
use super::split::CHUNK;
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{add3, dot3, mul, scale3, sub3, trace};

/// One invocation a face.
pub struct TriangleCosts<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// V quadrics.
    pub quadrics: &'a Buffer<PlaneQuadric>,
    /// F.
    pub face_count: u32,
    /// Where placements may be: one of the constants of [`super::pair_quadric`] but for the segment.
    pub placement: u32,
    /// Writes F candidates: the first half-edge of every face.
    pub triangles: &'a mut Buffer<Edge>,
    /// Writes F keys: the costs' bits, which order as the costs do, or [`NO_KEY`].
    pub keys: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        placement: u32,
        regularization: f32,
    }
}

/// A corner of a face.
#[derive(Debug, Clone, Copy)]
struct Corner {
    position: Position,
    quadric: PlaneQuadric,
}

/// The cost of the best allowed placement about the center, for corners at `a`, `b` and `c`.
///
/// Fallback: a least point that is too far away gives way to the best of the corners and the center.
#[inline(always)]
fn best_cost(q: PairQuadric, [a, b, c]: [Vec3; 3], locked: [bool; 3], params: Params) -> f32 {
    let at_a = value(q, a);
    let at_b = value(q, b);
    let at_c = value(q, c);
    let at_corners = at_a.min(at_b).min(at_c);
    let at_four = q.c.min(at_corners);
    let x = least(q, params.regularization);
    let radius_sq = dot3(a, a).max(dot3(b, b)).max(dot3(c, c));
    let near = dot3(x, x) <= mul(mul(REACH, REACH), radius_sq);
    let mut cost = if near { value(q, x) } else { at_four };
    cost = if params.placement == AT_THREE { at_four } else { cost };
    cost = if params.placement == AT_ENDS { at_corners } else { cost };
    cost = if locked[0] { at_a } else { cost };
    cost = if locked[1] { at_b } else { cost };
    cost = if locked[2] { at_c } else { cost };
    if cost > NOISE { cost } else { 0.0 }
}

/// Solved at a scale where the trace is about 1.
#[inline(always)]
fn triangle_cost([first, second, third]: [Corner; 3], params: Params) -> f32 {
    let sum = add3(add3(first.position.xyz(), second.position.xyz()), third.position.xyz());
    let center = scale3(sum, THIRD);
    let a = sub3(first.position.xyz(), center);
    let b = sub3(second.position.xyz(), center);
    let c = sub3(third.position.xyz(), center);
    let two = sum_moved(moved(first.quadric, scale3(a, -1.0)), moved(second.quadric, scale3(b, -1.0)));
    let all = sum_moved(two, moved(third.quadric, scale3(c, -1.0)));
    let q = PairQuadric { a: all.a, b: scale3(all.b, -1.0), c: all.c, n: Vec3::ZERO, d: 0.0 };
    let t = trace(q.a);
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let locked = [first, second, third].map(|corner| corner.position.flags & (LOCKED | SEAM) != 0);
    let cost = best_cost(scaled(q, scale_down(half)), [a, b, c], locked, params);
    mul(mul(cost, scale_up(half)), scale_up(half))
}

/// Two corners that stay, or a hub, are no candidate.
#[inline(always)]
fn triangle_key(corners: [Corner; 3], params: Params) -> u32 {
    let [a, b, c] = corners.map(|corner| corner.position.flags);
    let held = LOCKED | SEAM;
    let staying = u32::from(a & held != 0) + u32::from(b & held != 0) + u32::from(c & held != 0);
    if staying > 1 || (a | b | c) & HUB != 0 {
        return NO_KEY;
    }
    cost_key(triangle_cost(corners, params))
}

impl Kernel for TriangleCosts<'_> {
    const NAME: &'static str = "triangle_costs";
    const SOURCE: &'static str = include_str!("../../shaders/triangle_costs.wgsl");
    const SHARED: &'static [&'static str] = &[
        include_str!("../../shaders/shared/pair_quadric.wgsl"),
        include_str!("../../shaders/shared/plane_quadric.wgsl"),
    ];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = CONSTANTS;

    fn params(&self) -> Params {
        Params { placement: self.placement, regularization: PLANE_REGULARIZATION }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("quadrics", Access::Read, self.quadrics),
            Binding::new("triangles", Access::Write, self.triangles),
            Binding::new("keys", Access::Write, self.keys),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let params = self.params();
        let (positions, quadrics) = (self.positions.host(), self.quadrics.host());
        let faces = &self.faces.host()[..self.face_count as usize];
        let corner = |v: u32| Corner { position: positions[v as usize], quadric: quadrics[v as usize] };
        let keys = self.keys.host_mut()[..faces.len()].par_iter_mut();
        let triangles = self.triangles.host_mut()[..faces.len()].par_iter_mut();
        let rows = keys.zip(triangles).zip(faces).enumerate().with_min_len(CHUNK);
        rows.for_each(|(i, ((key, triangle), face))| {
            *triangle = Edge { half_edge: 3 * i as u32, across: NO_FACE };
            *key = triangle_key(face.corners().map(corner), params);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::pair_quadric::ANYWHERE;

    /// A corner at `p` that stands for the planes through `q` with these unit normals.
    fn corner(p: Vec3, q: Vec3, normals: &[Vec3], flags: u32) -> Corner {
        let mut quadric = PlaneQuadric::default();
        for &n in normals {
            let d = n.dot(p - q);
            quadric.xx += n.x * n.x;
            quadric.xy += n.x * n.y;
            quadric.xz += n.x * n.z;
            quadric.yy += n.y * n.y;
            quadric.yz += n.y * n.z;
            quadric.zz += n.z * n.z;
            quadric.bx += n.x * d;
            quadric.by += n.y * d;
            quadric.bz += n.z * d;
            quadric.c += d * d;
            quadric.weight += 1.0;
        }
        Corner { position: Position { x: p.x, y: p.y, z: p.z, flags }, quadric }
    }

    fn cost(corners: [Corner; 3], placement: u32) -> f32 {
        f32::from_bits(triangle_key(corners, Params { placement, regularization: PLANE_REGULARIZATION }))
    }

    /// Planes x = 0, y = 0 and z = 1, one at each corner of a triangle in z = 0.
    fn three_planes(flags: [u32; 3]) -> [Corner; 3] {
        let meet = Vec3::new(0.0, 0.0, 1.0);
        [
            corner(Vec3::ZERO, meet, &[Vec3::X], flags[0]),
            corner(Vec3::X, meet, &[Vec3::Y], flags[1]),
            corner(Vec3::Y, meet, &[Vec3::Z], flags[2]),
        ]
    }

    #[test]
    fn the_least_point_of_three_planes_is_where_they_meet() {
        assert!(cost(three_planes([0; 3]), ANYWHERE) < 1e-5);
        // At the corners: z misses by 1, and at the second and third x or y by 1 as well; at the center by 1 + 2/9.
        assert!((cost(three_planes([0; 3]), AT_ENDS) - 1.0).abs() < 1e-5);
        assert!((cost(three_planes([0; 3]), AT_THREE) - 1.0).abs() < 1e-5);
        assert!((cost(three_planes([0, LOCKED, 0]), ANYWHERE) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn the_center_is_best_of_four() {
        // Planes x = 1/3 and y = 1/3, at any corner.
        let center = Vec3::new(THIRD, THIRD, 0.0);
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| corner(p, center, &[Vec3::X, Vec3::Y], 0));
        assert!(cost(corners, AT_THREE) < 1e-6);
        assert!((cost(corners, AT_ENDS) - 3.0 * 2.0 / 9.0).abs() < 1e-5);
    }

    #[test]
    fn two_locks_or_a_hub_are_no_candidate() {
        for flags in [[LOCKED, LOCKED, 0], [0, LOCKED, LOCKED], [LOCKED, 0, LOCKED], [HUB, 0, 0], [0, 0, HUB]] {
            let params = Params { placement: ANYWHERE, regularization: PLANE_REGULARIZATION };
            assert_eq!(triangle_key(three_planes(flags), params), NO_KEY);
        }
    }
}
