//! The gate: how many of the cheapest pairs of a round become its candidates.

pub use crate::kernel::find_threshold::Gate;
use crate::simplify::Blocked;

use super::{Candidates, Metric};

/// Share of the live pairs that the `volume` metric lets through the gate. 15 % loses nothing but rounds.
const VOLUME_SHARE: f64 = 0.5;
/// Live faces from which that share holds. Below it falls with them, to a fifth: rounds are cheap there, and with few
/// faces left every contraction counts (fandisk at 128: 5.5 % above the serial order without, 2.4 % with).
const WIDE_FACES: f64 = 20_000.0;
const LEAST_SHARE: f64 = 0.2;
/// The same while a run is this many times as large as it has to become, and large: what such a round contracts too early a later one
/// would contract anyway.
const FAR_SHARE: f64 = 0.7;
const FAR: usize = 3;
/// The same for `plane`, whose accumulated costs grow as neighbors contract.
const PLANE_SHARE: f64 = 0.15;
/// Candidates for every contraction still needed, and in large rounds.
const CANDIDATES_EACH: f64 = 1.5;
const LARGE_EACH: f64 = 2.0;
/// The same where [`FAR_SHARE`] holds.
const FAR_EACH: f64 = 2.5;
/// The same of large rounds where it is to be the last, for it removes no more than this share of its faces: another would cost more than
/// the order of these few is worth. It is over as soon as it has enough.
const LAST_EACH: f64 = 4.0;
const LAST: f64 = 0.1;
/// The same of triangles, each of which has a corner in common with a dozen others.
const TRIANGLES_EACH: f64 = 4.0;
/// Candidates for every contraction still needed that pass whatever they cost; of `volume` the others only where they cost little more
/// than these. Where few pairs are cheap, as along the rims of a turned part, others are none: whichever has both ends left over in a
/// round was contracted, and one of 18,000 was 40 times as far off as all others together.
const NEEDED_EACH: f64 = 1.0;
/// Candidates for each that is going to be refused again: among those that the gate lets through beside them some are, too.
const REFUSED_EACH: f64 = 1.25;
/// From this share of what a round contracts on, what the shape refuses counts in the gate of the next, too. Without that,
/// features fill the gates of the last rounds, which are more then.
const REFUSING: f64 = 0.1;
/// Faces of a round below which it does not: rounds are cheap there, with few faces left every contraction counts, and what the
/// shape refuses changes with its neighbors.
pub const LARGE_ROUND: usize = 10_000;

/// The candidates that a round refused and the next is going to meet again. Without them in the gate, seams fill it: they are the
/// cheapest in every round.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Refused {
    count: usize,
    /// Those of seams alone, and what waits again, of all pairs of the round.
    share: f64,
}

impl Refused {
    /// Of a round on so many faces that contracted so many of its pairs. So many candidates became dear, and will again, whatever their
    /// neighbors do.
    pub fn new(blocked: &Blocked, outdated: usize, contracted: usize, [faces, pairs]: [usize; 2]) -> Self {
        let by_seams = (blocked.seam + blocked.texture) as usize + outdated;
        let refused = blocked.refused() as usize + outdated;
        let are_many = faces >= LARGE_ROUND && refused as f64 > REFUSING * contracted as f64;
        Self { count: if are_many { refused } else { by_seams }, share: by_seams as f64 / pairs.max(1) as f64 }
    }

    /// For how many the gate of the next round makes room, and a quarter more.
    pub fn count(&self) -> usize {
        self.count
    }
}

impl Gate {
    /// Every pair.
    pub const OPEN: Self = Self { share: u32::MAX, most: u32::MAX, wide_share: 0, wide_most: 0 };

    /// A share of the pairs in 0 … 1, and a number of them.
    pub fn new(share: f64, most: f64) -> Self {
        Self { share: (share * 2.0_f64.powi(32)) as u32, most: most.ceil() as u32, ..Self::OPEN }
    }

