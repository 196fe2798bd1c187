//! Near the number of faces that creases keep: whether they press, and if so, the better of a run in which they yield and
//! one in which they hold.
//!
//! A run that reaches such a number with its creases may have done so at a high price. Until it has two to four times as many faces
//! nothing presses, and both are one. The one in which they yield goes first then: what it estimates is how far off the other may
//! be, which mostly ends long before it is through.

use std::time::Instant;

use crate::error::Result;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::checkpoint::Checkpoints;
use super::driver::{self, Job};
use super::prepare::{Prepared, begin};
use super::yielding::Yields;

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
const FARTHER_WITH_CREASES: &str = "creases of the normals yield: the surface is estimated farther off with them";
/// What the user is told where that is not known.
const NOT_COMPARED: &str = "creases of the normals yield: cancelled before a run with them was through";

/// What creases keep of the faces of a run in which they hold.
#[derive(Debug, Clone, Copy)]
pub struct Pressure {
    pub start: usize,
    /// The fewest faces that it leaves.
    pub held: usize,
    /// How many less another does in which they yield.
    pub by_creases: usize,
}

impl Pressure {
    /// Whether creases keep many of the faces of a budget, of a mesh of so many, and most of what they leave would have to go.
    fn is_on(&self, budget: &Budget, faces: usize) -> bool {
        let Ok(asked) = budget.target_faces(faces) else { return false };
        let (vanish, free) = (self.start.saturating_sub(asked), self.start.saturating_sub(self.held));
        self.by_creases as f64 > KEPT_BY_CREASES * asked as f64 && vanish as f64 > PRESSED * free as f64
    }

    /// Whether it is for any of these budgets. Where an error limit ends a run nobody knows with how many faces.
    pub fn is_on_any(&self, budgets: &[Budget], faces: usize) -> bool {
        !budgets.iter().any(has_error) && budgets.iter().any(|budget| self.is_on(budget, faces))
    }
}

pub fn has_error(budget: &Budget) -> bool {
    budget.error.is_some() || budget.error_abs.is_some()
}

