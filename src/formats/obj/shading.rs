//! Normals of corners to normals of vertices.

use rustc_hash::FxHashMap;

use super::words::NONE;
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// A direction at unit length, zero where there is none, and NaN where a number is not finite.
pub(super) fn unit(direction: DVec3) -> Vec3 {
    if !direction.is_finite() {
        return Vec3::NAN;
    }
    // A zero has no sign here, or equal normals would differ.
    direction.normalize_or_zero().as_vec3() + Vec3::ZERO
}

/// Gives vertices the normals of their corners, `rows` of numbers into `normals`. A vertex whose corners disagree is repeated at
/// the end, once for each further normal; corners without one, or one that is not finite, go with the first. None where no corner
/// has any.
pub(super) fn shade(mesh: &mut Mesh, rows: &[[u32; 3]], normals: &[Vec3]) {
    let mut of_vertex = vec![NONE; mesh.positions.len()];
    let mut repeated: Vec<u32> = Vec::new();
    let mut further: FxHashMap<(u32, [u32; 3]), u32> = FxHashMap::default();
    for (face, row) in mesh.faces.iter_mut().zip(rows) {
        for (corner, &normal) in face.iter_mut().zip(row) {
            let Some(&direction) = normals.get(normal as usize).filter(|direction| **direction != Vec3::ZERO) else {
                continue;
            };
            let held = of_vertex[*corner as usize];
            if held == NONE || normals[held as usize].is_nan() {
                of_vertex[*corner as usize] = normal;
            } else if held != normal && normals[held as usize] != direction && !direction.is_nan() {
                let vertex = *corner;
                *corner = *further.entry((vertex, direction.to_array().map(f32::to_bits))).or_insert_with(|| {
                    repeated.push(vertex);
                    of_vertex.push(normal);
                    of_vertex.len() as u32 - 1
                });
            }
        }
    }
    if of_vertex.iter().all(|&normal| normal == NONE) {
        return;
    }
    repeat(&mut mesh.positions, &repeated);
    mesh.colors.iter_mut().for_each(|colors| repeat(colors, &repeated));
    let direction = |normal: &u32| normals.get(*normal as usize).copied().unwrap_or_default();
    mesh.normals = Some(of_vertex.iter().map(direction).collect());
}

/// Appends copies of some rows.
fn repeat<T: Copy>(values: &mut Vec<T>, rows: &[u32]) {
    values.reserve(rows.len());
    rows.iter().for_each(|&row| values.push(values[row as usize]));
}
