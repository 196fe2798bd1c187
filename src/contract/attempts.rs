//! A run, and where seams keep it from the number of faces asked for, another in which more of them yield.
//!
//! From a [checkpoint](super::checkpoint) of the first, or from its start where there is none far enough from where it got stuck: that
//! has taken what it could wherever no seam is.

use std::time::Instant;

use crate::error::Result;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::checkpoint::Checkpoints;
use super::driver::{self, Job};
use super::prepare::{Prepared, begin};
use super::pressure::{Pressure, compared, face_counts, has_error};
use super::seam_pressure::{FARTHER_WITH_SEAMS, are_pressing, is_seen, keep_closer};
use super::yielding::Yields;
use super::{Attributes, Options, Placement, Seams};

/// Runs a job.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let (all, diagonal, faces) = (job.budgets, job.mesh.diagonal(), job.mesh.faces.len());
    let mut left: Vec<usize> = (0..all.len()).collect();
    let mut made: Vec<Option<Outcome>> = vec![None; all.len()];
    // The levels that a run reached in which seams hold.
    let mut held = vec![false; all.len()];
    let (mut next, mut checkpoints) = (Some(Yields::Nothing), Checkpoints::default());
    let (mut are_dear, mut is_compared, mut from) = (false, false, 0);
    while let Some(least) = next {
        job.awake.rouse();
        let clock = Instant::now();
        let budgets: Vec<Budget> = left.iter().map(|&index| all[index]).collect();
        let job = Job { budgets: &budgets, ..job };
        let Attempt { prepared, yields, more, kept, is_pressed } = Attempt::new(job, least, checkpoints.ahead(from))?;
        let outcomes: Vec<Outcome> = if is_pressed {
            compared(job, prepared, &mut checkpoints, progress.as_deref_mut())?
        } else {
            let target = face_counts(&budgets, faces).map(|[least, _]| least);
            checkpoints.begin(&prepared, target, more, job.options);
            let outcomes = driver::run(job, prepared, &mut checkpoints, progress.as_deref_mut())?.into_iter().flatten();
            let warning = if is_compared { Some(FARTHER_WITH_SEAMS) } else { yields.warning() };
            outcomes.map(|outcome| outcome.with_warning(warning)).collect()
        };
        let spent = clock.elapsed().as_secs_f64();
        if is_compared {
            keep_closer(&mut made, left.into_iter().zip(outcomes).collect(), spent);
            break;
        }
        let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
        let mut again = Vec::new();
        for (index, outcome) in left.into_iter().zip(outcomes) {
            // By this run, not by the best: where its seams hold nothing, others that yield do not help.
            again.extend(may_help(&outcome, &all[index], faces).then_some(index));
            held[index] = yields < Yields::Seams && is_seen(&outcome, &all[index], diagonal);
            are_dear |= held[index] && are_pressing(&outcome, faces, kept);
            keep(&mut made[index], outcome, spent);
        }
        (left, next) = (again, more);
        if was_cancelled {
            break;
        }
        // Where an error limit ends a level nobody knows with how many faces.
        let may_compare = may_yield(job.options) && !all.iter().any(has_error);
        if are_dear && may_compare && (left.is_empty() || next.is_none()) {
            // With what presses all levels that are as far off: none may be farther off than a coarser one.
            left = (0..all.len()).filter(|&index| held[index]).collect();
            from = left.iter().filter_map(|&index| Some(made[index].as_ref()?.mesh.faces.len())).fold(0, usize::max);
            (next, is_compared) = (Some(Yields::Seams), true);
        }
        if left.is_empty() {
            break;
        }
    }
    Ok(made.into_iter().flatten().collect())
}

/// Keeps an outcome that took so many seconds, or the one that was made before.
fn keep(made: &mut Option<Outcome>, outcome: Outcome, spent: f64) {
    *made = Some(match made.take() {
        Some(before) => fewer(before, outcome, spent),
        None => outcome,
    });
}

