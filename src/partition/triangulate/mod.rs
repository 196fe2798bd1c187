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
mod fill;
mod flips;
mod line;
mod nodes;
mod outline;
pub mod sides;
#[cfg(test)]
mod tests;

pub use crossings::Flaw;
pub use fill::fill_in_space;
pub use flips::{flip_away, improve};
pub use outline::{Misfit, Outline};

use crate::math::DVec2;
use nodes::Nodes;
use outline::signed_area;
use sides::turn;

/// How polygons become triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Triangulation {
    /// Ears as they come, by the `earcut` crate: the fastest for a few thousand points.
    #[default]
    Earcut,
    /// The roundest ear first, holes joined by bridges \[Liu99\].
    Ears,
}

/// Outlines of more points are left to `Ears`: the time of the crate grows with the square of the points at the worst, 2.3 s
/// for a rough circle of 100,000, against 0.6 s.
const MOST_EARCUT: usize = 1 << 15;

/// So are those of more points times holes: a plate of 10,000 points with 3,300 triangular holes took 2.8 s, against 0.06 s.
const MOST_EARCUT_BRIDGED: usize = 1 << 22;

/// Greatest difference of the area, as a share.
const AREA_TOLERANCE: f64 = 1e-9;

/// The triangles of an outline, counter-clockwise, as indices of its points.
///
/// k points and h holes make k + 2h − 2 triangles; a ring that touches another or itself counts as the rings that the inside
/// sees. None is without area: where `Earcut` leaves such a one, or a gap, and where it would take long,
/// ears are cut as with `Ears`. `None` for an outline with a [`Flaw`].
pub fn triangulate(outline: &Outline, by: Triangulation) -> Option<Vec<[u32; 3]>> {
    let mut sketch = Sketch::new(outline)?;
    if by == Triangulation::Earcut
        && outline.points.len() <= MOST_EARCUT
        && outline.points.len() * sketch.nodes.holes.len() <= MOST_EARCUT_BRIDGED
        && let Some(triangles) = earcut::earcut(&sketch.nodes, &sketch.points, &sketch.west)
        && sketch.is_filled(&triangles)
    {
        return Some(triangles);
    }
    sketch.clip_ears(|_, _| true)
}

/// The first point of an outline without fault where rings touch and the inside goes on along another edge than the ring does: in
/// the plane it hangs together at that vertex otherwise than along its rings.
pub fn first_joined_otherwise(outline: &Outline) -> Option<usize> {
    let mut vertices = outline.vertices.clone();
    vertices.sort_unstable();
    if vertices.windows(2).all(|pair| pair[0] != pair[1]) {
        return None;
    }
    let nodes = Nodes::new(outline, &outline.scaled());
    outline.successors().iter().zip(&nodes.next).position(|(own, inside)| own != inside)
}

/// An outline without fault, and what is known of it.
struct Sketch<'a> {
    outline: &'a Outline,
    /// The outline's, scaled.
    points: Vec<DVec2>,
    /// What [`sweep`](crossings::sweep) found.
    west: Vec<u32>,
    nodes: Nodes,
    /// How many triangles fill it.
    count: usize,
}

impl<'a> Sketch<'a> {
    fn new(outline: &'a Outline) -> Option<Self> {
        if !outline.is_sound() {
            return None;
        }
        let points = outline.scaled();
        let west = crossings::sweep(outline, &points).ok()?;
        let nodes = Nodes::new(outline, &points);
        Some(Self { outline, west, count: nodes.triangle_count(), nodes, points })
    }

    /// Cuts ears, by diagonals between mesh vertices that `may_join` accepts: for each two of them it says always the same.
    fn clip_ears(&mut self, may_join: impl Fn(u32, u32) -> bool) -> Option<Vec<[u32; 3]>> {
        let vertices = &self.outline.vertices;
        bridge::bridge(&mut self.nodes, &self.points, &self.west, |a, b| {
            may_join(vertices[a as usize], vertices[b as usize])
        })?;
        let triangles = ears::clip_ears(&mut self.nodes, &self.points, vertices, may_join);
        self.is_filled(&triangles).then_some(triangles)
    }

    fn is_filled(&self, triangles: &[[u32; 3]]) -> bool {
        triangles.len() == self.count && is_whole(self.outline, &self.points, triangles)
    }
}

/// Whether triangles fill an outline: none is turned over or without area, the areas add up, every edge of the outline has one
/// on its left, and every other edge has two. `points` are the outline's, scaled.
fn is_whole(outline: &Outline, points: &[DVec2], triangles: &[[u32; 3]]) -> bool {
    let corners = |triangle: &[u32; 3]| triangle.map(|i| points[i as usize]);
    if triangles.iter().map(corners).any(|[a, b, c]| turn(a, b, c) <= 0.0) {
        return false;
    }
    let filled: f64 = triangles.iter().map(corners).map(|[a, b, c]| (b - a).perp_dot(c - a) / 2.0).sum();
    let whole = outline.rings().map(|ring| signed_area(&points[ring])).sum::<f64>();
    // Of a thin one rounding is worth more than the share, of its box.
    let extent = boxes::Rect::around(points);
    let rounding = f64::EPSILON * points.len() as f64 * (extent.max - extent.min).element_product();
    if (filled - whole).abs() > AREA_TOLERANCE * whole.abs() + rounding {
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
