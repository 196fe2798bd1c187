//! The plane that a region is drawn in.

use rayon::prelude::*;

use super::Partition;
use super::surface::Surface;
use crate::math::{DVec2, DVec3};

/// A plane with axes: `u`, `v`, `normal` are orthonormal and right-handed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    pub origin: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    pub normal: DVec3,
}

/// Normals of what is folded or closed cancel out where their sum is shorter than this share of theirs.
const FOLDED: f64 = 1e-6;

impl Plane {
    /// The plane of these faces: along the sum of their normals, through their centroid. `None` without a direction.
    pub fn of(surface: &Surface, faces: &[u32]) -> Option<Self> {
        let (mut sum, mut area, mut moment) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        let [first, ..] = faces else { return None };
        // About a corner, so that a small region far out loses no digits.
        let about = surface.points[surface.faces[*first as usize][0] as usize];
        for &f in faces {
            let [a, b, c] = surface.faces[f as usize].map(|v| surface.points[v as usize] - about);
            let cross = (b - a).cross(c - a);
            let length = cross.length();
            sum += cross;
            area += length;
            moment += (a + b + c) * (length / 3.0);
        }
        (sum.length() > FOLDED * area && area > 0.0).then(|| Self::new(about + moment / area, sum))
    }

    /// The plane of every region.
    pub fn of_regions(surface: &Surface, partition: &Partition) -> Vec<Option<Self>> {
        let (starts, faces) = partition.faces_by_region();
        let of = |ends: &[u32]| Self::of(surface, &faces[ends[0] as usize..ends[1] as usize]);
        starts.par_windows(2).map(of).collect()
    }

    /// The plane through a point across a direction.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        // Scaled first: a square may leave the range of numbers.
        let normal = (direction / direction.abs().max_element()).normalize();
        // The axis that is nearest to lying in it; an axis plane gets axes, exactly.
        let n = normal.abs();
        let helper = if n.x <= n.y && n.x <= n.z {
            DVec3::X
        } else if n.y <= n.z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        let u = helper.cross(normal).normalize();
        Self { origin, u, v: normal.cross(u), normal }
    }

    /// The coordinates of a point's foot.
    pub fn project(&self, point: DVec3) -> DVec2 {
        let away = point - self.origin;
        DVec2::new(away.dot(self.u), away.dot(self.v))
    }

    /// How far in front of it a point is.
    pub fn height(&self, point: DVec3) -> f64 {
        (point - self.origin).dot(self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn axes_are_right_handed() {
        for direction in [DVec3::X, -DVec3::Y, DVec3::Z * 1e-200, DVec3::new(1.0, -2.0, 1e200), DVec3::ONE] {
            let plane = Plane::new(DVec3::ONE, direction);
            assert!((plane.u.cross(plane.v) - plane.normal).length() < 1e-12, "{direction}");
            assert!((plane.height(DVec3::ONE + plane.normal * 2.0) - 2.0).abs() < 1e-12);
            assert_eq!(plane.project(DVec3::ONE), DVec2::ZERO);
        }
        let flat = Plane::new(DVec3::ZERO, DVec3::Z);
        assert!(flat.u.abs().max_element() == 1.0 && flat.v.abs().max_element() == 1.0);
    }

    #[test]
    fn regions_have_planes_and_closed_ones_none() {
        let of = |mesh| {
            let surface = Surface::new(&mesh, Some(0.0)).expect("a valid mesh");
            let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
            Plane::of(&surface, &faces).map(|plane| plane.normal)
        };
        assert_eq!(of(shapes::plane(3, 2)), Some(DVec3::Z));
        assert_eq!(of(shapes::icosphere(2)), None);
    }
}
