//! A round's commits: up to the next level, and past it where others follow, so that a level costs no round of its own.

use rayon::prelude::*;

use crate::kernel::pairs::half_edge_ends;
use crate::kernel::rows::{BORDER, Candidate, HUB, LOCKED};
use crate::kernel::split::CHUNK;
use crate::kernel::stars::Stars;
use crate::simplify::StopReason;

use super::committed::{Committed, Spent};
use super::driver::Run;
use super::gate::LARGE_ROUND;
use super::levels::Goal;
use super::pace::{WIDER, is_meager};
use super::surface::Surface;
use super::work::Quota;
use super::{Candidates, Metric};

/// Candidates for every contraction that a level on the way still needs. With four levels cost 5 % less time, and are 5 % off.
const CHEAPEST_EACH: usize = 2;
/// Pairs on the border that are tried for the last face, in any order. Of 60 numbers of faces of a helmet 25 left one, of 40 of a
/// terrain 14, and a pair was found for each.
const SHORTEST: usize = 64;

impl Run<'_> {
    /// Commits the round's candidates up to the goal and, where others follow, makes its levels and goes on to the next.
    ///
    /// On the way to a level the cheapest are committed, about as many as a round has that goes no farther; the others wait until it
    /// is met.
    pub fn commit_levels(&mut self, goal: Goal) -> (Committed, Spent) {
        let faces = self.host.face_count;
        self.tried = 0;
        let mut done = (Committed::default(), Spent::default());
        let mut next = Some(goal);
        while let Some(Goal { target, max_deviation }) = next {
            self.set_error_limit(max_deviation);
            let left = faces - done.0.faces_removed;
            let follows = |targets| !self.pace.is_full() && self.heading(targets) < target;
            if !self.levels.targets_below(left).is_some_and(follows) {
                self.commit(left - target, &mut done);
                if faces - done.0.faces_removed == target + 1 {
                    self.commit_on_border(&mut done);
                }
                break;
            }
            let pool = self.candidates.clone();
            self.commit_cheapest(&pool, left - target, &mut done);
            if faces - done.0.faces_removed == target + 1 {
                // Only a border pair removes one, whichever is there: another round would have to let every pair through.
                self.candidates = self.at_free_ends(&pool).into_iter().filter(|c| self.is_border(c)).collect();
                self.commit(1, &mut done);
            }
            let left = faces - done.0.faces_removed;
            if left > target {
                break;
            }
            let reached = self.levels.take_reached(left);
            self.make(reached, StopReason::FacesReached);
            self.candidates = self.at_free_ends(&pool);
            next = self.levels.goal();
        }
        done
    }

    /// Commits under an error limit from here on, in the normalized frame: under another than before, what was refused may be legal.
    fn set_error_limit(&mut self, max_deviation: f64) {
        if self.committer.set_max_deviation(max_deviation) {
            self.pace.known_refusals.clear();
        }
    }

    /// Commits the cheapest of `pool`, about as many as `to_remove` faces need, and more where nearly all are refused: the
    /// features of a part, which are the cheapest in every round.
    fn commit_cheapest(&mut self, pool: &[Candidate], to_remove: usize, done: &mut (Committed, Spent)) {
        let removed = done.0.faces_removed;
        let mut wanted = CHEAPEST_EACH * to_remove.div_ceil(2);
        self.candidates = pool.to_vec();
        loop {
            let threshold = threshold(pool, wanted);
            self.candidates.retain(|candidate| candidate.key <= threshold);
            let (tried, contracted) = (self.candidates.len(), done.0.contracted);
            self.commit(to_remove - (done.0.faces_removed - removed), done);
            let contracted = done.0.contracted - contracted;
            let is_met = done.0.faces_removed - removed + 1 >= to_remove;
            if is_met || !is_meager(contracted, tried) || wanted >= pool.len() {
                break;
            }
            wanted *= WIDER;
            self.candidates = self.at_free_ends(pool);
        }
    }

    /// Commits the candidates until so many faces are removed.
    fn commit(&mut self, to_remove: usize, done: &mut (Committed, Spent)) {
        // With every pair let through and nothing contracted, there is no later round to wait for.
        let may_wait = !self.pace.is_full();
        let may_overshoot = self.pace.is_full() || self.prepared.border_vertices == 0;
        let quota = Quota { faces: to_remove, of: self.pace.of, may_overshoot };
        self.tried = self.tried.max(self.candidates.len());
        self.pace.known_refusals.leave_out(&mut self.candidates, &self.host.faces.host()[..self.host.face_count]);
        let (carried, joins) = (&mut self.prepared.carried, self.joins.pairs());
        let before = self.recorder.as_ref().map(|_| carried.origin.clone());
        // Where parts join, and with weights, which every round may find anew, more decides than the faces around a pair.
        self.committer.lists_refused =
            self.pace.of == Candidates::Pairs && !self.rules.joins && carried.weights.is_empty();
        self.committer.is_followed =
            self.follower.is_some() || self.history.is_some() || self.recorder.is_some() || !joins.is_empty();
        let (committed, spent) =
            self.committer.commit(&mut self.host, carried, &mut self.candidates, joins, quota, may_wait);
        if let (Some(recorder), Some(mut before)) = (&mut self.recorder, before) {
            recorder.record(&committed, &mut before, carried);
        }
        // What the commits before refused was tried again, and counts once.
        done.0.forget_refused();
        self.pace.known_refusals.count_again(&mut done.0.blocked);
        done.0.add(committed);
        done.1.add(spent);
        self.deviation = self.deviation.max(done.0.deviation);
        if let Some(round) = self.rounds.last_mut() {
            round.contracted = done.0.contracted as u64;
            round.blocked = done.0.blocked;
            round.greatest_cost = f32::from_bits(done.0.greatest_key);
        }
    }

    /// Whether one face may be left of a goal that only a pair on the border removes.
    pub fn has_odd_ends(&self) -> bool {
        self.pace.of == Candidates::Pairs && self.prepared.border_vertices > 0
    }

    /// Removes one face by a pair on the border that costs little more than the dearest of the round did, if one is found: the
    /// next would have to let every pair through. What is refused for it is none of the round's candidates, and not counted.
    fn commit_on_border(&mut self, done: &mut (Committed, Spent)) {
        // Accumulated quadrics have no limit to what is too dear, and faces that cancelled out are gone only after the round.
        let may_find = self.options.metric == Metric::Volume && !self.rules.joins && !self.pace.is_full();
        // A small round of all pairs is cheap, and takes the cheapest.
        if !may_find || !self.has_odd_ends() || self.host.face_count < LARGE_ROUND {
            return;
        }
        self.candidates = self.shortest_on_border(done.0.greatest_key);
        let (blocked, outdated, refused) = (done.0.blocked, done.0.outdated, std::mem::take(&mut done.0.refused));
        self.commit(1, done);
        (done.0.blocked, done.0.outdated, done.0.refused) = (blocked, outdated, refused);
        if let Some(round) = self.rounds.last_mut() {
            round.blocked = done.0.blocked;
        }
    }

    /// Some of the shortest pairs on the border whose ends the round has not contracted yet, as if all cost what `key` tells.
    fn shortest_on_border(&self, key: u32) -> Vec<Candidate> {
        let Surface { positions, faces, ring_starts, ring_faces, face_count, .. } = &self.host;
        let stars = Stars::on_host(positions, faces, ring_starts, ring_faces);
        let roles = self.host.roles.host();
        let of_half_edge = |half_edge: u32| {
            let [u, w] = half_edge_ends(half_edge, stars.faces);
            let [at_u, at_w] = [u, w].map(|v| &stars.positions[v as usize]);
            let may_go = at_u.flags & at_w.flags & (BORDER | LOCKED) == BORDER && (at_u.flags | at_w.flags) & HUB == 0;
            if !may_go || roles[u as usize] != 0 || roles[w as usize] != 0 {
                return None;
            }
            let has_end = |&&f: &&u32| stars.faces[f as usize].corners().contains(&w);
            let is_border = stars.ring(u).iter().filter(has_end).count() == 1;
            is_border.then(|| (at_u.xyz().distance_squared(at_w.xyz()).to_bits(), half_edge))
        };
        let half_edges = (0..3 * *face_count as u32).into_par_iter().with_min_len(CHUNK);
        let mut found: Vec<(u32, u32)> = half_edges.filter_map(of_half_edge).collect();
        if found.len() > SHORTEST {
            found.select_nth_unstable(SHORTEST - 1);
            found.truncate(SHORTEST);
        }
        found.into_iter().map(|(_, half_edge)| Candidate { key, half_edge }).collect()
    }

    /// Whether both ends of a candidate are on a border.
    fn is_border(&self, candidate: &Candidate) -> bool {
        let positions = self.host.positions.host();
        let [u, w] = half_edge_ends(candidate.half_edge, self.host.faces.host());
        positions[u as usize].flags & positions[w as usize].flags & BORDER != 0
    }

    /// Those of `pool` whose ends the round has not contracted yet.
    fn at_free_ends(&self, pool: &[Candidate]) -> Vec<Candidate> {
        let (faces, roles) = (&self.host.faces.host()[..self.host.face_count], self.host.roles.host());
        let is_free = |candidate: &Candidate| {
            let [u, w] = half_edge_ends(candidate.half_edge, faces);
            roles[u as usize] == 0 && roles[w as usize] == 0
        };
        pool.par_iter().filter(|candidate| is_free(candidate)).copied().collect()
    }
}

