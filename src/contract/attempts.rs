//! A run, and where seams keep it from the number of faces asked for, another in which more of them yield.
//!
//! From the start again, not from where the first got stuck: that has taken what it could wherever no seam is. A run that
//! reaches a number of faces near what creases keep may have done so at a high price: another, in which they yield, is made
//! for comparison.

use std::time::Instant;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::driver::{self, Job};
use super::prepare::{Prepared, begin};
use super::yielding::Yields;
use super::{Attributes, Options, Placement, Seams};

/// The share of the faces asked for from which it pays to try without creases what keep so many. From a tenth on the teapot in
/// `docs/DECISIONS.md` is farther off in images at a third of its faces, from a third on the part is not tried at a tenth.
const KEPT_BY_CREASES: f64 = 0.2;
/// And only if so many of the faces that creases leave to vanish have to: a truck with hard edges everywhere keeps its texture
/// better with them from seven tenths of its faces on. With three quarters it is tried too late.
const PRESSED: f64 = 0.6;
/// What the estimated error of a run without creases is of that with them at most, for it to be worth what they show.
const CLOSER: f64 = 0.95;
/// Errors in the normalized frame that nobody sees: on flats they are rounding alone.
const UNSEEN: f64 = 1e-6;
/// What the user is told where the run without creases is better.
const WITHOUT_CREASES: &str = "creases of the normals yield: the surface is estimated farther off with them";

/// Runs a job.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let Job { mesh, options, budgets, .. } = job;
    let mut left: Vec<usize> = (0..budgets.len()).collect();
    let mut made: Vec<Option<Outcome>> = vec![None; budgets.len()];
    let mut next = Some(Yields::Nothing);
    while let Some(least) = next {
        let clock = Instant::now();
        let budgets: Vec<Budget> = left.iter().map(|&index| budgets[index]).collect();
        let Attempt { prepared, yields, pressure } = Attempt::new(mesh, options, &budgets, least)?;
        next = yields.more().filter(|_| may_yield(options));
        let frame = prepared.frame;
        let outcomes = driver::run(Job { budgets: &budgets, ..job }, prepared, progress.as_deref_mut())?;
        let spent = clock.elapsed().as_secs_f64();
        let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
        for (&index, outcome) in left.iter().zip(outcomes) {
            let chosen = match made[index].take() {
                Some(before) => better(before, outcome, yields, spent, frame.length_to_rows(1.0)),
                None => with_warning(outcome, yields.warning()),
            };
            made[index] = Some(chosen);
        }
        // All or none, so that a level of a chain is never farther off than a coarser one.
        let is_pressed = pressure.is_some_and(|pressure| pressure.is_on_any(&budgets, mesh.faces.len()));
        let goes_on = |&index: &usize| {
            let budget = &job.budgets[index];
            (is_pressed && !has_error(budget)) || made[index].as_ref().is_some_and(|outcome| is_held(outcome, budget))
        };
        left.retain(goes_on);
        if left.is_empty() || was_cancelled {
            break;
        }
    }
    Ok(made.into_iter().flatten().collect())
}
/// The outcome of a budget that is worth more, of that before and one in which such seams yield, which took so many seconds.
/// `scale` brings a length to the normalized frame.
fn better(mut before: Outcome, found: Outcome, yields: Yields, spent: f64, scale: f64) -> Outcome {
    let was_met = before.stop != StopReason::Stuck;
    let is_better = match found.stop {
        StopReason::Cancelled => !was_met,
        stop if was_met => {
            let [with, without] = [&before, &found].map(|outcome| outcome.error_estimate * scale);
            stop == before.stop && with > UNSEEN && without < CLOSER * with
        }
        _ => found.mesh.faces.len() < before.mesh.faces.len(),
    };
    if is_better {
        return with_warning(found, if was_met { Some(WITHOUT_CREASES) } else { yields.warning() });
    }
    if found.stop == StopReason::Cancelled {
        before.stop = StopReason::Cancelled;
    }
    before.seconds.build += spent;
    before.seconds.total += spent;
    before
}

