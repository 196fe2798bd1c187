//! Four vectors at once, in double precision, in the processor's own vector instructions.
//!
//! There are four lanes whatever the processor has: where numbers of many lanes become one sum, its order and so its bits are
//! the same everywhere. Nothing is fused.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use std::ops::{Add, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use super::DVec3;

/// How many vectors.
pub const WIDE: usize = 4;

/// As many vectors in memory, a row of numbers for each axis.
#[repr(C, align(32))]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WideRows([[f64; WIDE]; 3]);

impl WideRows {
    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> DVec3 {
        let [x, y, z] = &self.0;
        DVec3::new(x[lane], y[lane], z[lane])
    }

    /// Replaces the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: DVec3) {
        self.0.iter_mut().zip(v.to_array()).for_each(|(row, number)| row[lane] = number);
    }

    /// All of them.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> WideVec3<S> {
        let [x, y, z] = self.0;
        WideVec3 { x: x.simd_into(simd), y: y.simd_into(simd), z: z.simd_into(simd) }
    }
}

/// As many vectors in registers.
#[derive(Debug, Clone, Copy)]
pub struct WideVec3<S: Simd> {
    /// Along the first axis.
    pub x: f64x4<S>,
    /// Along the second.
    pub y: f64x4<S>,
    /// Along the third.
    pub z: f64x4<S>,
}

impl<S: Simd> WideVec3<S> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(simd: S, v: DVec3) -> Self {
        let [x, y, z] = v.to_array().map(|number| f64x4::splat(simd, number));
        Self { x, y, z }
    }

    /// Each times the number of its lane.
    #[inline(always)]
    pub fn scaled(self, by: f64x4<S>) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    /// The dot product, lane by lane.
    #[inline(always)]
    pub fn dot(self, other: Self) -> f64x4<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The squared lengths.
    #[inline(always)]
    pub fn length_squared(self) -> f64x4<S> {
        self.dot(self)
    }

    /// The cross product, lane by lane.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self) -> WideRows {
        WideRows([self.x.into(), self.y.into(), self.z.into()])
    }

    /// The sum of all lanes: see [`sum`].
    #[inline(always)]
    pub fn sum(self) -> DVec3 {
        DVec3::new(sum(self.x), sum(self.y), sum(self.z))
    }
}

impl<S: Simd> Add for WideVec3<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Simd> Sub for WideVec3<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

/// The sum of four lanes: the first and third, the second and fourth, then both.
#[inline(always)]
pub fn sum<S: Simd>(lanes: f64x4<S>) -> f64 {
    let (low, high) = lanes.split();
    let [even, odd]: [f64; 2] = (low + high).into();
    even + odd
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// Numbers whose sums and products all round.
    fn vectors(seed: f64) -> [DVec3; WIDE] {
        [1.0, 2.0, 3.0, 4.0].map(|i| DVec3::new(seed / i, i / (3.0 * seed), (i + 0.1) / 7.0))
    }

    fn rows(vectors: [DVec3; WIDE]) -> WideRows {
        let mut rows = WideRows::default();
        vectors.into_iter().enumerate().for_each(|(lane, v)| rows.set(lane, v));
        rows
    }

    #[inline(always)]
    fn compute<S: Simd>(simd: S, a: &WideRows, b: &WideRows) -> ([WideRows; 3], [f64; WIDE], DVec3) {
        let (a, b) = (a.load(simd), b.load(simd));
        let dot = a.dot(b);
        ([a.cross(b), a + b, (a - b).scaled(dot)].map(WideVec3::store), dot.into(), a.sum())
    }

    #[test]
    fn lanes_have_the_bits_of_scalar_vectors() {
        let (a, b) = (vectors(0.7), vectors(-1.3));
        let (vectors, dots, sum) = dispatch!(Level::new(), simd => compute(simd, &rows(a), &rows(b)));
        for lane in 0..WIDE {
            let (a, b) = (a[lane], b[lane]);
            let expected = [a.cross(b), a + b, (a - b) * a.dot(b)];
            assert_eq!(vectors.map(|rows| rows.get(lane)), expected);
            assert_eq!(dots[lane], a.dot(b));
        }
        assert_eq!(sum, (a[0] + a[2]) + (a[1] + a[3]));
        assert_ne!(sum, a[0] + a[1] + a[2] + a[3], "another order has other bits");
    }
}
