//! The loop: evaluate, select, commit, compact, until every budget is met.

use std::time::{Duration, Instant};

use crate::backend::{Awake, Device, Queue, fallback};
use crate::error::Result;
use crate::kernel::rows::{Candidate, HUB, LOCKED, SEAM};
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome, Phases, Progress, RoundRecord, StopReason};

use super::apply::Left;
use super::carry::Carried;
use super::checkpoint::Checkpoints;
use super::commit::Committer;
use super::committed::Committed;
use super::evaluate::{Evaluation, Round, plane_sums};
use super::follower::{Follower, auto_faces, handover_faces};
use super::gate::Gate;
use super::history::{History, became};
use super::join::Joins;
use super::levels::{Goal, Levels};
use super::pace::{Pace, Tried};
use super::prepare::Prepared;
use super::quadrics::QuadricRecord;
use super::quantize::{Storage, quantize};
use super::record::Recorder;
use super::rules::Rules;
use super::surface::{Start, Surface};
use super::triangles::Triangles;
use super::weigh::{start_weights, weigh_start};
use super::{Candidates, Metric, Options, Placement};

/// What a run is given.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    pub mesh: &'a Mesh,
    pub options: &'a Options,
    pub budgets: &'a [Budget],
    pub device: &'a Device,
    /// When it began. What it has tried before counts as building.
    pub clock: Instant,
    /// The pool's other threads, to be roused before they have work.
    pub awake: &'a Awake,
    /// The estimated deviation, in the normalized frame, past which nobody wants the outcomes that are not there yet.
    pub worst_deviation: f64,
}

/// Runs rounds on a job's device; the calling thread belongs to its pool. Returns an outcome for each budget, but for those
/// that came to be farther off than the job's worst, or after the checkpoint that ends the run.
pub fn run(
    job: Job<'_>,
    prepared: Prepared,
    checkpoints: &mut Checkpoints,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Option<Outcome>>> {
    let Job { mesh, options, budgets, device, clock, awake, worst_deviation } = job;
    let levels = Levels::new(budgets, mesh, prepared.frame)?;
    let recorder = options.log.then(|| Recorder::new(mesh, &prepared));
    let mut run = Run { recorder, ..Run::new(mesh, prepared, options, device, levels, clock)? };
    run.seconds.build = clock.elapsed().as_secs_f64() - run.seconds.but_building();

    loop {
        let reached = run.levels.take_reached(run.host.face_count);
        run.make(reached, StopReason::FacesReached);
        let Some(goal) = run.levels.goal() else { break };
        awake.rouse();
        let (pairs, committed) = run.round(goal)?;
        if f64::from(run.deviation) > worst_deviation {
            break;
        }
        if committed.contracted == 0 && run.pace.is_full() && run.pace.of == Candidates::Triangles {
            run.pace.go_on_with_pairs();
            continue;
        }
        // Where every pair is refused, a wider gate has no other.
        let are_all_refused = run.pace.of == Candidates::Pairs && committed.blocked.refused() == pairs as u64;
        if committed.contracted == 0 && (run.pace.is_full() || are_all_refused) {
            run.count_locked();
            let (ended, stop) = match committed.blocked.error > 0 {
                true => (run.levels.take_limited(goal.max_deviation), StopReason::ErrorReached),
                false => (run.levels.take_all(), StopReason::Stuck),
            };
            run.make(ended, stop);
            run.pace.begin_level(options.candidates);
            continue;
        }
        if committed.contracted == 0 {
            run.widen(goal);
        } else if checkpoints.note(&run).is_break() {
            break;
        }
        let target = run.levels.last_target;
        let now = Progress { faces: run.host.face_count, faces_in: mesh.faces.len(), target };
        if pairs > 0 && progress.as_mut().is_some_and(|report| report(now).is_break()) {
            let reached = run.levels.take_reached(run.host.face_count);
            run.make(reached, StopReason::FacesReached);
            let left = run.levels.take_all();
            run.make(left, StopReason::Cancelled);
        }
    }
    let mut outcomes = vec![None; budgets.len()];
    run.made.into_iter().for_each(|(index, outcome)| outcomes[index] = Some(outcome));
    Ok(outcomes)
}

/// The state of a run between rounds.
pub struct Run<'a> {
    pub input: &'a Mesh,
    pub options: &'a Options,
    pub device: &'a Device,
    pub prepared: Prepared,
    pub levels: Levels,
    /// The outcomes of those that are met, each with the number of its budget.
    pub made: Vec<(usize, Outcome)>,
    pub host: Surface,
    host_queue: Queue,
    evaluation: Evaluation,
    /// Where triangles are contracted.
    triangles: Option<Triangles>,
    /// In place of the evaluation: the GPU's copy.
    pub follower: Option<Follower>,
    pub committer: Committer,
    pub rules: Rules,
    pub pace: Pace,
    pub joins: Joins,
    /// The original and what became of its vertices, for the fit.
    pub history: Option<(Start, History)>,
    pub recorder: Option<Recorder<'a>>,
    pub quadrics: Option<QuadricRecord>,
    handover_faces: usize,
    pub candidates: Vec<Candidate>,
    /// How many of them the round's commits have had at most.
    pub tried: usize,
    /// Greatest estimated deviation of a contraction so far, in the normalized frame.
    pub deviation: f32,
    pub rounds: Vec<RoundRecord>,
    pub clock: Instant,
    pub seconds: Phases,
    /// By queues that are gone.
    pub bytes_moved: u64,
    pub warnings: Vec<String>,
}

