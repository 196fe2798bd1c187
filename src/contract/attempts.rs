//! A run, and where what it holds keeps it from the number of faces asked for, others in which that gives way: seams, of which more
//! yield each time, and vertices where the surface is not manifold.
//!
//! From a [checkpoint](super::checkpoint) of the first, or from its start where there is none far enough from where it got stuck: that
//! has taken what it could wherever nothing is held. What got through, but dearly, is compared with a run in which what pressed gives
//! way.

use std::time::Instant;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, StopReason};

use super::Options;
use super::attempt::{Attempt, Holds, Step, may_yield};
use super::checkpoint::Checkpoints;
use super::driver::{self, Job};
use super::prepare::Prepared;
use super::pressure::{compared, face_counts, has_error};
use super::seam_pressure::{
    FARTHER_WITH_SEAMS, SOUND, are_felt, are_pressing, is_seen, is_wrecked, keep_closer, keep_many, keep_some,
    worst_error,
};
use super::small_parts::may_go;
use super::yielding::Yields;

/// Runs a job, from its start if that is at hand, or from a checkpoint if there is one; leaves those of its own.
pub fn run(
    job: Job<'_>,
    mut start: Option<Prepared>,
    checkpoints: &mut Checkpoints,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Outcome>> {
    let mut found = Found::new(job);
    found.next = checkpoints.first_step();
    while !found.left.is_empty() {
        job.awake.rouse();
        let clock = Instant::now();
        let budgets: Vec<Budget> = found.left.iter().map(|&level| job.budgets[level]).collect();
        let job = Job { budgets: &budgets, ..job };
        let at = start.take().or_else(|| checkpoints.ahead(found.most_faces(), found.most_error()));
        let Attempt { prepared, step, holds, is_pressed } = Attempt::new(job, found.next, at)?;
        let outcomes: Vec<Option<Outcome>> = if is_pressed {
            let outcomes = compared(job, prepared, checkpoints, progress.as_deref_mut())?;
            outcomes.into_iter().map(Some).collect()
        } else {
            let job = Job { worst_deviation: found.worst_error() * prepared.frame.length_to_rows(1.0), ..job };
            let target = face_counts(&budgets, job.mesh.faces.len()).map(|[least, _]| least);
            let may_more = holds.seams.is_some() || holds.complex > 0;
            checkpoints.begin(&prepared, target, may_more, job.options);
            let outcomes = driver::run(job, prepared, checkpoints, progress.as_deref_mut())?;
            let warning = found.warning(step);
            outcomes.into_iter().map(|outcome| Some(outcome?.with_warning(warning))).collect()
        };
        if !found.compares && may_go(job.options) {
            // What it was to be, not what it became at its start: that may be for parts that go.
            checkpoints.note_tried(found.next, &outcomes);
        }
        found.take(outcomes, step, holds, clock.elapsed().as_secs_f64());
    }
    Ok(found.made.into_iter().flatten().collect())
}

/// What runs have come to, and what the next one is for.
struct Found<'a> {
    mesh: &'a Mesh,
    options: &'a Options,
    budgets: &'a [Budget],
    /// The levels, as far as they are made.
    made: Vec<Option<Outcome>>,
    /// Those that the next run makes, and what gives way in it.
    left: Vec<usize>,
    next: Step,
    /// Whether it makes them for the second time, and the closer ones are taken.
    compares: bool,
    /// The levels that were reached, but far off, by a run in which something held.
    dear: Vec<bool>,
    /// What makes them so.
    press: Step,
}

impl<'a> Found<'a> {
    fn new(Job { mesh, options, budgets, .. }: Job<'a>) -> Self {
        Self {
            mesh,
            options,
            budgets,
            made: vec![None; budgets.len()],
            left: (0..budgets.len()).collect(),
            next: Step::default(),
            compares: false,
            dear: vec![false; budgets.len()],
            press: Step::default(),
        }
    }

    /// The most faces of the levels that are made again to be compared: that run has to begin with more.
    fn most_faces(&self) -> usize {
        let faces = |&level: &usize| Some(self.made[level].as_ref()?.mesh.faces.len());
        if self.compares { self.left.iter().filter_map(faces).fold(0, usize::max) } else { 0 }
    }

