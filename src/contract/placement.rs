//! Where the vertex of an accepted pair goes, in double precision from the current state.
//!
//! The kernels cost pairs in single precision as the round began; here the few pairs that are contracted are solved
//! again, since neighbors may have moved in the same round.

use crate::kernel::pair_quadric::{CONSTRAINT, REACH};
use crate::kernel::rows::PlaneQuadric;
use crate::math::{DMat3, DVec3};

/// xᵀA x − 2 b·x + c about the pair's midpoint, and the plane n·x = d on which the volume is kept (none when n is 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
    n: DVec3,
    d: f64,
}

impl Default for Quadric {
    fn default() -> Self {
        Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0, n: DVec3::ZERO, d: 0.0 }
    }
}

fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}

impl Quadric {
    /// Adds (n·x − d)² of a face with normal n through p, about the midpoint.
    pub fn add_face(&mut self, n: DVec3, p: DVec3) {
        let d = n.dot(p);
        self.a += outer(n);
        self.b += n * d;
        self.c += d * d;
        self.n += n;
        self.d += d;
    }

    /// Adds `weight`·|e×(x − p)|² of a border edge e through p, about the midpoint.
    pub fn add_border(&mut self, e: DVec3, p: DVec3, weight: f64) {
        let m = (DMat3::from_diagonal(DVec3::splat(e.length_squared())) - outer(e)) * weight;
        let mp = m * p;
        self.a += m;
        self.b += mp;
        self.c += p.dot(mp);
    }

    /// Gives up the volume constraint.
    pub fn free_volume(&mut self) {
        (self.n, self.d) = (DVec3::ZERO, 0.0);
    }

    /// Adds an accumulated quadric that stands at `p` about the midpoint.
    pub fn add_plane_quadric(&mut self, quadric: &PlaneQuadric, p: DVec3) {
        let q = quadric;
        let [xx, xy, xz, yy, yz, zz] = [q.xx, q.xy, q.xz, q.yy, q.yz, q.zz].map(f64::from);
        let a = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let linear = q.linear().as_dvec3();
        // y = x − p in q(y) = yᵀA y + 2 l·y + c.
        self.a += a;
        self.b += a * p - linear;
        self.c += p.dot(a * p) - 2.0 * linear.dot(p) + f64::from(q.c);
    }

    /// Its value.
    pub fn value(&self, x: DVec3) -> f64 {
        x.dot(self.a * x) - 2.0 * self.b.dot(x) + self.c
    }

    /// The sum of the weights of the squared distances in it: its trace, or 1 where there are none.
    pub fn weight(&self) -> f64 {
        let trace = self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z;
        if trace > 0.0 { trace } else { 1.0 }
    }

    /// The least point for a pair from −h to h: on the constraint, near the midpoint; otherwise the best of the ends
    /// and the midpoint.
    pub fn least(&self, h: DVec3, regularization: f64) -> DVec3 {
        let trace = self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z;
        if trace.is_nan() || trace <= 0.0 {
            return DVec3::ZERO;
        }
        let r = regularization * trace;
        let inverse = (self.a + DMat3::from_diagonal(DVec3::splat(r))).inverse();
        let mut x = inverse * self.b;
        if self.n.length_squared() > f64::from(CONSTRAINT) * trace {
            let z = inverse * self.n;
            x += z * ((self.d - self.n.dot(x)) / self.n.dot(z));
        }
        let reach = f64::from(REACH);
        if x.length_squared() <= reach * reach * h.length_squared() {
            x
        } else {
            [DVec3::ZERO, -h, h].into_iter().fold(DVec3::ZERO, |x, y| if self.value(y) < self.value(x) { y } else { x })
        }
    }

    /// The better of the two ends −h and h.
    pub fn better_end(&self, h: DVec3) -> DVec3 {
        if self.value(h) < self.value(-h) { h } else { -h }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_faces_meet_at_their_corner() {
        let mut q = Quadric::default();
        let corner = DVec3::new(0.2, -0.1, 0.3);
        for (u, v) in [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)] {
            q.add_face(u.cross(v), corner);
        }
        q.free_volume();
        assert!((q.least(DVec3::X, 1e-4) - corner).length() < 1e-3);
        assert!(q.value(corner).abs() < 1e-12);
    }

    #[test]
    fn far_placements_fall_back_to_the_best_of_three() {
        let mut q = Quadric::default();
        q.add_face(DVec3::Z, DVec3::Z * 9.0);
        q.free_volume();
        assert_eq!(q.least(DVec3::new(0.0, 0.0, 0.1), 1e-4), DVec3::new(0.0, 0.0, 0.1));
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
