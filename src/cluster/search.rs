//! The grid for a number of faces: the finest found that leaves at most as many.
//!
//! The count falls about with the square of the cell's side, so that a few grids come close. Each is tried by first counting the
//! faces that span three cells, which is cheap; only near the target are repetitions taken out.

use std::ops::ControlFlow;

use crate::error::Result;
use crate::kernel::cell_keys::LEAST_STEPS;

/// A grid that leaves this share of the target or more ends the search.
const CLOSE: f64 = 0.99;
/// So do grids on both sides of the target whose cells differ by less than this.
const TIGHT: f64 = 1.002;
/// Faces within this factor of the target are worth an exact count.
const NEAR: f64 = 1.5;
/// So few are in any case.
const FEW: usize = 10_000;
/// Grids that a count that falls as expected takes at most.
const EXPECTED_GRIDS: usize = 6;
/// Grids at most; halving alone takes fifteen to get tight.
const MOST_GRIDS: usize = 24;
/// Faces that a closed surface leaves, about, over the square of the cells along its longest side.
const FACES_PER_SQUARE: f64 = 6.0;

/// What to count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// Faces that span three cells.
    Spanning,
    /// Faces that are left.
    Left,
}

/// A result, or the wish to stop.
pub type Unless<T> = Result<ControlFlow<(), T>>;

/// The value, or out of the function with an error or the wish to stop.
macro_rules! go_on {
    ($counted:expr) => {
        match $counted? {
            ControlFlow::Continue(value) => value,
            ControlFlow::Break(()) => return Ok(ControlFlow::Break(())),
        }
    };
}
pub(super) use go_on;

/// A grid that was tried.
#[derive(Debug, Clone, Copy)]
struct Tried {
    steps: u32,
    spanning: usize,
    left: Option<usize>,
}

/// What is sought, and what was found so far.
struct Search {
    target: usize,
    /// Steps to the side of the coarsest grid allowed.
    most: u32,
    grids: Vec<Tried>,
    /// Faces left of those that span, in the last exact count.
    kept: f64,
}

/// The steps of the finest grid found, with cells of at most `most` steps, that leaves 1 to `target` faces; without one
/// those of the coarsest found that leaves any, if one does.
///
/// # Errors
/// Those of `count`.
pub fn finest(
    target: usize,
    most: u32,
    extent: u32,
    mut count: impl FnMut(u32, Count) -> Unless<usize>,
) -> Unless<Option<u32>> {
    let mut search = Search { target, most, grids: Vec::new(), kept: 1.0 };
    let guess = f64::from(extent) * (FACES_PER_SQUARE / target.max(1) as f64).sqrt();
    let mut steps = (guess as u32).clamp(LEAST_STEPS, most);
    loop {
        let spanning = go_on!(count(steps, Count::Spanning));
        let mut grid = Tried { steps, spanning, left: None };
        if search.is_near(&grid) {
            grid.left = Some(go_on!(count(steps, Count::Left)));
        }
        search.add(grid);
        match search.next() {
            Some(next) if search.grids.len() < MOST_GRIDS => steps = next,
            _ => return search.settle(count),
        }
    }
}

impl Search {
    fn estimate(&self, grid: &Tried) -> f64 {
        grid.left.map_or(grid.spanning as f64 * self.kept, |left| left as f64)
    }

    fn is_near(&self, grid: &Tried) -> bool {
        let (estimate, target) = (self.estimate(grid), self.target as f64);
        grid.spanning <= FEW || (estimate < target * NEAR && estimate * NEAR > target)
    }

    fn add(&mut self, grid: Tried) {
        if let Some(left) = grid.left {
            self.kept = left.max(1) as f64 / grid.spanning.max(1) as f64;
        }
        self.grids.push(grid);
    }

