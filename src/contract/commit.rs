//! Contracting a round's candidates, in parallel on patches of the surface that share no vertex.
//!
//! Every patch takes its candidates by cost, each on the state that those before it left, as long as their faces lie
//! within the patch. What reaches out goes to larger patches, and at last to the whole surface. The size of patches
//! depends on nothing but the surface, so the result does not depend on the number of threads.
//!
//! # Invariants
//! - No vertex is an end of two contractions of a round.
//! - The quota is never passed, except by one face where it says so.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::iter::Peekable;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::kernel::pairs::{half_edge_corners, half_edge_ends};
use crate::kernel::rows::{BORDER, Candidate, Face, JOINED};

use super::Candidates;
use super::carry::Carried;
use super::committed::{Cancelled, Committed, Spent};
use super::deal::{Left, Pile, Share, Taker, lower_end};
use super::examine::{Examiner, Verdict};
use super::filter::Rejection;
use super::patch::{Connectivity, Patch, Placed};
use super::patch_sizes::{CUT, HALVED, LARGE, patch_sizes};
use super::reach::Reach;
use super::refusals::Refusal;
use super::rules::Rules;
use super::select::sort;
use super::star::Outside;
use super::surface::Surface;

/// How many times as much as the dearest of the run before, or its own first, a contraction costs at most in a commit of all pairs, of
/// those on the whole surface. Where nearly all are refused, as those across a thin sheet, what nobody needs is soon among the first that are legal.
const DEARER: f32 = 8.0;
/// One attempt in this many is timed: a clock takes as long as a tenth of an attempt.
const TIMED: u32 = 16;

/// How many faces a round may remove.
///
/// Interior pairs remove two and border pairs one. Where one is left to remove, only a border pair will do, unless the
/// quota may be overshot by one face because no border pair did. Triangles remove up to four, and leave what is less to
/// pairs.
#[derive(Debug, Clone, Copy)]
pub struct Quota {
    pub faces: usize,
    pub of: Candidates,
    pub may_overshoot: bool,
}

/// Scratch that outlives a round.
#[derive(Debug)]
pub struct Committer {
    rules: Rules,
    /// Whether what is accepted is listed. Else it can be told from roles and positions alone, and the list would only be copied.
    pub is_followed: bool,
    /// Whether refused pairs are listed.
    pub lists_refused: bool,
    /// Vertices from which surfaces are worked on in parallel.
    least_cut: usize,
    scratch: Vec<Candidate>,
    reach: Reach,
    /// Commits so far, of which a round may have several: another order among ties in each.
    pub commits: u32,
    /// What the dearest contraction of them cost.
    dearest: f32,
}

impl Committer {
    /// For a run under these rules, that began on a surface of so many vertices and had so many commits, of which the dearest
    /// contraction cost so much.
    pub fn new(rules: Rules, vertices: usize, (commits, dearest): (u32, f32)) -> Self {
        let least_cut = if vertices < LARGE { CUT } else { HALVED };
        Self {
            rules,
            is_followed: false,
            lists_refused: false,
            least_cut,
            scratch: Vec::new(),
            reach: Reach::default(),
            commits,
            dearest,
        }
    }

    /// Commits under an error limit, in the normalized frame, from here on; returns whether it is another than before.
    pub fn set_max_deviation(&mut self, max_deviation: f64) -> bool {
        std::mem::replace(&mut self.rules.max_deviation, max_deviation) != max_deviation
    }

