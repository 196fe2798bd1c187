//! The loop: evaluate, remove an independent set, compact, until the budget is met.

use std::time::Instant;

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, Phases, Progress, RoundRecord, StopReason};

use super::Options;
use super::commit::{Committed, Quota, Task, commit};
use super::evaluate::{Evaluated, Gate, evaluate};
use super::examine::Rules;
use super::prepare::{Prepared, prepare, restore};

/// Share of the vertices that may go that pass the gate. All of them lead to 1.1 … 4 times the error at 10 %, a tenth to as much
/// on a CAD part.
const SHARE: f64 = 0.25;
/// Candidates for every removal still needed: about one in three has no neighbor that goes before.
const CANDIDATES_EACH: f64 = 3.0;
/// A round that removes less than this share of its candidates widens the gate of the next.
const MEAGER: f64 = 0.05;
/// A gate this many times wider than usual lets every vertex through.
const FULL: f64 = 64.0;

/// Removes vertices with `device`; the calling thread belongs to its pool.
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    let clock = Instant::now();
    let target = budget.target_faces(mesh.faces.len())?;
    let max_deviation = budget.max_deviation(mesh.diagonal())?;
    let mut host = device.cpu_queue();
    let prepared = prepare(mesh, options, &mut host)?;
    let rules = Rules::new(options, prepared.frame.length_to_rows(max_deviation));
    let mut run = Run::new(prepared, rules, device, host);
    run.seconds.build = clock.elapsed().as_secs_f64() - run.seconds.weld;

    let stop = loop {
        if run.prepared.surface.face_count() <= target {
            break StopReason::FacesReached;
        }
        let committed = run.round(target)?;
        if committed.vertices == 0 && run.widening >= FULL {
            break if committed.blocked.error > 0 { StopReason::ErrorReached } else { StopReason::Stuck };
        }
        run.adapt(&committed);
        let now = Progress { faces: run.prepared.surface.face_count(), faces_in: mesh.faces.len(), target };
        if progress.as_mut().is_some_and(|report| report(now).is_break()) {
            break StopReason::Cancelled;
        }
    };
    Ok(run.finish(mesh, target, stop, clock))
}

/// The state of a run between rounds.
struct Run<'a> {
    prepared: Prepared,
    rules: Rules,
    device: &'a Device,
    host: Queue,
    /// The queue of a GPU, while it works.
    gpu: Option<Queue>,
    /// How many times wider than usual the gate is.
    widening: f64,
    /// Greatest distance of a sample to its face, or of an edge to the surface of the start, in the frame.
    deviation: f64,
    rounds: Vec<RoundRecord>,
    seconds: Phases,
    /// By queues that are gone.
    bytes_moved: u64,
}

impl<'a> Run<'a> {
    fn new(prepared: Prepared, rules: Rules, device: &'a Device, host: Queue) -> Self {
        Self {
            seconds: Phases { weld: prepared.weld_secs, ..Phases::default() },
            // One that was taken by itself would not gain: costs are a tenth of the work.
            gpu: device.gpu_queue().filter(|_| !device.is_auto()),
            prepared,
            rules,
            device,
            host,
            widening: 1.0,
            deviation: 0.0,
            rounds: Vec::new(),
            bytes_moved: 0,
        }
    }

