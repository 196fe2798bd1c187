//! A run, and where seams keep it from the number of faces asked for, another in which more of them yield.
//!
//! From the start again, not from where the first got stuck: that has taken what it could wherever no seam is. A run that
//! reaches a number of faces near what creases keep may have done so at a high price: another, in which they yield, is made
//! for comparison.

use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::driver::{self, Job};
use super::prepare::{Prepared, begin};
use super::yielding::Yields;
use super::{Attributes, Options, Placement, Seams};

/// The share of the faces asked for that creases have to keep for a run without them to be worth its time.
const KEPT_BY_CREASES: f64 = 0.2;
/// The same of the faces that creases leave to vanish, of which so many have to.
const PRESSED: f64 = 0.6;
/// What the user is told where the run without creases is better.
const CLOSER: &str = "creases of the normals yield: the surface would be farther off with them";

/// Runs a job.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let Job { mesh, options, budgets, .. } = job;
    let mut left: Vec<usize> = (0..budgets.len()).collect();
    let mut made: Vec<Option<Outcome>> = vec![None; budgets.len()];
    let mut yields = Some(Yields::Nothing);
    while let Some(first) = yields {
        let Start { prepared, yields: now, creases } = prepare_to_yield(mesh, options, budgets, first)?;
        yields = now.more().filter(|_| may_yield(options));
        let budgets: Vec<Budget> = left.iter().map(|&index| budgets[index]).collect();
        let outcomes = driver::run(Job { budgets: &budgets, ..job }, prepared, progress.as_deref_mut())?;
        let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
        for (&index, mut outcome) in left.iter().zip(outcomes) {
            let warning = match &made[index] {
                Some(before) if before.stop != StopReason::Stuck => {
                    let is_closer = outcome.error_estimate < before.error_estimate;
                    if outcome.stop != before.stop || !is_closer {
                        continue;
                    }
                    Some(CLOSER)
                }
                Some(before) if outcome.mesh.faces.len() >= before.mesh.faces.len() && !was_cancelled => continue,
                _ => now.warning(),
            };
            outcome.warnings.extend(warning.map(String::from));
            made[index] = Some(outcome);
        }
        let goes_on = |&index: &usize| {
            let budget = &job.budgets[index];
            made[index].as_ref().is_some_and(|outcome| is_held(outcome, budget))
                || creases.as_ref().is_some_and(|creases| creases.press(budget, mesh.faces.len()))
        };
        left.retain(goes_on);
        if left.is_empty() || was_cancelled {
            break;
        }
    }
    Ok(made.into_iter().flatten().collect())
}

/// The start of an attempt.
struct Start {
    prepared: Prepared,
    yields: Yields,
    creases: Option<Creases>,
}

/// Prepares a run in which such seams yield, or the first more of them that do not hold all of it from the start.
fn prepare_to_yield(mesh: &Mesh, options: &Options, budgets: &[Budget], mut yields: Yields) -> Result<Start> {
    let faces = mesh.faces.len();
    let first = first_count(faces, budgets)?;
    let mut prepared = begin(mesh, options)?;
    loop {
        let seams = prepared.seams(mesh, yields, options);
        let held = prepared.least_faces(&seams);
        let more = yields.more().filter(|_| may_yield(options));
        if let Some(more) = more.filter(|_| held > first && prepared.least_faces(&[]) <= first) {
            yields = more;
            continue;
        }
        let all = Creases { start: prepared.faces.len(), held, own: held };
        let may_press = yields == Yields::Nothing && budgets.iter().any(|budget| all.press(budget, faces));
        let creases = more.filter(|_| may_press).map(|more| {
            let without = prepared.least_faces(&prepared.seams(mesh, more, options));
            Creases { own: held.saturating_sub(without), ..all }
        });
        prepared.flag_seams(mesh, &seams, yields);
        return Ok(Start { prepared, yields, creases });
    }
}

/// What creases keep of the faces of a run in which they hold.
struct Creases {
    start: usize,
    /// The fewest faces that it leaves.
    held: usize,
    /// How many less another does in which they yield.
    own: usize,
}

impl Creases {
    /// Whether they keep many of the faces of a budget that counts them, of a mesh of so many, and most of what they leave
    /// would have to go.
    fn press(&self, budget: &Budget, faces: usize) -> bool {
        let has_error = budget.error.is_some() || budget.error_abs.is_some();
        let Some(asked) = budget.target_faces(faces).ok().filter(|_| !has_error) else { return false };
        let (vanish, free) = (self.start.saturating_sub(asked), self.start.saturating_sub(self.held));
        self.own as f64 > KEPT_BY_CREASES * asked as f64 && vanish as f64 > PRESSED * free as f64
    }
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
