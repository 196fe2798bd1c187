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

    /// Of a round on so many faces: `widening` times what is usual.
    pub fn of_round(metric: Metric, of: Candidates, faces: usize, target: usize, widening: f64) -> Self {
        let share = match metric {
            Metric::Volume => VOLUME_SHARE * (faces as f64 / WIDE_FACES).clamp(LEAST_SHARE, 1.0),
            Metric::Plane => PLANE_SHARE,
        };
        let needed = (faces - target).div_ceil(of.most_faces()) as f64;
        let each = match of {
            Candidates::Pairs => CANDIDATES_EACH,
            Candidates::Triangles => TRIANGLES_EACH,
        };
        Self::new(share * widening, each * needed * widening)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gate_takes_the_lesser_of_share_and_need() {
        assert_eq!(Gate::new(0.5, 100.0).wanted(30), 15);
        assert_eq!(Gate::new(0.15, 100.0).wanted(20), 3);
        assert_eq!(Gate::new(0.5, 2.5).wanted(30), 3);
        assert_eq!(Gate::new(1.0, 1e12), Gate::OPEN);
        assert_eq!(Gate::OPEN.wanted(30), 30);
    }
}
