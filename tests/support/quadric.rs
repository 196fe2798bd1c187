//! Quadratic functions of a point, in f64.

use coarsen::math::{DMat3, DVec3};

/// `xᵀ A x − 2 b·x + c`, relative to an origin that the user of it keeps in mind.
#[derive(Debug, Clone, Copy)]
pub struct Quadric {
    pub a: DMat3,
    pub b: DVec3,
    pub c: f64,
}

impl Quadric {
    /// Not `default()`: a matrix's default is the identity.
    pub const ZERO: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0 };

    /// `weight · (n·x − d)²`.
    pub fn plane(n: DVec3, d: f64, weight: f64) -> Self {
        Self { a: outer(n) * weight, b: n * (d * weight), c: d * d * weight }
    }

    /// `weight · |e × (x − p)|²`: the squared distance to the line, times `|e|²`.
    pub fn line(e: DVec3, p: DVec3, weight: f64) -> Self {
        let a = (DMat3::from_diagonal(DVec3::splat(e.length_squared())) - outer(e)) * weight;
        let b = a * p;
        Self { a, b, c: p.dot(b) }
    }

    /// Adds a function about the same origin.
    pub fn add(&mut self, other: &Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
    }

    /// Never below zero by rounding, and never −0, whose bits would sort last.
    pub fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.a * x) - 2.0 * self.b.dot(x) + self.c).max(0.0) + 0.0
    }

    /// The same function of `x − origin`.
    pub fn about(&self, origin: DVec3) -> Self {
        let ao = self.a * origin;
        Self { a: self.a, b: self.b - ao, c: origin.dot(ao) - 2.0 * self.b.dot(origin) + self.c }
    }

    /// The trace of the matrix.
    pub fn trace(&self) -> f64 {
        self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z
    }
}

fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}