    /// The steps to try next; `None` when the last grids are close or tight enough.
    fn next(&self) -> Option<u32> {
        let target = self.target as f64;
        let leaves = |grid: &&Tried| self.estimate(grid) > target;
        let is_close =
            |grid: &Tried| grid.left.is_some_and(|left| left <= self.target && left as f64 >= CLOSE * target);
        // The target lies between these two.
        let fine = self.grids.iter().filter(leaves).map(|grid| grid.steps).max().unwrap_or(LEAST_STEPS - 1);
        let coarser = self.grids.iter().filter(|grid| !leaves(grid) && grid.steps > fine);
        let coarse = coarser.map(|grid| grid.steps).min().unwrap_or(self.most + 1);
        if self.grids.iter().any(is_close) || coarse - fine <= 1 || f64::from(coarse) < f64::from(fine) * TIGHT {
            return None;
        }
        // Without a logarithm, which differs between platforms.
        let off = |grid: &Tried| {
            let ratio = self.estimate(grid) / target.max(1.0);
            ratio.max(ratio.recip())
        };
        let counted = self.grids.iter().filter(|grid| self.estimate(grid) > 0.0);
        let guess = match counted.min_by(|a, b| off(a).total_cmp(&off(b))) {
            None => f64::from(coarse) / 2.0,
            // Where the count does not fall as expected, halve what is left.
            Some(_) if self.grids.len() >= EXPECTED_GRIDS => (f64::from(fine) * f64::from(coarse)).sqrt(),
            // Half way between close and met.
            Some(grid) => {
                f64::from(grid.steps) * (self.estimate(grid) / (target.max(1.0) * (1.0 + CLOSE) / 2.0)).sqrt()
            }
        };
        Some((guess as u32).clamp(fine + 1, coarse - 1))
    }

    /// Picks from what was tried: the most faces up to the target, or else the coarsest grid that leaves any.
    fn settle(self, mut count: impl FnMut(u32, Count) -> Unless<usize>) -> Unless<Option<u32>> {
        let is_above = |grid: &Tried| self.estimate(grid) > self.target as f64;
        let mut tried = self.grids.clone();
        tried.sort_by(|a, b| {
            let by_count = self.estimate(b).total_cmp(&self.estimate(a)).then(a.steps.cmp(&b.steps));
            is_above(a).cmp(&is_above(b)).then(if is_above(a) { b.steps.cmp(&a.steps) } else { by_count })
        });
        for grid in tried.iter().filter(|grid| grid.spanning > 0) {
            let left = match grid.left {
                Some(left) => left,
                None => go_on!(count(grid.steps, Count::Left)),
            };
            if left > 0 && (left <= self.target || is_above(grid)) {
                return Ok(ControlFlow::Continue(Some(grid.steps)));
            }
        }
        Ok(ControlFlow::Continue(None))
    }
}

