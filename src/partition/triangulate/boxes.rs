//! A tree of boxes in the plane.

use std::ops::ControlFlow;

use crate::math::DVec2;

/// Items of a leaf.
const LEAF: usize = 4;

/// A closed box, or nothing where `min` is above `max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub min: DVec2,
    pub max: DVec2,
}

impl Rect {
    pub const EMPTY: Self = Self { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };

    pub fn around(points: &[DVec2]) -> Self {
        points.iter().fold(Self::EMPTY, |rect, &p| rect.union(Self { min: p, max: p }))
    }

    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    fn distance_squared(&self, p: DVec2) -> f64 {
        (self.min - p).max(p - self.max).max(DVec2::ZERO).length_squared()
    }

    /// Whether all of it lies right of the line from `a` to `b`, with something to spare for rounding.
    pub fn is_right_of(&self, a: DVec2, b: DVec2) -> bool {
        let along = b - a;
        // The corner farthest to the left.
        let corner = DVec2::select(DVec2::new(-along.y, along.x).cmpge(DVec2::ZERO), self.max, self.min) - a;
        let [first, second] = [along.x * corner.y, along.y * corner.x];
        first - second < -1e-14 * (first.abs() + second.abs())
    }
}

/// Items in the order of Morton's curve at first, boxes around ever longer runs of them. An item may move or vanish.
pub struct Boxes {
    items: Vec<Rect>,
    /// Items in leaves, [`LEAF`] each.
    order: Vec<u32>,
    /// The place of every item in `order`.
    places: Vec<u32>,
    /// A full binary tree: the root at 1, the children of `i` at `2i` and `2i + 1`, the leaves last.
    nodes: Vec<Rect>,
}

impl Boxes {
    pub fn new(items: Vec<Rect>) -> Self {
        let whole = items.iter().fold(Rect::EMPTY, |whole, &item| whole.union(item));
        let size = (whole.max - whole.min).max_element();
        let cells = if size > 0.0 { f64::from(u32::MAX) / size } else { 0.0 };
        let key = |item: &Rect| {
            let cell = ((item.min + item.max) / 2.0 - whole.min) * cells;
            spread(cell.x as u32) | spread(cell.y as u32) << 1
        };
        let mut rows: Vec<(u64, u32)> = items.iter().map(key).zip(0..).collect();
        rows.sort_unstable();
        let order: Vec<u32> = rows.into_iter().map(|(_, item)| item).collect();
        let mut places = vec![0; order.len()];
        (0..).zip(&order).for_each(|(place, &item)| places[item as usize] = place);
        let leaf_count = order.len().div_ceil(LEAF).next_power_of_two();
        let mut boxes = Self { items, order, places, nodes: vec![Rect::EMPTY; 2 * leaf_count] };
        (0..leaf_count).for_each(|leaf| boxes.nodes[leaf_count + leaf] = boxes.leaf_box(leaf));
        (1..leaf_count).rev().for_each(|node| boxes.nodes[node] = boxes.union_of_children(node));
        boxes
    }

    fn leaf_count(&self) -> usize {
        self.nodes.len() / 2
    }

    fn leaf_items(&self, leaf: usize) -> &[u32] {
        &self.order[(leaf * LEAF).min(self.order.len())..((leaf + 1) * LEAF).min(self.order.len())]
    }

    fn leaf_box(&self, leaf: usize) -> Rect {
        self.leaf_items(leaf).iter().fold(Rect::EMPTY, |rect, &item| rect.union(self.items[item as usize]))
    }

    fn union_of_children(&self, node: usize) -> Rect {
        self.nodes[2 * node].union(self.nodes[2 * node + 1])
    }

    /// Gives an item another box.
    pub fn set(&mut self, item: u32, rect: Rect) {
        self.items[item as usize] = rect;
        let leaf = self.places[item as usize] as usize / LEAF;
        let mut node = self.leaf_count() + leaf;
        self.nodes[node] = self.leaf_box(leaf);
        while node > 1 {
            node /= 2;
            let union = self.union_of_children(node);
            if std::mem::replace(&mut self.nodes[node], union) == union {
                break;
            }
        }
    }