    /// Contracts the legal ones among `candidates` until the quota is used up; `candidates` is overwritten. A pair that
    /// became dear waits for another round if it `may_wait`. Candidates past the half-edges stand for `joins`.
    ///
    /// Where parts join, faces may cancel each other out all around: such pairs are left to the last level, as are those
    /// that reach out of every patch.
    pub fn commit(
        &mut self,
        surface: &mut Surface,
        carried: &mut Carried,
        candidates: &mut Vec<Candidate>,
        joins: &[[u32; 2]],
        quota: Quota,
        may_wait: bool,
    ) -> (Committed, Spent) {
        let mut done = (Committed::default(), Spent::default());
        let mut joining = Vec::new();
        if self.rules.joins {
            let (faces, positions) = (&surface.faces.host()[..surface.face_count], surface.positions.host());
            let is_joined = |v: u32| positions[v as usize].flags & JOINED != 0;
            let joins_parts = |candidate: &mut Candidate| {
                let edge = half_edge_corners(candidate.half_edge % (3 * faces.len() as u32), faces);
                candidate.half_edge as usize >= 3 * faces.len() || edge[..2].iter().any(|&v| is_joined(v))
            };
            joining.extend(candidates.extract_if(.., joins_parts));
        }
        let dearest = candidates.iter().map(|candidate| candidate.key).max().map_or(0.0, f32::from_bits);
        let Self { rules, is_followed, lists_refused, commits: commit, .. } = *self;
        let task = Task { rules, is_followed, lists_refused, of: quota.of, may_wait, dearest, commit };
        self.commits += 1;
        if quota.of == Candidates::Triangles {
            // Those of triangles ascend by face.
            let faces = surface.faces.host();
            candidates.sort_by_key(|&candidate| lower_end(candidate, faces));
        }
        let mut left: Option<Vec<Left>> = None;
        let sizes = patch_sizes(surface.vertex_count, self.least_cut);
        for (number, &size) in sizes.iter().enumerate() {
            let pile = left.as_deref().map_or(Pile::List(candidates), Pile::Left);
            // As many faces as on the inside: what fits the quota as such fits at any border.
            let fitting = quota.faces.saturating_sub(done.0.faces_removed) / quota.of.most_faces();
            if pile.len() == 0 || fitting == 0 {
                break;
            }
            if number == 0 {
                self.reach.find(&surface.faces.host()[..surface.face_count], surface.vertex_count, &sizes);
            }
            let level = Level { number, reach: &self.reach, fitting };
            let patches = Patch::whole(surface, carried).split(size);
            left = Some(commit_patches(patches, pile, level, task, &mut done));
        }
        if let Some(left) = left {
            candidates.clear();
            left.iter().for_each(|left| candidates.extend_from_slice(&left.candidates));
        }
        candidates.extend(joining);
        let clock = Instant::now();
        sort(candidates, &mut self.scratch, self.commits);
        let sorting = clock.elapsed();
        let faces = surface.face_count - done.0.faces_removed;
        let dearest = self.dearest.max(f32::from_bits(done.0.greatest_key));
        let mut work = Work { joins, faces, dearest, ..Work::new(Patch::whole(surface, carried), task) };
        let quota = Quota { faces: quota.faces.saturating_sub(done.0.faces_removed), ..quota };
        work.attempt_to_the_end(candidates, quota);
        let spent = Spent { sorting, examining: work.examining(), total: clock.elapsed() };
        done.0.add(work.committed);
        done.1.add(spent);
        self.dearest = self.dearest.max(f32::from_bits(done.0.greatest_key));
        done
    }
}

/// A level of patches.
#[derive(Debug, Clone, Copy)]
struct Level<'a> {
    number: usize,
    reach: &'a Reach,
    /// How many candidates it may contract.
    fitting: usize,
}