    /// Evaluates and removes once.
    fn round(&mut self, target: usize) -> Result<Committed> {
        let clock = Instant::now();
        let faces = self.prepared.surface.face_count();
        let on_gpu = self.gpu.is_some();
        let before = self.time_moving();
        let found = self.evaluate(faces - target)?;
        let evaluated = clock.elapsed().as_secs_f64();
        let moved = self.time_moving() - before;
        let Prepared { surface, samples, has_border, .. } = &mut self.prepared;
        let vertices = surface.vertex_count();
        let may_overshoot = self.widening >= FULL || !*has_border;
        let quota = Quota { faces: faces - target, may_overshoot };
        let task = Task { evaluated: &found, rules: &self.rules, quota };
        let mut committed = commit(surface, samples, &mut self.host, task)?;
        if committed.vertices == 0 && self.widening >= FULL {
            committed.blocked.lock = (vertices - found.removable) as u64;
        }
        self.seconds.cost += (evaluated - moved).max(0.0);
        self.seconds.apply += clock.elapsed().as_secs_f64() - evaluated;
        self.deviation = self.deviation.max(committed.deviation);
        self.rounds.push(RoundRecord {
            faces: faces as u64,
            pairs: found.removable as u64,
            candidates: found.candidates.len() as u64,
            contracted: committed.vertices as u64,
            blocked: committed.blocked,
            greatest_cost: f32::from_bits(committed.greatest_key),
            on_gpu: on_gpu && self.gpu.is_some(),
        });
        Ok(committed)
    }

    /// Seconds spent moving bytes so far.
    fn time_moving(&self) -> f64 {
        self.seconds.transfer + self.gpu.as_ref().map_or(0.0, |queue| queue.time_moving().as_secs_f64())
    }

    /// Finds the candidates; a GPU that fails gives way to the host.
    fn evaluate(&mut self, faces_to_remove: usize) -> Result<Evaluated> {
        let gate = self.gate(faces_to_remove);
        let (surface, rules, round) = (&self.prepared.surface, &self.rules, self.rounds.len() as u32);
        if let Some(queue) = &mut self.gpu {
            match evaluate(queue, surface, rules, gate, round) {
                Err(reason @ (Error::Device(_) | Error::Limit(_))) => {
                    self.prepared.warnings.push(fallback(&reason));
                    self.bytes_moved += queue.bytes_moved();
                    self.seconds.transfer += queue.time_moving().as_secs_f64();
                    self.gpu = None;
                }
                result => return result,
            }
        }
        evaluate(&mut self.host, surface, rules, gate, round)
    }

    fn gate(&self, faces_to_remove: usize) -> Gate {
        if self.widening >= FULL {
            return Gate { share: 1.0, most: usize::MAX };
        }
        // An inner vertex takes two faces with it.
        let needed = faces_to_remove.div_ceil(2) as f64;
        Gate {
            share: (SHARE * self.widening).min(1.0),
            most: (CANDIDATES_EACH * needed * self.widening).ceil() as usize,
        }
    }

    /// Widens the gate after a round that mostly met refusals, narrows it again after a good one.
    fn adapt(&mut self, committed: &Committed) {
        let candidates = self.rounds.last().map_or(0.0, |round| round.candidates as f64);
        if committed.vertices == 0 {
            self.widening = FULL;
        } else if (committed.vertices as f64) < MEAGER * candidates {
            self.widening = (self.widening * 4.0).min(FULL);
        } else {
            self.widening = (self.widening / 4.0).max(1.0);
        }
    }

    fn finish(mut self, input: &Mesh, target: usize, stop: StopReason, clock: Instant) -> Outcome {
        let Prepared { frame, surface, vertex_source, lowest, warnings, .. } = self.prepared;
        let (mesh, vertex_origin) = restore(input, &surface, &vertex_source, lowest.as_ref());
        if let Some(queue) = &self.gpu {
            self.bytes_moved += queue.bytes_moved();
            self.seconds.transfer += queue.time_moving().as_secs_f64();
        }
        self.seconds.total = clock.elapsed().as_secs_f64();
        let on_gpu = self.rounds.iter().any(|round| round.on_gpu);
        Outcome {
            mesh,
            vertex_origin,
            faces_in: input.faces.len(),
            target,
            stop,
            blocked: self.rounds.last().map_or_else(Blocked::default, |round| round.blocked),
            error_estimate: frame.length_to_model(self.deviation),
            flips: 0,
            cell_size: None,
            quadrics: None,
            log: None,
            regions: None,
            rounds: self.rounds,
            seconds: self.seconds,
            bytes_moved: self.bytes_moved,
            device: if on_gpu { self.device.description() } else { self.device.cpu_description() },
            warnings,
        }
    }
}
