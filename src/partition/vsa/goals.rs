//! As many regions as a goal needs: more where it is worst, then fewer where it does not matter.

use rayon::prelude::*;

use crate::math::DVec3;

use super::attempt::Attempt;
use super::exchange::{add, merge_down, merge_where, split_all};
use super::labeling::Sum;
use super::scene::Scene;
use super::split::Members;

/// Regions to begin with.
const FIRST: usize = 16;
/// Times that faces move again after regions were split; then splitting alone ends the search.
const MOST_SETTLED: usize = 16;
/// Times that regions are merged again after faces moved.
const MOST_MERGED: usize = 6;
/// Energy that rounding may leave, as a share of the area.
const ROUNDING: f64 = 1e-14;

/// How many regions a search begins with.
pub fn first_count(fewest: usize, scene: &Scene<'_>) -> usize {
    fewest.max(FIRST).min(scene.face_count())
}

impl Attempt<'_, '_> {
    /// Adds regions until the energy is at most `limit`, then merges down to few.
    ///
    /// The energy of a smooth surface falls as one by the number of regions, which tells how many are missing: at most as many
    /// again at a time, where they gain most.
    pub fn reach_energy(&mut self, limit: f64, fewest: usize) {
        let limit = limit.max(ROUNDING * self.scene.area);
        loop {
            self.improve();
            let (energy, count) = (self.regions.energy(), self.regions.count());
            if energy <= limit || self.watch.is_cancelled() {
                break;
            }
            let missing = (count as f64 * (energy / limit - 1.0)).ceil().min(count as f64) as usize;
            if add(self.scene, &mut self.regions, missing.max(1)) == 0 {
                break;
            }
            self.record();
        }
        for _ in 0..MOST_MERGED {
            if self.watch.is_cancelled() || merge_down(self.scene, &mut self.regions, fewest, limit) == 0 {
                break;
            }
            self.record();
            self.improve();
        }
    }

    /// Splits regions until no vertex of one is farther than `limit` from its plane, in units of the frame, then merges what
    /// may be.
    pub fn reach_deviation(&mut self, limit: f64) {
        let scene = self.scene;
        self.improve();
        for round in 1.. {
            let members = Members::new(&self.regions);
            let deviates =
                |&region: &u32| deviation(scene, &self.regions.sums[region as usize], members.of(region)) > limit;
            let worst: Vec<u32> = (0..self.regions.count() as u32).into_par_iter().filter(deviates).collect();
            if self.watch.is_cancelled() || split_all(scene, &mut self.regions, &worst) == 0 {
                break;
            }
            self.record();
            if round < MOST_SETTLED {
                self.settle();
            }
        }
        while !self.watch.is_cancelled() {
            let fits = |sum: &Sum, faces: &[u32]| deviation(scene, sum, faces) <= limit;
            if merge_where(scene, &mut self.regions, fits) == 0 {
                break;
            }
            self.record();
        }
    }
}

/// The plane of a region: the mean of its points by area, and its direction.
pub fn plane(scene: &Scene<'_>, sum: &Sum, faces: &[u32]) -> (DVec3, DVec3) {
    let (mut weighted, mut plain) = (DVec3::ZERO, DVec3::ZERO);
    for &face in faces {
        let [a, b, c] = scene.surface.faces[face as usize].map(|v| scene.surface.points[v as usize]);
        let middle = (a + b + c) / 3.0;
        weighted += middle * scene.shapes[face as usize].area;
        plain += middle;
    }
    let point = if sum.area > 0.0 { weighted / sum.area } else { plain / faces.len().max(1) as f64 };
    (point, sum.direction())
}

/// How far a region's vertices are from its plane at most, in the frame; from its point where it has no direction. A face by
/// itself is its plane.
pub fn deviation(scene: &Scene<'_>, sum: &Sum, faces: &[u32]) -> f64 {
    if faces.len() < 2 {
        return 0.0;
    }
    let (point, normal) = plane(scene, sum, faces);
    let distance = |v: u32| {
        let way = scene.surface.points[v as usize] - point;
        if normal == DVec3::ZERO { way.length() } else { way.dot(normal).abs() }
    };
    faces.iter().flat_map(|&face| scene.surface.faces[face as usize]).map(distance).fold(0.0, f64::max)
}
