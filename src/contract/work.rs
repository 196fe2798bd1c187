//! What one task of a commit contracts: the candidates of a patch by cost, each on the state that those before it left.
//!
//! # Invariants
//! - No vertex is an end of two contractions of a round.
//! - The quota is never passed, except by one face where it may be overshot, and where parts join by the faces that cancel each other out.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::iter::Peekable;
use std::time::{Duration, Instant};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::kernel::pairs::{half_edge_corners, half_edge_ends};
use crate::kernel::rows::{BORDER, Candidate, Face};

use super::Candidates;
use super::committed::{Cancelled, Committed};
use super::crossings::Crossings;
use super::deal::Left;
use super::examine::{Examiner, Verdict};
use super::filter::Rejection;
use super::patch::{Patch, Placed};
use super::refusals::Refusal;
use super::rules::Rules;
use super::star::Outside;

/// How many faces a round may remove.
///
/// Interior pairs remove two and border pairs one; where parts join also what cancels out, which no quota foretells. Where one
/// is left to remove, only a border pair will do. One that is far dearer than all before waits for a round that may overshoot: there
/// an interior pair that costs no more goes first, and so it does where no border pair is legal. Triangles remove up to four, and
/// leave what is less to pairs.
#[derive(Debug, Clone, Copy)]
pub struct Quota {
    pub faces: usize,
    pub of: Candidates,
    pub may_overshoot: bool,
}

/// How many times as much as the dearest of the run before, or its own first, a contraction costs at most in a commit of all pairs, of
/// those on the whole surface. Where nearly all are refused, as those across a thin sheet, what nobody needs is soon among the first that are legal.
const DEARER: f32 = 8.0;
/// How many times as much as the dearest of the run before the last face of a quota costs at most, which only a pair at a border
/// removes: 64 times as far off. With eight times open surfaces miss their number by one.
const DEARER_LAST: f32 = 4096.0;
/// What the dearest of a run costs at least for that: on a flat all others cost rounding. Edges have a length of about 1.
const LEAST_DEAR: f32 = 1e-3;
/// One attempt in this many is timed: a clock takes as long as a tenth of an attempt.
const TIMED: u32 = 16;
/// How many times as much a pair costs whose faces come to pass through others, where it is not refused: eight times as far off. With
/// twice as much most do in the end, with eight times a thin boot of 400 faces keeps 35 of 62 such; without end one of 200 has none, and
/// is 2.1 times as far off, not 1.3.
const CROSSING: f32 = 64.0;

/// The ends of a candidate: of its half-edge, or past these of one of the pairs without an edge, where it may be one.
fn ends(candidate: Candidate, faces: &[Face], joins: &[[u32; 2]]) -> Option<[u32; 2]> {
    match (candidate.half_edge as usize).checked_sub(3 * faces.len()) {
        Some(join) => joins.get(join).copied(),
        None => Some(half_edge_ends(candidate.half_edge, faces)),
    }
}

/// What is the same for all patches of a commit.
#[derive(Debug, Clone, Copy)]
pub struct Task {
    pub rules: Rules,
    pub is_followed: bool,
    pub lists_refused: bool,
    pub of: Candidates,
    pub may_wait: bool,
    pub dearest: f32,
    pub commit: u32,
}

/// The contractions within one patch.
pub struct Work<'a> {
    patch: Patch<'a>,
    examiner: Examiner,
    of: Candidates,
    is_followed: bool,
    lists_refused: bool,
    pub committed: Committed,
    /// Pairs without an edge.
    pub joins: &'a [[u32; 2]],
    /// Where the faces are, if it counts whether one comes to pass through another.
    pub crossings: Option<&'a mut Crossings>,
    /// What pairs cost that come later for that, by their half-edges: bits.
    paid: FxHashMap<u32, u32>,
    /// Vertices that may not contract any more, for their rings hold faces that cancelled each other out.
    held: FxHashSet<u32>,
    /// The faces that did, as [`Committed`] lists them: a layer of thousands may cancel another in one commit.
    cancelled: FxHashSet<u32>,
    /// How many faces there are.
    pub faces: usize,
    /// What the dearest contraction of the run cost before, and the first one here.
    pub dearest: f32,
    cheapest: f32,
    /// Those that turned out to cost more than their keys, by what they do: bits, and half-edges.
    dearer: BinaryHeap<Reverse<(u32, u32)>>,
    attempts: u32,
    timed: Duration,
}