impl<'a> Run<'a> {
    /// At the start of a run.
    pub fn new(
        input: &'a Mesh,
        mut prepared: Prepared,
        options: &'a Options,
        device: &'a Device,
        levels: Levels,
        clock: Instant,
    ) -> Result<Self> {
        let mut host_queue = device.cpu_queue();
        let start = prepared.take_start();
        let fits = options.fit > 0 && options.placement == Placement::Optimal;
        let history = fits.then(|| (start.clone(), History::default()));
        let storage = Storage::new(options, &start.positions, prepared.frame)?;
        let host = Surface::new(&mut host_queue, start, options.metric == Metric::Plane)?;
        let triangles = Triangles::new(&host_queue, &host, options)?;
        let wedges = prepared.carried.wedges.as_ref();
        let evaluation = Evaluation::new(device.cpu_queue(), &host, options, prepared.border_vertices > 0, wedges)?;
        let rules = Rules::new(options, prepared.complex_yield, f64::INFINITY);
        let earlier = &mut prepared.earlier;
        let dearest = earlier.rounds.iter().map(|round| round.greatest_cost).fold(0.0, f32::max);
        let pace = earlier.pace.take().unwrap_or_else(|| Pace::new(options.candidates));
        let mut run = Self {
            input,
            options,
            device,
            committer: Committer::new(rules, earlier.vertices, (earlier.commits, dearest)),
            rules,
            pace,
            joins: Joins::default(),
            history,
            recorder: None,
            quadrics: None,
            handover_faces: handover_faces(device, earlier.faces),
            seconds: Phases { weld: prepared.weld_secs, ..earlier.seconds },
            host,
            host_queue,
            evaluation,
            triangles,
            follower: None,
            candidates: Vec::new(),
            tried: 0,
            deviation: earlier.deviation,
            rounds: std::mem::take(&mut earlier.rounds),
            clock,
            bytes_moved: earlier.bytes_moved,
            warnings: std::mem::take(&mut prepared.warnings),
            prepared,
            levels,
            made: Vec::new(),
        };
        if options.joins() {
            run.find_joins()?;
        } else if let Some(targets) = run.levels.targets_below(run.host.face_count).filter(|_| !run.rules.joins) {
            run.open_follower(run.heading(targets), storage);
        }
        run.start_quadrics(storage)?;
        Ok(run)
    }

