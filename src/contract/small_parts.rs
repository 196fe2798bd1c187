//! Parts that go where they alone would keep a run from its number of faces: the dust of a scan, leaves around a trunk.
//!
//! A part never has fewer faces than its topology needs, four where it is closed. Many small ones are more than was asked for: the
//! run gets stuck, and on its way has crushed whatever is large. It is made again without those that are smaller than what it came
//! to is off: from a [checkpoint](super::checkpoint) where seams, or vertices where the surface is not manifold, had one kept, or from
//! its start.

use std::time::Instant;

use crate::error::Result;
use crate::mesh::parts::{Parts, faces_by_size};
use crate::mesh::weld;
use crate::simplify::{Budget, OnProgress, Outcome, StopReason};

use super::checkpoint::Checkpoints;
use super::driver::Job;
use super::prepare::Prepared;
use super::pressure::has_error;
use super::{Options, attempts};

/// The share of the faces asked for that the small parts which stay may have left: the others are for what is large.
const LEFT: f64 = 0.75;
/// How large they may be at most, of the diagonal: what is larger is missed.
pub const MOST: f64 = 0.05;
/// The faces of a part that is closed, at least.
const LEAST_KEPT: usize = 4;
/// A limit is past the part that it takes in by this, as it is told of the diagonal.
pub const PAST: f64 = 1.0 + 1e-6;

/// Runs a job, whose start is at hand or not, and again where small parts kept it from its number of faces.
pub fn run(job: Job<'_>, start: Option<Prepared>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let mut checkpoints = Checkpoints::default();
    let outcomes = attempts::run(job, start, &mut checkpoints, progress.as_deref_mut())?;
    let is_stuck = |(outcome, budget): (&Outcome, &Budget)| outcome.stop == StopReason::Stuck && budget.counts_faces();
    let was_cancelled = outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled);
    if was_cancelled || job.options.joins() || !outcomes.iter().zip(job.budgets).any(is_stuck) {
        return Ok(outcomes);
    }
    let mut made = Made { job, all: Parts::of(job.mesh, 0.0), checkpoints, outcomes };
    let (of_input, mut faces) = (Sizes::of(&made.all), None);
    // The levels that were made again, and at which limit.
    let mut remade: Vec<(usize, Limit)> = Vec::new();
    for (level, budget) in job.budgets.iter().enumerate() {
        let outcome = &mut made.outcomes[level];
        if !is_stuck((outcome, budget)) {
            continue;
        }
        let target = budget.target_faces(job.mesh.faces.len())?;
        let left = faces_by_size(&outcome.mesh);
        match of_input.limit(outcome, &left, target).filter(|_| may_go(job.options) && !has_error(budget)) {
            Some(limit) => {
                let is_fewer = |found: &Outcome, made: &Outcome| found.mesh.faces.len() < made.mesh.faces.len();
                if made.again((level, limit), progress.as_deref_mut(), is_fewer)? {
                    remade.push((level, limit));
                }
            }
            None => {
                let faces = *faces.get_or_insert_with(|| weld(job.mesh, 0.0).mesh.faces.len());
                outcome.warnings.extend(advice([made.all.sizes.len(), faces], &left, target));
            }
        }
    }
    // None may be farther off than a coarser one.
    for (coarser, limit) in remade {
        for (level, budget) in job.budgets.iter().enumerate() {
            let [coarser, finer] = [coarser, level].map(|level| &made.outcomes[level]);
            let is_finer = finer.mesh.faces.len() > coarser.mesh.faces.len();
            if is_finer && finer.error_estimate > coarser.error_estimate && !has_error(budget) {
                let is_closer = |found: &Outcome, made: &Outcome| found.error_estimate < made.error_estimate;
                made.again((level, limit), progress.as_deref_mut(), is_closer)?;
            }
        }
    }
    Ok(made.outcomes)
}

/// What a job has come to, and what it is made again from.
struct Made<'a> {
    job: Job<'a>,
    /// The parts of its mesh.
    all: Parts,
    checkpoints: Checkpoints,
    outcomes: Vec<Outcome>,
}