    /// Of a round on so many faces: `widening` times what is usual, beside those that will be refused.
    pub fn of_round(
        metric: Metric,
        of: Candidates,
        [faces, target]: [usize; 2],
        widening: f64,
        refused: Refused,
    ) -> Self {
        // Where an error limit ends the run nobody knows how far it is.
        let is_far = metric == Metric::Volume
            && of == Candidates::Pairs
            && faces as f64 >= WIDE_FACES
            && target > 0
            && faces / FAR >= target;
        let share = match metric {
            Metric::Volume => VOLUME_SHARE * (faces as f64 / WIDE_FACES).clamp(LEAST_SHARE, 1.0),
            Metric::Plane => PLANE_SHARE,
        };
        let needed = (faces - target).div_ceil(of.most_faces()) as f64;
        let is_last = (faces - target) as f64 <= LAST * faces as f64;
        let each = match of {
            Candidates::Pairs if faces < LARGE_ROUND => CANDIDATES_EACH,
            Candidates::Pairs if is_last => LAST_EACH,
            Candidates::Pairs => LARGE_EACH,
            Candidates::Triangles => TRIANGLES_EACH,
        };
        let beside = (REFUSED_EACH * refused.share, REFUSED_EACH * refused.count as f64);
        let gate = |share: f64, each: f64| Self::new(share * widening + beside.0, each * needed * widening + beside.1);
        if metric == Metric::Plane || of == Candidates::Triangles {
            return gate(share, each);
        }
        let usual = gate(share, NEEDED_EACH);
        let wide = if is_far { gate(FAR_SHARE, FAR_EACH) } else { gate(share, each) };
        Self { wide_share: wide.share, wide_most: wide.most, ..usual }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(faces: usize, target: usize, refused: Refused, pairs: usize) -> usize {
        Gate::of_round(Metric::Volume, Candidates::Pairs, [faces, target], 1.0, refused).wanted(pairs)
    }

    #[test]
    fn what_is_refused_again_is_let_through_beside_what_is_needed() {
        let blocked = Blocked { seam: 60, texture: 20, flip: 920, ..Blocked::default() };
        let refused = |outdated: usize, contracted: usize, faces: usize| {
            Refused::new(&blocked, outdated, contracted, [faces, 45_000])
        };
        let large = |outdated: usize| wanted(30_000, 26_000, refused(outdated, 2_000, 30_000), 45_000);
        assert_eq!([0, 100].map(large), [4_000 + 1_250, 4_000 + 1_375]);
        // The shape's refusals count where they are many, in large rounds alone.
        assert_eq!([9_999, 10_000].map(|faces| refused(20, 2_000, faces).count), [100, 1_020]);
        assert_eq!([10_199, 10_200].map(|contracted| refused(20, contracted, 30_000).count), [1_020, 100]);
        // Where the share is what binds, those of seams come on top of it: a tenth of the pairs, and all.
        let small = |count: usize| wanted(4_000, 100, Refused { count, share: count as f64 / 6_000.0 }, 6_000);
        assert_eq!([0, 80, 800, 80_000].map(small), [600, 700, 1_600, 6_000]);
        assert!((refused(20, 2_000, 30_000).share - 100.0 / 45_000.0).abs() < 1e-12);
    }

    #[test]
    fn large_rounds_let_more_through_and_the_last_most() {
        let each = |faces: usize, needed: usize| {
            let wanted = wanted(faces, faces - 2 * needed, Refused::default(), 100_000);
            wanted as f64 / needed as f64
        };
        assert_eq!([4_000, 1_001, 1_000, 400].map(|needed| each(20_000, needed)), [2.0, 2.0, 4.0, 4.0]);
        assert_eq!([10_000, 9_998].map(|faces| each(faces, 400)), [4.0, 1.5]);
    }

    #[test]
    fn large_rounds_far_from_their_end_let_more_through() {
        let wanted = |faces, target| wanted(faces, target, Refused::default(), 3 * faces / 2);
        // A third of the faces, and one more: 2.5 and 2 for each contraction.
        assert_eq!([20_000, 20_001].map(|target| wanted(60_000, target)), [50_000, 40_000]);
        // With little left the share is what binds; below 20,000 faces it falls, whatever is left, and where no count is given.
        assert_eq!([1_000, 0].map(|target| wanted(60_000, target)), [63_000, 45_000]);
        assert_eq!([20_000, 19_998].map(|faces| wanted(faces, 100)), [21_000, 14_998]);
    }

    #[test]
    fn gate_takes_the_lesser_of_share_and_need() {
        assert_eq!(Gate::new(0.5, 100.0).wanted(30), 15);
        assert_eq!(Gate::new(0.15, 100.0).wanted(20), 3);
        assert_eq!(Gate::new(0.5, 2.5).wanted(30), 3);
        assert_eq!(Gate::new(1.0, 1e12), Gate::OPEN);
        assert_eq!(Gate::OPEN.wanted(30), 30);
    }
}