impl<'a> Work<'a> {
    pub fn new(patch: Patch<'a>, task: Task) -> Self {
        let examiner = Examiner::new(task.rules, task.may_wait, task.dearest);
        let faces = patch.connectivity.faces.len();
        Self {
            patch,
            examiner,
            of: task.of,
            is_followed: task.is_followed,
            lists_refused: task.lists_refused,
            committed: Committed::default(),
            joins: &[],
            crossings: None,
            paid: FxHashMap::default(),
            held: FxHashSet::default(),
            cancelled: FxHashSet::default(),
            faces,
            dearest: f32::INFINITY,
            cheapest: 0.0,
            dearer: BinaryHeap::new(),
            attempts: 0,
            timed: Duration::ZERO,
        }
    }

    /// Contracts at most `most` of `candidates`; those that it could not or was not allowed to look at are `left`.
    pub fn attempt_within(&mut self, candidates: &[Candidate], most: usize, left: &mut Left) {
        let faces = self.patch.connectivity.faces;
        let most = match self.of {
            Candidates::Pairs => most,
            Candidates::Triangles => 2 * most,
        };
        for (i, &candidate) in candidates.iter().enumerate() {
            if self.committed.contracted == most {
                candidates[i..].iter().for_each(|&candidate| left.push(candidate, faces));
                break;
            }
            if !self.attempt(candidate) {
                left.push(candidate, faces);
            }
        }
    }

    /// Contracts `candidates` until the quota is used up. The patch is the whole surface.
    pub fn attempt_to_the_end(&mut self, candidates: &[Candidate], quota: Quota) {
        let mut overshooting = Vec::new();
        let mut rest = candidates.iter().copied().peekable();
        while let Some(candidate) = self.next(&mut rest) {
            let left = quota.faces.saturating_sub(self.committed.faces_removed);
            if self.is_too_dear(candidate) {
                return;
            }
            if left == 0 || (self.of == Candidates::Triangles && left < self.of.most_faces()) {
                return;
            }
            if left == 1 && !self.removes_one(candidate) {
                overshooting.push(candidate);
                continue;
            }
            if left == 1 && self.is_dear_for_last(candidate) {
                if !quota.may_overshoot {
                    return;
                }
                self.overshoot(std::mem::take(&mut overshooting), quota, candidate.key);
                if self.committed.faces_removed >= quota.faces {
                    return;
                }
            }
            self.attempt(candidate);
        }
        if quota.may_overshoot {
            self.overshoot(overshooting, quota, u32::MAX);
        }
    }

    /// Contracts the first that is legal of `candidates`, and of those that turned out dearer, and costs no more than `most`, as bits,
    /// though the quota is passed.
    fn overshoot(&mut self, candidates: Vec<Candidate>, quota: Quota, most: u32) {
        let mut rest = candidates.into_iter().peekable();
        while self.committed.faces_removed < quota.faces {
            let Some(candidate) = self.next(&mut rest) else { return };
            if candidate.key > most {
                self.dearer.push(Reverse((candidate.key, candidate.half_edge)));
                return;
            }
            self.attempt(candidate);
        }
    }

    /// Whether a commit of all pairs has done enough: cheaper ones may be free in the next.
    fn is_too_dear(&self, candidate: Candidate) -> bool {
        let Examiner { rules, may_wait, .. } = &self.examiner;
        let most = DEARER * self.dearest.max(self.cheapest);
        let may_end = self.of == Candidates::Pairs && !(*may_wait || rules.joins);
        may_end && self.committed.contracted > 0 && f32::from_bits(candidate.key) > most
    }

    /// Whether a pair at a border costs too much for the last face: half of a ground went for it. Before the first contraction nothing
    /// tells what is dear.
    fn is_dear_for_last(&self, candidate: Candidate) -> bool {
        self.dearest > 0.0 && f32::from_bits(candidate.key) > DEARER_LAST * self.dearest.max(LEAST_DEAR)
    }

