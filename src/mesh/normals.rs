//! Normals of vertices from the faces around them.

use super::Mesh;
use super::weld::lowest_at_position;
use crate::math::{DVec3, Vec3};

/// The normal of every vertex: the mean of the faces at its position, each with the sine of its angle there over the
/// lengths of its sides \[Max99\], which is exact on a sphere however it is cut into triangles. Zero where they cancel out.
pub fn vertex_normals(mesh: &Mesh) -> Vec<Vec3> {
    let lowest = lowest_at_position(&mesh.positions);
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for face in &mesh.faces {
        for k in 0..3 {
            let [at, next, last] = [0, 1, 2].map(|i| mesh.positions[face[(k + i) % 3] as usize]);
            let (e, f) = (next - at, last - at);
            let lengths_sq = e.length_squared() * f.length_squared();
            let share = e.cross(f) / lengths_sq;
            if share.is_finite() {
                sums[lowest[face[k] as usize] as usize] += share;
            }
        }
    }
    lowest.iter().map(|&v| sums[v as usize].normalize_or_zero().as_vec3()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;

    #[test]
    fn those_of_a_sphere_point_outward() {
        let sphere = shapes::icosphere(2);
        for (normal, p) in vertex_normals(&sphere).iter().zip(&sphere.positions) {
            assert!(normal.as_dvec3().dot(p.normalize()) > 0.9999, "{normal} at {p}");
        }
    }

    #[test]
    fn vertices_at_one_place_have_one_normal() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], [3, 4, 5], [0, 1, 1]]);
        let normals = vertex_normals(&mesh);
        let half = 0.5_f32.sqrt();
        assert!((normals[0] - Vec3::new(half, 0.0, half)).length() < 1e-6 && normals[0] == normals[3], "{normals:?}");
        assert_eq!(normals[1], Vec3::Z);
    }
}
