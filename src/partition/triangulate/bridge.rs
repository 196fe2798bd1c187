//! Holes joined to what surrounds them by bridges, walked once each way: rings with holes become rings without \[Liu99\].
//!
//! Holes are taken by their tops, the greatest first. The bridge of a hole leads from its top to a greater vertex, so that it
//! cannot meet a hole that has none yet, whose vertices are all less:
//! 1. to the nearer end of the nearest edge that has an end above the top, as in the paper;
//! 2. where something hides it, to what hides it: of the vertices in the triangle of the top, the nearest point of that edge,
//!    and its end, the one closest to the direction of the nearest point;
//! 3. where that is hidden too, the same with the edge due west of the top: nothing lies on the way there, for edges of
//!    other bridges and rings that reach this height are above, so one vertex of that triangle is always in sight.

use std::ops::ControlFlow;

use super::boxes::{Boxes, Rect};
use super::crossings::NONE;
use super::nodes::Nodes;
use super::sides::{compare, corner_holds, is_above, segments_meet, turn};
use crate::math::DVec2;

/// Joins every hole with what surrounds it. `west` is what [`sweep`](super::crossings::sweep) found.
///
/// `None` where a hole has no way out between points that `may_join` accepts; if it accepts all, an outline without fault has one.
pub fn bridge(nodes: &mut Nodes, points: &[DVec2], west: &[u32], may_join: impl Fn(u32, u32) -> bool) -> Option<()> {
    let mut holes = nodes.holes.clone();
    if holes.is_empty() {
        return Some(());
    }
    let at = |node: u32| points[node as usize];
    holes.sort_unstable_by(|&a, &b| compare(at(b), at(a)).then(a.cmp(&b)));
    let edges: Vec<[u32; 2]> = (0..).zip(&nodes.next).map(|(node, &next)| [node, next]).collect();
    let boxes = (edges.iter().copied())
        // The place of a bridge, which is near the top.
        .chain(holes.iter().map(|&top| [top; 2]))
        .map(|ends| Rect::around(&ends.map(at)));
    let mut bridges = Bridges { points, may_join, boxes: Boxes::new(boxes.collect()), edges };
    for &top in &holes {
        let [from, to] = bridges.bridge_of(nodes, top, west[top as usize])?;
        bridges.build(nodes, from, to);
    }
    Some(())
}

/// Edges and the bridges between them.
struct Bridges<'a, F> {
    points: &'a [DVec2],
    may_join: F,
    /// Of the edges, then of the bridges; one not built yet is a point.
    boxes: Boxes,
    /// The ends of the edges and of the bridges built, as points.
    edges: Vec<[u32; 2]>,
}

impl<F: Fn(u32, u32) -> bool> Bridges<'_, F> {
    fn at(&self, point: u32) -> DVec2 {
        self.points[point as usize]
    }

    fn ends(&self, edge: u32) -> Option<[DVec2; 2]> {
        self.edges.get(edge as usize).map(|ends| ends.map(|point| self.at(point)))
    }

    /// The nodes of the bridge of a hole.
    fn bridge_of(&self, nodes: &Nodes, top: u32, west: u32) -> Option<[u32; 2]> {
        let p = self.at(top);
        let distance_squared = |edge: u32| {
            let [a, b] = self.ends(edge)?;
            (is_above(a, p) || is_above(b, p)).then(|| (closest(p, [a, b]) - p).length_squared())
        };
        let near = self.boxes.nearest(p, |rect| rect.max.y >= p.y, distance_squared)?;
        let [a, b] = self.edges[near as usize];
        let mut end = a;
        if is_above(self.at(b), p)
            && (!is_above(self.at(a), p) || self.at(b).distance_squared(p) < self.at(a).distance_squared(p))
        {
            end = b;
        }
        let foot = closest(p, [self.at(a), self.at(b)]);
        let first = || self.sight(nodes, top, end);
        let second = || self.sight(nodes, top, self.what_hides(p, foot, end, near));
        let third = || {
            let [a, b] = *self.edges.get(west as usize).filter(|_| west != NONE)?;
            let high = if is_above(self.at(a), self.at(b)) { a } else { b };
            self.sight(nodes, top, self.what_hides(p, p - DVec2::X, high, west))
        };
        first().or_else(second).or_else(third)
    }

    /// Of `end` and the vertices above `p` between it, `p` and the direction of `foot`, on the side of `p` of an edge that ends
    /// at `end`: the closest to that direction, then to `p`.
    fn what_hides(&self, p: DVec2, foot: DVec2, end: u32, edge: u32) -> u32 {
        let Some([a, b]) = self.ends(edge) else { return end };
        let [side, this_side] = [turn(p, foot, self.at(end)), turn(a, b, p)].map(f64::signum);
        let reach = Rect::around(&[p, a, b]);
        let reach = Rect { min: DVec2::new(reach.min.x, p.y), ..reach };
        let mut best = end;
        self.boxes.search(
            |rect| rect.meets(&reach),
            |item| {
                let Some(&[point, _]) = self.edges.get(item as usize) else { return ControlFlow::Continue(()) };
                let v = self.at(point);
                if is_above(v, p) && side * turn(p, foot, v) >= 0.0 && this_side * turn(a, b, v) > 0.0 {
                    let closer = side * turn(p, self.at(best), v);
                    if closer < 0.0 || (closer == 0.0 && is_above(self.at(best), v)) {
                        best = point;
                    }
                }
                ControlFlow::<()>::Continue(())
            },
        );
        best
    }

    /// The nodes that a bridge from `top` to the vertex of `end` joins, unless something is in its way.
    fn sight(&self, nodes: &Nodes, top: u32, end: u32) -> Option<[u32; 2]> {
        let [p, q] = [top, end].map(|point| self.at(point));
        if !is_above(q, p) || !(self.may_join)(top, end) {
            return None;
        }
        // Of several corners at one vertex the one that looks at the other end.
        let looking =
            |node: u32, to: DVec2| nodes.twins(node).find(|&twin| corner_holds(nodes.corner(twin, self.points), to));
        let (from, to) = (looking(top, q)?, looking(end, p)?);
        let reach = Rect::around(&[p, q]);
        let enters = |rect: &Rect| rect.meets(&reach) && !rect.is_right_of(p, q) && !rect.is_right_of(q, p);
        let visit = |item: u32| match self.ends(item) {
            Some(ends) if blocks(ends, p, q) => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        self.boxes.search(enters, visit).is_none().then_some([from, to])
    }

    /// ```text
    ///  →  to  →          →  to    to' →
    ///                        ↓     ↑
    ///  ←  from ←         ←  from  from' ←
    /// ```
    fn build(&mut self, nodes: &mut Nodes, from: u32, to: u32) {
        let item = self.edges.len() as u32;
        let ends = [from, to].map(|node| nodes.point[node as usize]);
        self.edges.push(ends);
        self.boxes.set(item, Rect::around(&ends.map(|point| self.at(point))));
        let [from_twin, to_twin] = [0, 1].map(|i| nodes.next.len() as u32 + i);
        let [before, after] = [nodes.prev[from as usize], nodes.next[to as usize]];
        nodes.point.extend(ends);
        nodes.next.extend([to_twin, after]);
        nodes.prev.extend([before, from_twin]);
        nodes.next[before as usize] = from_twin;
        nodes.prev[after as usize] = to_twin;
        nodes.next[to as usize] = from;
        nodes.prev[from as usize] = to;
        for (node, twin) in [(from, from_twin), (to, to_twin)] {
            nodes.twin.push(nodes.twin[node as usize]);
            nodes.twin[node as usize] = twin;
        }
    }
}