    /// A queue on the GPU, if there is one that gains.
    fn gpu_queue(&self) -> Option<Queue> {
        let least_faces = auto_faces(rayon::current_num_threads());
        let gains = !self.device.is_auto() || self.prepared.earlier.faces >= least_faces;
        self.device.gpu_queue().filter(|_| gains)
    }

    /// Finds the pairs without an edge. The host alone lists them in rounds.
    fn find_joins(&mut self) -> Result<()> {
        let delta = self.prepared.frame.length_to_rows(self.options.join_within) as f32;
        let (positions, faces) = (self.host.positions.host(), self.host.faces.host());
        let mut bytes_moved = 0;
        let mut find = |mut queue: Queue| {
            let joins = Joins::find(&mut queue, positions, faces, delta);
            bytes_moved += queue.bytes_moved();
            joins
        };
        self.joins = match self.gpu_queue().map(&mut find) {
            Some(Ok(joins)) => joins,
            Some(Err(reason)) => {
                warn_once(&mut self.warnings, fallback(&reason));
                find(self.device.cpu_queue())?
            }
            None => find(self.device.cpu_queue())?,
        };
        self.bytes_moved += bytes_moved;
        Ok(())
    }

    /// Copies the surface to the GPU, if there is one that gains, and starts the first round there.
    fn open_follower(&mut self, target: usize, storage: Option<Storage>) {
        let faces = self.host.face_count;
        let Some(queue) = self.gpu_queue().filter(|_| faces >= self.handover_faces) else { return };
        let applies = self.device.options().replays.unwrap_or(!self.device.is_software());
        let gate = self.gate(faces, target);
        let Prepared { border_vertices, carried, .. } = &mut self.prepared;
        let start = (self.options, storage);
        let opened = Follower::new(queue, &self.host, start, *border_vertices, carried, applies);
        match opened.and_then(|mut follower| follower.begin(self.pace.of, gate, &carried.weights).map(|()| follower)) {
            Ok(follower) => self.follower = Some(follower),
            Err(reason) => warn_once(&mut self.warnings, fallback(&reason)),
        }
    }

    /// Finds the weights of the start; fills the host's quadrics where the metric accumulates them, weighs and stores them.
    fn start_quadrics(&mut self, storage: Option<Storage>) -> Result<()> {
        let Self { options, prepared, host, host_queue, .. } = self;
        let clock = Instant::now();
        let normals = plane_sums(host_queue, host, options)?;
        let summing = clock.elapsed().as_secs_f64();
        let weights = &mut prepared.carried.weights;
        start_weights(host_queue, host, options, prepared.border_vertices > 0, weights)?;
        if options.metric == Metric::Plane {
            weigh_start(host_queue, host, weights)?;
            weights.clear();
        }
        let record = quantize(host_queue, host, normals.as_ref(), storage)?;
        self.quadrics = record.map(|record| QuadricRecord { secs: summing + record.secs, ..record });
        Ok(())
    }

    fn time_moving(&self) -> Duration {
        self.follower.as_ref().map_or(Duration::ZERO, Follower::time_moving)
    }

    /// Has the GPU do some work, if it is in use; where it fails, the host goes on.
    fn with_gpu(&mut self, work: impl FnOnce(&mut Follower, &Surface, &mut Carried) -> Result<()>) {
        if let Some(follower) = &mut self.follower
            && let Err(reason) = work(follower, &self.host, &mut self.prepared.carried)
        {
            warn_once(&mut self.warnings, fallback(&reason));
            self.take_over();
        }
    }

    /// Goes on on the host from here.
    fn take_over(&mut self) {
        self.bytes_moved += self.follower.take().map_or(0, |follower| follower.bytes_moved());
    }