/// The better outcomes of a job, of a run in which creases yield, whose checkpoints are noted, and another in which they hold. Of
/// all its budgets, so that no level of a chain is farther off than a coarser one but for what is not worth it. The seams of `start`
/// are not flagged yet.
pub fn compared(
    job: Job<'_>,
    start: Prepared,
    checkpoints: &mut Checkpoints,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Outcome>> {
    let Job { mesh, options, budgets, .. } = job;
    let (scale, counts) = (start.frame.length_to_rows(1.0), face_counts(budgets, mesh.faces.len()));
    let complex_yield = start.complex_yield;
    let (mut without, mut with_made) = (start, None);
    if counts.is_some_and(|[_, most]| checkpoints.may_part(&without, most, options)) {
        without.let_yield(mesh, Yields::Nothing, options);
        let outcomes = driver::run(job, without, checkpoints, progress.as_deref_mut())?;
        let was_cancelled = |outcome: &Outcome| outcome.stop == StopReason::Cancelled;
        if outcomes.iter().flatten().any(was_cancelled) {
            return Ok(outcomes.into_iter().flatten().collect());
        }
        without = checkpoints.parting().map_or_else(|| begin(mesh, options), Ok)?;
        if complex_yield && !without.complex_yield {
            without.let_complex_yield();
        }
        // Seams may hold it before.
        with_made = outcomes.iter().all(Option::is_some).then_some(outcomes);
    }
    let start_with = with_made.is_none().then(|| without.copy());
    without.let_yield(mesh, Yields::Creases, options);
    checkpoints.begin(&without, counts.map(|[least, _]| least), true, options);
    let without = driver::run(job, without, checkpoints, progress.as_deref_mut())?;
    let without: Vec<Outcome> = without.into_iter().flatten().collect();
    if without.iter().any(|outcome| outcome.stop == StopReason::Cancelled) {
        return Ok(without.into_iter().map(|outcome| outcome.with_warning(Some(NOT_COMPARED))).collect());
    }
    let clock = Instant::now();
    let with = match start_with {
        None => with_made.unwrap_or_default(),
        Some(mut with) => {
            with.let_yield(mesh, Yields::Nothing, options);
            let job = Job { worst_deviation: worst_deviation(&without, scale), ..job };
            driver::run(job, with, &mut Checkpoints::default(), progress)?
        }
    };
    let spent = clock.elapsed().as_secs_f64();
    Ok(with.into_iter().zip(without).map(|(with, without)| better(with, without, scale, spent)).collect())
}

/// The least and the greatest of the face counts asked for, if there are any.
pub fn face_counts(budgets: &[Budget], faces: usize) -> Option<[usize; 2]> {
    let counting = budgets.iter().filter(|budget| budget.counts_faces());
    let counts = || counting.clone().filter_map(|budget| budget.target_faces(faces).ok());
    Some([counts().min()?, counts().max()?])
}

/// Up to which error, in the normalized frame, creases are worth more than an outcome without them. `scale` brings a length there.
fn limit(without: &Outcome, scale: f64) -> f64 {
    (without.error_estimate * scale / CLOSER).max(UNSEEN)
}

/// The deviation past which a run with creases is the worse at every budget that it has not met yet.
fn worst_deviation(without: &[Outcome], scale: f64) -> f64 {
    let are_met = without.iter().all(|outcome| outcome.stop != StopReason::Stuck);
    let limits = without.iter().map(|outcome| limit(outcome, scale));
    if are_met { limits.fold(0.0, f64::max) } else { f64::INFINITY }
}

/// The better of two outcomes of a budget, of which that with creases is not there if it is the worse, and came so many
/// seconds after the other.
fn better(with: Option<Outcome>, mut without: Outcome, scale: f64, spent: f64) -> Outcome {
    let Some(with) = with else { return without.later(spent).with_warning(Some(FARTHER_WITH_CREASES)) };
    let warning = match with.stop {
        StopReason::Cancelled => {
            without.stop = StopReason::Cancelled;
            Some(NOT_COMPARED)
        }
        StopReason::Stuck if without.mesh.faces.len() < with.mesh.faces.len() => Yields::Creases.warning(),
        StopReason::Stuck => return with,
        stop if stop == without.stop && with.error_estimate * scale > limit(&without, scale) => {
            Some(FARTHER_WITH_CREASES)
        }
        _ => return with,
    };
    without.later(spent).with_warning(warning)
}

#[cfg(test)]
mod tests {
    use super::super::{Options, run};
    use super::*;
    use crate::backend::Device;
    use crate::mesh::shapes;

    /// With so many faces and such an estimated error.
    fn outcome(stop: StopReason, faces: u32, error: f64) -> Outcome {
        let device = Device::cpu(1).expect("a device");
        let ball = shapes::icosphere(0);
        let mut made = run(&ball, &Options::default(), &[Budget::keep(1.0)], &device, None).expect("a valid mesh");
        let mut found = made.pop().expect("one budget");
        found.mesh.faces.truncate(faces as usize);
        Outcome { stop, error_estimate: error, ..found }
    }

    #[test]
    fn the_closer_is_taken_unless_the_difference_is_small_or_nobody_sees_it() {
        use StopReason::{Cancelled, FacesReached, Stuck};
        // Whether that without creases is taken, in units of twice the model's.
        let is_without = |with: (StopReason, u32, f64), without: (StopReason, u32, f64)| {
            let [with, without] = [with, without].map(|(stop, faces, error)| outcome(stop, faces, error));
            let chosen = better(Some(with), without, 0.5, 3.0);
            (chosen.warnings.len() == 1, chosen.stop)
        };
        assert_eq!(is_without((FacesReached, 9, 1.06), (FacesReached, 9, 1.0)), (true, FacesReached));
        assert_eq!(is_without((FacesReached, 9, 1.05), (FacesReached, 9, 1.0)), (false, FacesReached));
        assert_eq!(is_without((FacesReached, 9, 1.9e-6), (FacesReached, 9, 0.0)), (false, FacesReached));
        assert_eq!(is_without((FacesReached, 9, 2.1e-6), (FacesReached, 9, 0.0)), (true, FacesReached));
        // What is stuck has more faces than asked for, and the fewer the better.
        assert_eq!(is_without((FacesReached, 9, 9.0), (Stuck, 10, 1.0)), (false, FacesReached));
        assert_eq!(is_without((Stuck, 11, 1.0), (Stuck, 10, 9.0)), (true, Stuck));
        assert_eq!(is_without((Stuck, 10, 9.0), (Stuck, 10, 1.0)), (false, Stuck));
        assert_eq!(is_without((Cancelled, 12, 1.0), (FacesReached, 9, 1.0)), (true, Cancelled));
        let given_up = better(None, outcome(FacesReached, 9, 1.0), 0.5, 3.0);
        assert_eq!((given_up.warnings.len(), given_up.seconds.total > 3.0), (1, true));
    }

    #[test]
    fn a_run_goes_on_as_long_as_it_may_win_anywhere() {
        let levels = [0.5, 1.9].map(|error| outcome(StopReason::FacesReached, 9, error));
        assert!((worst_deviation(&levels, 0.5) - 1.0).abs() < 1e-12);
        let stuck = levels.map(|level| Outcome { stop: StopReason::Stuck, ..level });
        assert_eq!(worst_deviation(&stuck, 0.5), f64::INFINITY);
        assert_eq!(worst_deviation(&[outcome(StopReason::FacesReached, 9, 0.0)], 0.5), UNSEEN);
    }

    #[test]
    fn creases_press_where_they_keep_many_and_most_others_would_have_to_go() {
        let pressure = Pressure { start: 1000, held: 100, by_creases: 80 };
        let is_on = |faces: usize| pressure.is_on(&Budget::faces(faces), 1000);
        assert_eq!([101, 399, 400, 459, 461, 900].map(is_on), [true, true, false, false, false, false]);
        // Three fifths of the 700 that may vanish are 420.
        let wide = Pressure { held: 300, by_creases: 290, ..pressure };
        assert_eq!([579, 581].map(|faces| wide.is_on(&Budget::faces(faces), 1000)), [true, false]);
        assert!(!Pressure { by_creases: 0, ..pressure }.is_on(&Budget::faces(101), 1000));
        let limited = Budget { error: Some(0.1), ..Budget::faces(101) };
        assert!(!pressure.is_on_any(&[limited, Budget::faces(101)], 1000));
        assert!(pressure.is_on_any(&[900, 150].map(Budget::faces), 1000));
    }
}
