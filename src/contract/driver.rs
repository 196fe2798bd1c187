//! The loop: evaluate, select, commit, compact, until the budget is met.

use std::time::Instant;

use crate::backend::{Buffer, Device, Queue, fallback};
use crate::error::Result;
use crate::kernel::rows::{Candidate, Contraction, HUB, LOCKED, SEAM};
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome, Phases, Progress, RoundRecord, StopReason};

use super::carry::MOVED_FROM;
use super::commit::{Committed, Committer, Quota, Spent};
use super::evaluate::{Evaluation, Gate, Round, plane_sums};
use super::examine::Rules;
use super::fit::{Shape, fit};
use super::fit_guard::Guard;
use super::history::{History, became};
use super::join::Joins;
use super::prepare::{Prepared, prepare};
use super::quadrics::QuadricRecord;
use super::quantize::{Storage, quantize};
use super::record::Recorder;
use super::restore::restore;
use super::surface::{Start, Surface};
use super::triangle::in_two_steps;
use super::triangles::Triangles;
use super::weigh::{start_weights, weigh_start};
use super::{Candidates, Metric, Options, Placement};

/// Live faces below which a GPU hands over to the CPU: a round there costs more than its work.
const HANDOVER_FACES: usize = 20_000;
/// The same for software, which shares the CPU's cores and never gains: it does the bulk and leaves the many small rounds.
const SOFTWARE_HANDOVER_FACES: usize = 250_000;
/// Faces from which a GPU that was taken by itself is used: below, its kernels are not even loaded when the CPU is done.
const AUTO_FACES: usize = 100_000;
/// Share of the live pairs that the `volume` metric lets through the gate. 15 % loses nothing but rounds.
const VOLUME_SHARE: f64 = 0.5;
/// Live faces from which that share holds. Below it falls with them, to a fifth: rounds are cheap there, and with few
/// faces left every contraction counts (fandisk at 128: 5.5 % above the serial order without, 2.4 % with).
const WIDE_FACES: f64 = 20_000.0;
const LEAST_SHARE: f64 = 0.2;
/// The same for `plane`, whose accumulated costs grow as neighbors contract.
const PLANE_SHARE: f64 = 0.15;
/// Candidates for every contraction still needed.
const CANDIDATES_EACH: f64 = 1.5;
/// The same of triangles, each of which has a corner in common with a dozen others.
const TRIANGLES_EACH: f64 = 4.0;
/// A round that contracts less than this share of its candidates widens the gate of the next.
const MEAGER: f64 = 0.05;
/// A gate this many times wider than usual lets every pair through.
const FULL: f64 = 64.0;
/// Where rounds are evaluated: on the host's own surface, or on a GPU's copy of it.
struct Evaluator {
    queue: Queue,
    /// The GPU's copy; `None` on the host.
    copy: Option<(Surface, Buffer<Contraction>)>,
    evaluation: Evaluation,
    /// Where triangles are contracted.
    triangles: Option<Triangles>,
}

impl Evaluator {
    fn on_host(mut queue: Queue, host: &Surface, options: &Options, has_border: bool) -> Result<Self> {
        let evaluation = Evaluation::new(&mut queue, host, options, has_border)?;
        let triangles = Triangles::new(&mut queue, host, options)?;
        Ok(Self { queue, copy: None, evaluation, triangles })
    }

    fn on_gpu(
        mut queue: Queue,
        host: &Surface,
        options: &Options,
        has_border: bool,
        weights: &mut Vec<f32>,
        storage: Option<Storage>,
    ) -> Result<Self> {
        let mut surface = Surface::copy(&mut queue, host, options.metric == Metric::Plane)?;
        plane_sums(&mut queue, &mut surface, options)?;
        start_weights(&mut queue, &surface, options, has_border, weights)?;
        weigh_start(&mut queue, &mut surface, weights)?;
        quantize(&mut queue, &mut surface, storage)?;
        let evaluation = Evaluation::new(&mut queue, &surface, options, has_border)?;
        let triangles = Triangles::new(&mut queue, &surface, options)?;
        let contractions = queue.buffer(surface.vertex_count / 2 + 1)?;
        Ok(Self { queue, copy: Some((surface, contractions)), evaluation, triangles })
    }

    fn is_gpu(&self) -> bool {
        self.copy.is_some()
    }

