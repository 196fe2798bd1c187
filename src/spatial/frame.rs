//! The frame that meshes are compared in: centered, scaled by a power of two into −1 .. 1.
//!
//! A model far from the origin loses no digits there, squares neither overflow nor vanish, and scaling a model by a power
//! of two changes no bit.

use rayon::prelude::*;

use crate::math::DVec3;
use crate::mesh::Mesh;

/// Faces taken by one thread at a time.
const CHUNK: usize = 1 << 14;

/// Between model units and the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    center: DVec3,
    /// Frame lengths a model unit: a power of two.
    scale: f64,
}

impl Frame {
    /// The frame of the faces of both meshes; the same whichever comes first.
    ///
    /// Unused vertices do not count: they may lie anywhere.
    pub fn of(a: &Mesh, b: &Mesh) -> Self {
        let boxes = [a, b].map(bounds);
        let low = boxes[0].0.min(boxes[1].0);
        let high = boxes[0].1.max(boxes[1].1);
        if low.x > high.x {
            return Self { center: DVec3::ZERO, scale: 1.0 };
        }
        // Halves first: the sum of two finite numbers may not be.
        let center = low * 0.5 + high * 0.5;
        let half = (high - center).max(center - low).max_element();
        // From the bits, one more than the exponent: a length of less than 2^k goes below 1 by 2^−k.
        let exponent = if half.is_normal() { (half.to_bits() >> 52 & 0x7ff) as i64 - 1022 } else { 0 };
        Self { center, scale: f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52) }
    }

    /// A position in the frame.
    pub fn to_frame(self, position: DVec3) -> DVec3 {
        (position - self.center) * self.scale
    }

    /// A position of the frame in model units.
    pub fn to_model(self, position: DVec3) -> DVec3 {
        position / self.scale + self.center
    }

    /// A length of the frame in model units.
    pub fn length_to_model(self, length: f64) -> f64 {
        length / self.scale
    }

    /// The corners of a face in the frame.
    pub fn corners(self, mesh: &Mesh, face: [u32; 3]) -> [DVec3; 3] {
        face.map(|v| self.to_frame(mesh.positions[v as usize]))
    }
}

/// The bounds of all corners, inverted without faces.
fn bounds(mesh: &Mesh) -> (DVec3, DVec3) {
    let none = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let grown = |(low, high): (DVec3, DVec3), face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        (low.min(a).min(b).min(c), high.max(a).max(b).max(c))
    };
    (mesh.faces.par_iter().with_min_len(CHUNK)).fold(none, grown).reduce(none, |(a, b), (c, d)| (a.min(c), b.max(d)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn corners_come_to_lie_within_one_at_any_scale_and_place() {
        let cube = shapes::cube(2);
        for scale in [1e-300, 1e-6, 1.0, 1e6, 1e300] {
            for shift in [0.0, 1000.0] {
                let positions = cube.positions.iter().map(|&p| (p + shift) * scale).collect();
                let mesh = Mesh { positions, ..cube.clone() };
                let frame = Frame::of(&mesh, &mesh);
                let farthest =
                    mesh.positions.iter().map(|&p| frame.to_frame(p).abs().max_element()).fold(0.0, f64::max);
                assert!((0.5..=1.0).contains(&farthest), "{scale} {shift}: {farthest}");
                let p = mesh.positions[5];
                assert!((frame.to_model(frame.to_frame(p)) - p).length() <= 1e-15 * p.length(), "{scale} {shift}");
            }
        }
    }

    #[test]
    fn a_point_and_nothing_have_a_frame() {
        let point = Mesh::new(vec![DVec3::splat(3.0)], vec![[0, 0, 0]]);
        assert_eq!(Frame::of(&point, &Mesh::default()).to_frame(DVec3::splat(3.0)), DVec3::ZERO);
        assert_eq!(Frame::of(&Mesh::default(), &Mesh::default()).to_frame(DVec3::ONE), DVec3::ONE);
    }
}