    /// The greatest error that such a run may begin with: what is a wreck was none for long.
    fn most_error(&self) -> f64 {
        let diagonal = self.mesh.diagonal();
        let is_one = |&level: &usize| self.made[level].as_ref().is_some_and(|made| is_wrecked(made, diagonal));
        if self.compares && self.left.iter().any(is_one) { SOUND * diagonal } else { f64::INFINITY }
    }

    /// The greatest error that levels of the next run may have to be taken.
    fn worst_error(&self) -> f64 {
        if self.compares { worst_error(&self.made, &self.left) } else { f64::INFINITY }
    }

    /// What the user is told of seams where the next run does.
    fn warning(&self, step: Step) -> Option<&'static str> {
        let for_seams = self.compares && self.press.yields == Yields::Seams;
        if for_seams { Some(FARTHER_WITH_SEAMS) } else { step.yields.warning() }
    }

    /// Takes in what a run came to in so many seconds, and finds what the next one is for.
    fn take(&mut self, outcomes: Vec<Option<Outcome>>, step: Step, holds: Holds, spent: f64) {
        let left = std::mem::take(&mut self.left);
        if self.compares {
            return keep_closer(&mut self.made, left.into_iter().zip(outcomes).collect(), spent);
        }
        let outcomes: Vec<Outcome> = outcomes.into_iter().flatten().collect();
        let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
        let mut stuck = Stuck::default();
        for (level, outcome) in left.into_iter().zip(outcomes) {
            // By this run, not by the best: where it holds nothing, others in which more yields do not help.
            stuck.note(level, &outcome, &self.budgets[level], self.mesh.faces.len(), holds);
            self.note_dear(level, &outcome, step, holds);
            keep(&mut self.made[level], outcome, spent);
        }
        if was_cancelled {
            return;
        }
        self.next = stuck.next(step, holds);
        self.left = stuck.levels;
        // Where an error limit ends a level nobody knows with how many faces.
        if self.left.is_empty() && self.press != Step::default() && !self.budgets.iter().any(has_error) {
            // With what presses all levels that are as far off: none may be farther off than a coarser one.
            self.left = (0..self.dear.len()).filter(|&level| self.dear[level]).collect();
            let Step { yields, complex } = self.press;
            self.next = Step { yields: step.yields.max(yields), complex: step.complex || complex };
            self.compares = true;
        }
    }

    /// Notes whether a level was reached far off, and what makes it so.
    fn note_dear(&mut self, level: usize, outcome: &Outcome, step: Step, holds: Holds) {
        let diagonal = self.mesh.diagonal();
        let (is_far, is_wrecked) = (is_seen(outcome, &self.budgets[level], diagonal), is_wrecked(outcome, diagonal));
        let (faces, seams_hold) = (self.mesh.faces.len(), step.yields < Yields::Seams && may_yield(self.options));
        self.dear[level] = is_far && (seams_hold || holds.complex > 0);
        if is_far
            && seams_hold
            && (are_pressing(outcome, faces, holds.by_seams)
                || (is_wrecked && holds.seams.is_some() && are_felt(outcome, holds.by_seams)))
        {
            self.press.yields = Yields::Seams;
        }
        let kept = FACES_EACH * holds.complex;
        let complex_presses = keep_many(outcome, faces, kept) || (is_wrecked && keep_some(outcome, kept));
        self.press.complex |= is_far && complex_presses;
    }
}

/// Faces that a vertex keeps that stays where the surface is not manifold, as many as go with one that vanishes.
const FACES_EACH: usize = 2;

/// The levels that a run got stuck at, for which another in which more yields may come nearer.
#[derive(Debug, Default)]
struct Stuck {
    levels: Vec<usize>,
    /// How many pairs seams refused there that could yield, and vertices where the surface is not manifold.
    by_seams: u64,
    by_complex: u64,
}

impl Stuck {
    fn note(&mut self, level: usize, outcome: &Outcome, budget: &Budget, faces: usize, holds: Holds) {
        let Blocked { seam, texture, lock, .. } = outcome.blocked;
        let refused = |refused: u64, may_yield: bool| {
            if may_yield && may_help(outcome, refused, budget, faces) { refused } else { 0 }
        };
        let (by_seams, by_complex) = (refused(seam + texture, holds.seams.is_some()), refused(lock, holds.complex > 0));
        self.by_seams += by_seams;
        self.by_complex += by_complex;
        self.levels.extend((by_seams + by_complex > 0).then_some(level));
    }