/// The outcome with fewer faces, of one that is stuck and another that took so many seconds; or the other where that was
/// cancelled, as it may have come to have fewer.
fn fewer(stuck: Outcome, found: Outcome, spent: f64) -> Outcome {
    let is_better = found.stop == StopReason::Cancelled || found.mesh.faces.len() < stuck.mesh.faces.len();
    if is_better { found } else { stuck.later(spent) }
}

/// The start of a run.
struct Attempt {
    prepared: Prepared,
    yields: Yields,
    /// What yields if this is not enough.
    more: Option<Yields>,
    /// How many faces more the seams that hold leave than there would be without them, at least.
    kept: usize,
    /// Whether creases press, and a run in which they yield is to be compared with one in which they hold: its seams are not flagged.
    is_pressed: bool,
}

impl Attempt {
    /// A run in which such seams yield, or the first more of them that do not hold all of it from the start: `at` a checkpoint, or at
    /// the start of the mesh.
    fn new(Job { mesh, options, budgets, .. }: Job<'_>, mut yields: Yields, at: Option<Prepared>) -> Result<Self> {
        let faces = mesh.faces.len();
        let first = first_count(faces, budgets)?;
        let mut prepared = at.map_or_else(|| begin(mesh, options), Ok)?;
        let more = |prepared: &Prepared, yields: Yields| {
            may_yield(options).then(|| more_than(yields, prepared.has_shading())).flatten()
        };
        loop {
            let seams = prepared.seam_flags(mesh, yields, options);
            let held = prepared.least_faces(&seams);
            let free = if seams.is_empty() { held } else { prepared.least_faces(&[]) };
            let next = more(&prepared, yields);
            // Charts keep faces that no flag tells of. Where parts keep as many anyway, all seams would yield for nothing.
            let charts_hold = || {
                let least = prepared.carried.wedges.as_ref().map(|wedges| wedges.least_faces_of_parts(mesh));
                least.is_some_and(|[of_charts, of_materials]| of_charts > first && of_materials <= first)
            };
            let holds = || held > first || (yields == Yields::Corners && charts_hold());
            if let Some(next) = next.filter(|_| free <= first && holds()) {
                yields = next;
                continue;
            }
            // Without another look at the seams: no more than if all of them were creases.
            let most = Pressure { start: prepared.faces.len(), held, by_creases: held };
            if next == Some(Yields::Creases) && most.is_on_any(budgets, faces) {
                let without = prepared.seam_flags(mesh, Yields::Creases, options);
                let by_creases = held.saturating_sub(prepared.least_faces(&without));
                if (Pressure { by_creases, ..most }).is_on_any(budgets, faces) {
                    let (yields, more) = (Yields::Creases, Yields::Creases.more());
                    let kept = held.saturating_sub(by_creases + free);
                    return Ok(Self { prepared, yields, more, kept, is_pressed: true });
                }
            }
            prepared.flag_seams(mesh, &seams, yields);
            return Ok(Self { prepared, yields, more: next, kept: held.saturating_sub(free), is_pressed: false });
        }
    }
}

