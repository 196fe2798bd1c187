//! Where it is done, how often it is tried, and what came of it.

use std::time::Instant;

use rayon::prelude::*;

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};

use super::super::labels::Partition;
use super::super::surface::Surface;
use super::attempt::{Attempt, Watch};
use super::goals::{first_count, plane};
use super::regions::Regions;
use super::rounds::Rounds;
use super::scene::Scene;
use super::split::Members;
use super::{Goal, OnPass, Options, Proxy, Solver, Vsa};

/// Partitions a surface on `device`; the calling thread belongs to its pool.
///
/// # Errors
/// [`Error::Parameter`] for an option out of range.
pub fn partition(
    surface: &Surface,
    options: &Options,
    device: &Device,
    on_pass: Option<&mut OnPass<'_>>,
) -> Result<Vsa> {
    options.check()?;
    let clock = Instant::now();
    // One that was taken by itself would not gain: most of the work is the host's.
    let mut run = Run { device, gpu: device.gpu_queue().filter(|_| !device.is_auto()), vsa: Vsa::default() };
    let scene = run.measure(surface)?;
    run.vsa.seconds.measure = clock.elapsed().as_secs_f64();
    let count = run.first_count(&scene, options.goal);
    let watch = Watch::new(on_pass);
    let attempts = run.attempts(&scene, options, &watch, count)?;
    run.vsa.is_cancelled = watch.is_cancelled();
    run.vsa.seconds.solve = clock.elapsed().as_secs_f64() - run.vsa.seconds.measure;
    Ok(run.finish(&scene, attempts, options.goal))
}

/// What is known so far.
struct Run<'a> {
    device: &'a Device,
    /// The queue of a GPU, while it works.
    gpu: Option<Queue>,
    vsa: Vsa,
}

impl Run<'_> {
    /// Measures the surface; a GPU that fails gives way to the host.
    fn measure<'s>(&mut self, surface: &'s Surface) -> Result<Scene<'s>> {
        if let Some(queue) = &mut self.gpu {
            match Scene::new(queue, surface) {
                Err(reason @ (Error::Device(_) | Error::Limit(_))) => self.fall_back(&reason),
                result => return result,
            }
        }
        Scene::new(&mut self.device.cpu_queue(), surface)
    }

    /// Goes on without the GPU.
    fn fall_back(&mut self, reason: &Error) {
        self.vsa.warnings.push(fallback(reason));
        if let Some(queue) = self.gpu.take() {
            self.count_moved(&queue);
        }
    }

    fn count_moved(&mut self, queue: &Queue) {
        self.vsa.bytes_moved += queue.bytes_moved();
        self.vsa.seconds.transfer += queue.time_moving().as_secs_f64();
    }

    /// How many regions to begin with.
    fn first_count(&mut self, scene: &Scene<'_>, goal: Goal) -> usize {
        let Goal::Regions(count) = goal else { return first_count(scene.fewest_regions(), scene) };
        let fewest = scene.fewest_regions();
        if count >= fewest {
            return count;
        }
        let (closed, taken) =
            (scene.is_closed.iter().filter(|&&is_closed| is_closed).count(), scene.regions_beside(count));
        self.vsa.warnings.push(format!(
            "{taken} regions instead of {count}: the surface has {} parts, {closed} of them closed, which take two",
            scene.is_closed.len()
        ));
        taken
    }

    /// Every attempt, to its end.
    fn attempts<'s, 'b>(
        &mut self,
        scene: &'s Scene<'s>,
        options: &'s Options,
        watch: &'s Watch<'b>,
        count: usize,
    ) -> Result<Vec<Attempt<'s, 'b>>> {
        let mut attempts: Vec<Attempt<'s, 'b>> =
            (0..options.restarts).map(|index| Attempt::new(scene, options, watch, index)).collect();
        let each = |attempts: &mut Vec<Attempt<'s, 'b>>, work: &(dyn Fn(&mut Attempt<'s, 'b>) + Sync)| {
            attempts.par_iter_mut().with_max_len(1).for_each(work);
        };
        if options.solver == Solver::Lloyd {
            each(&mut attempts, &|attempt| attempt.iterate(count));
        } else {
            each(&mut attempts, &|attempt| attempt.start(count));
        }
        if options.solver == Solver::Rounds {
            self.rounds(scene, &mut attempts)?;
        }
        let limit = |limit| scene.surface.frame.length_to_rows(limit);
        match options.goal {
            Goal::Regions(_) if options.solver == Solver::Lloyd => {}
            Goal::Regions(_) => each(&mut attempts, &|attempt| attempt.improve()),
            Goal::Energy(most) => each(&mut attempts, &|attempt| attempt.reach_energy(most, scene.fewest_regions())),
            Goal::Deviation(most) => each(&mut attempts, &|attempt| attempt.reach_deviation(limit(most))),
        }
        Ok(attempts)
    }

    /// The parallel rounds of every attempt, one after the other; the host goes on where a GPU fails.
    fn rounds(&mut self, scene: &Scene<'_>, attempts: &mut [Attempt<'_, '_>]) -> Result<()> {
        let mut on = None;
        for attempt in attempts {
            let mut round = 0;
            loop {
                let (result, was_on_gpu) = match &mut on {
                    None => {
                        let queue = self.gpu.take();
                        let was_on_gpu = queue.is_some();
                        let made = Rounds::new(queue.unwrap_or_else(|| self.device.cpu_queue()), scene);
                        (made.map(|rounds| on = Some(rounds)), was_on_gpu)
                    }
                    Some(rounds) => (attempt.rounds(rounds, &mut round), !rounds.queue.is_on_host()),
                };
                match result {
                    Ok(()) if round > 0 => break,
                    Ok(()) => {}
                    Err(reason @ (Error::Device(_) | Error::Limit(_))) if was_on_gpu => {
                        self.gpu = on.take().map(|rounds: Rounds| rounds.queue);
                        self.fall_back(&reason);
                    }
                    Err(reason) => return Err(reason),
                }
            }
        }
        self.gpu = on.map(|rounds| rounds.queue).filter(|queue| !queue.is_on_host());
        Ok(())
    }

    /// Keeps the best attempt: with the least energy, of those that look for few regions first the one with the fewest; the
    /// earlier of equals.
    fn finish(mut self, scene: &Scene<'_>, mut attempts: Vec<Attempt<'_, '_>>, goal: Goal) -> Vsa {
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
        let Attempt { regions, mut energies, index, .. } = attempts.swap_remove(best);
        energies.push(regions.energy());
        if let Some(queue) = self.gpu.take() {
            self.count_moved(&queue);
            self.vsa.on_gpu = true;
        }
        Vsa {
            proxies: proxies(scene, &regions),
            partition: Partition { region_count: regions.count(), labels: regions.labels },
            energies,
            attempt: index,
            ..self.vsa
        }
    }
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
