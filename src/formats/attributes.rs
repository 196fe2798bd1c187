//! Vertex colors, normals, texture coordinates and positions between what files store and what a mesh holds.

use rayon::prelude::*;

use crate::math::{Vec2, Vec3};
use crate::mesh::Mesh;

/// The greatest way that rounding to f32 may move a vertex, as a fraction of the bounding box's diagonal.
const ROUNDING_FRACTION: f64 = 1e-6;

/// One channel of `[0, 1]` as a byte.
pub(super) fn to_byte(channel: f32) -> u8 {
    // The cast saturates and takes NaN to 0.
    (channel * 255.0).round() as u8
}

/// All four channels as bytes.
pub(super) fn to_bytes(color: [f32; 4]) -> [u8; 4] {
    color.map(to_byte)
}

/// The factor that takes stored channels to `[0, 1]`: text files hold fractions or bytes and do not say which.
///
/// `greatest` is the greatest channel of the whole file. Bytes are whole numbers: just above 1 it is a fraction, rounded.
pub(super) fn unit_factor(greatest: f64) -> f64 {
    if greatest >= 2.0 { 1.0 / 255.0 } else { 1.0 }
}

/// A stored channel scaled and clamped to `[0, 1]`; what is not finite stays.
pub(super) fn channel(stored: f64, factor: f64) -> f32 {
    let value = (stored * factor) as f32;
    match stored.is_finite() {
        true if value > 0.0 => value.min(1.0),
        true => 0.0,
        false => value,
    }
}

/// A channel as it is written, within `[0, 1]`; NaN becomes 0, since text has none that every reader takes.
pub(super) fn written_channel(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// A stored normal at unit length, unchanged when it is that already or not finite; zero when it has no direction.
pub(super) fn unit_normal(stored: Vec3) -> Vec3 {
    if stored.is_normalized() || !stored.is_finite() { stored } else { stored.normalize_or_zero() }
}

/// A normal as it is written: zero when it is no direction, since text has no NaN that every reader takes.
pub(super) fn written_normal(normal: Vec3) -> Vec3 {
    if normal.is_finite() { normal } else { Vec3::ZERO }
}

/// A stored texture coordinate; infinite where it is too large for f32.
pub(super) fn texcoord(u: f64, v: f64) -> Vec2 {
    Vec2::new(u as f32, v as f32)
}

/// A row for each face from texture coordinates that a file has for each vertex.
pub(super) fn of_corners(faces: &[[u32; 3]], of_vertex: &[Vec2]) -> Vec<[Vec2; 3]> {
    faces.par_iter().map(|face| face.map(|vertex| of_vertex[vertex as usize])).collect()
}

/// Whether rounding positions to f32 would show.
pub(super) fn needs_double(mesh: &Mesh) -> bool {
    let greatest = ROUNDING_FRACTION * mesh.diagonal();
    mesh.positions.iter().any(|position| {
        let rounded = position.as_vec3();
        !rounded.is_finite() || rounded.as_dvec3().distance(*position) > greatest
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_from_two_on_are_bytes() {
        assert_eq!([0.5, 1.0, 1.0001, 2.0, 255.0].map(unit_factor), [1.0, 1.0, 1.0, 1.0 / 255.0, 1.0 / 255.0]);
    }

    #[test]
    fn bytes_survive_the_round_trip() {
        for byte in 0..=255 {
            assert_eq!(to_byte(channel(f64::from(byte), 1.0 / 255.0)), byte);
        }
        assert_eq!([to_byte(-1.0), to_byte(7.0), to_byte(f32::NAN)], [0, 255, 0]);
    }

    #[test]
    fn hostile_normals_become_zero_or_unit_or_stay() {
        assert!(unit_normal(Vec3::NAN).is_nan() && unit_normal(Vec3::INFINITY) == Vec3::INFINITY);
        assert_eq!(unit_normal(Vec3::new(0.0, 0.0, 5.0)), Vec3::Z);
    }
}
