//! Where to cut a range of triangles in two: the surface area heuristic over bins.

use crate::math::Vec3;

use super::bounds::Bounds;

/// Bins along the longest side of the centers' box.
const BINS: usize = 16;

/// Levels cut by cost; ranges below are halved by count, so that the depth is bounded.
const COST_LEVELS: u32 = 32;

/// A triangle while the tree is built.
#[derive(Debug, Clone, Copy)]
pub(super) struct Item {
    pub bounds: Bounds,
    pub face: u32,
}

/// Reorders at least two `items` so that the first of the returned count go left, the others right: both at least one.
/// With the boxes of both.
pub(super) fn split(items: &mut [Item], depth: u32) -> (usize, [Bounds; 2]) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for item in &*items {
        let center = item.bounds.doubled_center();
        low = low.min(center);
        high = high.max(center);
    }
    let extent = high - low;
    let axis = extent.max_position();
    let scale = BINS as f32 / extent[axis];
    // A scale that is not finite: the centers lie on one another, or so close that no bin tells them apart.
    if depth >= COST_LEVELS || !scale.is_finite() {
        return halve(items, axis);
    }
    let bin = |item: &Item| (((item.bounds.doubled_center()[axis] - low[axis]) * scale) as usize).min(BINS - 1);

    let mut bins = [(Bounds::NONE, 0u32); BINS];
    for item in &*items {
        let (bounds, count) = &mut bins[bin(item)];
        *bounds = bounds.union(item.bounds);
        *count += 1;
    }
    let (cut, boxes) = cheapest_cut(&bins);
    let left = partition(items, |item| bin(item) <= cut);
    if left == 0 || left == items.len() { halve(items, axis) } else { (left, boxes) }
}

/// The last bin of the left side, such that area times count is least over both sides; the first of equals.
fn cheapest_cut(bins: &[(Bounds, u32); BINS]) -> (usize, [Bounds; 2]) {
    let mut right = [(Bounds::NONE, 0u32); BINS];
    for i in (0..BINS - 1).rev() {
        right[i] = (right[i + 1].0.union(bins[i + 1].0), right[i + 1].1 + bins[i + 1].1);
    }
    let mut left = (Bounds::NONE, 0u32);
    let (mut least, mut cut, mut boxes) = (f32::INFINITY, 0, [Bounds::NONE; 2]);
    for i in 0..BINS - 1 {
        left = (left.0.union(bins[i].0), left.1 + bins[i].1);
        if left.1 == 0 || right[i].1 == 0 {
            continue;
        }
        let cost = left.0.half_area() * left.1 as f32 + right[i].0.half_area() * right[i].1 as f32;
        if cost < least {
            (least, cut, boxes) = (cost, i, [left.0, right[i].0]);
        }
    }
    (cut, boxes)
}

/// Moves the items that go left to the front; returns how many.
fn partition(items: &mut [Item], goes_left: impl Fn(&Item) -> bool) -> usize {
    let (mut i, mut j) = (0, items.len());
    loop {
        while i < j && goes_left(&items[i]) {
            i += 1;
        }
        while i < j && !goes_left(&items[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        items.swap(i, j - 1);
        i += 1;
        j -= 1;
    }
}

/// Cuts at the median along `axis`.
fn halve(items: &mut [Item], axis: usize) -> (usize, [Bounds; 2]) {
    let middle = items.len() / 2;
    let key = |item: &Item| item.bounds.doubled_center()[axis];
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.face.cmp(&b.face)));
    let (left, right) = items.split_at(middle);
    (middle, [left, right].map(bounds_of))
}

/// The box of all items.
pub(super) fn bounds_of(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::NONE, |bounds, item| bounds.union(item.bounds))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(centers: &[f32]) -> Vec<Item> {
        let item = |(face, &x): (u32, &f32)| {
            let bounds = Bounds { low: Vec3::new(x - 0.25, 0.0, 0.0), high: Vec3::new(x + 0.25, 1.0, 1.0) };
            Item { bounds, face }
        };
        (0..).zip(centers).map(item).collect()
    }

    #[test]
    fn a_gap_is_where_to_cut() {
        let mut items = items(&[9.0, 0.0, 10.0, 1.0, 0.5]);
        let (left, boxes) = split(&mut items, 0);
        assert_eq!(left, 3);
        assert_eq!(boxes.map(|b| (b.low.x, b.high.x)), [(-0.25, 1.25), (8.75, 10.25)]);
        let mut faces: Vec<u32> = items[..left].iter().map(|item| item.face).collect();
        faces.sort_unstable();
        assert_eq!(faces, [1, 3, 4]);
    }

    #[test]
    fn coincident_and_deep_ranges_are_halved() {
        assert_eq!(split(&mut items(&[1.0; 7]), 0).0, 3);
        assert_eq!(split(&mut items(&[0.0, 1.0, 2.0, 4.0, 8.0, 1000.0]), COST_LEVELS).0, 3);
        // Closer than any bin: the scale overflows.
        assert_eq!(split(&mut items(&[0.0, 1e-40, 2e-40]), 0).0, 1);
    }
}
