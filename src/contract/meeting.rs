//! Whether faces of a star touch or cross others already: those may come to pass through others.

use crate::math::{DVec3, Vec3};
use crate::spatial::bounds::Bounds;
use crate::spatial::crossing::{cross, lies_on};

use super::patch::Patch;
use super::star::Star;

/// A face as it is now.
#[derive(Debug, Clone, Copy)]
pub struct FaceNow {
    vertices: [u32; 3],
    corners: [Vec3; 3],
    /// Around what is so near that it touches, and somewhat more: single precision rounds.
    bounds: Bounds,
}

impl FaceNow {
    /// With corners at these vertices; `touching` is how far apart faces are that touch, at most.
    #[inline]
    pub fn of(vertices: [u32; 3], patch: &Patch<'_>, touching: f64) -> Self {
        Self::at(vertices, vertices.map(|v| patch.position(v).xyz()), touching)
    }

    #[inline]
    fn at(vertices: [u32; 3], corners: [Vec3; 3], touching: f64) -> Self {
        Self { vertices, corners, bounds: Bounds::of(corners).wider(2.0 * touching as f32) }
    }

    fn located(&self) -> [DVec3; 3] {
        self.corners.map(Vec3::as_dvec3)
    }

    /// Whether it touches or crosses another, beside where both have a vertex.
    fn meets(&self, other: &Self, touching: f64) -> bool {
        self.bounds.meets(&other.bounds)
            && (cross(self.located(), other.located(), touching)
                || self.has_corner_of(other, touching)
                || other.has_corner_of(self, touching))
    }

    /// Whether a corner of another, but for those of both, lies on it.
    fn has_corner_of(&self, other: &Self, touching: f64) -> bool {
        let is_near = |p: Vec3| self.bounds.holds(&Bounds { low: p, high: p });
        let mut corners = other.vertices.into_iter().zip(other.corners);
        corners
            .any(|(v, p)| is_near(p) && !self.vertices.contains(&v) && lies_on(p.as_dvec3(), self.located(), touching))
    }
}

/// The faces of a star as they are now.
#[derive(Debug, Default)]
pub struct Meeting {
    own: Vec<FaceNow>,
    around: Option<Bounds>,
    touching: f64,
}

impl Meeting {
    /// Takes in the star of a pair.
    pub fn gather(&mut self, patch: &Patch<'_>, star: &Star, pair: [u32; 2], touching: f64) {
        self.own.clear();
        for (number, face) in star.faces().iter().enumerate() {
            let end = pair[usize::from(star.numbers_of_second().contains(&number))];
            let [v1, v2] = face.others;
            self.own.push(FaceNow::of([end, v1, v2], patch, touching));
        }
        self.around = self.own.iter().map(|face| face.bounds).reduce(Bounds::union);
        self.touching = touching;
    }

    /// Whether one of its faces touches or crosses another.
    pub fn meets(&self, other: &FaceNow) -> bool {
        self.around.is_some_and(|around| around.meets(&other.bounds))
            && self.own.iter().any(|own| own.meets(other, self.touching))
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
        let own = Meeting { own: vec![flat], around: Some(flat.bounds), touching: TOUCHING };
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
            assert_eq!(own.meets(&other), meets, "{other:?}");
            assert_eq!([flat.meets(&other, TOUCHING), other.meets(&flat, TOUCHING)], [meets; 2], "{other:?}");
        }
        assert!(!Meeting::default().meets(&flat));
    }
}