    fn evaluate(&mut self, host: &Surface, round: Round<'_>, candidates: &mut Vec<Candidate>) -> Result<usize> {
        let surface = self.copy.as_ref().map_or(host, |(surface, _)| surface);
        if let (Candidates::Triangles, Some(triangles)) = (round.of, &mut self.triangles) {
            return triangles.run(&mut self.queue, surface, round.gate, candidates);
        }
        self.evaluation.run(&mut self.queue, surface, round, candidates)
    }

    /// Applies a round's contractions to the GPU's copy, which had so many vertices and faces.
    fn follow_round(&mut self, committed: &Committed, of: Candidates, [vertices, faces]: [usize; 2]) -> Result<()> {
        let Committed { contractions, faces_removed, by_first_steps, .. } = committed;
        let vertices_left = vertices - contractions.len();
        if of == Candidates::Triangles && self.is_gpu() {
            let [first, second] = in_two_steps(contractions);
            self.follow(&first, vertices_left + second.len(), faces - by_first_steps)?;
            return self.follow(&second, vertices_left, faces - faces_removed);
        }
        self.follow(contractions, vertices_left, faces - faces_removed)
    }

    /// Applies contractions to the GPU's copy.
    fn follow(&mut self, contractions: &[Contraction], vertices_left: usize, faces_left: usize) -> Result<()> {
        let Some((surface, list)) = &mut self.copy else { return Ok(()) };
        self.queue.write(list, contractions)?;
        surface.replay(&mut self.queue, list, contractions.len())?;
        surface.compact(&mut self.queue, vertices_left, faces_left)?;
        // Now, so that it works while the host compacts.
        self.queue.submit()
    }
}

/// Runs rounds on `device`; the calling thread belongs to its pool.
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    let clock = Instant::now();
    let target = budget.target_faces(mesh.faces.len())?;
    let prepared = prepare(mesh, options)?;
    let max_deviation = prepared.frame.length_to_rows(budget.max_deviation(mesh.diagonal())?);
    let recorder = options.log.then(|| Recorder::new(mesh, &prepared));
    let mut run = Run { recorder, ..Run::new(prepared, options, device, max_deviation)? };
    run.seconds.build = clock.elapsed().as_secs_f64() - run.seconds.weld;

    let stop = loop {
        if run.host.face_count <= target {
            break StopReason::FacesReached;
        }
        let (pairs, committed) = run.round(target)?;
        if committed.contractions.is_empty() && run.widening >= FULL && run.of == Candidates::Triangles {
            (run.of, run.widening) = (Candidates::Pairs, 1.0);
            continue;
        }
        if committed.contractions.is_empty() && run.widening >= FULL {
            let limited = committed.blocked.error > 0;
            run.count_locked();
            break if limited { StopReason::ErrorReached } else { StopReason::Stuck };
        }
        run.adapt(&committed);
        let now = Progress { faces: run.host.face_count, faces_in: mesh.faces.len(), target };
        if pairs > 0 && progress.as_mut().is_some_and(|report| report(now).is_break()) {
            break StopReason::Cancelled;
        }
    };
    run.fit();
    run.finish(mesh, target, stop, clock)
}

/// The state of a run between rounds.
struct Run<'a> {
    options: &'a Options,
    device: &'a Device,
    prepared: Prepared,
    host: Surface,
    host_queue: Queue,
    evaluator: Evaluator,
    committer: Committer,
    rules: Rules,
    /// What rounds contract from here on.
    of: Candidates,
    joins: Joins,
    /// The original and what became of its vertices, for the fit.
    history: Option<(Start, History)>,
    recorder: Option<Recorder<'a>>,
    quadrics: Option<QuadricRecord>,
    handover_faces: usize,
    candidates: Vec<Candidate>,
    /// How many times wider than usual the gate is.
    widening: f64,
    /// Greatest estimated deviation of a contraction so far, in the normalized frame.
    deviation: f32,
    rounds: Vec<RoundRecord>,
    seconds: Phases,
    /// By queues that are gone.
    bytes_moved: u64,
    warnings: Vec<String>,
}

