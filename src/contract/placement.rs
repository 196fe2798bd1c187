//! Where the vertex of an accepted pair goes, in double precision from the current state.
//!
//! The kernels cost pairs in single precision as the round began; here the few pairs that are contracted are solved
//! again, since neighbors may have moved in the same round.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};

use crate::kernel::pair_quadric::{CONSTRAINT, REACH};
use crate::kernel::rows::PlaneQuadric;
use crate::math::DVec3;
use crate::math::wide::{WideVec3, sum};

use super::quads::{Quad, Quads};
use super::star::Star;

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sym3 {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Sym3 {
    #[inline(always)]
    fn outer(n: DVec3) -> Self {
        Self { xx: n.x * n.x, xy: n.x * n.y, xz: n.x * n.z, yy: n.y * n.y, yz: n.y * n.z, zz: n.z * n.z }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }

    #[inline(always)]
    fn times(self, v: DVec3) -> DVec3 {
        DVec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    fn trace(self) -> f64 {
        self.xx + self.yy + self.zz
    }
}

/// L D Lᵀ of a matrix with `r` added to its diagonal, which needs no pivots: what [`crate::kernel::pair_quadric::least`]
/// does in single precision.
#[derive(Debug, Clone, Copy)]
struct Factors {
    r: DVec3,
    l1: f64,
    l2: f64,
    l3: f64,
}

impl Factors {
    fn new(a: Sym3, r: f64) -> Self {
        let r0 = 1.0 / (a.xx + r);
        let (l1, l2) = (a.xy * r0, a.xz * r0);
        let r1 = 1.0 / (a.yy + r - l1 * a.xy);
        let m = a.yz - l2 * a.xy;
        let l3 = m * r1;
        let r2 = 1.0 / (a.zz + r - l2 * a.xz - l3 * m);
        Self { r: DVec3::new(r0, r1, r2), l1, l2, l3 }
    }

    fn solve(&self, b: DVec3) -> DVec3 {
        let b1 = b.y - self.l1 * b.x;
        let b2 = b.z - self.l2 * b.x - self.l3 * b1;
        let z = b2 * self.r.z;
        let y = b1 * self.r.y - self.l3 * z;
        DVec3::new(b.x * self.r.x - self.l1 * y - self.l2 * z, y, z)
    }
}

/// What [`Quadric::of_star`] promises, lane by lane, and the lanes at last.
#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn sums_of_quads<S: Simd>(simd: S, quads: &[Quad], h: DVec3) -> Quadric {
    let zero = f64x4::splat(simd, 0.0);
    let h = WideVec3::splat(simd, h);
    let [mut xx, mut xy, mut xz, mut yy, mut yz, mut zz, mut c, mut d] = [zero; 8];
    let [mut b, mut normal] = [WideVec3::splat(simd, DVec3::ZERO); 2];
    for quad in quads {
        let n = quad.normals.load(simd);
        let length = n.length_squared().sqrt();
        // A face without area adds nothing.
        let weight = length.simd_gt(zero).select(f64x4::splat(simd, 1.0) / length, zero);
        let m = n.scaled(weight);
        xx += m.x * n.x;
        xy += m.x * n.y;
        xz += m.x * n.z;
        yy += m.y * n.y;
        yz += m.y * n.z;
        zz += m.z * n.z;
        let along = n.dot(h);
        let sides: f64x4<S> = quad.sides.simd_into(simd);
        let distance = along * sides;
        b = b + m.scaled(distance);
        c += along * along * weight;
        normal = normal + n;
        d += distance;
    }
    let a = Sym3 { xx: sum(xx), xy: sum(xy), xz: sum(xz), yy: sum(yy), yz: sum(yz), zz: sum(zz) };
    Quadric { a, b: b.sum(), c: sum(c), n: normal.sum(), d: sum(d) }
}

/// xᵀA x − 2 b·x + c about the pair's midpoint, and the plane n·x = d on which the volume is kept (none when n is 0).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quadric {
    a: Sym3,
    b: DVec3,
    c: f64,
    n: DVec3,
    d: f64,
}

impl Quadric {
    /// The sum of (n·x − d)²/|n| over the faces of a star.
    ///
    /// About the midpoint every plane of the first end has d = −n·h, every one of the second d = n·h, and the shared ones
    /// hold both ends.
    pub fn of_star(star: &Star) -> Self {
        Self::of_quads(&star.quads, star.h)
    }