    /// What gives way in the next run: what refused more.
    fn next(&self, step: Step, holds: Holds) -> Step {
        match holds.seams {
            Some(yields) if self.by_seams > self.by_complex => Step { yields, ..step },
            _ => Step { complex: true, ..step },
        }
    }
}

/// The least number of pairs that were refused for each face too many, for another run in which what refused them yields: of seams
/// none was seen to come to fewer faces by more than there were such pairs. An engine with 9 for 830 came to as many, twice.
const LEAST_REFUSED_EACH: f64 = 0.03;

/// Whether a run in which more yields of what refused so many pairs at the end of an outcome, of a mesh of so many faces, may come
/// nearer to what is asked.
fn may_help(outcome: &Outcome, refused: u64, budget: &Budget, faces: usize) -> bool {
    let too_many = outcome.mesh.faces.len().saturating_sub(budget.target_faces(faces).unwrap_or(0));
    let are_enough = refused > 0 && refused as f64 >= LEAST_REFUSED_EACH * too_many as f64;
    outcome.stop == StopReason::Stuck && are_enough && budget.counts_faces()
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

#[cfg(test)]
mod tests {
    use super::super::NonManifold;
    use super::*;
    use crate::backend::Device;
    use crate::math::{DVec3, Vec2};
    use crate::mesh::shapes;

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
            may_help(&outcome, seam + texture, &Budget::faces(1), 800)
        };
        let stuck = [[0, 0], [2, 0], [3, 0], [1, 2]].map(|[seam, texture]| helps(StopReason::Stuck, seam, texture));
        assert_eq!(stuck, [false, false, true, true]);
        assert!(!helps(StopReason::FacesReached, 50, 50));
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

    /// A plane of 20 × 20 squares with a fin on every edge of the first half of each so many rows, where three faces meet;
    /// of two charts, whose seam stays clear of them.
    fn finned(every: u32) -> Mesh {
        let mut mesh = shapes::plane(20, 20);
        for row in (every..20).step_by(every as usize) {
            for v in (0..10).map(|column| 21 * row + column) {
                let fin = (mesh.positions[v as usize] + mesh.positions[v as usize + 1]) * 0.5 + DVec3::Z * 0.02;
                mesh.positions.push(fin);
                mesh.faces.push([v, v + 1, mesh.positions.len() as u32 - 1]);
            }
        }
        let chart = |face: &[u32; 3]| if mesh.positions[face[2] as usize].x < 15.0 { 0.0 } else { 3.0 };
        let place = |face: &[u32; 3]| {
            face.map(|v| mesh.positions[v as usize]).map(|p| Vec2::new(p.x as f32 + chart(face), (p.y + p.z) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().map(place).collect());
        mesh
    }

    #[test]
    fn what_is_not_manifold_yields_where_it_would_keep_too_many_faces() {
        let device = Device::cpu(1).expect("a device");
        let to = |mesh: &Mesh, faces: usize, non_manifold: NonManifold| {
            let options = Options { non_manifold, ..Options::default() };
            let made = super::super::run(mesh, &options, &[Budget::faces(faces)], &device, None);
            let outcome = made.expect("a valid mesh").pop().expect("one budget");
            outcome.mesh.check().expect("a valid mesh");
            let is_told = |of: &str| outcome.warnings.iter().any(|warning| warning.contains(of));
            assert!(!is_told("seams"), "{:?}", outcome.warnings);
            (outcome.stop, outcome.mesh.faces.len(), is_told("not manifold move"))
        };
        for every in [1, 4] {
            let mesh = finned(every);
            let (stop, faces, is_told) = to(&mesh, 40, NonManifold::Hold);
            assert!(stop == StopReason::Stuck && faces > 60 && !is_told, "{every}: {stop:?} at {faces}");
            let (stop, faces, is_told) = to(&mesh, 40, NonManifold::Cut);
            assert!(stop == StopReason::FacesReached && faces <= 40 && is_told, "{every}: {stop:?} at {faces}");
        }
        let (stop, _, is_told) = to(&finned(4), 600, NonManifold::Cut);
        assert!(stop == StopReason::FacesReached && !is_told, "{stop:?}");
    }
}