    /// Evaluates, selects, commits and compacts once; returns the live pairs there were and what was committed.
    fn round(&mut self, goal: Goal) -> Result<(usize, Committed)> {
        let clock = Instant::now();
        let faces = self.host.face_count;
        let heading = self.levels.targets_below(faces).map_or(goal.target, |targets| self.heading(targets));
        if faces < self.handover_faces {
            self.take_over();
        }
        self.pace.of = self.candidates_for(self.pace.of, faces - heading);
        let before = self.time_moving();
        let pairs = self.evaluate(self.gate(faces, heading))?;
        let moved = self.time_moving().saturating_sub(before).as_secs_f64();
        let evaluated = clock.elapsed().as_secs_f64();
        self.seconds.cost += evaluated - moved;
        let candidates = self.candidates.len();
        self.rounds.push(RoundRecord {
            faces: faces as u64,
            pairs: pairs as u64,
            candidates: candidates as u64,
            on_gpu: self.follower.is_some(),
            ..RoundRecord::default()
        });
        let restoring = self.seconds.restore;
        let (committed, spent) = self.commit_levels(goal);
        let restored = self.seconds.restore - restoring;
        let committed_at = clock.elapsed().as_secs_f64();
        let before = self.time_moving();
        self.keep_refusals(&committed);
        if committed.contracted > 0 {
            self.adapt(&committed);
            self.compact(&committed)?;
        }
        let moved_up = self.time_moving().saturating_sub(before).as_secs_f64();
        self.seconds.transfer += moved + moved_up;
        let [select, filter, apply] = spent.shares(committed_at - evaluated - restored);
        self.seconds.select += select;
        self.seconds.filter += filter;
        self.seconds.apply += apply + clock.elapsed().as_secs_f64() - committed_at - moved_up;
        Ok((pairs, committed))
    }

    /// The face count by which a round chooses its candidates, of the first and the last one to come: the last where a round
    /// can meet levels on its way. What joins parts, triangles and what is to be fitted need a round's end for that.
    pub fn heading(&self, [first, last]: [usize; 2]) -> usize {
        let options = self.options;
        let on_the_way = options.candidates == Candidates::Pairs && !self.rules.joins && options.fit == 0;
        if on_the_way { last } else { first }
    }

    /// Compacts what a round leaves, and what follows it. A GPU starts the next round in the meantime.
    fn compact(&mut self, committed: &Committed) -> Result<()> {
        let Committed { contracted, contractions, cancelled, faces_removed, by_first_steps, .. } = committed;
        let (of, vertices) = (self.pace.of, self.host.vertex_count);
        let left = Left { vertices: vertices - contracted, faces: self.host.face_count - faces_removed };
        if self.levels.meets(left.faces) {
            self.pace.begin_level(self.options.candidates);
        }
        let goes_on = |_: &[usize; 2]| left.faces >= self.handover_faces;
        let next = self.levels.targets_below(left.faces).filter(goes_on).map(|targets| {
            let target = self.heading(targets);
            self.pace.of = self.candidates_for(self.pace.of, left.faces - target);
            (self.pace.of, self.gate(left.faces, target))
        });
        if let Some((next_of, gate)) = next {
            self.with_gpu(|follower, _, _| match of {
                Candidates::Pairs => follower.follow(contractions, left, next_of, gate),
                Candidates::Triangles => follower.follow_triangles(contractions, *by_first_steps, left, next_of, gate),
            });
        }
        self.host.kill(cancelled.iter().map(|cancelled| cancelled.face));
        self.host.compact_on_host(&mut self.prepared.carried, left.faces);
        let new_vertex = &self.host.new_vertex()[..vertices];
        self.pace.known_refusals.rename(new_vertex);
        if let Some((_, history)) = &mut self.history {
            history.follow(contractions, new_vertex);
        }
        if !self.joins.pairs().is_empty() {
            self.joins.follow(&became(contractions, new_vertex), &self.host.faces.host()[..left.faces]);
        }
        if let Some((of, gate)) = next {
            self.with_gpu(|follower, host, carried| follower.catch_up(host, carried, of, gate));
        }
        Ok(())
    }

