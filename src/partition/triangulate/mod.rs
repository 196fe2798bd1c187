//! Polygons with holes to triangles: every corner is used, and no other.
//!
//! # Invariants
//! - The triangles of an [`Outline`] use every edge of it once in its direction and every other edge twice, once each way
//!   (`is_whole`).
//! - No edge joins a mesh vertex with itself, so pinched regions stay manifold.

mod boxes;
mod bridge;
#[cfg(test)]
mod cases;
mod crossings;
mod earcut;
mod ears;
mod flips;
mod line;
mod nodes;
mod outline;
mod sides;
#[cfg(test)]
mod tests;

pub use crossings::Fault;
pub use flips::{flip_away, improve};
pub use outline::{Misfit, Outline};

use nodes::Nodes;
use sides::turn;

/// How polygons become triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Triangulation {
    /// Ears as they come, by the `earcut` crate: the fastest.
    #[default]
    Earcut,
    /// The roundest ear first, holes joined by bridges \[Liu99\].
    Ears,
}

/// Greatest difference of the area, as a share.
const AREA_TOLERANCE: f64 = 1e-9;

/// The triangles of an outline, counter-clockwise, as indices of its points.
///
/// k points and h holes make k + 2h − 2 triangles; a ring that touches another or itself counts as the rings that the inside
/// sees. `None` for an outline with a [`Fault`], and where the result would not be whole.
pub fn triangulate(outline: &Outline, by: Triangulation) -> Option<Vec<[u32; 3]>> {
    if !outline.is_sound() {
        return None;
    }
    let points = outline.scaled();
    let west = crossings::sweep(outline, &points).ok()?;
    let mut nodes = Nodes::new(outline, &points);
    let count = nodes.triangle_count();
    let triangles = match by {
        Triangulation::Earcut => earcut::earcut(&nodes, &points, &west)?,
        Triangulation::Ears => {
            bridge::bridge(&mut nodes, &points, &west)?;
            ears::clip_ears(&mut nodes, &points, &outline.vertices)
        }
    };
    (triangles.len() == count && is_whole(outline, &triangles)).then_some(triangles)
}

/// Whether triangles fill an outline: none turned over, the areas add up, every edge of the outline has one on its left, and
/// every other edge has two.
fn is_whole(outline: &Outline, triangles: &[[u32; 3]]) -> bool {
    let points = outline.scaled();
    let corners = |triangle: &[u32; 3]| triangle.map(|i| points[i as usize]);
    let area = |[a, b, c]: [crate::math::DVec2; 3]| (b - a).perp_dot(c - a) / 2.0;
    let [filled, whole] = [
        triangles.iter().map(|triangle| area(corners(triangle))).sum::<f64>(),
        Outline { points: points.clone(), ..outline.clone() }.area(),
    ];
    let is_turned = |[a, b, c]: [crate::math::DVec2; 3]| turn(a, b, c) < 0.0;
    if (filled - whole).abs() > AREA_TOLERANCE * whole || triangles.iter().map(corners).any(is_turned) {
        return false;
    }
    // The other sides of the outline's edges, and the edges of the triangles: each way once.
    let key = |a: u32, b: u32| u64::from(outline.vertices[a as usize]) << 32 | u64::from(outline.vertices[b as usize]);
    let mut edges: Vec<u64> = (0..).zip(outline.successors()).map(|(a, b)| key(b, a)).collect();
    edges.extend(triangles.iter().flat_map(|&[a, b, c]| [key(a, b), key(b, c), key(c, a)]));
    edges.sort_unstable();
    let mut reversed: Vec<u64> = edges.iter().map(|edge| edge.rotate_left(32)).collect();
    reversed.sort_unstable();
    edges == reversed && edges.windows(2).all(|pair| pair[0] < pair[1])
        // Neither way of an edge from a vertex to itself is the other.
        && edges.iter().all(|edge| *edge != edge.rotate_left(32))
}
