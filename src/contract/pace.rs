//! What the rounds of a run tell the next one: what it contracts, how wide its gate is, and which pairs it is going to refuse.

use crate::simplify::{Blocked, RoundRecord};

use super::Candidates;
use super::gate::{LARGE_ROUND, Refused};
use super::refusals::Refusals;

/// A round that contracts less than this share of its candidates widens the gate of the next.
const MEAGER: f64 = 0.05;
/// How many times wider the gate is then.
pub const WIDER: usize = 4;
/// A gate this many times wider than usual lets every pair through.
const FULL: f64 = 64.0;

/// What became of the candidates of a round, beside what its record tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// How many a commit tried at most.
    pub count: usize,
    /// How many the last one let wait, for they became dear.
    pub outdated: usize,
    /// Whether attributes decide with the surface.
    pub has_attributes: bool,
}

/// What the next round goes by.
#[derive(Debug, Clone)]
pub struct Pace {
    /// What rounds contract from here on.
    pub of: Candidates,
    /// How many times wider than usual the gate is.
    pub widening: f64,
    /// How many pairs the next round is expected to refuse.
    pub refused: Refused,
    /// The pairs that it would refuse for sure.
    pub known_refusals: Refusals,
}

impl Pace {
    /// At the start of a run.
    pub fn new(of: Candidates) -> Self {
        Self { of, widening: 1.0, refused: Refused::default(), known_refusals: Refusals::default() }
    }

    /// Heads for the next level as a run that starts here would.
    pub fn begin_level(&mut self, of: Candidates) {
        (self.of, self.widening, self.refused) = (of, 1.0, Refused::default());
        self.known_refusals.clear();
    }

    /// Whether the gate lets every pair through.
    pub fn is_full(&self) -> bool {
        self.widening >= FULL
    }

    /// After a round that contracted something: notes how many pairs the next is going to refuse, widens its gate where little was
    /// contracted of what was tried, and narrows it again where what it makes no room for would not fill the narrower one. Features are the
    /// cheapest, and refused, in every round.
    ///
    /// What waits is mostly as cheap as it looks once its neighbors are done. Not where attributes decide, nor, in a large round, where more
    /// waits than was contracted: of rims and tips planes tell too little in every round.
    pub fn adapt(&mut self, round: &RoundRecord, Tried { count: tried, outdated, has_attributes }: Tried) {
        let RoundRecord { faces, pairs, candidates, contracted, .. } = *round;
        let [faces, pairs, candidates, contracted] = [faces, pairs, candidates, contracted].map(|count| count as usize);
        let is_most = self.of == Candidates::Pairs && faces >= LARGE_ROUND && outdated > contracted;
        let outdated = if has_attributes || is_most { outdated } else { 0 };
        // What has no key is past all that cost something: no gate but one of all pairs lets it through.
        let border = round.blocked.border.saturating_sub(self.known_refusals.without_key());
        let blocked = &Blocked { border, ..round.blocked };
        self.refused = match self.of {
            Candidates::Pairs => Refused::new(blocked, outdated, contracted, [faces, pairs]),
            Candidates::Triangles => Refused::default(),
        };
        // What is past the error limit is among the dearest.
        let cheap = (blocked.refused() - blocked.error) as usize + outdated;
        let without_room = cheap.saturating_sub(self.refused.count());
        if is_meager(contracted, tried) {
            self.widening = (self.widening * WIDER as f64).min(FULL);
        } else if self.is_full() || WIDER * without_room < candidates {
            // Full is more than wide: no pair waits then for having become dear.
            self.widening = (self.widening / WIDER as f64).max(1.0);
        }
    }

    /// Goes on with pairs, where there is nothing else left to contract.
    pub fn go_on_with_pairs(&mut self) {
        (self.of, self.widening) = (Candidates::Pairs, 1.0);
    }

    /// Widens the gate after a round that contracted nothing, or lets every pair through `at_once`.
    pub fn widen(&mut self, at_once: bool) {
        self.widening = if at_once { FULL } else { (self.widening * WIDER as f64).min(FULL) };
    }
}