impl Made<'_> {
    /// Makes a level again without the parts up to a limit, and keeps it if it is better, or cancelled; returns whether it was better.
    fn again(
        &mut self,
        (level, limit): (usize, Limit),
        progress: Option<&mut OnProgress<'_>>,
        is_better: impl Fn(&Outcome, &Outcome) -> bool,
    ) -> Result<bool> {
        let Self { job, all, checkpoints, outcomes } = self;
        if outcomes.iter().any(|outcome| outcome.stop == StopReason::Cancelled) {
            return Ok(false);
        }
        let clock = Instant::now();
        let Job { mesh, device, .. } = *job;
        let options = Options { prune: Some(limit.share), ..job.options.clone() };
        let budgets = &job.budgets[level..=level];
        let tolerance = options.weld.unwrap_or_default();
        let find =
            || if tolerance > 0.0 { Parts::of(mesh, tolerance).small(limit.share) } else { all.small(limit.share) };
        let mut checkpoints = checkpoints.without(budgets[0].target_faces(mesh.faces.len())?, find, device)?;
        let found = attempts::run(Job { options: &options, budgets, ..*job }, None, &mut checkpoints, progress)?.pop();
        let outcome = &mut outcomes[level];
        let Some(mut found) = found else { return Ok(false) };
        found.error_estimate = found.error_estimate.max(limit.length);
        if found.stop == StopReason::Cancelled {
            outcome.stop = StopReason::Cancelled;
        } else if is_better(&found, outcome) {
            found.warnings.push(format!(
                "parts up to {:.2}% of the diagonal across go: they would keep more faces than were asked for",
                limit.share * 100.0
            ));
            *outcome = found;
            return Ok(true);
        }
        let spent = clock.elapsed().as_secs_f64();
        outcome.seconds.build += spent;
        outcome.seconds.total += spent;
        Ok(false)
    }
}

/// Whether parts may go that nobody named.
pub fn may_go(options: &Options) -> bool {
    options.prune.is_none() && options.may_lose_parts()
}

/// Up to which size parts go.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limit {
    /// Of the mesh's diagonal.
    share: f64,
    /// In model units.
    length: f64,
}

/// The sizes of the parts of an input.
#[derive(Debug, Clone)]
struct Sizes {
    /// Ascending.
    sorted: Vec<f64>,
    /// Of all of them.
    diagonal: f64,
}

impl Sizes {
    fn of(parts: &Parts) -> Self {
        let mut sorted = parts.sizes.clone();
        sorted.sort_by(f64::total_cmp);
        Self { sorted, diagonal: parts.diagonal }
    }

    /// The limit for an outcome that is stuck with parts of such faces `left`, those of the smallest first, of a mesh with these; none
    /// where they are not to blame, or where those would have to go that are larger than it is off. Parts as large as the last that goes
    /// go as well.
    fn limit(&self, outcome: &Outcome, left: &[usize], target: usize) -> Option<Limit> {
        // Each of them is still there. Which of them it was does not show, but the order of their sizes hardly changes.
        let largest = MOST * self.diagonal;
        let may_go = self.sorted.partition_point(|&size| size <= outcome.error_estimate.min(largest));
        let (mut stay, mut go) = (outcome.mesh.faces.len(), 0);
        for &faces in left.iter().take(may_go) {
            if stay as f64 <= LEFT * target as f64 {
                break;
            }
            stay -= faces;
            go += 1;
        }
        let last = if go > 0 { self.sorted.get(go - 1) } else { None };
        // Of many of one size all would go.
        let leaves_any = |length: f64| self.sorted.last().is_some_and(|&largest| length * PAST < largest);
        let length = last.copied().filter(|&length| stay <= target && leaves_any(length));
        length.map(|length| Limit { share: length / self.diagonal * PAST, length })
    }
}

/// What to do about a mesh of so many parts and faces that got stuck on its way to so many faces, with parts of such faces `left`.
fn advice([parts, faces]: [usize; 2], left: &[usize], target: usize) -> Option<String> {
    if faces < 2 * parts {
        return Some("hardly a face shares an edge with another: weld vertices that lie close to each other".into());
    }
    let kept: usize = left.iter().map(|&faces| faces.min(LEAST_KEPT)).sum();
    (parts > 1 && kept > target)
        .then(|| format!("{parts} parts keep too many faces: prune small ones, or join those that lie close"))
}

