//! Where it is done, how often it is tried, and what came of it.

use std::time::Instant;

use rayon::prelude::*;

use crate::backend::Device;
use crate::error::Result;

use super::super::labels::Partition;
use super::super::queues::{OnDevice, Queues};
use super::super::surface::Surface;
use super::attempt::{Attempt, Watch};
use super::goals::{self, plane};
use super::labeling::Labeling;
use super::rounds::Rounds;
use super::scene::Scene;
use super::split::Members;
use super::{Goal, OnPass, Options, Proxy, Seconds, Solver, Vsa};

/// Partitions a surface on `device`; the calling thread belongs to its pool.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) for an option out of range.
pub fn partition(
    surface: &Surface,
    options: &Options,
    device: &Device,
    on_pass: Option<&mut OnPass<'_>>,
) -> Result<Vsa> {
    partition_on(&mut Queues::new(device), surface, options, on_pass)
}

/// [`partition`] on these queues, which others may have used before.
pub fn partition_on(
    queues: &mut Queues,
    surface: &Surface,
    options: &Options,
    on_pass: Option<&mut OnPass<'_>>,
) -> Result<Vsa> {
    options.check()?;
    let clock = Instant::now();
    let (bytes_before, transfer_before) = (queues.bytes_moved(), queues.seconds_moving());
    let mut warnings = Vec::new();
    let scene = queues.run(&mut warnings, |queue| Scene::new(queue, surface))?;
    let measure = clock.elapsed().as_secs_f64();
    let count = first_count(&scene, options.goal, &mut warnings);
    let watch = Watch::new(on_pass);
    let mut attempts: Vec<Attempt<'_, '_>> =
        (0..options.restarts).map(|index| Attempt::new(&scene, options, &watch, index)).collect();
    each(&mut attempts, |attempt| match options.solver {
        Solver::Lloyd => attempt.iterate(count),
        Solver::Greedy | Solver::Rounds => attempt.start(count),
    });
    if options.solver == Solver::Rounds {
        rounds(queues, &scene, &mut attempts, &mut warnings)?;
    }
    each(&mut attempts, |attempt| match options.goal {
        Goal::Regions(_) if options.solver == Solver::Lloyd => {}
        Goal::Regions(_) => attempt.improve(),
        Goal::Energy(most) => attempt.reach_energy(most, scene.fewest_regions()),
        Goal::Deviation(most) => attempt.reach_deviation(surface.frame.length_to_rows(most)),
    });
    let best = best(attempts, options.goal);
    Ok(Vsa {
        proxies: proxies(&scene, &best.regions),
        partition: Partition { region_count: best.regions.count(), labels: best.regions.labels },
        energies: best.energies,
        attempt: best.index,
        is_cancelled: watch.is_cancelled(),
        on_gpu: queues.is_on_gpu(),
        bytes_moved: queues.bytes_moved() - bytes_before,
        seconds: Seconds {
            measure,
            solve: clock.elapsed().as_secs_f64() - measure,
            transfer: queues.seconds_moving() - transfer_before,
        },
        warnings,
    })
}

/// How many regions to begin with.
fn first_count(scene: &Scene<'_>, goal: Goal, warnings: &mut Vec<String>) -> usize {
    let fewest = scene.fewest_regions();
    let Goal::Regions(count) = goal else { return goals::first_count(fewest, scene) };
    if count >= fewest {
        return count;
    }
    let closed = scene.is_closed.iter().filter(|&&is_closed| is_closed).count();
    let taken = scene.regions_beside(count);
    warnings.push(format!(
        "{taken} regions instead of {count}: the surface has {} parts, {closed} of them closed, which take two",
        scene.is_closed.len()
    ));
    taken
}

/// Does the same to every attempt, one a thread.
fn each<'s, 'b>(attempts: &mut [Attempt<'s, 'b>], work: impl Fn(&mut Attempt<'s, 'b>) + Sync + Send) {
    attempts.par_iter_mut().with_max_len(1).for_each(work);
}

/// The parallel rounds of every attempt, one after the other; the host goes on where a GPU fails.
fn rounds(
    queues: &mut Queues,
    scene: &Scene<'_>,
    attempts: &mut [Attempt<'_, '_>],
    warnings: &mut Vec<String>,
) -> Result<()> {
    let mut rounds = OnDevice::new();
    for attempt in attempts {
        let mut round = 0;
        queues.run(warnings, |queue| {
            let rounds = rounds.get(queue, |queue| Rounds::new(queue, scene))?;
            attempt.rounds(queue, rounds, &mut round)
        })?;
    }
    Ok(())
}

/// The best attempt: with the least energy, of those that look for few regions first the one with the fewest; the earlier of
/// equals.
fn best<'s, 'b>(mut attempts: Vec<Attempt<'s, 'b>>, goal: Goal) -> Attempt<'s, 'b> {
    let regions = |attempt: &Attempt<'_, '_>| match goal {
        Goal::Regions(_) => 0,
        _ => attempt.regions.count(),
    };
    let best = (attempts.iter())
        .min_by(|a, b| {
            let by_count = regions(a).cmp(&regions(b));
            by_count.then(a.regions.energy().total_cmp(&b.regions.energy())).then(a.index.cmp(&b.index))
        })
        .map_or(0, |attempt| attempt.index);
    let mut best = attempts.swap_remove(best);
    best.energies.push(best.regions.energy());
    best
}

/// What the regions are like on the whole.
fn proxies(scene: &Scene<'_>, regions: &Labeling) -> Vec<Proxy> {
    let members = Members::new(regions);
    let square = (scene.surface.diagonal / 2.0).powi(2);
    let proxy = |(region, sum)| {
        let (point, normal) = plane(scene, sum, members.of(region));
        Proxy { normal, point, area: sum.area * square, energy: sum.energy() }
    };
    (0..).zip(&regions.sums).map(proxy).collect()
}
