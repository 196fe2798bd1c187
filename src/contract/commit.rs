//! Contracting a round's candidates, in parallel on patches of the surface that share no vertex.
//!
//! Every patch takes its candidates by cost, each on the state that those before it left, as long as their faces lie
//! within the patch. What reaches out goes to larger patches, and at last to the whole surface. The size of patches
//! depends on nothing but the surface, so the result does not depend on the number of threads.
//!
//! What one task does with its candidates is in [`work`](super::work).

use std::cmp::Reverse;
use std::time::Instant;

use rayon::prelude::*;

use crate::kernel::pairs::half_edge_corners;
use crate::kernel::rows::{Candidate, JOINED};

use super::Candidates;
use super::carry::Carried;
use super::committed::{Committed, Spent};
use super::crossings::Crossings;
use super::deal::{Left, Pile, Share, Taker, lower_end};
use super::patch::{Connectivity, Patch};
use super::patch_sizes::{CUT, HALVED, LARGE, patch_sizes};
use super::reach::Reach;
use super::rules::Rules;
use super::select::sort;
use super::surface::Surface;
use super::work::{Quota, Task, Work};

/// Faces below which a surface that is one task's is watched for faces that would come to pass through others. With half as many, of
/// a boot of 40,000 to a tenth six faces intersect, with these none.
const WATCHED: usize = 1 << 14;
/// The same of a surface that was large. With twice as many 100,000 faces to 1 % take up to 5 % longer on two threads, and of 17 meshes
/// as many faces intersect.
const WATCHED_OF_LARGE: usize = 1 << 12;

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
    /// Faces below which those that are one task's are watched for crossings.
    watched: usize,
    scratch: Vec<Candidate>,
    reach: Reach,
    crossings: Crossings,
    /// Commits so far, of which a round may have several: another order among ties in each; the whole surface has that which
    /// patches have in the next commit.
    pub commits: u32,
    /// What the dearest contraction of them cost.
    dearest: f32,
}

impl Committer {
    /// For a run under these rules, that began on a surface of so many vertices and had so many commits, of which the dearest
    /// contraction cost so much.
    pub fn new(rules: Rules, vertices: usize, (commits, dearest): (u32, f32)) -> Self {
        let (least_cut, watched) = if vertices < LARGE { (CUT, WATCHED) } else { (HALVED, WATCHED_OF_LARGE) };
        Self {
            rules,
            is_followed: false,
            lists_refused: false,
            least_cut,
            watched,
            scratch: Vec::new(),
            reach: Reach::default(),
            crossings: Crossings::default(),
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
        // What joins parts passes through them, and so do faces at vertices where more than a surface meets; patches do not know
        // where others are.
        let is_small = sizes.is_empty() && surface.face_count < self.watched;
        let is_guarded = is_small && quota.of == Candidates::Pairs && !rules.joins;
        let patch = Patch::whole(surface, carried);
        let crossings = is_guarded.then(|| {
            self.crossings.start(&patch);
            &mut self.crossings
        });
        let mut work = Work::new(patch, task);
        (work.joins, work.faces, work.dearest, work.crossings) = (joins, faces, dearest, crossings);
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