    fn of_quads(quads: &Quads, h: DVec3) -> Self {
        dispatch!(quads.level, simd => sums_of_quads(simd, quads.rows(), h))
    }

    /// Adds `weight`·|e×(x − p)|² of a border edge e through p.
    pub fn add_border(&mut self, e: DVec3, p: DVec3, weight: f64) {
        let along = Sym3::outer(e);
        let sq = along.trace();
        let m = Sym3 {
            xx: (sq - along.xx) * weight,
            xy: -along.xy * weight,
            xz: -along.xz * weight,
            yy: (sq - along.yy) * weight,
            yz: -along.yz * weight,
            zz: (sq - along.zz) * weight,
        };
        let mp = m.times(p);
        self.a = self.a.plus(m);
        self.b += mp;
        self.c += p.dot(mp);
    }

    /// Adds xᵀA x + 2 b·x + c, of A the upper half row by row.
    pub fn add_sums(&mut self, [xx, xy, xz, yy, yz, zz]: [f64; 6], b: DVec3, c: f64) {
        self.a = self.a.plus(Sym3 { xx, xy, xz, yy, yz, zz });
        self.b -= b;
        self.c += c;
    }

    /// The sum of the normals, unless they cancel each other out nearly, or the volume constraint was given up.
    pub fn normal(&self) -> Option<DVec3> {
        let trace = self.a.trace();
        (self.n.length_squared() > f64::from(CONSTRAINT) * trace * trace).then_some(self.n)
    }

    /// Gives up the volume constraint.
    pub fn free_volume(&mut self) {
        (self.n, self.d) = (DVec3::ZERO, 0.0);
    }

    /// Adds an accumulated quadric that stands at `p`.
    pub fn add_plane_quadric(&mut self, quadric: &PlaneQuadric, p: DVec3) {
        let q = quadric;
        let [xx, xy, xz, yy, yz, zz] = [q.xx, q.xy, q.xz, q.yy, q.yz, q.zz].map(f64::from);
        let a = Sym3 { xx, xy, xz, yy, yz, zz };
        let linear = q.linear().as_dvec3();
        let ap = a.times(p);
        // y = x − p in q(y) = yᵀA y + 2 l·y + c.
        self.a = self.a.plus(a);
        self.b += ap - linear;
        self.c += p.dot(ap) - 2.0 * linear.dot(p) + f64::from(q.c);
    }

    /// Its value.
    pub fn value(&self, x: DVec3) -> f64 {
        x.dot(self.a.times(x)) - 2.0 * self.b.dot(x) + self.c
    }

    /// The sum of the weights of the squared distances in it: its trace, or 1 where there are none.
    pub fn weight(&self) -> f64 {
        let trace = self.a.trace();
        if trace > 0.0 { trace } else { 1.0 }
    }

    /// The least point for a pair from −h to h: on the constraint, near the midpoint; otherwise the best of the ends
    /// and the midpoint.
    pub fn least(&self, h: DVec3, regularization: f64) -> DVec3 {
        self.least_near(&[DVec3::ZERO, -h, h], h.length_squared(), regularization)
    }

    /// The least point within a few times the radius whose square is given, on the constraint; otherwise the best of
    /// `points`, the first of which is the middle.
    pub fn least_near(&self, points: &[DVec3], radius_sq: f64, regularization: f64) -> DVec3 {
        let trace = self.a.trace();
        if trace.is_nan() || trace <= 0.0 {
            return DVec3::ZERO;
        }
        let factors = Factors::new(self.a, regularization * trace);
        let mut x = factors.solve(self.b);
        if self.normal().is_some() {
            let z = factors.solve(self.n);
            x += z * ((self.d - self.n.dot(x)) / self.n.dot(z));
        }
        let reach = f64::from(REACH);
        if x.length_squared() <= reach * reach * radius_sq { x } else { self.least_of(points) }
    }

    /// The least point between −h and h.
    pub fn least_between(&self, h: DVec3) -> DVec3 {
        let along = self.b.dot(h) / h.dot(self.a.times(h));
        let inside = if along.is_nan() { DVec3::ZERO } else { h * along.clamp(-1.0, 1.0) };
        self.least_of(&[inside, -h, h])
    }