    /// The next of those that are left, or of those that turned out dearer.
    fn next(&mut self, rest: &mut Peekable<impl Iterator<Item = Candidate>>) -> Option<Candidate> {
        let is_next = |&Reverse((key, _)): &Reverse<(u32, u32)>| rest.peek().is_none_or(|other| key <= other.key);
        match self.dearer.peek().is_some_and(is_next) {
            true => self.dearer.pop().map(|Reverse((key, half_edge))| Candidate { key, half_edge }),
            false => rest.next(),
        }
    }

    /// Contracts a candidate if its ends are free and it is legal; returns false if it reaches out of the patch, or others come first.
    fn attempt(&mut self, candidate: Candidate) -> bool {
        if self.of == Candidates::Triangles {
            return self.attempt_triangle(candidate);
        }
        let Some([u, w]) = ends(candidate, self.patch.connectivity.faces, self.joins) else { return true };
        if (u == w) | !self.patch.is_free(u) | !self.patch.is_free(w) {
            return true;
        }
        if !self.held.is_empty() && (self.held.contains(&u) || self.held.contains(&w)) {
            return true;
        }
        let clock = self.attempts.is_multiple_of(TIMED).then(Instant::now);
        self.attempts += 1;
        // A pair that comes late for what its faces would cross costs what it did.
        let key = self.paid.get(&candidate.half_edge).map_or(candidate.key, |&key| key);
        let candidate = Candidate { key, ..candidate };
        let verdict = self.examiner.examine(&self.patch, [u, w], f32::from_bits(key));
        let crosses = self.would_cross(candidate, [u, w], &verdict);
        self.timed += clock.map_or(Duration::ZERO, |clock| clock.elapsed());
        match verdict {
            Verdict::Outside => return false,
            // Of a patch it is left to the whole surface.
            Verdict::Dearer(cost) => {
                let paid = self.paid.get_mut(&candidate.half_edge);
                let price = paid.map_or(cost, |paid| {
                    *paid = cost.to_bits();
                    CROSSING * cost
                });
                self.dearer.push(Reverse((price.to_bits(), candidate.half_edge)));
                return false;
            }
            Verdict::Rejected(Rejection::Outdated) => self.committed.outdated += 1,
            Verdict::Rejected(rejection) => {
                self.committed.blocked.count(rejection);
                if self.lists_refused {
                    self.committed.refused.push(Refusal::new([u, w], rejection));
                }
            }
            // Faces that cancel each other out may not leave a mesh of none.
            Verdict::Accepted(accepted) if self.committed.faces_removed + accepted.faces_removed >= self.faces => {
                self.committed.blocked.count(Rejection::Link);
            }
            Verdict::Accepted(_) if crosses => return self.put_off_crossing(candidate),
            Verdict::Accepted(accepted) => {
                self.cancel([u, w], &accepted.cancelled);
                let Examiner { sides, blend, .. } = &self.examiner;
                blend.write(&mut self.patch, sides, &[u, w], accepted.end);
                self.contract([u, w], &accepted.placed);
                if let Some(crossings) = &mut self.crossings {
                    crossings.follow(&self.patch, &self.examiner.star, accepted.placed.x);
                }
                let committed = &mut self.committed;
                committed.faces_removed += accepted.faces_removed;
                if committed.contracted == 1 {
                    self.cheapest = f32::from_bits(candidate.key);
                }
                committed.greatest_key = committed.greatest_key.max(candidate.key);
                committed.deviation = committed.deviation.max(accepted.deviation);
            }
        }
        true
    }

    /// Whether faces would come to pass through others, for which nothing was paid.
    fn would_cross(&mut self, candidate: Candidate, pair: [u32; 2], verdict: &Verdict) -> bool {
        let (Some(crossings), Verdict::Accepted(accepted)) = (&mut self.crossings, verdict) else { return false };
        let Self { patch, examiner: Examiner { star, .. }, paid, .. } = self;
        !paid.contains_key(&candidate.half_edge) && crossings.would_cross(patch, star, pair, accepted.placed.x)
    }

