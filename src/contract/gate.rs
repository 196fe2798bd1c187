//! The gate: how many of the cheapest pairs of a round become its candidates.

use crate::kernel::find_threshold::share_of;

use super::{Candidates, Metric};

/// Share of the live pairs that the `volume` metric lets through the gate. 15 % loses nothing but rounds.
const VOLUME_SHARE: f64 = 0.5;
/// Live faces from which that share holds. Below it falls with them, to a fifth: rounds are cheap there, and with few
/// faces left every contraction counts (fandisk at 128: 5.5 % above the serial order without, 2.4 % with).
const WIDE_FACES: f64 = 20_000.0;
const LEAST_SHARE: f64 = 0.2;
/// The same for `plane`, whose accumulated costs grow as neighbors contract.
const PLANE_SHARE: f64 = 0.15;
/// Candidates for every contraction still needed.
const CANDIDATES_EACH: f64 = 1.5;
/// The same of triangles, each of which has a corner in common with a dozen others.
const TRIANGLES_EACH: f64 = 4.0;

/// Candidates for each that is going to be refused again: among those that the gate lets through beside them some are, too.
const REFUSED_EACH: f64 = 1.25;

/// From this share of what a round contracts on, what it refuses counts in the gate of the next. Without that, seams and features
/// fill the gates of the last rounds, which are more then: a flight helmet to 25 % took nine instead of six.
const REFUSING: f64 = 0.1;
/// Faces of a round below which it does not: rounds are cheap there, and with few faces left every contraction counts.
const LARGE_ROUND: usize = 10_000;

/// How many of the candidates that a round of so many faces refused the next is going to meet again, where they are many.
pub fn refused_again(refused: usize, contracted: usize, faces: usize) -> usize {
    let are_many = refused as f64 > REFUSING * contracted as f64;
    if are_many && faces >= LARGE_ROUND { refused } else { 0 }
}

/// How many of the live pairs become candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gate {
    /// At most this share of the live pairs, in units of 2⁻³².
    pub share: u32,
    /// At most this many, before the bucket of the last is completed.
    pub most: u32,
}

impl Gate {
    /// Every pair.
    pub const OPEN: Self = Self { share: u32::MAX, most: u32::MAX };

    /// A share of the pairs in 0 … 1, and a number of them.
    pub fn new(share: f64, most: f64) -> Self {
        Self { share: (share * 2.0_f64.powi(32)) as u32, most: most.ceil() as u32 }
    }

    /// How many of so many pairs it wants.
    pub fn wanted(self, pairs: usize) -> usize {
        share_of(pairs as u32, self.share).min(self.most) as usize
    }

    /// Of a round on so many faces: `widening` times what is usual, beside so many that will be refused.
    pub fn of_round(
        metric: Metric,
        of: Candidates,
        [faces, target]: [usize; 2],
        widening: f64,
        refused: usize,
    ) -> Self {
        let share = match metric {
            Metric::Volume => VOLUME_SHARE * (faces as f64 / WIDE_FACES).clamp(LEAST_SHARE, 1.0),
            Metric::Plane => PLANE_SHARE,
        };
        let needed = (faces - target).div_ceil(of.most_faces()) as f64;
        let each = match of {
            Candidates::Pairs => CANDIDATES_EACH,
            Candidates::Triangles => TRIANGLES_EACH,
        };
        Self::new(share * widening, each * needed * widening + REFUSED_EACH * refused as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_again_is_let_through_beside_what_is_needed() {
        let of_round = |refused: usize| {
            let refused = refused_again(refused, 1_000, 30_000);
            Gate::of_round(Metric::Volume, Candidates::Pairs, [30_000, 28_000], 1.0, refused).wanted(45_000)
        };
        assert_eq!([0, 100, 104, 1_000].map(of_round), [1_500, 1_500, 1_630, 2_750]);
        assert_eq!(of_round(100_000), 22_500);
        // Small rounds are as they were.
        assert_eq!([9_999, 10_000].map(|faces| refused_again(1_000, 1_000, faces)), [0, 1_000]);
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