    /// The best of some points, the first of equals; the midpoint of none.
    pub fn least_of(&self, points: &[DVec3]) -> DVec3 {
        let best = |x: DVec3, &y: &DVec3| if self.value(y) < self.value(x) { y } else { x };
        points.split_first().map_or(DVec3::ZERO, |(&first, others)| others.iter().fold(first, best))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (n·x − d)² of a plane with normal n through p.
    fn plane(n: DVec3, p: DVec3) -> Quadric {
        let d = n.dot(p);
        Quadric { a: Sym3::outer(n), b: n * d, c: d * d, ..Quadric::default() }
    }

    #[test]
    fn three_faces_meet_at_their_corner() {
        let corner = DVec3::new(0.2, -0.1, 0.3);
        let planes = [DVec3::Z, DVec3::X, DVec3::Y].map(|n| plane(n, corner));
        let q = planes.into_iter().fold(Quadric::default(), |sum, q| Quadric {
            a: sum.a.plus(q.a),
            b: sum.b + q.b,
            c: sum.c + q.c,
            ..sum
        });
        assert!((q.least(DVec3::X, 1e-4) - corner).length() < 1e-3);
        assert!(q.value(corner).abs() < 1e-12);
    }

    #[test]
    fn far_placements_fall_back_to_the_best_of_three() {
        let q = plane(DVec3::Z, DVec3::Z * 9.0);
        assert_eq!(q.least(DVec3::new(0.0, 0.0, 0.1), 1e-4), DVec3::new(0.0, 0.0, 0.1));
    }

    #[test]
    fn the_star_of_a_roof_keeps_its_volume() {
        // Two ends at height 1 over four faces that slope to height 0: the least point keeps Σ n·x = Σ d.
        let (h, down) = (DVec3::X * 0.5, DVec3::NEG_Z);
        let (left, right) = (DVec3::Y + down, DVec3::NEG_Y + down);
        let first = [[left, DVec3::NEG_X * 2.0 + down], [DVec3::NEG_X * 2.0 + down, right]];
        let second = [[right, DVec3::X * 2.0 + down], [DVec3::X * 2.0 + down, left]];
        let shared = [[h, left], [right, h]];
        let faces = [(first, -1.0), (second, 1.0), (shared, -1.0)];
        let faces: Vec<_> = faces.into_iter().flat_map(|(faces, side)| faces.map(|points| (points, side))).collect();
        let quads = Quads::of(&faces, h);
        let q = Quadric::of_quads(&quads, h);
        let x = q.least(h, 1e-5);
        assert!(q.n.z > 0.0 && (q.n.dot(x) - q.d).abs() < 1e-9 * q.n.length(), "{x}");
        let by_hand = |(number, &(_, side)): (usize, &([DVec3; 2], f64))| {
            let n = quads.normal(number);
            n.dot(x - h * side).powi(2) / n.length()
        };
        let by_hand: f64 = faces.iter().enumerate().map(by_hand).sum();
        assert!((q.value(x) - by_hand).abs() < 1e-12);
    }

    #[test]
    fn the_least_between_the_ends_stays_between_them() {
        let at = |x: f64| plane(DVec3::X, DVec3::X * x).least_between(DVec3::X);
        assert_eq!([at(0.25), at(3.0), at(-3.0)], [DVec3::X * 0.25, DVec3::X, DVec3::NEG_X]);
        // A plane along the segment: all of it is as good, and nothing is divided by zero.
        assert_eq!(plane(DVec3::Z, DVec3::Z).least_between(DVec3::X), DVec3::ZERO);
    }

    #[test]
    fn no_area_stays_at_the_midpoint() {
        assert_eq!(Quadric::default().least(DVec3::X, 1e-4), DVec3::ZERO);
    }

    #[test]
    fn borders_hold_their_line() {
        let mut q = Quadric::default();
        q.add_border(DVec3::X, DVec3::new(0.3, 0.1, 0.0), 2.0);
        let x = q.least(DVec3::new(0.5, 0.0, 0.0), 1e-4);
        assert!((x.y - 0.1).abs() < 1e-3 && x.z.abs() < 1e-12, "{x}");
    }
}