impl<'a> Run<'a> {
    fn new(mut prepared: Prepared, options: &'a Options, device: &'a Device, max_deviation: f64) -> Result<Self> {
        let mut host_queue = device.cpu_queue();
        let start = prepared.take_start();
        let fits = options.fit > 0 && options.placement == Placement::Optimal;
        let history = fits.then(|| (start.clone(), History::default()));
        let storage = Storage::new(options, &start.positions, prepared.frame)?;
        let mut host = Surface::new(&mut host_queue, start, true)?;
        let clock = Instant::now();
        plane_sums(&mut host_queue, &mut host, options)?;
        let summing = clock.elapsed().as_secs_f64();
        let weights = &mut prepared.carried.weights;
        let mut warnings = std::mem::take(&mut prepared.warnings);
        let gains = !device.is_auto() || host.face_count >= AUTO_FACES;
        let gpu_queue = || device.gpu_queue().filter(|_| gains);
        // The host alone lists pairs without an edge.
        let on_gpu = gpu_queue()
            .filter(|_| !options.joins())
            .map(|queue| Evaluator::on_gpu(queue, &host, options, prepared.has_border, weights, storage));
        let evaluator = match on_gpu {
            Some(Ok(evaluator)) => evaluator,
            Some(Err(reason)) => {
                warnings.push(fallback(&reason));
                Evaluator::on_host(device.cpu_queue(), &host, options, prepared.has_border)?
            }
            None => Evaluator::on_host(device.cpu_queue(), &host, options, prepared.has_border)?,
        };
        start_weights(&mut host_queue, &host, options, prepared.has_border, weights)?;
        if options.metric == Metric::Plane {
            weigh_start(&mut host_queue, &mut host, weights)?;
            weights.clear();
        }
        let quadrics = quantize(&mut host_queue, &mut host, storage)?
            .map(|record| QuadricRecord { secs: summing + record.secs, ..record });
        let rules = Rules::new(options, max_deviation);
        let delta = prepared.frame.length_to_rows(options.join_within) as f32;
        let mut bytes_moved = 0;
        let mut find = |mut queue: Queue| {
            let joins = Joins::find(&mut queue, host.positions.host(), host.faces.host(), delta);
            bytes_moved += queue.bytes_moved();
            joins
        };
        let joins = match gpu_queue().filter(|_| options.joins()).map(&mut find) {
            Some(Ok(joins)) => joins,
            Some(Err(reason)) => {
                warnings.push(fallback(&reason));
                find(device.cpu_queue())?
            }
            None => find(device.cpu_queue())?,
        };
        Ok(Self {
            options,
            device,
            committer: Committer::new(rules),
            rules,
            of: options.candidates,
            joins,
            history,
            recorder: None,
            quadrics,
            handover_faces: handover_faces(device).min(host.face_count / 4),
            seconds: Phases { weld: prepared.weld_secs, ..Phases::default() },
            prepared,
            host,
            host_queue,
            evaluator,
            candidates: Vec::new(),
            widening: 1.0,
            deviation: 0.0,
            rounds: Vec::new(),
            bytes_moved,
            warnings,
        })
    }

    /// Evaluates, selects, commits and compacts once; returns the live pairs there were and what was committed.
    fn round(&mut self, target: usize) -> Result<(usize, Committed)> {
        let clock = Instant::now();
        let faces = self.host.face_count;
        if self.evaluator.is_gpu() && faces < self.handover_faces {
            self.take_over()?;
        }
        if faces - target < self.of.most_faces() {
            self.of = Candidates::Pairs;
        }
        let before = self.evaluator.queue.time_moving();
        let pairs = self.evaluate(self.gate(faces - target))?;
        let moved = self.evaluator.queue.time_moving().saturating_sub(before).as_secs_f64();
        let on_gpu = self.evaluator.is_gpu();
        let evaluated = clock.elapsed().as_secs_f64();
        let candidates = self.candidates.len();
        let (committed, spent) = self.commit(faces - target);
        let committed_at = clock.elapsed().as_secs_f64();
        let faces_left = faces - committed.faces_removed;
        let mut moved_up = 0.0;
        if !committed.contractions.is_empty() {
            let before = self.evaluator.queue.time_moving();
            let counts = [self.host.vertex_count, faces];
            if let Err(reason) = self.evaluator.follow_round(&committed, self.of, counts) {
                self.warnings.push(fallback(&reason));
                self.evaluator.copy = None;
            }
            moved_up = self.evaluator.queue.time_moving().saturating_sub(before).as_secs_f64();
            let vertices = self.host.vertex_count;
            self.host.kill(committed.cancelled.iter().map(|cancelled| cancelled.face));
            self.host.compact_on_host(&self.host_queue, &mut self.prepared.carried, faces_left)?;
            let new_vertex = &self.host.new_vertex()[..vertices];
            if let Some((_, history)) = &mut self.history {
                history.follow(&committed.contractions, new_vertex);
            }
            if !self.joins.pairs().is_empty() {
                let faces = &self.host.faces.host()[..faces_left];
                self.joins.follow(&became(&committed.contractions, new_vertex), faces);
            }
            if on_gpu && !self.evaluator.is_gpu() {
                self.take_over()?;
            }
        }
        self.seconds.cost += evaluated - moved;
        self.seconds.transfer += moved + moved_up;
        let [select, filter, apply] = shares(spent, committed_at - evaluated);
        self.seconds.select += select;
        self.seconds.filter += filter;
        self.seconds.apply += apply + clock.elapsed().as_secs_f64() - committed_at - moved_up;
        self.deviation = self.deviation.max(committed.deviation);
        self.rounds.push(RoundRecord {
            faces: faces as u64,
            pairs: pairs as u64,
            candidates: candidates as u64,
            contracted: committed.contractions.len() as u64,
            blocked: committed.blocked,
            greatest_cost: f32::from_bits(committed.greatest_key),
            on_gpu,
        });
        Ok((pairs, committed))
    }

