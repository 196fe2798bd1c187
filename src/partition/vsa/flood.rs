//! Growing regions face by face, the nearest normal first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::math::DVec3;

use super::labeling::{FREE, Labeling, Sum};
use super::scene::Scene;

/// Faces that may join a region, the one with the nearest normal first; ties go to the lower face, then to the lower region.
#[derive(Debug, Default)]
pub struct Frontier {
    /// The bits of the squared distance above the face, and the region.
    heap: BinaryHeap<Reverse<(u64, u32)>>,
}

impl Frontier {
    pub fn clear(&mut self) {
        self.heap.clear();
    }

    /// A face that is |n − u|² from the region's direction.
    pub fn push(&mut self, distance_sq: f64, face: u32, label: u32) {
        // Not negative: its bits order as it does.
        let key = u64::from((distance_sq as f32).to_bits()) << 32 | u64::from(face);
        self.heap.push(Reverse((key, label)));
    }

    /// The next face and its region.
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        self.heap.pop().map(|Reverse((key, label))| (key as u32, label))
    }
}

/// Grows regions into the free faces around them, by directions that stay as they are.
pub fn flood(scene: &Scene<'_>, labels: &mut [u32], directions: &[DVec3], frontier: &mut Frontier) {
    while let Some((face, label)) = frontier.pop() {
        if labels[face as usize] != FREE {
            continue;
        }
        labels[face as usize] = label;
        for other in scene.around(face) {
            if labels[other as usize] == FREE {
                frontier.push(scene.shapes[other as usize].distance_sq(directions[label as usize]), other, label);
            }
        }
    }
}

/// Shares the free faces among the regions beside them; those that no region reaches become regions, one a component.
pub fn fill(scene: &Scene<'_>, regions: &mut Labeling) {
    let directions: Vec<DVec3> = regions.sums.iter().map(Sum::direction).collect();
    let mut frontier = Frontier::default();
    let labels = &mut regions.labels;
    for face in 0..labels.len() as u32 {
        if labels[face as usize] == FREE {
            continue;
        }
        let label = labels[face as usize];
        for other in scene.around(face).filter(|&other| labels[other as usize] == FREE) {
            frontier.push(scene.shapes[other as usize].distance_sq(directions[label as usize]), other, label);
        }
    }
    flood(scene, labels, &directions, &mut frontier);
    let mut count = regions.count();
    let mut of_component = vec![FREE; scene.is_closed.len()];
    for (label, &component) in regions.labels.iter_mut().zip(&scene.components) {
        if *label == FREE {
            let new = &mut of_component[component as usize];
            if *new == FREE {
                *new = count as u32;
                count += 1;
            }
            *label = *new;
        }
    }
    regions.sums.resize(count, Sum::default());
    regions.sum_anew(scene);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::vsa::scene::tests::{scene, surface};

    #[test]
    fn the_nearest_face_comes_first() {
        let mut frontier = Frontier::default();
        for (distance, face, label) in [(2.0, 1, 0), (0.5, 9, 1), (0.5, 3, 2), (0.5, 3, 1), (0.0, 7, 0)] {
            frontier.push(distance, face, label);
        }
        let order: Vec<_> = std::iter::from_fn(|| frontier.pop()).collect();
        assert_eq!(order, [(7, 0), (3, 1), (3, 2), (9, 1), (1, 0)]);
    }

    /// A cube with one face of each of two sides seeded: the sides first, then what lies beside.
    #[test]
    fn free_faces_are_shared() {
        let mut mesh = shapes::cube(4);
        let plane = shapes::plane(2, 2);
        let shift = mesh.positions.len() as u32;
        mesh.positions.extend(plane.positions.iter().map(|&p| p + 30.0));
        mesh.faces.extend(plane.faces.iter().map(|face| face.map(|v| v + shift)));
        let surface = surface(&mesh);
        let scene = scene(&surface);
        let mut labels = vec![FREE; scene.face_count()];
        let first = (0..labels.len()).find(|&face| scene.shapes[face].normal == DVec3::X).expect("a side");
        let second = (0..labels.len()).find(|&face| scene.shapes[face].normal == DVec3::NEG_X).expect("a side");
        (labels[first], labels[second]) = (0, 1);
        let mut regions = Labeling::new(&scene, labels, 2);
        fill(&scene, &mut regions);
        assert_eq!(regions.count(), 3);
        assert!(!regions.labels.contains(&FREE));
        for (shape, &label) in scene.shapes.iter().zip(&regions.labels) {
            assert!(shape.normal != DVec3::X || label == 0 || label == 2, "its own side");
        }
        assert_eq!(regions.sums[2].faces, 8);
    }
}
