//! Whether faces of a star touch or cross others already: those may come to pass through others.

use crate::math::Vec3;
use crate::spatial::bounds::Bounds;
use crate::spatial::crossing::Triangle;

use super::patch::Patch;
use super::star::Star;

/// A face as it is now.
#[derive(Debug, Clone, Copy)]
struct FaceNow {
    vertices: [u32; 3],
    corners: [Vec3; 3],
    /// Around what is so near that it touches, and somewhat more: single precision rounds.
    bounds: Bounds,
}

impl FaceNow {
    /// With corners at these vertices; `touching` is how far apart faces are that touch, at most.
    #[inline]
    fn of(vertices: [u32; 3], patch: &Patch<'_>, touching: f64) -> Self {
        Self::at(vertices, vertices.map(|v| patch.position(v).xyz()), touching)
    }

    #[inline]
    fn at(vertices: [u32; 3], corners: [Vec3; 3], touching: f64) -> Self {
        Self { vertices, corners, bounds: Bounds::of(corners).wider(2.0 * touching as f32) }
    }

    fn triangle(&self, touching: f64) -> Triangle {
        Triangle::of(self.corners.map(Vec3::as_dvec3), touching)
    }

    /// Whether a corner of another, but for those of both, lies on this one, which is the `triangle`.
    fn has_corner_of(&self, triangle: &Triangle, other: &Self) -> bool {
        let is_near = |p: Vec3| self.bounds.holds(&Bounds { low: p, high: p });
        let mut corners = other.vertices.into_iter().zip(other.corners);
        corners.any(|(v, p)| is_near(p) && !self.vertices.contains(&v) && triangle.has(p.as_dvec3()))
    }
}

/// The faces of a star as they are now.
#[derive(Debug, Default)]
pub struct Meeting {
    own: Vec<(FaceNow, Triangle)>,
    around: Option<Bounds>,
    touching: f64,
}

impl Meeting {
    /// Takes in the star of a pair.
    pub fn gather(&mut self, patch: &Patch<'_>, star: &Star, pair: [u32; 2], touching: f64) {
        let faces = star.faces().iter().enumerate().map(|(number, face)| {
            let end = pair[usize::from(star.numbers_of_second().contains(&number))];
            let [v1, v2] = face.others;
            FaceNow::of([end, v1, v2], patch, touching)
        });
        self.take(faces, touching);
    }

    fn take(&mut self, faces: impl Iterator<Item = FaceNow>, touching: f64) {
        self.own.clear();
        self.own.extend(faces.map(|face| (face, face.triangle(touching))));
        self.around = self.own.iter().map(|(face, _)| face.bounds).reduce(Bounds::union);
        self.touching = touching;
    }

    /// Whether one of its faces touches or crosses another, beside where both have a vertex.
    pub fn meets(&self, vertices: [u32; 3], patch: &Patch<'_>) -> bool {
        self.meets_face(&FaceNow::of(vertices, patch, self.touching))
    }

    fn meets_face(&self, other: &FaceNow) -> bool {
        if !self.around.is_some_and(|around| around.meets(&other.bounds)) {
            return false;
        }
        let mut near = self.own.iter().filter(|(own, _)| own.bounds.meets(&other.bounds)).peekable();
        if near.peek().is_none() {
            return false;
        }
        let triangle = other.triangle(self.touching);
        near.any(|(own, of_own)| {
            of_own.crosses(&triangle) || own.has_corner_of(of_own, other) || other.has_corner_of(&triangle, own)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOUCHING: f64 = 1e-6;

    fn face(vertices: [u32; 3], corners: [[f32; 3]; 3]) -> FaceNow {
        FaceNow::at(vertices, corners.map(Vec3::from), TOUCHING)
    }

    #[test]
    fn faces_meet_where_they_cross_and_where_a_corner_of_either_lies_on_the_other() {
        let flat = face([0, 1, 2], [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let standing = |z: f32| [[1.0, 1.0, z], [1.0, 2.0, 3.0], [2.0, 1.0, 3.0]];
        let of = |face: FaceNow| {
            let mut star = Meeting::default();
            star.take([face].into_iter(), TOUCHING);
            star
        };
        for (vertices, corners, meets) in [
            ([3, 4, 5], standing(0.5), false),
            ([3, 4, 5], standing(0.0), true),
            ([3, 4, 5], standing(5e-7), true),
            ([3, 4, 5], standing(-0.5), true),
            // The corner that lies on it is its own, too.
            ([0, 4, 5], standing(0.0), false),
            ([3, 4, 5], [[3.0, 3.0, 0.0], [9.0, 3.0, 0.0], [3.0, 9.0, 0.0]], false),
        ] {
            let other = face(vertices, corners);
            assert_eq!([of(flat).meets_face(&other), of(other).meets_face(&flat)], [meets; 2], "{other:?}");
        }
        assert!(!Meeting::default().meets_face(&flat));
    }
}