    /// Visits items in boxes that `enters` accepts until `visit` breaks, and returns with what.
    pub fn search<B>(
        &self,
        mut enters: impl FnMut(&Rect) -> bool,
        mut visit: impl FnMut(u32) -> ControlFlow<B>,
    ) -> Option<B> {
        let mut stack = vec![1];
        while let Some(node) = stack.pop() {
            if !enters(&self.nodes[node]) {
                continue;
            }
            if node < self.leaf_count() {
                stack.extend([2 * node + 1, 2 * node]);
                continue;
            }
            for &item in self.leaf_items(node - self.leaf_count()) {
                if enters(&self.items[item as usize])
                    && let ControlFlow::Break(found) = visit(item)
                {
                    return Some(found);
                }
            }
        }
        None
    }

    /// The nearest item to a point, of equals the lowest, among those in boxes that `enters` accepts and that have a distance.
    pub fn nearest(
        &self,
        p: DVec2,
        enters: impl Fn(&Rect) -> bool,
        distance_squared: impl Fn(u32) -> Option<f64>,
    ) -> Option<u32> {
        let mut best = (f64::INFINITY, u32::MAX);
        let mut stack = vec![(0.0, 1)];
        while let Some((distance, node)) = stack.pop() {
            if distance > best.0 {
                continue;
            }
            if node < self.leaf_count() {
                let mut children = [2 * node, 2 * node + 1].map(|child| (self.nodes[child].distance_squared(p), child));
                if children[0].0 < children[1].0 {
                    children.swap(0, 1);
                }
                stack.extend(children.into_iter().filter(|&(_, child)| enters(&self.nodes[child])));
                continue;
            }
            for &item in self.leaf_items(node - self.leaf_count()) {
                if let Some(distance) = distance_squared(item).filter(|&distance| (distance, item) < best) {
                    best = (distance, item);
                }
            }
        }
        (best.1 != u32::MAX).then_some(best.1)
    }
}

/// The bits of a number with a zero before each.
fn spread(number: u32) -> u64 {
    const STEPS: [(u32, u64); 5] = [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ];
    STEPS.iter().fold(u64::from(number), |bits, &(shift, mask)| (bits | bits << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::super::cases::random;
    use super::*;

    fn rect(i: u32, seed: u32) -> Rect {
        let corner = DVec2::new(random(i, seed), random(i, seed + 1));
        // Crowded, so that the tree is not even.
        Rect::around(&[corner * corner, corner * corner + 0.05 * DVec2::new(random(i, seed + 2), random(i, seed + 3))])
    }

    /// Against a look at all items, after some have moved and some are gone.
    #[test]
    fn it_finds_what_is_there() {
        for count in [0, 1, 3, 5, 100, 1000] {
            let mut items: Vec<Rect> = (0..count).map(|i| rect(i, 1)).collect();
            let mut boxes = Boxes::new(items.clone());
            for i in (0..count).step_by(3) {
                items[i as usize] = if i % 2 == 0 { Rect::EMPTY } else { rect(i, 10) };
                boxes.set(i, items[i as usize]);
            }
            for query in 0..200 {
                let area = rect(query, 20);
                let mut found = Vec::new();
                let ended = boxes.search(
                    |rect| rect.meets(&area),
                    |item| {
                        found.push(item);
                        ControlFlow::<()>::Continue(())
                    },
                );
                found.sort_unstable();
                let expected: Vec<u32> = (0..count).filter(|&i| items[i as usize].meets(&area)).collect();
                assert_eq!((ended, found), (None, expected));
                let p = area.min;
                let distance = |i: u32| Some(items[i as usize].distance_squared(p)).filter(|d| d.is_finite());
                let nearest = (0..count)
                    .filter(|&i| distance(i).is_some())
                    .min_by(|&a, &b| distance(a).partial_cmp(&distance(b)).expect("numbers"));
                assert_eq!(boxes.nearest(p, |_| true, distance), nearest);
            }
        }
    }

    #[test]
    fn sides_of_boxes_are_safe() {
        let unit = Rect::around(&[DVec2::ZERO, DVec2::ONE]);
        let [a, b] = [DVec2::new(1.5, 0.0), DVec2::new(0.0, 1.5)];
        assert!(!unit.is_right_of(a, b) && !unit.is_right_of(b, a));
        let [a, b] = [a * 1.5, b * 1.5];
        assert!(unit.is_right_of(b, a) && !unit.is_right_of(a, b));
        // Touching is not beside.
        assert!(
            !unit.is_right_of(DVec2::Y, DVec2::new(5.0, 1.0))
                && unit.is_right_of(DVec2::Y * 1.01, DVec2::new(5.0, 1.01))
        );
    }
}