/// Contracts candidates of `pile` within the `patches` of a level, which have one size; returns those that reach out or did not
/// fit.
fn commit_patches(
    patches: Vec<Patch<'_>>,
    pile: Pile<'_>,
    level: Level<'_>,
    task: Task,
    done: &mut (Committed, Spent),
) -> Vec<Left> {
    let Some(Connectivity { faces, .. }) = patches.first().map(|patch| patch.connectivity) else { return Vec::new() };
    let (starts, total) = (pile.cut(faces, patches[0].len(), patches.len()), pile.len());
    let candidates = |patch: usize| starts.get(patch + 1).map_or(0, |end| end - starts[patch]);
    let mut results: Vec<_> = in_equal_halves(patches, candidates)
        .into_par_iter()
        .map_init(Vec::new, |scratch, (number, patch)| {
            let clock = Instant::now();
            let taker = Taker { patch: number, vertices: patch.vertices(), level: level.number, reach: level.reach };
            let Share { mut own, mut left } = pile.share(&starts, &taker, faces);
            sort(&mut own, scratch, task.commit);
            let sorting = clock.elapsed();
            let most = (level.fitting as u128 * own.len() as u128 / total as u128) as usize;
            patch.warm_up();
            let mut work = Work::new(patch, task);
            work.attempt_within(&own, most, &mut left);
            let spent = Spent { sorting, examining: work.examining(), total: clock.elapsed() };
            (number, (work.committed, spent, left))
        })
        .collect();
    results.sort_unstable_by_key(|&(number, _)| number);
    done.0.contractions.reserve(results.iter().map(|(_, (committed, ..))| committed.contractions.len()).sum());
    let all = results.into_iter().map(|(_, (committed, spent, left))| {
        done.0.add(committed);
        done.1.add(spent);
        left
    });
    all.collect()
}

/// `tasks` with their numbers, in an order in which both halves have about as much to do, and the last of either the least: what
/// two threads begin with, and what one that is done takes from the other.
fn in_equal_halves<T>(tasks: Vec<T>, work: impl Fn(usize) -> usize) -> Vec<(usize, T)> {
    let mut numbered: Vec<(usize, T)> = tasks.into_iter().enumerate().collect();
    numbered.sort_by_key(|&(number, _)| Reverse(work(number)));
    let (mut first, mut second) = (Vec::with_capacity(numbered.len()), Vec::new());
    for (place, task) in numbered.into_iter().enumerate() {
        if matches!(place % 4, 0 | 3) { first.push(task) } else { second.push(task) }
    }
    first.append(&mut second);
    first
}

/// The ends of a candidate: of its half-edge, or past these of one of the pairs without an edge, where it may be one.
fn ends(candidate: Candidate, faces: &[Face], joins: &[[u32; 2]]) -> Option<[u32; 2]> {
    match (candidate.half_edge as usize).checked_sub(3 * faces.len()) {
        Some(join) => joins.get(join).copied(),
        None => Some(half_edge_ends(candidate.half_edge, faces)),
    }
}

/// What is the same for all patches of a commit.
#[derive(Debug, Clone, Copy)]
struct Task {
    rules: Rules,
    is_followed: bool,
    lists_refused: bool,
    of: Candidates,
    may_wait: bool,
    dearest: f32,
    commit: u32,
}

/// The contractions within one patch.
struct Work<'a> {
    patch: Patch<'a>,
    examiner: Examiner,
    of: Candidates,
    is_followed: bool,
    lists_refused: bool,
    committed: Committed,
    /// Pairs without an edge.
    joins: &'a [[u32; 2]],
    /// Vertices that may not contract any more, for their rings hold faces that cancelled each other out.
    held: FxHashSet<u32>,
    /// How many faces there are.
    faces: usize,
    /// What the dearest contraction of the run cost before, and the first one here.
    dearest: f32,
    cheapest: f32,
    /// Those that turned out to cost more than their keys, by what they do: bits, and half-edges.
    dearer: BinaryHeap<Reverse<(u32, u32)>>,
    attempts: u32,
    timed: Duration,
}

