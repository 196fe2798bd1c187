//! Where it is done, how often it is tried, and what came of it.

use std::time::Instant;

use rayon::prelude::*;

use crate::backend::Device;
use crate::error::Result;

use super::super::labels::Partition;
use super::super::queues::Queues;
use super::super::surface::Surface;
use super::attempt::{Attempt, Watch};
use super::goals::{self, plane};
use super::regions::Regions;
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
    let mut queues = Queues::new(device);
    let mut vsa = partition_on(&mut queues, surface, options, on_pass)?;
    vsa.on_gpu = queues.is_on_gpu();
    vsa.bytes_moved = queues.bytes_moved();
    vsa.seconds.transfer = queues.seconds_moving();
    Ok(vsa)
}

/// [`partition`] on these queues, which know where it was done and what was moved.
pub fn partition_on(
    queues: &mut Queues,
    surface: &Surface,
    options: &Options,
    on_pass: Option<&mut OnPass<'_>>,
) -> Result<Vsa> {
    options.check()?;
    let clock = Instant::now();
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
        seconds: Seconds { measure, solve: clock.elapsed().as_secs_f64() - measure, transfer: 0.0 },
        warnings,
        ..Vsa::default()
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
    // On the host, or on the GPU.
    let mut made: Option<(bool, Rounds)> = None;
    for attempt in attempts {
        let mut round = 0;
        queues.run(warnings, |queue| {
            let on_host = queue.is_on_host();
            let rounds = match made.take().filter(|made| made.0 == on_host) {
                Some((_, rounds)) => rounds,
                None => Rounds::new(queue, scene)?,
            };
            let (_, rounds) = made.insert((on_host, rounds));
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
fn proxies(scene: &Scene<'_>, regions: &Regions) -> Vec<Proxy> {
    let members = Members::new(regions);
    let square = (scene.surface.diagonal / 2.0).powi(2);
    let proxy = |(region, sum)| {
        let (point, normal) = plane(scene, sum, members.of(region));
        Proxy { normal, point, area: sum.area * square, energy: sum.energy() }
    };
    (0..).zip(&regions.sums).map(proxy).collect()
}
