//! The closest face of a tree: near boxes first, nothing that lies beyond the best so far.

use super::bvh::{Bvh, MOST_LEVELS, Node};
use super::triangle::{Nearest, closest_point};
use crate::math::{DVec3, Vec3};

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
        let guess = if (guess as usize) < self.mesh.faces.len() { guess } else { 0 };
        let &corners = self.mesh.faces.get(guess as usize)?;
        let mut best = self.hit(p, guess, corners);
        let mut limit = limit(best.distance_sq);
        let point = p.as_vec3();

        let mut stack = [(0u32, 0f32); MOST_LEVELS];
        let mut top = 0;
        let mut node = &self.nodes[0];
        loop {
            if node.count == 0 {
                let below = [node.first, node.first + 1];
                let distances = below.map(|child| box_distance_sq(point, &self.nodes[child as usize]));
                let near = usize::from(distances[1] < distances[0]);
                if distances[1 - near] <= limit {
                    stack[top] = (below[1 - near], distances[1 - near]);
                    top += 1;
                }
                if distances[near] <= limit {
                    node = &self.nodes[below[near] as usize];
                    continue;
                }
            }
            for slot in node.first as usize..(node.first + node.count) as usize {
                let hit = self.hit(p, self.faces[slot], self.corners[slot]);
                if hit.distance_sq < best.distance_sq || (hit.distance_sq == best.distance_sq && hit.face < best.face) {
                    best = hit;
                    limit = self::limit(best.distance_sq);
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
    }

    fn hit(&self, p: DVec3, face: u32, corners: [u32; 3]) -> Hit {
        let Nearest { distance_sq, weights } = closest_point(p, self.frame.corners(self.mesh, corners));
        Hit { face, distance_sq, weights }
    }
}

/// The greatest squared distance, as [`box_distance_sq`] computes it, of a box that may hold a triangle as close as
/// `distance_sq` by double precision.
fn limit(distance_sq: f64) -> f32 {
    let distance = distance_sq.sqrt() * (1.0 + SLACK) + SLACK;
    (distance * distance) as f32
}

/// Squared distance from `p` to a box, in single precision.
fn box_distance_sq(p: Vec3, node: &Node) -> f32 {
    let outside = (Vec3::from_array(node.low) - p).max(p - Vec3::from_array(node.high)).max(Vec3::ZERO);
    outside.length_squared()
}
