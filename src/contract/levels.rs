//! The budgets that a run has still to meet, and which comes next.
//!
//! A run meets the budgets of all its levels on its way. It heads for the largest face count and keeps the tightest error
//! limit of those that are left, so that every level is within its own limit and none is passed over.

use crate::error::Result;
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::simplify::Budget;

/// A budget as a run knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Which of the budgets it is.
    pub index: usize,
    /// Faces at which it is met.
    pub target: usize,
    /// Greatest estimated deviation, in the normalized frame.
    pub max_deviation: f64,
}

/// What a run heads for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    pub target: usize,
    pub max_deviation: f64,
}

/// The levels that are left.
#[derive(Debug)]
pub struct Levels {
    left: Vec<Level>,
    /// The least face count of all that were asked for.
    pub last_target: usize,
}

impl Levels {
    /// One for every budget of a run on `mesh`.
    ///
    /// # Errors
    /// As [`Budget::target_faces`] and [`Budget::max_deviation`].
    pub fn new(budgets: &[Budget], mesh: &Mesh, frame: Frame) -> Result<Self> {
        let level = |(index, budget): (usize, &Budget)| {
            Ok(Level {
                index,
                target: budget.target_faces(mesh.faces.len())?,
                max_deviation: frame.length_to_rows(budget.max_deviation(mesh.diagonal())?),
            })
        };
        let left: Vec<Level> = budgets.iter().enumerate().map(level).collect::<Result<_>>()?;
        let last_target = left.iter().map(|level| level.target).min().unwrap_or(0);
        Ok(Self { left, last_target })
    }

    /// What comes next; nothing when every budget is met.
    pub fn goal(&self) -> Option<Goal> {
        let target = self.left.iter().map(|level| level.target).max()?;
        let limits = self.left.iter().map(|level| level.max_deviation);
        Some(Goal { target, max_deviation: limits.fold(f64::INFINITY, f64::min) })
    }

    /// The face counts to come when so many are left, the first and the last; nothing when every budget is met by then.
    pub fn targets_below(&self, faces: usize) -> Option<[usize; 2]> {
        let targets = || self.left.iter().map(|level| level.target).filter(|&target| target < faces);
        Some([targets().max()?, targets().min()?])
    }

    /// Whether so many faces meet a budget.
    pub fn meets(&self, faces: usize) -> bool {
        self.left.iter().any(|level| level.target >= faces)
    }

    /// Takes out those that so many faces meet.
    pub fn take_reached(&mut self, faces: usize) -> Vec<Level> {
        self.left.extract_if(.., |level| level.target >= faces).collect()
    }

    /// Takes out those whose limit nothing that is left to contract keeps.
    pub fn take_limited(&mut self, max_deviation: f64) -> Vec<Level> {
        self.left.extract_if(.., |level| level.max_deviation <= max_deviation).collect()
    }

    /// Takes out all.
    pub fn take_all(&mut self) -> Vec<Level> {
        std::mem::take(&mut self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn levels(budgets: &[Budget]) -> Levels {
        let ball = shapes::icosphere(3);
        let frame = Frame::new(&ball.faces, |v| ball.positions[v as usize], ball.bounds());
        Levels::new(budgets, &ball, frame).expect("budgets in range")
    }

    fn indices(levels: Vec<Level>) -> Vec<usize> {
        levels.into_iter().map(|level| level.index).collect()
    }

    #[test]
    fn face_counts_come_from_fine_to_coarse_whatever_their_order() {
        let mut levels = levels(&[Budget::faces(10), Budget::faces(500), Budget::keep(0.1), Budget::faces(500)]);
        assert_eq!(levels.last_target, 10);
        let mut met = Vec::new();
        while let Some(Goal { target, max_deviation }) = levels.goal() {
            assert!(levels.meets(target) && !levels.meets(target + 1) && max_deviation == f64::INFINITY);
            met.push((target, levels.targets_below(target), indices(levels.take_reached(target))));
        }
        assert_eq!(met, [(500, Some([128, 10]), vec![1, 3]), (128, Some([10, 10]), vec![2]), (10, None, vec![0])]);
    }

    #[test]
    fn the_tightest_limit_holds_until_its_level_is_met() {
        let tight = Budget { error: Some(0.01), ..Budget::faces(100) };
        let mut levels = levels(&[Budget::error(0.05), tight, Budget::faces(50)]);
        let first = levels.goal().expect("three are left");
        assert_eq!(first.target, 100);
        assert_eq!(indices(levels.take_limited(first.max_deviation)), [1]);
        let second = levels.goal().expect("two are left");
        assert!(second.max_deviation > 4.9 * first.max_deviation);
        assert_eq!((second.target, indices(levels.take_reached(50))), (50, vec![2]));
        assert_eq!(levels.goal(), Some(Goal { target: 0, ..second }));
        assert_eq!(indices(levels.take_all()), [0]);
        assert_eq!(levels.goal(), None);
    }
}