    /// Adds to the last round's refusals the edges that were no pairs: between locked vertices, and at hubs.
    fn count_locked(&mut self) {
        let positions = self.host.positions.host();
        let flags = |side: [u32; 2]| side.map(|v| positions[v as usize].flags);
        let is_seam = |&[a, b]: &[u32; 2]| a & b & (SEAM | LOCKED) == SEAM | LOCKED;
        let is_held = |&[a, b]: &[u32; 2]| a & b & LOCKED != 0 || (a | b) & HUB != 0;
        let faces = &self.host.faces.host()[..self.host.face_count];
        let sides = || faces.iter().flat_map(|f| [[f.a, f.b], [f.b, f.c], [f.c, f.a]].map(flags));
        let (held, seams) = (sides().filter(is_held).count(), sides().filter(is_seam).count());
        if let Some(round) = self.rounds.last_mut() {
            // An edge is a side of two faces.
            round.blocked.lock = (held - seams).div_ceil(2) as u64;
            round.blocked.seam += seams.div_ceil(2) as u64;
        }
    }

    /// Fills the candidates; a device that fails gives way to the host.
    fn evaluate(&mut self, gate: Gate) -> Result<usize> {
        let mut candidates = std::mem::take(&mut self.candidates);
        let mut found = None;
        candidates.clear();
        let of = self.pace.of;
        self.with_gpu(|follower, _, carried| {
            found = Some(follower.propose(of, gate, &mut carried.weights, &mut candidates)?);
            Ok(())
        });
        let pairs = match (found, &mut self.triangles) {
            (Some(pairs), _) => pairs,
            (None, Some(triangles)) if of == Candidates::Triangles => {
                candidates.clear();
                triangles.run(&mut self.host_queue, &self.host, gate, &mut candidates)?
            }
            (None, _) => {
                candidates.clear();
                let Carried { weights, wedges, .. } = &mut self.prepared.carried;
                let round = Round { joins: self.joins.pairs(), gate, weights, wedges: wedges.as_ref() };
                self.evaluation.run(&self.host, round, &mut candidates)?
            }
        };
        self.candidates = candidates;
        Ok(pairs)
    }

    /// What a round contracts that begins with `of` and so many faces to remove: the last ones by pairs.
    fn candidates_for(&self, of: Candidates, faces_to_remove: usize) -> Candidates {
        if faces_to_remove < of.most_faces() { Candidates::Pairs } else { of }
    }

    /// What becomes candidates when so many faces live.
    fn gate(&self, faces: usize, target: usize) -> Gate {
        // One face is a border pair's to remove, and there is seldom one among the cheapest few.
        if self.pace.is_full() || (faces == target + 1 && self.has_odd_ends()) {
            return Gate::OPEN;
        }
        let Pace { of, widening, refused, .. } = self.pace;
        Gate::of_round(self.options.metric, of, [faces, target], widening, refused)
    }

    /// Notes which pairs are going to be refused again.
    fn keep_refusals(&mut self, committed: &Committed) {
        if self.committer.lists_refused {
            self.pace.known_refusals.keep(&committed.refused, committed.contracted, &self.host);
        } else {
            self.pace.known_refusals.clear();
        }
    }

    /// What the next round goes by after this one.
    fn adapt(&mut self, committed: &Committed) {
        let has_attributes = self.prepared.carried.wedges.as_ref().is_some_and(|wedges| wedges.layout.costed > 0);
        if let Some(round) = self.rounds.last() {
            let tried = Tried { count: self.tried, outdated: committed.outdated, has_attributes };
            self.pace.adapt(round, tried);
        }
    }

    /// Widens the gate after a round that contracted nothing: for the last few faces, and where an error limit may be the
    /// reason, to every pair at once. With many to remove that would contract what is far too dear.
    fn widen(&mut self, goal: Goal) {
        let are_few = self.host.face_count - goal.target <= 2 * self.tried;
        self.pace.widen(are_few || goal.max_deviation.is_finite());
    }
}

/// Notes a warning once: a run that is taken up may meet what it met before, and so may the fit of its result.
pub fn warn_once(warnings: &mut Vec<String>, warning: String) {
    if !warnings.contains(&warning) {
        warnings.push(warning);
    }
}