/// The steps of the coarsest grid found, with cells of at most `most` steps, that leaves a face; `None` when none does.
///
/// # Errors
/// Those of `count`.
pub fn coarsest(most: u32, mut count: impl FnMut(u32, Count) -> Unless<usize>) -> Unless<Option<u32>> {
    let mut leaves_any = |steps: u32| -> Unless<bool> {
        let left = go_on!(count(steps, Count::Left));
        Ok(ControlFlow::Continue(left > 0))
    };
    if go_on!(leaves_any(most)) {
        return Ok(ControlFlow::Continue(Some(most)));
    }
    let (mut fine, mut coarse) = (LEAST_STEPS, most);
    if fine >= coarse || !go_on!(leaves_any(fine)) {
        return Ok(ControlFlow::Continue(None));
    }
    while coarse - fine > 1 && f64::from(coarse) > f64::from(fine) * TIGHT {
        let middle = (f64::from(fine) * f64::from(coarse)).sqrt() as u32;
        let middle = middle.clamp(fine + 1, coarse - 1);
        if go_on!(leaves_any(middle)) { fine = middle } else { coarse = middle }
    }
    Ok(ControlFlow::Continue(Some(fine)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: u32 = 1 << 24;

    /// Searches with this count of faces by steps, of which `kept` are no repetitions; also returns how often it counted.
    fn search(target: usize, most: u32, kept: f64, faces: impl Fn(u32) -> usize) -> (Option<u32>, usize) {
        let mut counts = 0;
        let found = finest(target, most, EXTENT, |steps, what| {
            counts += 1;
            let share = if what == Count::Left { kept } else { 1.0 };
            Ok(ControlFlow::Continue((faces(steps) as f64 * share) as usize))
        });
        match found.expect("no error") {
            ControlFlow::Continue(steps) => (steps, counts),
            ControlFlow::Break(()) => panic!("nobody asked to stop"),
        }
    }

    /// A closed surface of so many faces in grids as fine as they get.
    fn surface(steps: u32) -> usize {
        let cells = f64::from(EXTENT) / f64::from(steps);
        (3.0 * cells * cells).min(1e6) as usize
    }

    #[test]
    fn the_target_is_met_from_below_in_a_few_grids() {
        for (target, kept) in [(100_000, 1.0), (100_000, 0.7), (1000, 0.9), (37, 1.0), (999_000, 1.0), (100, 0.2)] {
            let (steps, counts) = search(target, EXTENT, kept, surface);
            let left = (surface(steps.expect("a grid")) as f64 * kept) as usize;
            assert!(left <= target && left as f64 >= 0.97 * target as f64, "{target}: {left}");
            assert!(counts <= 10, "{target}: {counts} counts");
        }
    }

    #[test]
    fn what_every_grid_fits_takes_the_finest() {
        let (steps, _) = search(1_000_000, EXTENT, 1.0, surface);
        assert!(surface(steps.expect("a grid")) >= 990_000);
        assert_eq!(search(5_000_000, EXTENT, 1.0, surface).0, Some(LEAST_STEPS));
    }

    #[test]
    fn without_a_grid_that_fits_the_coarsest_with_a_face_is_taken() {
        // 12 faces are the fewest before there are none.
        let sphere = |steps: u32| if steps > EXTENT / 2 { 0 } else { surface(steps).max(12) };
        let steps = search(4, EXTENT, 1.0, sphere).0.expect("a grid");
        assert!((EXTENT / 2 - 20_000..=EXTENT / 2).contains(&steps), "{steps}");
        assert_eq!(search(4, EXTENT, 1.0, |_| 0).0, None);
        // And none coarser than allowed.
        assert_eq!(search(4, 1000, 1.0, surface).0, Some(1000));
    }

    #[test]
    fn counts_that_jump_do_not_keep_it_from_ending() {
        let stairs = |steps: u32| 1_usize << (24 - steps.ilog2());
        let (steps, counts) = search(1000, EXTENT, 1.0, stairs);
        assert_eq!(stairs(steps.expect("a grid")), 512);
        assert!(counts <= 2 * MOST_GRIDS, "{counts} counts");
        let noise = |steps: u32| surface(steps) + (steps.wrapping_mul(2_654_435_761) % 997) as usize;
        let left = noise(search(20_000, EXTENT, 1.0, noise).0.expect("a grid"));
        assert!((19_000..=20_000).contains(&left), "{left}");
    }

    #[test]
    fn a_wish_to_stop_is_heard() {
        let stopped = finest(10, EXTENT, EXTENT, |_, _| Ok(ControlFlow::Break(())));
        assert!(matches!(stopped, Ok(ControlFlow::Break(()))));
    }

    #[test]
    fn the_coarsest_grid_with_a_face_is_found() {
        let any = |limit: u32| {
            coarsest(EXTENT, |steps, _| Ok(ControlFlow::Continue(usize::from(steps <= limit)))).expect("no error")
        };
        assert_eq!(any(EXTENT), ControlFlow::Continue(Some(EXTENT)));
        assert_eq!(any(LEAST_STEPS), ControlFlow::Continue(Some(LEAST_STEPS)));
        assert_eq!(any(0), ControlFlow::Continue(None));
        assert!(matches!(any(100_000), ControlFlow::Continue(Some(99_800..=100_000))));
    }
}
