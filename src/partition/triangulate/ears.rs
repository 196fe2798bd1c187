//! Triangles cut off one by one, the roundest first \[Liu99\].

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use super::boxes::{Boxes, Rect};
use super::crossings::NONE;
use super::nodes::Nodes;
use super::sides::{triangle_holds, turn};
use crate::math::{DVec2, radius_ratio};

/// A corner that may be cut off.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ear {
    ratio: f64,
    tip: u32,
    /// How often the neighbors of the tip had changed.
    age: u32,
}

impl Eq for Ear {}

impl Ord for Ear {
    /// The roundest is the greatest, then the one of the lowest tip.
    fn cmp(&self, other: &Self) -> Ordering {
        self.ratio.total_cmp(&other.ratio).then(other.tip.cmp(&self.tip)).then(self.age.cmp(&other.age))
    }
}

impl PartialOrd for Ear {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Rings being cut up.
struct Ears<'a, F> {
    nodes: &'a mut Nodes,
    points: &'a [DVec2],
    vertices: &'a [u32],
    /// Which mesh vertices a diagonal may join.
    may_join: F,
    heap: BinaryHeap<Ear>,
    ages: Vec<u32>,
    /// The nodes that may lie in an ear: if one does, then also one whose corner is not convex.
    reflex: Boxes,
    /// Ears that wait for a node to go, by node: the last of them in `waiting`.
    last_waiting: Vec<u32>,
    /// An ear and the one that waited before it.
    waiting: Vec<(Ear, u32)>,
    triangles: Vec<[u32; 3]>,
}

/// The triangles of rings without holes, as points; fewer than there should be where `may_join` leaves no ear.
///
/// An ear holds no other vertex, not on its sides either. So a vertex on a straight side is used and not passed over, and no
/// triangle is without area; with exact predicates there always is an ear, if all diagonals may be used.
pub fn clip_ears(
    nodes: &mut Nodes,
    points: &[DVec2],
    vertices: &[u32],
    may_join: impl Fn(u32, u32) -> bool,
) -> Vec<[u32; 3]> {
    let count = nodes.next.len();
    let rect = |node: u32| {
        let [before, at, after] = nodes.corner(node, points);
        if turn(before, at, after) > 0.0 { Rect::EMPTY } else { Rect::around(&[at]) }
    };
    let reflex = Boxes::new((0..count as u32).map(rect).collect());
    let mut ears = Ears {
        nodes,
        points,
        vertices,
        may_join,
        heap: BinaryHeap::with_capacity(count),
        ages: vec![0; count],
        reflex,
        last_waiting: vec![NONE; count],
        waiting: Vec::new(),
        triangles: Vec::with_capacity(count),
    };
    (0..count as u32).for_each(|node| ears.offer(node));
    while let Some(ear) = ears.heap.pop() {
        if ears.ages[ear.tip as usize] == ear.age {
            match ears.obstacle(ear.tip) {
                Some(node) => ears.wait(ear, node),
                None => ears.cut(ear.tip),
            }
        }
    }
    ears.triangles
}

impl<F: Fn(u32, u32) -> bool> Ears<'_, F> {
    fn vertex(&self, node: u32) -> u32 {
        self.vertices[self.nodes.point[node as usize] as usize]
    }

    /// Takes up a corner as an ear if it is convex and would leave a ring.
    fn offer(&mut self, tip: u32) {
        let corner = self.nodes.corner(tip, self.points);
        let [before, after] = [self.nodes.prev[tip as usize], self.nodes.next[tip as usize]];
        let [first, last] = [before, after].map(|node| self.vertex(node));
        let may_leave = || {
            let is_last = self.nodes.next[after as usize] == before;
            is_last || (first != last && (self.may_join)(first, last))
        };
        if turn(corner[0], corner[1], corner[2]) > 0.0 && may_leave() {
            let sides = [0, 1, 2].map(|i| corner[i].distance(corner[(i + 1) % 3]));
            self.heap.push(Ear { ratio: radius_ratio(sides), tip, age: self.ages[tip as usize] });
        }
    }

    /// A node at another vertex in an ear.
    fn obstacle(&self, tip: u32) -> Option<u32> {
        let corner @ [a, b, c] = self.nodes.corner(tip, self.points);
        let reach = Rect::around(&corner);
        let enters = |rect: &Rect| {
            rect.meets(&reach) && !rect.is_right_of(a, b) && !rect.is_right_of(b, c) && !rect.is_right_of(c, a)
        };
        self.reflex.search(enters, |node| {
            let p = self.points[self.nodes.point[node as usize] as usize];
            if !corner.contains(&p) && triangle_holds(corner, p) {
                ControlFlow::Break(node)
            } else {
                ControlFlow::Continue(())
            }
        })
    }

    fn wait(&mut self, ear: Ear, node: u32) {
        let last = &mut self.last_waiting[node as usize];
        self.waiting.push((ear, *last));
        *last = self.waiting.len() as u32 - 1;
    }

    fn cut(&mut self, tip: u32) {
        let [before, after] = [self.nodes.prev[tip as usize], self.nodes.next[tip as usize]];
        self.triangles.push([before, tip, after].map(|node| self.nodes.point[node as usize]));
        if self.nodes.next[after as usize] == before {
            [before, tip, after].into_iter().for_each(|node| self.leave(node));
            return;
        }
        self.nodes.next[before as usize] = after;
        self.nodes.prev[after as usize] = before;
        self.leave(tip);
        for node in [before, after] {
            self.ages[node as usize] += 1;
            let [a, b, c] = self.nodes.corner(node, self.points);
            if turn(a, b, c) > 0.0 {
                self.reflex.set(node, Rect::EMPTY);
            }
            self.offer(node);
        }
    }

    /// Takes a node out and offers the ears that it was in again.
    fn leave(&mut self, node: u32) {
        self.ages[node as usize] = NONE;
        self.reflex.set(node, Rect::EMPTY);
        let mut last = std::mem::replace(&mut self.last_waiting[node as usize], NONE);
        while let Some(&(ear, previous)) = self.waiting.get(last as usize) {
            if self.ages[ear.tip as usize] == ear.age {
                self.heap.push(ear);
            }
            last = previous;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Triangulation;
    use super::super::cases::{checked, outline, star};
    use super::*;

    /// Against a look at all corners and all points for each ear.
    #[test]
    fn the_roundest_ear_goes_first() {
        for (outline, seed) in (0..40).map(|seed| (outline(&[star([0.0; 2], 60, 1.0, 0.97, seed)]), seed)) {
            let points = outline.scaled();
            let mut ring: Vec<u32> = (0..60).collect();
            let mut expected = Vec::new();
            while ring.len() > 2 {
                let corner = |at: usize| [ring.len() - 1, 0, 1].map(|step| ring[(at + step) % ring.len()]);
                let mut best = (-1.0, 0);
                for at in 0..ring.len() {
                    let [a, b, c] = corner(at).map(|i| points[i as usize]);
                    let holds = |&i: &u32| {
                        let p = points[i as usize];
                        turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
                    };
                    let others = ring.iter().filter(|i| !corner(at).contains(i));
                    let ratio = radius_ratio([a.distance(b), b.distance(c), c.distance(a)]);
                    if turn(a, b, c) > 0.0 && ratio > best.0 && !others.into_iter().any(holds) {
                        best = (ratio, at);
                    }
                }
                expected.push(corner(best.1));
                ring.remove(best.1);
            }
            assert_eq!(checked(&outline, Triangulation::Ears), expected, "{seed}");
        }
    }
}
