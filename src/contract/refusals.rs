//! Pairs that a round refused and the next one would: nothing around their ends has changed. The gate counts them as before, but
//! no commit is given them.
//!
//! Under the same rules and error limit a verdict follows from the faces around the ends, and from what their corners carry. A
//! vertex beside no contraction has the same faces, in the same order, in the next round.

use crate::kernel::pair_quadric::NO_KEY;
use crate::kernel::pairs::half_edge_ends;
use crate::kernel::rows::{Candidate, Face};
use crate::simplify::Blocked;

use super::filter::Rejection;
use super::surface::Surface;

/// The greatest share of the vertices that a round may contract for its refusals to be kept: after more, hardly one has two
/// ends that nothing happened around.
const MOST_CONTRACTED: f64 = 0.125;
/// The least refusals for each contraction that are worth the look at what changed.
const LEAST_EACH: f64 = 0.1;

/// A refused pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// The lower end first.
    ends: [u32; 2],
    reason: Rejection,
}

impl Refusal {
    /// Of a pair, for a reason that lies in the faces around it.
    pub fn new([u, w]: [u32; 2], reason: Rejection) -> Self {
        Self { ends: [u.min(w), u.max(w)], reason }
    }
}

/// The pairs that are going to be refused again.
#[derive(Debug, Clone, Default)]
pub struct Refusals {
    /// Ascending by their ends.
    kept: Vec<Refusal>,
    /// Those that were candidates of a commit.
    again: Vec<Refusal>,
    /// How many candidates of a commit had no key.
    without_key: u64,
    /// Which vertices stand beside a contraction.
    changed: Vec<bool>,
}

impl Refusals {
    /// Whether none is known.
    #[cfg(test)]
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Forgets them: under other rules they may be legal.
    pub fn clear(&mut self) {
        self.kept.clear();
        self.again.clear();
    }

    /// Takes them out of the candidates of a commit: all if these ascend by lower end, but for those past the half-edges, and
    /// some if they do not. Takes out what has no key, too: what runs from border to border, whatever happens beside it.
    pub fn leave_out(&mut self, candidates: &mut Vec<Candidate>, faces: &[Face]) {
        self.again.clear();
        let all = candidates.len();
        candidates.retain(|candidate| candidate.key != NO_KEY);
        self.without_key = (all - candidates.len()) as u64;
        if self.kept.is_empty() {
            return;
        }
        let mut first = 0;
        candidates.retain(|candidate| {
            if candidate.half_edge as usize >= 3 * faces.len() {
                return true;
            }
            let [u, w] = half_edge_ends(candidate.half_edge, faces);
            let ends = [u.min(w), u.max(w)];
            while self.kept.get(first).is_some_and(|refusal| refusal.ends[0] < ends[0]) {
                first += 1;
            }
            let mut at_end = self.kept[first..].iter().take_while(|refusal| refusal.ends[0] == ends[0]);
            let known = at_end.find(|refusal| refusal.ends == ends);
            self.again.extend(known);
            known.is_none()
        });
    }

    /// Counts those that were left out last: as refused, though some would not have been examined.
    pub fn count_again(&self, blocked: &mut Blocked) {
        self.again.iter().for_each(|refusal| blocked.count(refusal.reason));
        blocked.border += self.without_key;
    }

    /// How many of those that were left out last had no key.
    pub fn without_key(&self) -> u64 {
        self.without_key
    }

    /// After a round on this surface, which is not compacted yet: keeps those, of it and of before, that nothing happened
    /// around.
    pub fn keep(&mut self, refused: &[Refusal], contracted: usize, surface: &Surface) {
        let are_worth = (self.kept.len() + refused.len()) as f64 >= LEAST_EACH * contracted as f64;
        if !are_worth || contracted as f64 > MOST_CONTRACTED * surface.vertex_count as f64 {
            self.clear();
            return;
        }
        self.kept.extend_from_slice(refused);
        if contracted > 0 {
            self.find_changed(surface);
            self.kept.retain(|refusal| refusal.ends.iter().all(|&v| !self.changed[v as usize]));
        }
        // Those of before are in order, which this sort makes use of.
        self.kept.sort_by_key(|refusal| refusal.ends);
        self.kept.dedup_by_key(|refusal| refusal.ends);
    }