impl<'a> Work<'a> {
    fn new(patch: Patch<'a>, task: Task) -> Self {
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
            held: FxHashSet::default(),
            faces,
            dearest: f32::INFINITY,
            cheapest: 0.0,
            dearer: BinaryHeap::new(),
            attempts: 0,
            timed: Duration::ZERO,
        }
    }

    /// Contracts at most `most` of `candidates`; those that it could not or was not allowed to look at are `left`.
    fn attempt_within(&mut self, candidates: &[Candidate], most: usize, left: &mut Left) {
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
    fn attempt_to_the_end(&mut self, candidates: &[Candidate], quota: Quota) {
        let mut overshooting: Option<usize> = None;
        let mut rest = candidates.iter().copied().enumerate().peekable();
        while let Some((i, candidate)) = self.next(&mut rest, candidates.len()) {
            let left = quota.faces.saturating_sub(self.committed.faces_removed);
            if self.is_too_dear(candidate) {
                return;
            }
            if left == 0 || (self.of == Candidates::Triangles && left < self.of.most_faces()) {
                return;
            }
            if left == 1 && !self.removes_one(candidate) {
                overshooting = Some(overshooting.map_or(i, |first| first.min(i)));
                continue;
            }
            self.attempt(candidate);
        }
        if let Some(first) = overshooting.filter(|_| quota.may_overshoot) {
            for &candidate in &candidates[first..] {
                if self.committed.faces_removed >= quota.faces {
                    break;
                }
                self.attempt(candidate);
            }
        }
    }

    /// Whether a commit of all pairs has done enough: cheaper ones may be free in the next.
    fn is_too_dear(&self, candidate: Candidate) -> bool {
        let Examiner { rules, may_wait, .. } = &self.examiner;
        let most = DEARER * self.dearest.max(self.cheapest);
        let may_end = self.of == Candidates::Pairs && !(*may_wait || rules.joins);
        may_end && self.committed.contracted > 0 && f32::from_bits(candidate.key) > most
    }

    /// The next of those that are left, with its number, or of those that turned out dearer, with this one.
    fn next(
        &mut self,
        rest: &mut Peekable<impl Iterator<Item = (usize, Candidate)>>,
        number: usize,
    ) -> Option<(usize, Candidate)> {
        let is_next = |&Reverse((key, _)): &Reverse<(u32, u32)>| rest.peek().is_none_or(|(_, other)| key <= other.key);
        match self.dearer.peek().is_some_and(is_next) {
            true => self.dearer.pop().map(|Reverse((key, half_edge))| (number, Candidate { key, half_edge })),
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
        let verdict = self.examiner.examine(&self.patch, [u, w], f32::from_bits(candidate.key));
        self.timed += clock.map_or(Duration::ZERO, |clock| clock.elapsed());
        match verdict {
            Verdict::Outside => return false,
            // Of a patch it is left to the whole surface.
            Verdict::Dearer(cost) => {
                self.dearer.push(Reverse((cost.to_bits(), candidate.half_edge)));
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
            Verdict::Accepted(accepted) => {
                self.cancel([u, w], &accepted.cancelled);
                let Examiner { sides, blend, .. } = &self.examiner;
                blend.write(&mut self.patch, sides, &[u, w], accepted.end);
                self.contract([u, w], &accepted.placed);
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
            let is_known = |f: u32| self.committed.cancelled.iter().any(|cancelled| cancelled.face == f);
            let face = rings.copied().find(|&f| lies_on(f) && !is_known(f));
            let keep = pair[0].min(pair[1]);
            self.committed.cancelled.extend(face.map(|face| Cancelled { face, keep }));
        }
    }

    /// Whether a candidate may be a border pair, which removes one face.
    fn removes_one(&self, candidate: Candidate) -> bool {
        let Some([u, w]) = ends(candidate, self.patch.connectivity.faces, self.joins) else { return true };
        self.patch.position(u).flags & self.patch.position(w).flags & BORDER != 0
    }

    fn examining(&self) -> Duration {
        self.timed * self.attempts / self.attempts.div_ceil(TIMED).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_have_as_much_to_do() {
        let work = [5, 90, 20, 60, 70, 10, 80, 40, 15];
        let dealt = in_equal_halves(work.to_vec(), |number| work[number]);
        assert!(dealt.iter().all(|&(number, task)| work[number] == task));
        assert_eq!(dealt.iter().map(|&(_, task)| task).collect::<Vec<_>>(), [90, 60, 40, 10, 5, 80, 70, 20, 15]);
    }
}
