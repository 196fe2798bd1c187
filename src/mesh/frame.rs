//! The normalized frame: centered, scaled by a power of two so that the mean edge is about 1.
//!
//! Not the unit box: costs of the `volume` metric grow with the sixth power of length and would underflow there.

use rayon::prelude::*;

use crate::math::{DVec3, Vec3};

/// Faces summed by one thread at a time.
const CHUNK: usize = 1 << 14;

/// Faces whose edges are measured, about: the scale is a power of two, and does not need them all.
const SAMPLE: usize = 1 << 12;

/// Farthest that an unused vertex may lie out; a corner of a face lies within the number of its faces.
const FARTHEST: DVec3 = DVec3::splat((1_u64 << 40) as f64);

/// Between model units and the normalized frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    center: DVec3,
    /// Normalized lengths a model unit: a power of two.
    scale: f64,
}

impl Frame {
    /// The frame of faces whose corners have these positions and lie between `low` and `high`.
    pub fn new(faces: &[[u32; 3]], position: impl Fn(u32) -> DVec3 + Sync, (low, high): (DVec3, DVec3)) -> Self {
        if faces.is_empty() {
            return Self { center: DVec3::ZERO, scale: 1.0 };
        }
        // Halves first: the sum of two finite numbers may not be.
        let center = low * 0.5 + high * 0.5;
        let half = ((high - center).max(center - low)).max_element();
        // In units of the box, where squares neither overflow nor vanish.
        let unit = if half > 0.0 { 1.0 / half } else { 1.0 };
        let unit = if unit.is_finite() { unit } else { 1.0 };
        let perimeter = |&face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| (position(v) - center) * unit);
            (b - a).length() + (c - b).length() + (a - c).length()
        };
        // Chunks of equal length, summed in order: the same number for any count of threads.
        let mean_of_every = |step: usize| {
            let sums: Vec<f64> =
                faces.par_chunks(CHUNK * step).map(|faces| faces.iter().step_by(step).map(perimeter).sum()).collect();
            sums.iter().sum::<f64>() / (3.0 * faces.len().div_ceil(step) as f64)
        };
        let mut mean = mean_of_every(faces.len().div_ceil(SAMPLE));
        // Faces that reach around the box have a mean edge of at least this; where a sample has less, it is a poor one.
        if mean * faces.len() as f64 <= 0.5 {
            mean = mean_of_every(1);
        }
        let mean = mean / unit;
        // From the bits: no logarithm, whose last digit differs between platforms.
        let exponent = if mean.is_normal() { (mean.to_bits() >> 52 & 0x7ff) as i64 - 1023 } else { 0 };
        Self { center, scale: f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52) }
    }

    /// A position in the frame.
    pub fn to_frame(self, position: DVec3) -> DVec3 {
        ((position - self.center) * self.scale).clamp(-FARTHEST, FARTHEST)
    }

    /// A position in the frame, rounded to single precision.
    pub fn to_rows(self, position: DVec3) -> Vec3 {
        self.to_frame(position).as_vec3()
    }

    /// A position of the frame in model units; a vertex beyond the greatest number stays there.
    pub fn to_model(self, position: Vec3) -> DVec3 {
        self.point_to_model(position.as_dvec3())
    }

    /// As [`Self::to_model`], of a point that is not rounded.
    pub fn point_to_model(self, point: DVec3) -> DVec3 {
        let p = point / self.scale + self.center;
        p.clamp(DVec3::splat(f64::MIN), DVec3::splat(f64::MAX))
    }

    /// The origin of the model's coordinates.
    pub fn origin_in_rows(self) -> DVec3 {
        -self.center * self.scale
    }

    /// A length of the frame in model units.
    pub fn length_to_model(self, length: f64) -> f64 {
        length / self.scale
    }

    /// A length in model units in the frame.
    pub fn length_to_rows(self, length: f64) -> f64 {
        length * self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, shapes};

    fn frame(mesh: &Mesh) -> Frame {
        Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds())
    }

    #[test]
    fn mean_edge_is_about_one_at_any_scale_and_place() {
        let sphere = shapes::icosphere(3);
        for scale in [1e-150, 1e-6, 1.0, 1e6, 1e150] {
            let positions: Vec<DVec3> = sphere.positions.iter().map(|&p| (p + 1000.0) * scale).collect();
            let frame = frame(&Mesh { positions: positions.clone(), ..sphere.clone() });
            let [a, b, _] = sphere.faces[0].map(|v| frame.to_rows(positions[v as usize]));
            assert!((0.5..2.0).contains(&(b - a).length()), "{scale}: {}", (b - a).length());
        }
    }

    #[test]
    fn there_and_back_is_within_single_precision() {
        let sphere = shapes::icosphere(2);
        let frame = frame(&sphere);
        for &p in &sphere.positions {
            assert!((frame.to_model(frame.to_rows(p)) - p).length() < 1e-6);
        }
    }
}
