//! The closest face of a tree: near boxes first, nothing that lies beyond the best so far.

use super::bvh::{Bvh, MOST_LEVELS, Node};
use super::triangle::{Nearest, closest_point};
use crate::math::{DVec3, Vec4};

/// The closest point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The face that it is on, the lowest of those at this distance.
    pub face: u32,
    /// Squared distance to it, in the frame.
    pub distance_sq: f64,
    /// Its weights at the three corners of the face.
    pub weights: [f64; 3],
}

/// What single precision may lose of a distance to a box: five roundings of numbers below 4, in each of three components.
const SLACK: f64 = 16.0 / 16_777_216.0;

impl Bvh<'_> {
    /// The closest point of the mesh to `p`, a point of the frame; `None` without faces.
    ///
    /// `guess` is a face that may be close: the answer is the same with any, and sooner with a good one.
    pub fn closest(&self, p: DVec3, guess: u32) -> Option<Hit> {
        self.closest_beyond(p, guess, -1.0)
    }

    /// As [`Bvh::closest`] where the squared distance is greater than `enough`; where it is not, some point that is at
    /// most so far, sooner. For who looks for the greatest distance only.
    pub fn closest_beyond(&self, p: DVec3, guess: u32, enough: f64) -> Option<Hit> {
        let guess = if (guess as usize) < self.mesh.faces.len() { guess } else { 0 };
        let &corners = self.mesh.faces.get(guess as usize)?;
        let mut best = self.hit(p, guess, corners);
        let mut limit = box_limit(best.distance_sq);
        let point = p.as_vec3().extend(0.0);

        let mut stack = [(0u32, 0f32); MOST_LEVELS];
        let mut top = 0;
        let mut node = &self.nodes[0];
        while best.distance_sq > enough {
            if node.count == 0 {
                let (left, right) = (node.first as usize, node.first as usize + 1);
                let to_left = box_distance_sq(point, &self.nodes[left]);
                let to_right = box_distance_sq(point, &self.nodes[right]);
                let (near, far) = if to_right < to_left { (right, left) } else { (left, right) };
                if to_left.max(to_right) <= limit {
                    stack[top] = (far as u32, to_left.max(to_right));
                    top += 1;
                }
                if to_left.min(to_right) <= limit {
                    node = &self.nodes[near];
                    continue;
                }
            }
            for slot in node.first as usize..(node.first + node.count) as usize {
                let hit = self.hit(p, self.faces[slot], self.corners[slot]);
                if hit.distance_sq < best.distance_sq || (hit.distance_sq == best.distance_sq && hit.face < best.face) {
                    best = hit;
                    limit = box_limit(best.distance_sq);
                }
            }
            node = loop {
                if top == 0 {
                    return Some(best);
                }
                top -= 1;
                if stack[top].1 <= limit {
                    break &self.nodes[stack[top].0 as usize];
                }
            };
        }
        Some(best)
    }

    fn hit(&self, p: DVec3, face: u32, corners: [u32; 3]) -> Hit {
        let Nearest { distance_sq, weights } = closest_point(p, self.frame.corners(self.mesh, corners));
        Hit { face, distance_sq, weights }
    }
}

/// The greatest squared distance, as [`box_distance_sq`] computes it, of a box that may hold a triangle as close as
/// `distance_sq` by double precision.
fn box_limit(distance_sq: f64) -> f32 {
    let distance = distance_sq.sqrt() * (1.0 + SLACK) + SLACK;
    (distance * distance) as f32
}

/// Squared distance from `p` to a box, in single precision.
fn box_distance_sq(p: Vec4, node: &Node) -> f32 {
    // In the fourth place are `first` and `count`, which the last step makes zero.
    const COORDINATES: Vec4 = Vec4::new(f32::INFINITY, f32::INFINITY, f32::INFINITY, 0.0);
    let [low, high]: [[f32; 4]; 2] = bytemuck::cast(*node);
    let outside = (Vec4::from_array(low) - p).max(p - Vec4::from_array(high)).max(Vec4::ZERO).min(COORDINATES);
    outside.length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::mesh::{Mesh, sample, shapes};
    use crate::spatial::Frame;

    fn points(count: u32) -> impl Iterator<Item = DVec3> {
        let unit = |i: u32, k: u32| f64::from((i * 3 + k).wrapping_mul(0x9e37_79b9) >> 8) / f64::from(1 << 23) - 1.0;
        (0..count).map(move |i| DVec3::new(unit(i, 0), unit(i, 1), unit(i, 2)))
    }

    /// One face after the other; the first of equals is the lowest.
    fn by_brute_force(bvh: &Bvh<'_>, p: DVec3) -> Hit {
        let hits = (0..).zip(&bvh.mesh.faces).map(|(face, &corners)| bvh.hit(p, face, corners));
        hits.reduce(|best, hit| if hit.distance_sq < best.distance_sq { hit } else { best }).unwrap()
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds_from_any_guess() {
        let coincident = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]; 100]);
        for mesh in [sample("part", Some(3000)).unwrap(), shapes::cube(4), shapes::plane(9, 9), coincident] {
            let frame = Frame::of(&mesh, &mesh);
            let bvh = Bvh::new(&mesh, frame);
            let corners = mesh.positions.iter().take(200).map(|&p| frame.to_frame(p));
            for (i, p) in (0..).zip(points(300).chain(corners)) {
                let want = by_brute_force(&bvh, p);
                for guess in [0, i * 7 % mesh.faces.len() as u32, want.face, u32::MAX] {
                    assert_eq!(bvh.closest(p, guess), Some(want), "{p} from {guess}");
                }
            }
        }
    }

    #[test]
    fn what_is_not_beyond_is_left_early_and_truthfully() {
        let mesh = sample("statue", Some(3000)).unwrap();
        let bvh = Bvh::new(&mesh, Frame::of(&mesh, &mesh));
        for p in points(300) {
            let least = bvh.closest(p, 0).unwrap();
            assert_eq!(bvh.closest_beyond(p, 7, least.distance_sq * 0.999), Some(least));
            let some = bvh.closest_beyond(p, 7, least.distance_sq * 1.5).unwrap();
            assert!((least.distance_sq..=1.5 * least.distance_sq).contains(&some.distance_sq));
        }
    }

    #[test]
    fn no_box_is_farther_than_what_it_holds() {
        for p in points(10_000) {
            let corner = points(1).next().unwrap() * 0.7;
            let at = corner.as_vec3().to_array();
            let node = Node { low: at, first: u32::MAX >> 1, high: at, count: u32::MAX };
            let exact = p.distance_squared(Vec3::from_array(at).as_dvec3());
            let distance_sq = box_distance_sq(p.as_vec3().extend(0.0), &node);
            assert!(distance_sq <= box_limit(exact), "{p}");
            assert!((f64::from(distance_sq) - exact).abs() <= 1e-5);
        }
    }
}