/// Whether an edge keeps one of `p` and `q` from seeing the other.
fn blocks([a, b]: [DVec2; 2], p: DVec2, q: DVec2) -> bool {
    for (shared, other) in [(a, b), (b, a)] {
        for (near, far) in [(p, q), (q, p)] {
            if shared == near {
                // Only an edge in the same direction is in the way.
                return turn(p, q, other) == 0.0 && (other - near).dot(far - near) > 0.0;
            }
        }
    }
    segments_meet([a, b], [p, q])
}

/// The point of a segment closest to `p`.
fn closest(p: DVec2, [a, b]: [DVec2; 2]) -> DVec2 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    if t > 0.0 { a + along * t.min(1.0) } else { a }
}

#[cfg(test)]
mod tests {
    use super::super::cases::{outline, plate, turned};
    use super::super::crossings::sweep;
    use super::*;

    /// A hole in the middle of a square: its top is joined with the upper right corner.
    #[test]
    fn holes_are_joined_with_what_is_above() {
        let ring = |s: f64| vec![[-s, -s], [s, -s], [s, s], [-s, s]];
        let mut hole = ring(1.0);
        hole.reverse();
        let outline = outline(&[ring(3.0), hole]);
        let points = outline.scaled();
        let west = sweep(&outline, &points).expect("no fault");
        let mut nodes = Nodes::new(&outline, &points);
        bridge(&mut nodes, &points, &west, |_, _| true).expect("a bridge");
        // 3 --------- 2        The top of the hole, 5, and the nearest of the corners above it.
        // |  4 --- 5  |
        // |  |     |  |
        // |  7 --- 6  |
        // 0 --------- 1
        let ring: Vec<u32> = nodes.ring(0).map(|node| nodes.point[node as usize]).collect();
        assert_eq!(ring, [0, 1, 2, 5, 6, 7, 4, 5, 2, 3]);
    }

    #[test]
    fn bridges_do_not_cross() {
        for (holes, corners, roughness) in [(12, 12, 0.9), (20, 4, 0.2), (8, 40, 0.99)] {
            for seed in 0..3 {
                let outline = turned(plate(holes, corners, roughness, seed), f64::from(seed));
                let points = outline.scaled();
                let west = sweep(&outline, &points).expect("no fault");
                let mut nodes = Nodes::new(&outline, &points);
                bridge(&mut nodes, &points, &west, |_, _| true).expect("bridges");
                // The bridges are the edges of the nodes added, each walked both ways.
                let at = |node: u32| points[nodes.point[node as usize] as usize];
                let first = points.len() as u32;
                let bridges: Vec<[DVec2; 2]> =
                    (first..nodes.next.len() as u32).step_by(2).map(|node| [at(node), at(node + 1)]).collect();
                assert_eq!(bridges.len(), (holes * holes) as usize);
                let edges = (0..first).map(|i| [i, outline.successor(i)].map(|i| points[i as usize]));
                let all: Vec<[DVec2; 2]> = edges.chain(bridges.iter().copied()).collect();
                for (i, bridge) in bridges.iter().enumerate() {
                    for (j, other) in all.iter().enumerate().filter(|&(j, _)| j != first as usize + i) {
                        let shares_end = bridge.iter().any(|end| other.contains(end));
                        assert!(
                            shares_end || !segments_meet(*bridge, *other),
                            "{holes} {seed}: bridge {i} and edge {j}"
                        );
                    }
                }
                assert_eq!(nodes.ring(0).count(), nodes.next.len(), "not one ring");
            }
        }
    }
}