/// What yields when this was not enough: without shading there are no creases.
fn more_than(yields: Yields, has_shading: bool) -> Option<Yields> {
    yields.more().and_then(|more| if more == Yields::Creases && !has_shading { more.more() } else { Some(more) })
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

/// The least number of pairs that seams refuse for each face too many, for another run in which more of them yield: none was seen to
/// come to fewer faces by more than there were such pairs. An engine with 9 for 830 came to as many, twice.
const LEAST_REFUSED_EACH: f64 = 0.03;

/// Whether a run in which more seams yield than in that of an outcome, of a mesh of so many faces, may come nearer to what is asked.
fn may_help(outcome: &Outcome, budget: &Budget, faces: usize) -> bool {
    let refused = outcome.blocked.seam + outcome.blocked.texture;
    let too_many = outcome.mesh.faces.len().saturating_sub(budget.target_faces(faces).unwrap_or(0));
    let are_enough = refused > 0 && refused as f64 >= LEAST_REFUSED_EACH * too_many as f64;
    outcome.stop == StopReason::Stuck && are_enough && budget.counts_faces()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::{Awake, Device};
    use crate::math::Vec2;
    use crate::mesh::{Mesh, shapes};
    use crate::simplify::Blocked;

    /// A plane of 20 × 20 squares whose texture is a wall of bricks, each a chart of four squares, but for halves at the ends of
    /// every second row: 110 in all, and three meet at most corners.
    fn bricks() -> Mesh {
        let mut mesh = shapes::plane(20, 20);
        let brick = |f: usize| 6 * (f / 40) + (f % 40 + 4 * (f / 40 % 2)) / 8;
        let at = |(f, face): (usize, &[u32; 3])| {
            face.map(|v| Vec2::new((v % 21) as f32 + 30.0 * brick(f) as f32, (v / 21) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
        mesh
    }

    /// Of a plane with 100 faces left, at such an end.
    fn outcome(stop: StopReason, seam: u64, texture: u64) -> Outcome {
        let (mesh, device) = (shapes::plane(20, 20), Device::cpu(1).expect("a device"));
        let made = super::super::run(&mesh, &Options::default(), &[Budget::faces(100)], &device, None);
        let made = made.expect("a valid mesh").pop().expect("one budget");
        Outcome { stop, blocked: Blocked { seam, texture, flip: 900, ..Blocked::default() }, ..made }
    }

    #[test]
    fn more_seams_yield_only_where_they_refuse_more_than_a_little() {
        let helps = |stop: StopReason, seam: u64, texture: u64| {
            let outcome = outcome(stop, seam, texture);
            assert_eq!(outcome.mesh.faces.len(), 100);
            // 99 too many.
            may_help(&outcome, &Budget::faces(1), 800)
        };
        let stuck = [[0, 0], [2, 0], [3, 0], [1, 2]].map(|[seam, texture]| helps(StopReason::Stuck, seam, texture));
        assert_eq!(stuck, [false, false, true, true]);
        assert!(!helps(StopReason::FacesReached, 50, 50));
    }

    #[test]
    fn creases_are_given_up_only_where_there_is_shading() {
        let chain = |has_shading: bool| {
            let next = |yields: &Yields| more_than(*yields, has_shading);
            std::iter::successors(Some(Yields::Nothing), next).collect::<Vec<_>>()
        };
        assert_eq!(chain(true), [Yields::Nothing, Yields::Creases, Yields::Corners, Yields::Seams]);
        assert_eq!(chain(false), [Yields::Nothing, Yields::Corners, Yields::Seams]);
    }

    #[test]
    fn of_two_stuck_outcomes_the_first_is_kept_unless_the_other_has_fewer_faces() {
        let kept = |faces: usize| {
            let mut made = None;
            keep(&mut made, outcome(StopReason::Stuck, 50, 0), 1.0);
            let mut later = outcome(StopReason::Stuck, 0, 0);
            later.mesh.faces.truncate(faces);
            keep(&mut made, later, 2.0);
            made.map(|made| (made.mesh.faces.len(), made.blocked.seam))
        };
        assert_eq!([100, 99].map(kept), [Some((100, 50)), Some((99, 0))]);
    }

    #[test]
    fn a_run_that_charts_would_hold_is_not_made() {
        let (mesh, options, device) = (bricks(), Options::default(), Device::cpu(1).expect("a device"));
        let yields = |faces: usize| {
            let budgets = [Budget::faces(faces)];
            let job = Job {
                mesh: &mesh,
                options: &options,
                budgets: &budgets,
                device: &device,
                clock: Instant::now(),
                awake: &Awake::new(),
                worst_deviation: f64::INFINITY,
            };
            Attempt::new(job, Yields::Nothing, None).expect("a valid mesh").yields
        };
        // Corners of bricks hold more than two faces each; where they do not, that is what bricks keep. A face is kept by the plane
        // itself.
        assert_eq!([500, 220, 219, 2, 1].map(yields), {
            use Yields::{Corners, Nothing, Seams};
            [Nothing, Corners, Seams, Seams, Corners]
        });
    }
}