    fn commit(&mut self, to_remove: usize) -> (Committed, Spent) {
        // With every pair let through and nothing contracted, there is no later round to wait for.
        let may_wait = self.widening < FULL;
        let may_overshoot = self.widening >= FULL || !self.prepared.has_border;
        let quota = Quota { faces: to_remove, of: self.of, may_overshoot };
        let (carried, joins) = (&mut self.prepared.carried, self.joins.pairs());
        let before = self.recorder.as_ref().map(|_| carried.origin.clone());
        let done = self.committer.commit(&mut self.host, carried, &mut self.candidates, joins, quota, may_wait);
        if let (Some(recorder), Some(mut before)) = (&mut self.recorder, before) {
            recorder.record(&done.0, &mut before, carried);
        }
        done
    }

    /// Adds to the last round's refusals the edges that were no pairs: between locked vertices, and at hubs.
    fn count_locked(&mut self) {
        let positions = self.host.positions.host();
        let flags = |side: [u32; 2]| side.map(|v| positions[v as usize].flags);
        let is_seam = |&[a, b]: &[u32; 2]| a & b & SEAM != 0;
        let is_held = |&[a, b]: &[u32; 2]| a & b & LOCKED != 0 || (a | b) & HUB != 0;
        let faces = &self.host.faces.host()[..self.host.face_count];
        let sides = || faces.iter().flat_map(|f| [[f.a, f.b], [f.b, f.c], [f.c, f.a]].map(flags));
        let (held, seams) = (sides().filter(is_held).count(), sides().filter(is_seam).count());
        if let Some(round) = self.rounds.last_mut() {
            // An edge is a side of two faces.
            round.blocked.lock = (held - seams).div_ceil(2) as u64;
            round.blocked.seam = seams.div_ceil(2) as u64;
        }
    }

    /// Fills the candidates; a device that fails gives way to the host.
    fn evaluate(&mut self, gate: Gate) -> Result<usize> {
        self.candidates.clear();
        let of = self.of;
        let round = Round { of, joins: self.joins.pairs(), gate, weights: &mut self.prepared.carried.weights };
        match self.evaluator.evaluate(&self.host, round, &mut self.candidates) {
            Err(reason) if self.evaluator.is_gpu() => {
                self.warnings.push(fallback(&reason));
                self.take_over()?;
                self.candidates.clear();
                let round = Round { of, joins: self.joins.pairs(), gate, weights: &mut self.prepared.carried.weights };
                self.evaluator.evaluate(&self.host, round, &mut self.candidates)
            }
            result => result,
        }
    }

    /// Goes on on the host from here.
    fn take_over(&mut self) -> Result<()> {
        let queue = self.device.cpu_queue();
        self.bytes_moved += self.evaluator.queue.bytes_moved();
        self.evaluator = Evaluator::on_host(queue, &self.host, self.options, self.prepared.has_border)?;
        Ok(())
    }

    fn gate(&self, faces_to_remove: usize) -> Gate {
        if self.widening >= FULL {
            return Gate { share: 1.0, most: usize::MAX };
        }
        let share = match self.options.metric {
            Metric::Volume => VOLUME_SHARE * (self.host.face_count as f64 / WIDE_FACES).clamp(LEAST_SHARE, 1.0),
            Metric::Plane => PLANE_SHARE,
        };
        let needed = faces_to_remove.div_ceil(self.of.most_faces()) as f64;
        let each = match self.of {
            Candidates::Pairs => CANDIDATES_EACH,
            Candidates::Triangles => TRIANGLES_EACH,
        };
        Gate { share: (share * self.widening).min(1.0), most: (each * needed * self.widening).ceil() as usize }
    }

