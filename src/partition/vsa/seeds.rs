//! Where regions begin: at random faces, each grown until it bends as much as its share.
//!
//! # Reference
//! \[Jin09\]: more regions where the Gaussian curvature is, none wasted on flats. Departs: what is left when the regions are
//! spent goes to the region with the nearest normal, not to the first beside it.

use crate::math::random;

use super::flood::Frontier;
use super::labeling::{FREE, Labeling, Sum};
use super::scene::Scene;

/// |n − u| up to which a face is absorbed though the region has its share; 0.57 degrees.
const ABSORBED: f64 = 1e-2;

/// Up to `count` regions; faces that none took are free.
pub fn grow(scene: &Scene<'_>, count: usize, seed: u64) -> Labeling {
    let share = scene.bends.iter().sum::<f64>() / count as f64;
    let mut regions = Labeling::none(scene);
    let mut free = FreeFaces::new(scene.face_count());
    let mut frontier = Frontier::default();
    while regions.count() < count {
        let face = below(random(seed, regions.count() as u64), scene.face_count());
        let Some(first) = free.at_or_after(face, &regions.labels) else { break };
        let sum = grow_one(scene, first, share, &mut regions, &mut frontier);
        regions.sums.push(sum);
    }
    regions
}

/// A number below `bound` from 64 random bits.
pub fn below(bits: u64, bound: usize) -> u32 {
    (((bits >> 32) * bound as u64) >> 32) as u32
}

/// Grows one region from `first`.
fn grow_one(scene: &Scene<'_>, first: u32, share: f64, regions: &mut Labeling, frontier: &mut Frontier) -> Sum {
    let label = regions.count() as u32;
    let labels = &mut regions.labels;
    let mut sum = Sum::default();
    let mut bend = 0.0;
    frontier.clear();
    frontier.push(0.0, first, label);
    while let Some((face, _)) = frontier.pop() {
        if labels[face as usize] != FREE {
            continue;
        }
        let is_spent = bend > share;
        if is_spent && scene.shapes[face as usize].distance_sq(sum.direction()) >= ABSORBED * ABSORBED {
            continue;
        }
        labels[face as usize] = label;
        sum.add(scene, face);
        bend += scene.bends[face as usize];
        let direction = sum.direction();
        for other in scene.around(face) {
            if labels[other as usize] == FREE {
                frontier.push(scene.shapes[other as usize].distance_sq(direction), other, label);
            }
        }
    }
    sum
}

/// Finds free faces: skips runs of faces that have a label, and remembers how far.
struct FreeFaces {
    /// A later face for each, with none between them that is free.
    next: Vec<u32>,
}

impl FreeFaces {
    fn new(face_count: usize) -> Self {
        Self { next: (1..=face_count as u32).collect() }
    }

    /// The first free face from `face` on, going around.
    fn at_or_after(&mut self, face: u32, labels: &[u32]) -> Option<u32> {
        [face, 0].into_iter().map(|from| self.skip(from, labels)).find(|&found| (found as usize) < labels.len())
    }

    fn skip(&mut self, mut face: u32, labels: &[u32]) -> u32 {
        while labels.get(face as usize).is_some_and(|&label| label != FREE) {
            let mut next = self.next[face as usize];
            // The way is halved for the next time.
            if labels.get(next as usize).is_some_and(|&label| label != FREE) {
                next = self.next[next as usize];
                self.next[face as usize] = next;
            }
            face = next;
        }
        face
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;
    use crate::partition::vsa::flood::fill;
    use crate::partition::vsa::scene::tests::{scene, surface};

    #[test]
    fn free_faces_are_found_around_the_end() {
        let mut free = FreeFaces::new(5);
        let mut labels = vec![FREE, 0, FREE, 0, 0];
        assert_eq!([1, 3, 0, 2].map(|from| free.at_or_after(from, &labels)), [2, 0, 0, 2].map(Some));
        labels[0] = 0;
        assert_eq!(free.at_or_after(4, &labels), Some(2));
        labels[2] = 0;
        assert_eq!(free.at_or_after(0, &labels), None);
    }

    /// One region takes a plane, however many are asked for; regions of a cube take its sides, less corners.
    #[test]
    fn flats_are_not_cut() {
        let plane = surface(&shapes::plane(9, 9));
        let scene_of_plane = scene(&plane);
        let regions = grow(&scene_of_plane, 5, 1);
        assert_eq!((regions.count(), regions.labels.iter().max()), (1, Some(&0)));
        let cube = surface(&shapes::cube(8));
        let scene = scene(&cube);
        for seed in 0..20 {
            let regions = grow(&scene, 6, seed);
            let whole = regions.sums.iter().filter(|sum| sum.faces > 100).count();
            assert!(whole >= 4, "seed {seed}: {whole} regions with most of a side's 128 faces");
        }
    }

    #[test]
    fn regions_are_connected_and_follow_the_seed() {
        let torus = surface(&shapes::torus(40, 30));
        let scene = scene(&torus);
        let [one, same, other] = [3, 3, 4].map(|seed| {
            let mut regions = grow(&scene, 12, seed);
            fill(&scene, &mut regions);
            regions
        });
        assert_eq!(one, same);
        assert!(one.labels != other.labels);
        assert_eq!(one.count(), 12);
        let partition = Partition { labels: one.labels, region_count: 12 };
        assert_eq!(partition.validate(&torus.neighbors), []);
    }
}