/// The key of the `count`-th cheapest candidate; the greatest of keys where there are not so many.
fn threshold(candidates: &[Candidate], count: usize) -> u32 {
    if count >= candidates.len() {
        return u32::MAX;
    }
    let mut keys: Vec<u32> = candidates.iter().map(|candidate| candidate.key).collect();
    *keys.select_nth_unstable(count).1
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::super::Options;
    use super::super::filter::Rejection;
    use super::super::levels::Levels;
    use super::super::prepare::prepare;
    use super::super::refusals::Refusal;
    use super::*;
    use crate::backend::Device;
    use crate::mesh::shapes;
    use crate::simplify::Budget;

    #[test]
    fn under_another_error_limit_nothing_is_known_to_be_refused() {
        let (mesh, options, device) = (shapes::icosphere(2), Options::default(), Device::cpu(1).expect("a device"));
        let prepared = prepare(&mesh, &options).expect("a valid mesh");
        let levels = Levels::new(&[Budget::faces(100)], &mesh, prepared.frame).expect("a budget");
        let mut run = Run::new(&mesh, prepared, &options, &device, levels, Instant::now()).expect("room");
        run.set_error_limit(1.0);
        run.pace.known_refusals.keep(&[Refusal::new([0, 1], Rejection::Error)], 0, &run.host);
        for (limit, forgets) in [(1.0, false), (2.0, true)] {
            run.set_error_limit(limit);
            assert_eq!(run.pace.known_refusals.is_empty(), forgets, "{limit}");
        }
    }
}
