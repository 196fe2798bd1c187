//! What the rounds of a run tell the next one: what it contracts, how wide its gate is, and which pairs it is going to refuse.

use crate::simplify::Blocked;

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

    /// Widens the gate after a round that mostly met refusals, narrows it again after a good one, and notes how many pairs the next
    /// is going to refuse again: of a round on so many faces and pairs, which contracted so many of those that it tried.
    pub fn adapt(&mut self, blocked: &Blocked, outdated: usize, [contracted, tried]: [usize; 2], sizes: [usize; 2]) {
        self.refused = match self.of {
            Candidates::Pairs => Refused::new(blocked, outdated, contracted, sizes),
            Candidates::Triangles => Refused::default(),
        };
        self.widening = if is_meager(contracted, tried) {
            (self.widening * WIDER as f64).min(FULL)
        } else {
            (self.widening / WIDER as f64).max(1.0)
        };
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

    #[test]
    fn the_gate_widens_by_fours_and_narrows_again() {
        let mut pace = Pace::new(Candidates::Pairs);
        let mut after = |contracted: usize| {
            pace.adapt(&Blocked::default(), 0, [contracted, 100], [1000, 1500]);
            (pace.widening, pace.is_full())
        };
        let widened = [4, 4, 4, 4].map(&mut after);
        assert_eq!(widened, [(4.0, false), (16.0, false), (64.0, true), (64.0, true)]);
        assert_eq!([5, 90, 90, 90].map(&mut after).map(|(widening, _)| widening), [16.0, 4.0, 1.0, 1.0]);
        pace.widen(false);
        assert_eq!(pace.widening, 4.0);
        pace.widen(true);
        assert!(pace.is_full());
        pace.begin_level(Candidates::Pairs);
        assert_eq!(pace.widening, 1.0);
    }

    #[test]
    fn triangles_expect_no_refusals() {
        let blocked = Blocked { seam: 60, ..Blocked::default() };
        let expects = |of: Candidates| {
            let mut pace = Pace::new(of);
            pace.adapt(&blocked, 0, [10, 100], [1000, 1500]);
            pace.refused != Refused::default()
        };
        assert_eq!([Candidates::Pairs, Candidates::Triangles].map(expects), [true, false]);
    }
}
