//! Rings as linked lists, cut and joined where they touch.

use super::Outline;
use super::sides::{by_sign, compare, is_above, turn};
use crate::math::DVec2;

/// The corners of rings. At first node `i` is point `i`; a bridge adds two.
#[derive(Debug, Clone)]
pub struct Nodes {
    pub next: Vec<u32>,
    pub prev: Vec<u32>,
    /// The point of every node.
    pub point: Vec<u32>,
    /// Another node at the same vertex; in the end all of them, in a circle.
    pub twin: Vec<u32>,
    /// A node of every ring that has the inside within, and of every hole; of a hole its top, in a corner that opens upward.
    pub outers: Vec<u32>,
    pub holes: Vec<u32>,
}

impl Nodes {
    /// The rings of an outline without fault.
    ///
    /// Where rings touch at a vertex, or one touches itself, every edge that comes is joined with the edge that leaves on the
    /// other side of the inside:
    /// ```text
    ///    \ outside /            \     /
    ///     \       /              \   /
    ///  in  ↘     ↗  in      in    ) (   in
    ///     ↗       ↘              /   \
    ///    /  hole   \            /     \
    /// ```
    /// So a hole that touches the outer ring becomes part of it, as by a bridge without length.
    pub fn new(outline: &Outline, points: &[DVec2]) -> Self {
        let mut next = outline.successors();
        let before = predecessors(&next);
        let count = next.len() as u32;
        let mut twin: Vec<u32> = (0..count).collect();
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_unstable_by_key(|&i| (outline.vertices[i as usize], i));
        let mut rays: Vec<Ray> = Vec::new();
        for places in order.chunk_by(|&a, &b| outline.vertices[a as usize] == outline.vertices[b as usize]) {
            if places.len() == 1 {
                continue;
            }
            places.iter().zip(places.iter().cycle().skip(1)).for_each(|(&a, &b)| twin[a as usize] = b);
            let p = points[places[0] as usize];
            rays.clear();
            for &place in places {
                // An edge keeps its first node, so these are what they were.
                let [back, ahead] = [before[place as usize], outline.successor(place)];
                rays.push(Ray { edge: place, leaves: true, to: points[ahead as usize] });
                rays.push(Ray { edge: back, leaves: false, to: points[back as usize] });
            }
            rays.sort_unstable_by(|a, b| {
                is_above(a.to, p).cmp(&is_above(b.to, p)).then_with(|| by_sign(turn(p, b.to, a.to)))
            });
            for (a, b) in rays.iter().zip(rays.iter().cycle().skip(1)) {
                if a.leaves {
                    next[b.edge as usize] = a.edge;
                }
            }
        }
        let mut nodes =
            Self { prev: predecessors(&next), next, point: (0..count).collect(), twin, outers: vec![], holes: vec![] };
        nodes.list_rings(points);
        nodes
    }

    /// The points at a node, the node before, and the node after.
    pub fn corner(&self, node: u32, points: &[DVec2]) -> [DVec2; 3] {
        [self.prev[node as usize], node, self.next[node as usize]].map(|i| points[self.point[i as usize] as usize])
    }

    /// The nodes of a ring.
    pub fn ring(&self, first: u32) -> impl Iterator<Item = u32> + '_ {
        let after = move |&node: &u32| Some(self.next[node as usize]).filter(|&next| next != first);
        std::iter::successors(Some(first), after)
    }

    /// The nodes at the vertex of a node.
    pub fn twins(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let after = move |&other: &u32| Some(self.twin[other as usize]).filter(|&twin| twin != node);
        std::iter::successors(Some(node), after)
    }

    /// Triangles in the end: each bridge adds two nodes, and a ring of k nodes has k − 2 triangles.
    pub fn triangle_count(&self) -> usize {
        (self.next.len() + 2 * self.holes.len()).saturating_sub(2 * self.outers.len())
    }

    fn list_rings(&mut self, points: &[DVec2]) {
        let mut seen = vec![false; self.next.len()];
        for first in 0..self.next.len() as u32 {
            if seen[first as usize] {
                continue;
            }
            let at = |node: u32| points[node as usize];
            let mut top = first;
            // The inside is below the top of an outer ring, above a hole's, where the corner is reflex.
            let mut is_hole = false;
            for node in self.ring(first) {
                seen[node as usize] = true;
                let order = compare(at(node), at(top));
                let [before, here, after] = self.corner(node, points);
                let is_reflex = turn(before, here, after) < 0.0;
                if order.is_gt() || (order.is_eq() && is_reflex) {
                    (top, is_hole) = (node, is_reflex);
                }
            }
            if is_hole { self.holes.push(top) } else { self.outers.push(top) }
        }
    }
}

/// An edge seen from one of its ends.
struct Ray {
    edge: u32,
    leaves: bool,
    to: DVec2,
}

fn predecessors(next: &[u32]) -> Vec<u32> {
    let mut prev = vec![0; next.len()];
    (0..).zip(next).for_each(|(node, &after)| prev[after as usize] = node);
    prev
}
