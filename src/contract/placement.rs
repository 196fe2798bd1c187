//! Where the vertex of an accepted pair goes, in double precision from the current state.
//!
//! The kernels cost pairs in single precision as the round began; here the few pairs that are contracted are solved
//! again, since neighbors may have moved in the same round.

use crate::kernel::pair_quadric::{CONSTRAINT, REACH};
use crate::kernel::rows::PlaneQuadric;
use crate::math::DVec3;

use super::star::{Star, StarFace};

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

    /// n nᵀ/|n|; zero for a face without area.
    #[inline(always)]
    fn of_face(n: DVec3) -> Self {
        let length = n.length();
        let m = n * if length > 0.0 { 1.0 / length } else { 0.0 };
        Self { xx: m.x * n.x, xy: m.x * n.y, xz: m.x * n.z, yy: m.y * n.y, yz: m.y * n.z, zz: m.z * n.z }
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
        let sums = |faces: &[StarFace]| {
            let zero = (Sym3::default(), DVec3::ZERO);
            faces.iter().fold(zero, |(a, n), face| (a.plus(Sym3::of_face(face.normal)), n + face.normal))
        };
        let ((first, n1), (second, n2), (shared, n)) = (sums(&star.first), sums(&star.second), sums(&star.shared));
        let (first_h, second_h) = (first.times(star.h), second.times(star.h));
        Self {
            a: first.plus(second).plus(shared),
            b: second_h - first_h,
            c: star.h.dot(first_h + second_h),
            n: n1 + n2 + n,
            d: (n2 - n1).dot(star.h),
        }
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

    /// The quadric less another's terms, on its own constraint.
    pub fn minus(&self, other: &Self) -> Self {
        let (a, b) = (self.a, other.a);
        let a = Sym3 {
            xx: a.xx - b.xx,
            xy: a.xy - b.xy,
            xz: a.xz - b.xz,
            yy: a.yy - b.yy,
            yz: a.yz - b.yz,
            zz: a.zz - b.zz,
        };
        Self { a, b: self.b - other.b, c: self.c - other.c, ..*self }
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
        if self.n.length_squared() > f64::from(CONSTRAINT) * trace * trace {
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
        let face = |p0: DVec3, p1: DVec3, p2: DVec3| StarFace {
            face: 0,
            others: [0, 0],
            points: [p1, p2],
            normal: (p1 - p0).cross(p2 - p0),
        };
        let (h, down) = (DVec3::X * 0.5, DVec3::NEG_Z);
        let (left, right) = (DVec3::Y + down, DVec3::NEG_Y + down);
        let star = Star {
            h,
            first: vec![face(-h, left, DVec3::NEG_X * 2.0 + down), face(-h, DVec3::NEG_X * 2.0 + down, right)],
            second: vec![face(h, right, DVec3::X * 2.0 + down), face(h, DVec3::X * 2.0 + down, left)],
            shared: vec![face(-h, h, left), face(-h, right, h)],
            ..Star::default()
        };
        let q = Quadric::of_star(&star);
        let x = q.least(h, 1e-5);
        assert!(q.n.z > 0.0 && (q.n.dot(x) - q.d).abs() < 1e-9 * q.n.length(), "{x}");
        let by_hand: f64 = (star.first.iter().map(|f| (f, -h)).chain(star.second.iter().map(|f| (f, h))))
            .chain(star.shared.iter().map(|f| (f, h)))
            .map(|(f, p)| f.normal.dot(x - p).powi(2) / f.normal.length())
            .sum();
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
