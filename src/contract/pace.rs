//! What the rounds of a run tell the next one: what it contracts, how wide its gate is, and which pairs it is going to refuse.

use crate::simplify::{Blocked, RoundRecord};

use super::Candidates;
use super::gate::Refused;
use super::refusals::Refusals;

/// A round that contracts less than this share of its candidates widens the gate of the next.
const MEAGER: f64 = 0.05;
/// How many times wider the gate is then.
pub const WIDER: usize = 4;
/// A gate this many times wider than usual lets every pair through.
const FULL: f64 = 64.0;

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

/// A round that is over.
#[derive(Debug, Clone, Copy)]
pub struct Done<'a> {
    /// What it was on, and how many candidates its gate let through.
    pub round: RoundRecord,
    pub blocked: &'a Blocked,
    /// How many pairs became dear that are going to be refused again.
    pub outdated: usize,
    pub contracted: usize,
    /// How many candidates its commits had at most.
    pub tried: usize,
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

    /// After a round that contracted something: notes how many pairs the next is going to refuse, widens its gate where most were
    /// refused, and narrows it again where those would not fill it. Of features and seams the cheapest are refused in every round.
    pub fn adapt(&mut self, done: Done<'_>) {
        let Done { round: RoundRecord { faces, pairs, candidates, .. }, blocked, outdated, contracted, tried } = done;
        let unexpected = (blocked.refused() as usize).saturating_sub(self.refused.count());
        self.refused = match self.of {
            Candidates::Pairs => Refused::new(blocked, outdated, contracted, [faces as usize, pairs as usize]),
            Candidates::Triangles => Refused::default(),
        };
        if is_meager(contracted, tried) {
            self.widening = (self.widening * WIDER as f64).min(FULL);
        } else if WIDER * unexpected < candidates as usize {
            self.widening = (self.widening / WIDER as f64).max(1.0);
        }
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

    /// Adapts to a round on 1,000 faces that tried all of its 100 candidates.
    fn after(pace: &mut Pace, contracted: usize, blocked: Blocked) -> f64 {
        let round = RoundRecord { faces: 1000, pairs: 1500, candidates: 100, ..RoundRecord::default() };
        pace.adapt(Done { round, blocked: &blocked, outdated: 0, contracted, tried: 100 });
        pace.widening
    }

    #[test]
    fn the_gate_widens_by_fours_and_narrows_again() {
        let mut pace = Pace::new(Candidates::Pairs);
        let mut widening = |contracted: usize| after(&mut pace, contracted, Blocked::default());
        assert_eq!([4; 4].map(&mut widening), [4.0, 16.0, 64.0, 64.0]);
        assert_eq!([5, 90, 90, 90].map(&mut widening), [16.0, 4.0, 1.0, 1.0]);
        pace.widen(false);
        assert!(pace.widening == 4.0 && !pace.is_full());
        pace.widen(true);
        assert!(pace.is_full());
        pace.begin_level(Candidates::Pairs);
        assert_eq!(pace.widening, 1.0);
    }

    /// A quarter of 100 candidates would be these alone.
    #[test]
    fn a_gate_that_refusals_would_fill_is_not_narrowed_to() {
        let after_two = |blocked: Blocked, others: Blocked| {
            let mut pace = Pace { widening: 16.0, ..Pace::new(Candidates::Pairs) };
            [blocked, others].map(|blocked| after(&mut pace, 20, blocked))
        };
        let flips = |flip: u64| Blocked { flip, ..Blocked::default() };
        assert_eq!([24, 25].map(|count| after_two(flips(count), flips(count))), [[4.0, 1.0], [16.0, 16.0]]);
        // Next time there is room for what seams refused, beside what the gate lets through.
        let seams = |seam: u64| Blocked { seam, ..Blocked::default() };
        assert_eq!(after_two(seams(60), seams(84)), [16.0, 4.0]);
        assert_eq!(after_two(seams(60), seams(85)), [16.0, 16.0]);
    }

    #[test]
    fn triangles_expect_no_refusals() {
        let expects = |of: Candidates| {
            let mut pace = Pace::new(of);
            after(&mut pace, 20, Blocked { seam: 60, ..Blocked::default() });
            pace.refused.count()
        };
        assert_eq!([Candidates::Pairs, Candidates::Triangles].map(expects), [60, 0]);
    }
}