    /// Has a pair whose faces would come to pass through others come as late as if it cost far more, which may be in another round;
    /// within an error limit it is refused, for this round, as what is far away may move. Returns what [`Work::attempt`] does.
    #[cold]
    fn put_off_crossing(&mut self, candidate: Candidate) -> bool {
        let Examiner { rules, may_wait, dearest, .. } = &self.examiner;
        let price = CROSSING * f32::from_bits(candidate.key);
        if rules.max_deviation.is_finite() {
            self.committed.blocked.count(Rejection::Crossing);
            return true;
        }
        // Counted as blocked it would widen the next gate: an office of boxes with 240 faces was ten times as far off.
        if *may_wait && price > *dearest {
            self.committed.outdated += 1;
            return true;
        }
        self.paid.insert(candidate.half_edge, candidate.key);
        self.dearer.push(Reverse((price.to_bits(), candidate.half_edge)));
        false
    }

    /// [`Work::attempt`] of the triangle whose half-edge a candidate names.
    fn attempt_triangle(&mut self, candidate: Candidate) -> bool {
        let corners = half_edge_corners(candidate.half_edge, self.patch.connectivity.faces);
        if corners.iter().any(|&v| self.patch.current(v).is_none()) {
            return false;
        }
        if !corners.iter().all(|&v| self.patch.is_free(v)) {
            return true;
        }
        let clock = self.attempts.is_multiple_of(TIMED).then(Instant::now);
        self.attempts += 1;
        let verdict = self.examiner.examine_triangle(&self.patch, corners);
        self.timed += clock.map_or(Duration::ZERO, |clock| clock.elapsed());
        match verdict {
            Err(Outside) => return false,
            Ok(Err(rejection)) => self.committed.blocked.count(rejection),
            Ok(Ok(accepted)) => {
                let [keep, first, second] = accepted.ends;
                let Examiner { sides, blend, .. } = &self.examiner;
                blend.write(&mut self.patch, sides, &accepted.corners, accepted.end);
                let [with_first, with_second] = &accepted.placed;
                self.contract([keep, first], with_first);
                self.contract([keep, second], with_second);
                let committed = &mut self.committed;
                committed.faces_removed += accepted.faces_removed.iter().sum::<usize>();
                committed.by_first_steps += accepted.faces_removed[0];
                committed.greatest_key = committed.greatest_key.max(candidate.key);
                committed.deviation = committed.deviation.max(accepted.deviation);
            }
        }
        true
    }

    fn contract(&mut self, ends: [u32; 2], placed: &Placed) {
        let contraction = self.patch.contract(ends, placed);
        self.committed.contracted += 1;
        if self.is_followed {
            self.committed.contractions.push(contraction);
        }
    }

    /// Notes the faces of a pair that cancel each other out: those with an end and a side of `sides`, as often as it is there.
    fn cancel(&mut self, pair: [u32; 2], sides: &[[u32; 2]]) {
        for &side in sides {
            self.held.extend(side);
            let connectivity = self.patch.connectivity;
            let lies_on = |f: u32| {
                let corners = connectivity.faces[f as usize].corners().map(|v| self.patch.current(v));
                (0..3).any(|i| {
                    let [end, v1, v2] = [0, 1, 2].map(|k| corners[(i + k) % 3]);
                    pair.map(Some).contains(&end) && [v1, v2] == side.map(Some)
                })
            };
            // The second's before the first's: of two on the same side it is the second's that goes.
            let rings = [pair[1], pair[0]].into_iter().flat_map(|end| connectivity.ring(end));
            let face = rings.copied().find(|&f| lies_on(f) && !self.cancelled.contains(&f));
            let keep = pair[0].min(pair[1]);
            self.cancelled.extend(face);
            self.committed.cancelled.extend(face.map(|face| Cancelled { face, keep }));
        }
    }

    /// Whether a candidate may be a border pair, which removes one face.
    fn removes_one(&self, candidate: Candidate) -> bool {
        let Some([u, w]) = ends(candidate, self.patch.connectivity.faces, self.joins) else { return true };
        self.patch.position(u).flags & self.patch.position(w).flags & BORDER != 0
    }

    pub fn examining(&self) -> Duration {
        self.timed * self.attempts / self.attempts.div_ceil(TIMED).max(1)
    }
}
