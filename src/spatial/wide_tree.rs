//! A tree of boxes over rows in their own order, eight below each node, whose rows may change: what lies along a space-filling
//! curve needs no other.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};

use super::bounds::Bounds;
use crate::math::Vec3;

/// How many boxes stand side by side.
pub const EIGHT: usize = 8;

/// Eight boxes, a row of numbers for each bound and axis. That of nothing meets none.
#[repr(C, align(32))]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideBounds {
    low: [[f32; EIGHT]; 3],
    high: [[f32; EIGHT]; 3],
}

impl WideBounds {
    /// Around nothing.
    pub const NONE: Self = Self { low: [[f32::INFINITY; EIGHT]; 3], high: [[f32::NEG_INFINITY; EIGHT]; 3] };

    /// Replaces the box of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, bounds: Bounds) {
        for axis in 0..3 {
            (self.low[axis][lane], self.high[axis][lane]) = (bounds.low[axis], bounds.high[axis]);
        }
    }

    /// The box of a lane.
    #[inline(always)]
    fn get(&self, lane: usize) -> Bounds {
        // Mapped rows would be copied.
        let at = |rows: &[[f32; EIGHT]; 3]| Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]);
        Bounds { low: at(&self.low), high: at(&self.high) }
    }

    /// The box around all.
    fn around(&self) -> Bounds {
        (0..EIGHT).map(|lane| self.get(lane)).fold(Bounds::NONE, Bounds::union)
    }

    /// Which of the boxes meet another, a bit for each lane.
    #[inline(always)]
    pub fn meeting<S: Simd>(&self, simd: S, bounds: &Bounds) -> u8 {
        // A closure would be compiled for any processor.
        let x = self.meeting_along(simd, 0, bounds);
        let y = self.meeting_along(simd, 1, bounds);
        let z = self.meeting_along(simd, 2, bounds);
        (x & y & z).to_bitmask() as u8
    }

    /// Which of them do along an axis.
    #[inline(always)]
    fn meeting_along<S: Simd>(&self, simd: S, axis: usize, bounds: &Bounds) -> mask32x8<S> {
        let (low, high): (f32x8<S>, f32x8<S>) = (self.low[axis].simd_into(simd), self.high[axis].simd_into(simd));
        let begins = low.simd_le(f32x8::splat(simd, bounds.high[axis]));
        begins & high.simd_ge(f32x8::splat(simd, bounds.low[axis]))
    }
}

/// The tree.
#[derive(Debug, Default)]
pub struct WideTree {
    /// Boxes of rows, then of eight of the level before each, until one holds all.
    levels: Vec<Vec<WideBounds>>,
    /// Nodes that are still to be looked at: level, number.
    open: Vec<(u32, u32)>,
}

impl WideTree {
    /// Builds the tree over the boxes of `rows`, anew.
    pub fn build(&mut self, rows: impl ExactSizeIterator<Item = Bounds>) {
        self.levels.clear();
        let mut top = by_eight(rows);
        while top.len() > 1 {
            let above = by_eight(top.iter().map(WideBounds::around));
            self.levels.push(std::mem::replace(&mut top, above));
        }
        self.levels.push(top);
    }

    /// Replaces the box of a row; those above only grow.
    pub fn replace(&mut self, row: usize, bounds: Bounds) {
        let mut place = row;
        self.levels[0][place / EIGHT].set(place % EIGHT, bounds);
        for level in &mut self.levels[1..] {
            place /= EIGHT;
            let (node, lane) = (&mut level[place / EIGHT], place % EIGHT);
            let before = node.get(lane);
            if before.holds(&bounds) {
                break;
            }
            node.set(lane, before.union(bounds));
        }
    }

    /// The box of a row.
    #[inline(always)]
    pub fn bounds(&self, row: usize) -> Bounds {
        self.levels[0][row / EIGHT].get(row % EIGHT)
    }

    /// Lists the rows whose boxes meet another, in no order, in place of what was listed before.
    #[inline(always)]
    pub fn list_meeting<S: Simd>(&mut self, simd: S, bounds: &Bounds, rows: &mut Vec<u32>) {
        let Self { levels, open, .. } = self;
        rows.clear();
        open.clear();
        // Of no rows there is a level without a node.
        if levels.last().is_some_and(|top| !top.is_empty()) {
            open.push((levels.len() as u32 - 1, 0));
        }
        while let Some((level, number)) = open.pop() {
            let mut lanes = levels[level as usize][number as usize].meeting(simd, bounds);
            while lanes != 0 {
                let below = number * EIGHT as u32 + lanes.trailing_zeros();
                match level.checked_sub(1) {
                    Some(next) => open.push((next, below)),
                    None => rows.push(below),
                }
                lanes &= lanes - 1;
            }
        }
    }
}

/// Boxes side by side.
fn by_eight(boxes: impl ExactSizeIterator<Item = Bounds>) -> Vec<WideBounds> {
    let mut wide = vec![WideBounds::NONE; boxes.len().div_ceil(EIGHT)];
    boxes.enumerate().for_each(|(number, bounds)| wide[number / EIGHT].set(number % EIGHT, bounds));
    wide
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// Boxes along a curve in space.
    fn boxes(count: usize) -> Vec<Bounds> {
        let at = |row: usize| {
            let t = row as f32 * 0.1;
            Vec3::new(t.sin(), t.cos(), 0.01 * t)
        };
        (0..count).map(|row| Bounds::of([at(row), at(row + 1)])).collect()
    }

    fn check(tree: &mut WideTree, boxes: &[Bounds]) {
        let mut found = Vec::new();
        let everywhere = Bounds::of([Vec3::splat(-9.0), Vec3::splat(9.0)]);
        for query in boxes.iter().chain([&everywhere]) {
            dispatch!(Level::new(), simd => tree.list_meeting(simd, query, &mut found));
            found.sort_unstable();
            let all = (0..boxes.len() as u32).filter(|&row| boxes[row as usize].meets(query));
            assert_eq!(found, all.collect::<Vec<_>>());
        }
    }

    #[test]
    fn all_boxes_that_meet_are_listed_and_no_others() {
        let mut tree = WideTree::default();
        // Also after larger ones.
        for count in [1000, 1, 8, 9, 0, 64, 65, 513] {
            let boxes = boxes(count);
            tree.build(boxes.iter().copied());
            check(&mut tree, &boxes);
        }
    }

    #[test]
    fn boxes_that_change_are_found_where_they_are() {
        let (mut tree, mut boxes) = (WideTree::default(), boxes(200));
        tree.build(boxes.iter().copied());
        for row in (0..200).step_by(3) {
            boxes[row] = if row % 2 == 0 { boxes[199 - row] } else { Bounds::NONE };
            tree.replace(row, boxes[row]);
        }
        let there: Vec<_> = boxes.iter().copied().filter(|bounds| *bounds != Bounds::NONE).collect();
        assert!(there.len() < 200);
        let mut found = Vec::new();
        for query in &there {
            dispatch!(Level::new(), simd => tree.list_meeting(simd, query, &mut found));
            found.sort_unstable();
            let all = (0..200_u32).filter(|&row| boxes[row as usize].meets(query));
            assert_eq!(found, all.collect::<Vec<_>>());
        }
    }
}