fn with_warning(mut outcome: Outcome, warning: Option<&str>) -> Outcome {
    outcome.warnings.extend(warning.map(String::from));
    outcome
}

/// The start of a run.
struct Attempt {
    prepared: Prepared,
    yields: Yields,
    /// That of creases, where they hold and may yield.
    pressure: Option<Pressure>,
}

impl Attempt {
    /// A run in which such seams yield, or the first more of them that do not hold all of it from the start.
    fn new(mesh: &Mesh, options: &Options, budgets: &[Budget], mut yields: Yields) -> Result<Self> {
        let faces = mesh.faces.len();
        let first = first_count(faces, budgets)?;
        let mut prepared = begin(mesh, options)?;
        loop {
            let seams = prepared.seam_flags(mesh, yields, options);
            let held = prepared.least_faces(&seams);
            let more = yields.more().filter(|_| may_yield(options));
            if let Some(more) = more.filter(|_| held > first && prepared.least_faces(&[]) <= first) {
                yields = more;
                continue;
            }
            // Without another look at the seams: no more than if all of them were creases.
            let most = Pressure { start: prepared.faces.len(), held, by_creases: held };
            let may_press = yields == Yields::Nothing && most.is_on_any(budgets, faces);
            let pressure = more.filter(|_| may_press).map(|more| {
                let without = prepared.least_faces(&prepared.seam_flags(mesh, more, options));
                Pressure { by_creases: held.saturating_sub(without), ..most }
            });
            prepared.flag_seams(mesh, &seams, yields);
            return Ok(Self { prepared, yields, pressure });
        }
    }
}

/// What creases keep of the faces of a run in which they hold.
#[derive(Debug, Clone, Copy)]
struct Pressure {
    start: usize,
    /// The fewest faces that it leaves.
    held: usize,
    /// How many less another does in which they yield.
    by_creases: usize,
}

impl Pressure {
    /// Whether creases keep many of the faces of a budget, of a mesh of so many, and most of what they leave would have to go.
    /// Where an error limit ends the run nobody knows how many.
    fn is_on(&self, budget: &Budget, faces: usize) -> bool {
        let Some(asked) = budget.target_faces(faces).ok().filter(|_| !has_error(budget)) else { return false };
        let (vanish, free) = (self.start.saturating_sub(asked), self.start.saturating_sub(self.held));
        self.by_creases as f64 > KEPT_BY_CREASES * asked as f64 && vanish as f64 > PRESSED * free as f64
    }

    fn is_on_any(&self, budgets: &[Budget], faces: usize) -> bool {
        budgets.iter().any(|budget| self.is_on(budget, faces))
    }
}

fn has_error(budget: &Budget) -> bool {
    budget.error.is_some() || budget.error_abs.is_some()
}

/// The face count that comes first, where all that is asked for is a count; an error limit may end a run before seams do.
fn first_count(faces: usize, budgets: &[Budget]) -> Result<usize> {
    let count = |budget: &Budget| if has_error(budget) { Ok(usize::MAX) } else { budget.target_faces(faces) };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creases_press_where_they_keep_many_and_most_others_would_have_to_go() {
        let pressure = Pressure { start: 1000, held: 100, by_creases: 80 };
        let is_on = |faces: usize| pressure.is_on(&Budget::faces(faces), 1000);
        assert_eq!([101, 399, 400, 459, 461, 900].map(is_on), [true, true, false, false, false, false]);
        // Three fifths of the 700 that may vanish are 420.
        let wide = Pressure { held: 300, by_creases: 290, ..pressure };
        assert_eq!([579, 581].map(|faces| wide.is_on(&Budget::faces(faces), 1000)), [true, false]);
        assert!(!Pressure { by_creases: 0, ..pressure }.is_on(&Budget::faces(101), 1000));
        assert!(!pressure.is_on(&Budget { error: Some(0.1), ..Budget::faces(101) }, 1000));
        assert!(pressure.is_on_any(&[900, 150].map(Budget::faces), 1000));
    }
}
