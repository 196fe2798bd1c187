//! Dealing a round's candidates to patches.
//!
//! In two stable steps that run in parallel: every chunk of the candidates sorts its own by patch, then every patch takes
//! its share of each chunk, so that a patch has its candidates in the order of the list.

use rayon::prelude::*;

use crate::kernel::pairs::half_edge_ends;
use crate::kernel::rows::{Candidate, Face};

/// Candidates that are sorted at a time.
const CHUNK: usize = 1 << 14;

/// Candidates by patch.
#[derive(Debug, Default)]
pub struct Deal {
    /// The candidates, by patch within every chunk; last come those whose ends lie in two patches.
    dealt: Vec<Candidate>,
    /// For every chunk where its share for each patch starts, where those of no patch do, and its end.
    starts: Vec<u32>,
    patches: usize,
}

impl Deal {
    /// Deals `candidates` to as many `patches` of `size` vertices each.
    pub fn deal(&mut self, candidates: &[Candidate], faces: &[Face], size: usize, patches: usize) {
        self.patches = patches;
        self.dealt.clear();
        self.dealt.resize(candidates.len(), Candidate::default());
        self.starts.clear();
        self.starts.resize(candidates.len().div_ceil(CHUNK) * (patches + 2), 0);
        let size = size as u32;
        let patch = |candidate: &Candidate| {
            let [u, w] = half_edge_ends(candidate.half_edge, faces);
            let (first, second) = (u / size, w / size);
            if first == second { first as usize } else { patches }
        };
        (candidates.par_chunks(CHUNK).zip(self.dealt.par_chunks_mut(CHUNK)))
            .zip(self.starts.par_chunks_mut(patches + 2))
            .enumerate()
            .for_each_init(Vec::new, |of_patch: &mut Vec<u32>, (chunk, ((candidates, dealt), starts))| {
                of_patch.clear();
                of_patch.extend(candidates.iter().map(|candidate| patch(candidate) as u32));
                for &patch in of_patch.iter() {
                    starts[patch as usize + 1] += 1;
                }
                for patch in 0..=patches {
                    starts[patch + 1] += starts[patch];
                }
                // The starts move on to the ends, which are the next starts: shifted back by one below.
                for (candidate, &patch) in candidates.iter().zip(of_patch.iter()) {
                    let start = &mut starts[patch as usize];
                    dealt[*start as usize] = *candidate;
                    *start += 1;
                }
                starts.copy_within(0..=patches, 1);
                starts[0] = 0;
                for start in starts {
                    *start += (chunk * CHUNK) as u32;
                }
            });
    }

    /// How many candidates a patch has.
    pub fn count(&self, patch: usize) -> usize {
        self.shares(patch).map(<[_]>::len).sum()
    }

    /// A patch's candidates, in parts.
    pub fn shares(&self, patch: usize) -> impl Iterator<Item = &[Candidate]> {
        let share = move |starts: &[u32]| &self.dealt[starts[patch] as usize..starts[patch + 1] as usize];
        self.starts.chunks_exact(self.patches + 2).map(share)
    }

    /// Those whose ends lie in two patches, in parts.
    pub fn crossing(&self) -> impl Iterator<Item = &[Candidate]> {
        self.shares(self.patches)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_patch_gets_its_own_in_order() {
        // Face i joins vertices i and i + 1; patches of 10 vertices: half-edges at 9, 19, … cross.
        let faces: Vec<Face> = (0..40_000).map(|i| Face { a: i, b: i + 1, c: i + 2 }).collect();
        let candidates: Vec<Candidate> =
            (0..40_000).map(|i| Candidate { key: i, half_edge: 3 * (i * 7 % 40_000) }).collect();
        let mut deal = Deal::default();
        deal.deal(&candidates, &faces, 10, 4_001);
        let all = |shares: &mut dyn Iterator<Item = &[Candidate]>| shares.flatten().copied().collect::<Vec<_>>();
        let mut seen = 0;
        for patch in 0..4_001_u32 {
            let own = |c: &&Candidate| c.half_edge / 30 == patch && c.half_edge / 3 % 10 != 9;
            let expected: Vec<Candidate> = candidates.iter().filter(own).copied().collect();
            assert_eq!(all(&mut deal.shares(patch as usize)), expected);
            assert_eq!(deal.count(patch as usize), expected.len());
            seen += expected.len();
        }
        let expected: Vec<Candidate> = candidates.iter().filter(|c| c.half_edge / 3 % 10 == 9).copied().collect();
        assert_eq!(all(&mut deal.crossing()), expected);
        assert_eq!(seen + expected.len(), candidates.len());
    }
}