    /// Widens the gate after a round that mostly met refusals, narrows it again after a good one.
    fn adapt(&mut self, committed: &Committed) {
        if committed.contractions.is_empty() {
            self.widening = FULL;
        } else if (committed.contractions.len() as f64)
            < MEAGER * self.rounds.last().map_or(0.0, |round| round.candidates as f64)
        {
            self.widening = (self.widening * 4.0).min(FULL);
        } else {
            self.widening = (self.widening / 4.0).max(1.0);
        }
    }

    /// Fits the vertices of the result to the original, where asked for: on the GPU if that evaluated a round.
    fn fit(&mut self) {
        let Some((original, history)) = self.history.take() else { return };
        let clock = Instant::now();
        let owners = history.owners(original.positions.len());
        let (vertices, faces) = (self.host.vertex_count, self.host.face_count);
        let shape = Shape {
            faces: &self.host.faces.host()[..faces],
            ring_starts: &self.host.ring_starts.host()[..=vertices],
            ring_faces: &self.host.ring_faces.host()[..3 * faces],
        };
        let guard = Guard { limits: self.rules.limits };
        let mut positions = self.host.positions.host()[..vertices].to_vec();
        let mut left = self.options.fit;
        let mut on = |mut queue: Queue, original: Start| {
            fit(&mut queue, original, &owners, shape, &mut positions, &mut left, &guard)
        };
        let gpu = self.device.gpu_queue().filter(|_| self.rounds.iter().any(|round| round.on_gpu));
        let on_gpu = gpu.map(|queue| on(queue, original.clone()));
        if let Some(Err(reason)) = &on_gpu {
            self.warnings.push(fallback(reason));
        }
        if !matches!(on_gpu, Some(Ok(())))
            && let Err(reason) = on(self.device.cpu_queue(), original)
        {
            self.warnings.push(format!("the result is not fitted: {reason}"));
        }
        let moved = self.host.positions.host_mut().iter_mut().zip(positions);
        for ((before, after), origin) in moved.zip(&mut self.prepared.carried.origin) {
            if *before != after {
                *before = after;
                *origin |= MOVED_FROM;
            }
        }
        self.seconds.fit = clock.elapsed().as_secs_f64();
    }

    fn finish(mut self, input: &Mesh, target: usize, stop: StopReason, clock: Instant) -> Result<Outcome> {
        let Prepared { frame, carried, .. } = self.prepared;
        let faces = &self.host.faces.host()[..self.host.face_count];
        let (mesh, vertex_origin) = restore(input, frame, self.host.positions.host(), faces, carried);
        self.seconds.total = clock.elapsed().as_secs_f64();
        let mut device = self.device.description();
        if self.device.is_gpu() && !self.rounds.iter().any(|round| round.on_gpu) {
            device = self.device.cpu_description();
        }
        Ok(Outcome {
            mesh,
            vertex_origin,
            faces_in: input.faces.len(),
            target,
            stop,
            blocked: self.rounds.last().map(|round| round.blocked).unwrap_or_default(),
            error_estimate: frame.length_to_model(f64::from(self.deviation)),
            flips: 0,
            cell_size: None,
            quadrics: self.quadrics,
            log: self.recorder.map(Recorder::into_log),
            rounds: self.rounds,
            seconds: self.seconds,
            bytes_moved: self.bytes_moved + self.evaluator.queue.bytes_moved(),
            device,
            warnings: self.warnings,
        })
    }
}

/// The wall-clock seconds of a commit split as its tasks spent theirs: ordering, examining, contracting.
fn shares(spent: Spent, secs: f64) -> [f64; 3] {
    let total = spent.total.as_secs_f64().max(f64::MIN_POSITIVE);
    let share = |part: std::time::Duration| (part.as_secs_f64() / total).min(1.0) * secs;
    let (select, filter) = (share(spent.sorting), share(spent.examining));
    [select, filter, (secs - select - filter).max(0.0)]
}

fn handover_faces(device: &Device) -> usize {
    if device.is_software() { SOFTWARE_HANDOVER_FACES } else { HANDOVER_FACES }
}