/// Whether a commit contracted too few of what it tried.
pub fn is_meager(contracted: usize, tried: usize) -> bool {
    (contracted as f64) < MEAGER * tried as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::pair_quadric::NO_KEY;
    use crate::kernel::rows::Candidate;

    /// All of 200 candidates.
    fn tried(outdated: usize, has_attributes: bool) -> Tried {
        Tried { count: 200, outdated, has_attributes }
    }

    /// Adapts to a round on 1,000 faces that tried all of its 200 candidates; returns how wide the next gate is.
    fn after(pace: &mut Pace, contracted: u64, blocked: Blocked) -> f64 {
        let round =
            RoundRecord { faces: 1000, pairs: 1500, candidates: 200, contracted, blocked, ..RoundRecord::default() };
        pace.adapt(&round, tried(0, false));
        pace.widening
    }

    /// A pace that has widened so far.
    fn widened(widening: f64) -> Pace {
        Pace { widening, ..Pace::new(Candidates::Pairs) }
    }

    fn flips(flip: u64) -> Blocked {
        Blocked { flip, ..Blocked::default() }
    }

    #[test]
    fn the_gate_widens_by_fours_and_narrows_again() {
        let mut pace = Pace::new(Candidates::Pairs);
        let mut widening = |contracted: u64| after(&mut pace, contracted, Blocked::default());
        assert_eq!([9; 4].map(&mut widening), [4.0, 16.0, 64.0, 64.0]);
        assert_eq!([10, 180, 180, 180].map(&mut widening), [16.0, 4.0, 1.0, 1.0]);
        pace.widen(false);
        assert!(pace.widening == 4.0 && !pace.is_full());
        pace.widen(true);
        assert!(pace.is_full());
        pace.begin_level(Candidates::Pairs);
        assert_eq!(pace.widening, 1.0);
    }

    /// A quarter of 200 candidates would be these alone.
    #[test]
    fn a_gate_that_refusals_would_fill_is_not_narrowed_to() {
        let next = |blocked: Blocked| after(&mut widened(16.0), 40, blocked);
        assert_eq!([49, 50].map(|flip| next(flips(flip))), [4.0, 16.0]);
        // The next gate makes room for what seams refused, and nothing past the error limit is among the cheapest.
        let room = |count: u64| Blocked { seam: count, ..flips(49) };
        let past = |count: u64| Blocked { error: count, ..flips(49) };
        assert_eq!([room(100), past(100)].map(next), [4.0; 2]);
        // From a gate that lets every pair through it is always narrowed.
        assert_eq!(after(&mut widened(64.0), 40, flips(150)), 16.0);
    }

    /// Large rounds make room for all that they refuse, and for outdated pairs any round does.
    #[test]
    fn what_there_is_room_for_fills_no_gate() {
        let next = |faces: u64, flip: u64, outdated: usize| {
            let (blocked, mut pace) = (flips(flip), widened(16.0));
            let round = RoundRecord {
                faces,
                pairs: 15_000,
                candidates: 200,
                contracted: 40,
                blocked,
                ..RoundRecord::default()
            };
            pace.adapt(&round, tried(outdated, true));
            pace.widening
        };
        assert_eq!([9_999, 10_000].map(|faces| next(faces, 100, 0)), [16.0, 4.0]);
        assert_eq!([49, 50].map(|flip| next(9_999, flip, 60)), [4.0, 16.0]);
    }

    #[test]
    fn what_waits_is_let_through_again_where_it_is_most() {
        let expects_of = |of: Candidates, faces: u64, outdated: usize, has_attributes: bool| {
            let round = RoundRecord { faces, pairs: 15_000, contracted: 40, ..RoundRecord::default() };
            let mut pace = Pace::new(of);
            pace.adapt(&round, tried(outdated, has_attributes));
            pace.refused.count()
        };
        let expects = |faces, outdated, has_attributes| expects_of(Candidates::Pairs, faces, outdated, has_attributes);
        assert_eq!([40, 41].map(|outdated| expects(10_000, outdated, false)), [0, 41]);
        assert_eq!([9_999, 10_000].map(|faces| expects(faces, 41, false)), [0, 41]);
        assert_eq!([0, 40].map(|outdated| expects(1_000, outdated, true)), [0, 40]);
        assert_eq!(expects_of(Candidates::Triangles, 10_000, 41, false), 0);
    }

    /// Of 200 candidates that were refused for their border some had no key.
    #[test]
    fn there_is_no_room_for_what_has_no_key() {
        let expects = |without_key: u32| {
            let refused = (0..without_key).map(|i| Candidate { key: NO_KEY, half_edge: i });
            let round = RoundRecord {
                faces: 10_000,
                pairs: 15_000,
                candidates: 200,
                contracted: 40,
                blocked: Blocked { border: 100, ..Blocked::default() },
                ..RoundRecord::default()
            };
            let mut pace = Pace::new(Candidates::Pairs);
            pace.known_refusals.leave_out(&mut refused.collect(), &[]);
            pace.adapt(&round, tried(0, false));
            pace.refused.count()
        };
        assert_eq!([0, 60, 100].map(expects), [100, 40, 0]);
    }

    #[test]
    fn triangles_expect_no_refusals() {
        let expects = |of: Candidates| {
            let mut pace = Pace::new(of);
            after(&mut pace, 40, Blocked { seam: 60, ..Blocked::default() });
            pace.refused.count()
        };
        assert_eq!([Candidates::Pairs, Candidates::Triangles].map(expects), [60, 0]);
    }
}
