//! Lloyd's iterations: directions from regions, regions from directions.
//!
//! # Reference
//! \[CSAD04\], what \[Jin09\] compares itself with: random seeds, growth by a queue over the whole surface, and again from the
//! face nearest to each new direction.

use crate::math::{DVec3, random};

use super::attempt::complete;
use super::flood::{Frontier, flood};
use super::labeling::{FREE, Labeling, Sum};
use super::scene::Scene;
use super::seeds::below;
use super::split::{Members, nearest};

/// Iterations at most.
const MOST_ITERATIONS: usize = 20;

/// `count` regions, at least one a component, around random faces.
pub fn start(scene: &Scene<'_>, count: usize, seed: u64) -> Labeling {
    let seeds = random_faces(scene.face_count(), count, seed);
    let directions: Vec<DVec3> = seeds.iter().map(|&face| scene.shapes[face as usize].normal).collect();
    let mut regions = grow(scene, &seeds, &directions);
    complete(scene, &mut regions, count);
    regions
}

/// Grows the regions anew until they stay as they are; `go_on` is asked after each iteration.
pub fn iterate(scene: &Scene<'_>, regions: &mut Labeling, mut go_on: impl FnMut(&Labeling) -> bool) {
    for _ in 1..MOST_ITERATIONS {
        let directions: Vec<DVec3> = regions.sums.iter().map(Sum::direction).collect();
        let members = Members::new(regions);
        let seed_of = |region: u32| nearest(scene, members.of(region).iter().copied(), directions[region as usize]);
        let seeds: Vec<u32> = (0..regions.count() as u32).filter_map(seed_of).collect();
        let grown = grow(scene, &seeds, &directions);
        if grown.labels == regions.labels {
            return;
        }
        *regions = grown;
        if !go_on(regions) {
            return;
        }
    }
}

/// Grows a region from every seed.
fn grow(scene: &Scene<'_>, seeds: &[u32], directions: &[DVec3]) -> Labeling {
    let mut labels = vec![FREE; scene.face_count()];
    let mut frontier = Frontier::default();
    for (label, &seed) in (0..).zip(seeds) {
        labels[seed as usize] = label;
    }
    for (label, &seed) in (0..).zip(seeds) {
        for other in scene.around(seed).filter(|&other| labels[other as usize] == FREE) {
            frontier.push(scene.shapes[other as usize].distance_sq(directions[label as usize]), other, label);
        }
    }
    flood(scene, &mut labels, directions, &mut frontier);
    Labeling::new(scene, labels, seeds.len())
}

/// `count` different faces; all, where there are not more.
fn random_faces(face_count: usize, count: usize, seed: u64) -> Vec<u32> {
    let mut is_taken = vec![false; face_count];
    let mut faces = Vec::with_capacity(count.min(face_count));
    for step in 0..count.min(face_count) {
        let mut face = below(random(seed, step as u64), face_count) as usize;
        while std::mem::replace(&mut is_taken[face], true) {
            face = (face + 1) % face_count;
        }
        faces.push(face as u32);
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;
    use crate::partition::vsa::scene::tests::{scene, surface};

    #[test]
    fn iterations_lower_the_energy() {
        let surface = surface(&shapes::torus(60, 40));
        let scene = scene(&surface);
        let mut regions = start(&scene, 30, 5);
        let mut energies = vec![regions.energy()];
        iterate(&scene, &mut regions, |regions| {
            energies.push(regions.energy());
            true
        });
        assert!(energies.len() > 3 && energies[energies.len() - 1] < 0.8 * energies[0], "{energies:?}");
        assert_eq!(regions.count(), 30);
        let partition = Partition { labels: regions.labels, region_count: 30 };
        assert_eq!(partition.validate(&surface.neighbors), []);
    }

    #[test]
    fn seeds_differ() {
        for (count, wanted) in [(5, 5), (10, 10), (40, 10)] {
            let mut faces = random_faces(10, count, 3);
            faces.sort_unstable();
            faces.dedup();
            assert_eq!(faces.len(), wanted);
        }
    }
}
