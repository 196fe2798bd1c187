//! A run, and where seams keep it from the number of faces asked for, another in which more of them yield.
//!
//! From the start again, not from where the first got stuck: that has taken what it could wherever no seam is.

use crate::error::Result;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::driver::{self, Job};
use super::prepare::begin;
use super::yielding::Yields;
use super::{Attributes, Options, Placement, Seams};

/// Runs a job.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let Job { mesh, options, budgets, .. } = job;
    let first = first_count(mesh.faces.len(), budgets)?;
    let mut left: Vec<usize> = (0..budgets.len()).collect();
    let mut made: Vec<Option<Outcome>> = vec![None; budgets.len()];
    let mut yields = Some(Yields::Nothing);
    // What was prepared for a run that seams would have held from its start.
    let mut ready = None;
    while let Some(now) = yields {
        yields = now.more().filter(|_| may_yield(options));
        let mut prepared = ready.take().map_or_else(|| begin(mesh, options), Ok)?;
        let seams = prepared.seams(mesh, now, options);
        if yields.is_some() && prepared.seams_hold_above(&seams, first) {
            ready = Some(prepared);
            continue;
        }
        prepared.flag_seams(&seams);
        drop(seams);
        let budgets: Vec<Budget> = left.iter().map(|&index| budgets[index]).collect();
        let outcomes = driver::run(Job { budgets: &budgets, ..job }, prepared, progress.as_deref_mut())?;
        let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
        for (&index, mut outcome) in left.iter().zip(outcomes) {
            let before = made[index].as_ref().map_or(usize::MAX, |before| before.mesh.faces.len());
            if outcome.mesh.faces.len() < before || was_cancelled {
                outcome.warnings.extend(now.warning().map(String::from));
                made[index] = Some(outcome);
            }
        }
        let is_stuck =
            |&index: &usize| made[index].as_ref().is_some_and(|outcome| is_held(outcome, &job.budgets[index]));
        let stuck: Vec<usize> = left.iter().copied().filter(is_stuck).collect();
        if stuck.is_empty() || was_cancelled {
            break;
        }
        left = stuck;
    }
    Ok(made.into_iter().flatten().collect())
}

/// The face count that comes first, where all that is asked for is a count; an error limit may end a run before seams do.
fn first_count(faces: usize, budgets: &[Budget]) -> Result<usize> {
    let count = |budget: &Budget| match budget {
        Budget { error: None, error_abs: None, .. } => budget.target_faces(faces),
        _ => Ok(usize::MAX),
    };
    budgets.iter().map(count).try_fold(0, |most, faces| Ok(most.max(faces?)))
}

/// Whether seams may yield at all. What reaches a vertex of the input from beside a seam brings numbers that it never had.
fn may_yield(options: &Options) -> bool {
    let Attributes { seams, lock_seams, .. } = options.attributes;
    let of_input = options.placement == Placement::Endpoint;
    seams == Seams::Yield && !(lock_seams || of_input || options.log || options.joins())
}

/// Whether seams keep an outcome from the number of faces asked for.
fn is_held(outcome: &Outcome, budget: &Budget) -> bool {
    let by_seams = outcome.blocked.seam + outcome.blocked.texture > 0;
    outcome.stop == StopReason::Stuck && by_seams && budget.counts_faces()
}
