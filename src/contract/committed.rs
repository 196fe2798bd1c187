//! What a round's commit did, and what its tasks spent their time on.

use std::time::Duration;

use crate::kernel::rows::Contraction;
use crate::simplify::Blocked;

use super::refusals::Refusal;

/// What a round's commit did.
#[derive(Debug, Default)]
pub struct Committed {
    /// How many contractions were accepted: two for each triangle.
    pub contracted: usize,
    /// These in order, where somebody follows them: see [`Committer::is_followed`](super::commit::Committer::is_followed).
    pub contractions: Vec<Contraction>,
    /// Faces they removed.
    pub faces_removed: usize,
    /// Those among these that the first contractions of triangles removed.
    pub by_first_steps: usize,
    /// Those among these that cancelled each other out, whose corners still differ.
    pub cancelled: Vec<Cancelled>,
    /// Refusals by reason.
    pub blocked: Blocked,
    /// The refused pairs, where somebody asks for them: see
    /// [`Committer::lists_refused`](super::commit::Committer::lists_refused).
    pub refused: Vec<Refusal>,
    /// Candidates that cost far more than as the round began, by themselves or as faces would cross, and wait for the next.
    pub outdated: usize,
    /// Greatest key of an accepted candidate.
    pub greatest_key: u32,
    /// Greatest estimated deviation of an accepted candidate, in the normalized frame.
    pub deviation: f32,
}

/// A face that vanished where parts met.
#[derive(Debug, Clone, Copy)]
pub struct Cancelled {
    pub face: u32,
    /// The vertex whose contraction laid it on another.
    pub keep: u32,
}

impl Committed {
    /// Forgets what was refused, which is going to be tried again in the same round.
    pub fn forget_refused(&mut self) {
        (self.blocked, self.outdated) = (Blocked::default(), 0);
        self.refused.clear();
    }

    /// Adds what was committed after it, and beside it, in the same round.
    pub fn add(&mut self, other: Self) {
        self.contracted += other.contracted;
        self.contractions.extend(other.contractions);
        self.cancelled.extend(other.cancelled);
        self.faces_removed += other.faces_removed;
        self.by_first_steps += other.by_first_steps;
        self.blocked.add(other.blocked);
        self.refused.extend(other.refused);
        self.outdated += other.outdated;
        self.greatest_key = self.greatest_key.max(other.greatest_key);
        self.deviation = self.deviation.max(other.deviation);
    }
}

/// What the tasks of a commit spent their time on.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spent {
    pub sorting: Duration,
    /// In filters and placements, estimated from the attempts that were timed.
    pub examining: Duration,
    pub total: Duration,
}

impl Spent {
    /// Adds what others spent.
    pub fn add(&mut self, other: Self) {
        self.sorting += other.sorting;
        self.examining += other.examining;
        self.total += other.total;
    }

    /// The wall-clock seconds of a commit split as its tasks spent theirs: ordering, examining, contracting.
    pub fn shares(&self, secs: f64) -> [f64; 3] {
        let total = self.total.as_secs_f64().max(f64::MIN_POSITIVE);
        let share = |part: Duration| (part.as_secs_f64() / total).min(1.0) * secs;
        let select = share(self.sorting);
        // Estimated from some: all of them together may come out as more than there was.
        let filter = share(self.examining).min(secs - select);
        [select, filter, secs - select - filter]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_what_there_was() {
        let spent = |sorting, examining| {
            let [sorting, examining, total] = [sorting, examining, 100].map(Duration::from_millis);
            Spent { sorting, examining, total }
        };
        assert_eq!(spent(25, 50).shares(8.0), [2.0, 4.0, 2.0]);
        assert_eq!(spent(25, 90).shares(8.0), [2.0, 6.0, 0.0]);
        assert_eq!(Spent::default().shares(8.0), [0.0, 0.0, 8.0]);
    }
}