    /// Marks all corners of faces around the vertices that took part in contractions.
    fn find_changed(&mut self, surface: &Surface) {
        let Surface { faces, ring_starts, ring_faces, vertex_count, .. } = surface;
        let (faces, starts, rings) = (faces.host(), ring_starts.host(), ring_faces.host());
        self.changed.clear();
        self.changed.resize(*vertex_count, false);
        let took_part = |&(_, &role): &(usize, &u32)| role != 0;
        for (vertex, _) in surface.roles.host()[..*vertex_count].iter().enumerate().filter(took_part) {
            for &f in &rings[starts[vertex] as usize..starts[vertex + 1] as usize] {
                faces[f as usize].corners().iter().for_each(|&v| self.changed[v as usize] = true);
            }
        }
    }

    /// After a compaction: gives the ends their new numbers, how many live vertices come before each.
    pub fn rename(&mut self, new_vertex: &[u32]) {
        self.kept.iter_mut().for_each(|refusal| refusal.ends = refusal.ends.map(|v| new_vertex[v as usize]));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::carry::Carried;
    use super::super::evaluate::{Evaluation, Round};
    use super::super::examine::{Examiner, Verdict};
    use super::super::gate::Gate;
    use super::super::patch::Patch;
    use super::super::prepare::prepare;
    use super::super::rules::Rules;
    use super::*;
    use crate::backend::Device;
    use crate::math::Vec2;
    use crate::mesh::{Mesh, shapes};

    /// The verdict on every pair of a surface, lower end first.
    fn verdicts(surface: &mut Surface, carried: &mut Carried) -> Vec<([u32; 2], Verdict)> {
        let faces = &surface.faces.host()[..surface.face_count];
        let sides = faces.iter().flat_map(|f| [[f.a, f.b], [f.b, f.c], [f.c, f.a]]);
        let mut pairs: Vec<[u32; 2]> = sides.map(|[u, w]| [u.min(w), u.max(w)]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut examiner = Examiner::new(Rules::new(&Options::default(), false, f64::INFINITY), false, 0.0);
        let patch = Patch::whole(surface, carried);
        pairs.into_iter().map(|pair| (pair, examiner.examine(&patch, pair, f32::INFINITY))).collect()
    }

    /// Contracts one of so many legal pairs of a mesh whose ends are free, keeps what was refused, and looks again; tells how
    /// many refusals there were, how many were kept and how many had changed.
    fn contract_some(mesh: &Mesh, every: usize) -> [usize; 3] {
        let mut prepared = prepare(mesh, &Options::default()).expect("a valid mesh");
        let device = Device::cpu(1).expect("a device");
        let start = prepared.take_start();
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let carried = &mut prepared.carried;
        let (mut refused, mut legal) = (Vec::new(), Vec::new());
        for (pair, verdict) in verdicts(&mut surface, carried) {
            match verdict {
                Verdict::Rejected(reason) => refused.push(Refusal::new([pair[1], pair[0]], reason)),
                Verdict::Accepted(accepted) => legal.push((pair, accepted)),
                Verdict::Dearer(_) | Verdict::Outside => {
                    unreachable!("the patch is the whole surface, and every pair may cost what it does")
                }
            }
        }
        let (mut contracted, mut removed) = (0, 0);
        let mut patch = Patch::whole(&mut surface, carried);
        let mut examiner = Examiner::new(Rules::new(&Options::default(), false, f64::INFINITY), false, 0.0);
        for (pair, _) in legal.into_iter().step_by(every) {
            let is_free = pair.iter().all(|&v| patch.is_free(v));
            if is_free && let Verdict::Accepted(accepted) = examiner.examine(&patch, pair, f32::INFINITY) {
                let Examiner { sides, blend, .. } = &examiner;
                blend.write(&mut patch, sides, &pair, accepted.end);
                patch.contract(pair, &accepted.placed);
                contracted += 1;
                removed += accepted.faces_removed;
            }
        }
        let mut refusals = Refusals::default();
        refusals.keep(&refused, contracted, &surface);
        let (vertices, faces_left) = (surface.vertex_count, surface.face_count - removed);
        surface.compact_on_host(carried, faces_left);
        refusals.rename(&surface.new_vertex()[..vertices]);
        let again = verdicts(&mut surface, carried);
        for refusal in &refusals.kept {
            let found = again.binary_search_by_key(&refusal.ends, |&(pair, _)| pair).map(|place| &again[place].1);
            assert!(
                matches!(found, Ok(Verdict::Rejected(reason)) if *reason == refusal.reason),
                "{refusal:?}: {found:?}"
            );
        }
        [refused.len(), refusals.kept.len(), refused.len() - refusals.kept.len()]
    }

    #[test]
    fn what_is_kept_would_be_refused_again() {
        // Pairs between the holes of a plane, and around rings of three.
        let mut sieve = shapes::plane(30, 20);
        sieve.faces = sieve.faces.chunks(10).flat_map(|faces| &faces[..faces.len() - 2]).copied().collect();
        // And from seam to seam of a texture in strips.
        let mut strips = shapes::plane(30, 20);
        let texcoords = |(f, face): (usize, &[u32; 3])| {
            let strip = 40 * (f / 2 % 30) as u32;
            face.map(|v| Vec2::new((v % 31 + strip) as f32, (v / 31) as f32))
        };
        strips.texcoords = Some(strips.faces.iter().enumerate().map(texcoords).collect());
        for mesh in [sieve, shapes::torus(3, 60), strips] {
            let [refused, kept, changed] = contract_some(&mesh, 41);
            assert!(kept > 0 && changed > 0, "{kept} of {refused}");
            // After too many contractions nothing is looked at.
            assert_eq!(contract_some(&mesh, 1)[1], 0);
        }
    }

    #[test]
    fn known_pairs_are_no_candidates() {
        // Face i has the half-edge from i + 1 to i, of the candidate with the key i.
        let faces: Vec<Face> = (0..6).map(|i| Face { a: i + 1, b: i, c: 9 }).collect();
        let candidate = |i: u32| Candidate { key: i, half_edge: 3 * i };
        let mut refusals = Refusals::default();
        refusals.kept.extend([[1, 2], [1, 7], [3, 4], [5, 8]].map(|ends| Refusal::new(ends, Rejection::Flip)));
        // Past the half-edges stand pairs of others.
        let mut candidates: Vec<Candidate> = [0, 1, 3, 4, 5, 6].map(candidate).to_vec();
        refusals.leave_out(&mut candidates, &faces);
        assert_eq!(candidates, [0, 4, 5, 6].map(candidate));
        let mut blocked = Blocked { flip: 1, ..Blocked::default() };
        refusals.count_again(&mut blocked);
        assert_eq!((refusals.again.len(), blocked.flip), (2, 3));
        refusals.clear();
        refusals.leave_out(&mut candidates, &faces);
        assert_eq!((candidates.len(), refusals.again.len()), (4, 0));
        // What runs from border to border is counted, whatever is known.
        candidates.insert(1, Candidate { key: NO_KEY, half_edge: 3 });
        candidates.push(Candidate { key: NO_KEY, half_edge: 6 });
        refusals.leave_out(&mut candidates, &faces);
        let mut blocked = Blocked::default();
        refusals.count_again(&mut blocked);
        assert_eq!((candidates, blocked.border), ([0, 4, 5, 6].map(candidate).to_vec(), 2));
    }

    /// The pairs without a key of a strip, of a plane of which a corner is locked, and of one with two holes: each is refused for its
    /// border, and no other pair is.
    #[test]
    fn what_has_no_key_is_what_would_join_borders() {
        let mut holed = shapes::plane(9, 9);
        holed.faces.drain(100..102);
        holed.faces.drain(50..54);
        for (mesh, locked) in [(shapes::plane(1, 30), None), (shapes::plane(2, 2), Some(0)), (holed, None)] {
            let locked = locked.map(|first| (0..mesh.positions.len()).map(|v| v == first).collect());
            let options = Options { locked, ..Options::default() };
            let mut prepared = prepare(&mesh, &options).expect("a valid mesh");
            let device = Device::cpu(1).expect("a device");
            let (start, mut candidates) = (prepared.take_start(), Vec::new());
            let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
            let weights = &mut prepared.carried.weights;
            let mut evaluation = Evaluation::new(device.cpu_queue(), &surface, &options, true, None).expect("room");
            let round = Round { joins: &[], gate: Gate::OPEN, weights, wedges: None };
            let pairs = evaluation.run(&surface, round, &mut candidates).expect("room");
            assert_eq!(pairs, candidates.len());
            let mut examiner = Examiner::new(Rules::new(&options, false, f64::INFINITY), false, 0.0);
            let mut joining = 0;
            for &Candidate { key, half_edge } in &candidates {
                let pair = half_edge_ends(half_edge, surface.faces.host());
                let patch = Patch::whole(&mut surface, &mut prepared.carried);
                let verdict = examiner.examine(&patch, pair, f32::INFINITY);
                let is_refused = matches!(verdict, Verdict::Rejected(Rejection::Border));
                assert_eq!(key == NO_KEY, is_refused, "{pair:?}: {verdict:?}");
                joining += usize::from(is_refused);
            }
            assert!(joining > 0 && joining < pairs, "{joining} of {pairs}");
        }
    }
}