#[cfg(test)]
mod tests {
    use super::super::{Placement, run};
    use super::*;
    use crate::backend::Device;
    use crate::math::DVec3;
    use crate::mesh::{Mesh, shapes};

    /// A sphere of 1,280 faces and `count` tetrahedra around it, of such a size.
    fn dusty(count: u32, size: f64) -> Mesh {
        with_dust(shapes::icosphere(3), count, size)
    }

    /// A mesh about as large as a sphere, and after it `count` tetrahedra around it, of such a size.
    fn with_dust(mut mesh: Mesh, count: u32, size: f64) -> Mesh {
        let grain = shapes::tetrahedron();
        for i in 0..count {
            let turn = f64::from(i) * 2.4;
            let height = f64::from(2 * i + 1) / f64::from(count) - 1.0;
            let at = DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - height * height).sqrt() + DVec3::Z * height;
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(grain.positions.iter().map(|&p| at * 1.2 + p * size));
            mesh.faces.extend(grain.faces.iter().map(|face| face.map(|v| v + first)));
        }
        mesh
    }

    fn to(mesh: &Mesh, faces: usize, options: &Options) -> Outcome {
        let device = Device::cpu(1).expect("a device");
        let made = run(mesh, options, &[Budget::faces(faces)], &device, None);
        made.expect("a valid mesh").pop().expect("one budget")
    }

    #[test]
    fn dust_goes_where_it_would_keep_too_many_faces() {
        let (mesh, options) = (dusty(100, 0.01), Options::default());
        let is_told = |outcome: &Outcome| outcome.warnings.iter().any(|warning| warning.contains("across go"));
        let few = to(&mesh, 300, &options);
        few.mesh.check().expect("a valid mesh");
        assert!(few.stop == StopReason::FacesReached && few.mesh.faces.len() <= 300 && is_told(&few));
        assert!(few.error_estimate < 0.1 * mesh.diagonal(), "{}", few.error_estimate);
        // All of them where there is room, and where nothing may go.
        let many = to(&mesh, 500, &options);
        assert!(many.stop == StopReason::FacesReached && !is_told(&many));
        for held in [Options { prune: Some(0.0), ..options.clone() }, Options { log: true, ..options.clone() }] {
            let held = to(&mesh, 300, &held);
            assert!(held.stop == StopReason::Stuck && held.mesh.faces.len() >= 400 && !is_told(&held));
            assert!(
                held.warnings.iter().any(|warning| warning.contains("101 parts keep too many")),
                "{:?}",
                held.warnings
            );
        }
    }

    /// Where three faces meet holds a run as well: what gives way there in the one with dust does so from the start in the one without.
    #[test]
    fn a_run_without_dust_is_not_held_by_what_gave_way_before() {
        let mut ball = shapes::icosphere(5);
        for f in (0..ball.faces.len()).step_by(50) {
            let [a, b, _] = ball.faces[f];
            let fin = (ball.positions[a as usize] + ball.positions[b as usize]) * 0.52;
            ball.positions.push(fin);
            ball.faces.push([a, b, ball.positions.len() as u32 - 1]);
        }
        let (mesh, device) = (with_dust(ball, 300, 0.01), Device::cpu(1).expect("a device"));
        let (mut last, mut again) = (usize::MAX, 0);
        let mut count = |now: crate::simplify::Progress| {
            again += usize::from(now.faces > last);
            last = now.faces;
            std::ops::ControlFlow::Continue(())
        };
        let made = run(&mesh, &Options::default(), &[Budget::faces(400)], &device, Some(&mut count));
        let outcome = made.expect("a valid mesh").pop().expect("one budget");
        let is_told = |of: &str| outcome.warnings.iter().any(|warning| warning.contains(of));
        assert_eq!(outcome.stop, StopReason::FacesReached);
        assert!(is_told("across go") && is_told("not manifold move"), "{:?}", outcome.warnings);
        assert_eq!(again, 2, "one in which those vertices move, and one without dust");
    }

    #[test]
    fn what_is_large_or_all_there_is_stays() {
        // Grains of a tenth of the diagonal.
        let large = dusty(100, 0.1);
        assert_eq!(to(&large, 300, &Options::default()).stop, StopReason::Stuck);
        let mut alone = dusty(100, 0.01);
        alone.faces.drain(..1280);
        let wreck = Outcome { error_estimate: 1.0, ..to(&alone, 100, &Options::default()) };
        assert_eq!(Sizes::of(&Parts::of(&alone, 0.0)).limit(&wreck, &faces_by_size(&wreck.mesh), 100), None);
        let outcome = to(&alone, 100, &Options::default());
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 400));
        assert!(outcome.warnings.iter().any(|warning| warning.contains("100 parts keep too many")));
        // Every face for itself.
        let mut apart = shapes::plane(4, 4);
        let corners = apart.faces.iter().flatten().enumerate();
        apart.positions = corners.map(|(c, &v)| apart.positions[v as usize] + DVec3::Z * (1e-6 * c as f64)).collect();
        apart.faces = (0..apart.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let outcome = to(&apart, 8, &Options::default());
        assert!(outcome.warnings.iter().any(|warning| warning.contains("weld vertices")), "{:?}", outcome.warnings);
    }

    #[test]
    fn no_level_is_farther_off_than_a_coarser_one() {
        let (mesh, device) = (dusty(100, 0.01), Device::cpu(1).expect("a device"));
        let parts = |outcome: &Outcome| faces_by_size(&outcome.mesh).len();
        for (counts, with_dust) in [([900, 300], [true, false]), ([450, 300], [false, false])] {
            let budgets = counts.map(Budget::faces);
            let made = run(&mesh, &Options::default(), &budgets, &device, None).expect("a valid mesh");
            assert!(made.iter().all(|outcome| outcome.stop == StopReason::FacesReached));
            assert!(made.is_sorted_by_key(|outcome| outcome.error_estimate), "{counts:?}");
            let found: Vec<bool> = made.iter().map(|outcome| parts(outcome) > 1).collect();
            assert_eq!(found, with_dust, "{counts:?}");
        }
    }

    #[test]
    fn who_cancels_the_second_run_cancels() {
        let (mesh, device) = (dusty(100, 0.01), Device::cpu(1).expect("a device"));
        let (mut last, mut runs) = (usize::MAX, 0);
        let mut cancel = |now: crate::simplify::Progress| {
            runs += usize::from(now.faces > last);
            last = now.faces;
            if runs > 0 { std::ops::ControlFlow::Break(()) } else { std::ops::ControlFlow::Continue(()) }
        };
        let made = run(&mesh, &Options::default(), &[Budget::faces(300)], &device, Some(&mut cancel));
        let stop = made.expect("a valid mesh").pop().expect("one budget").stop;
        assert_eq!((stop, runs), (StopReason::Cancelled, 1));
    }

    #[test]
    fn nothing_goes_that_is_to_stay() {
        let mesh = dusty(100, 0.01);
        let of_input = Options { placement: Placement::Endpoint, ..Options::default() };
        let locked = Options { locked: Some(vec![false; mesh.positions.len()].into()), ..Options::default() };
        let bounded = Budget { error: Some(0.5), ..Budget::faces(300) };
        for (options, budget) in [
            (of_input, Budget::faces(300)),
            (locked, Budget::faces(300)),
            (Options { lock_border: true, ..Options::default() }, Budget::faces(300)),
            (Options { weld: None, ..Options::default() }, Budget::faces(300)),
            (Options::default(), bounded),
        ] {
            let device = Device::cpu(1).expect("a device");
            let made = run(&mesh, &options, &[budget], &device, None).expect("a valid mesh").pop().expect("one budget");
            assert_eq!((made.stop, faces_by_size(&made.mesh).len()), (StopReason::Stuck, 101), "{options:?}");
        }
    }
}
