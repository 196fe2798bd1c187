//! Dealing a round's candidates to patches: each looks through those whose lower end may be its own, takes what lies inside,
//! and leaves the rest to the larger patches of the next level. No list is sorted for it, and nobody waits.

use std::ops::Range;

use crate::kernel::pairs::half_edge_ends;
use crate::kernel::rows::{Candidate, Face};

/// What patches are dealt from.
#[derive(Debug, Clone, Copy)]
pub enum Pile<'a> {
    /// A list that ascends by lower end, of which every patch has a piece; what stands in another's waits for a larger one.
    List(&'a [Candidate]),
    /// What the patches of the level before left over.
    Left(&'a [Left]),
}

/// Candidates that a patch left over.
#[derive(Debug)]
pub struct Left {
    pub candidates: Vec<Candidate>,
    /// The least lower end and the greatest.
    least: u32,
    greatest: u32,
}

/// What is dealt to a patch.
#[derive(Debug)]
pub struct Share {
    /// Candidates with both ends inside.
    pub own: Vec<Candidate>,
    pub left: Left,
}

impl Pile<'_> {
    /// How many candidates there are.
    pub fn len(&self) -> usize {
        match self {
            Self::List(candidates) => candidates.len(),
            Self::Left(left) => left.iter().map(|left| left.candidates.len()).sum(),
        }
    }

    /// Where the piece of every patch of `size` vertices begins, and the end; nothing where there are no pieces.
    pub fn cut(&self, faces: &[Face], size: usize, patches: usize) -> Vec<usize> {
        let Self::List(candidates) = *self else { return Vec::new() };
        let mut starts = vec![0];
        for patch in 1..patches {
            let (start, end) = (starts[patch - 1], (patch * size) as u32);
            starts.push(start + candidates[start..].partition_point(|&candidate| lower_end(candidate, faces) < end));
        }
        starts.push(candidates.len());
        starts
    }

    /// The share of the patch of this number and these vertices, of a pile cut so.
    pub fn share(&self, starts: &[usize], patch: usize, vertices: &Range<u32>, faces: &[Face]) -> Share {
        match *self {
            Self::List(candidates) => {
                let piece = &candidates[starts[patch]..starts[patch + 1]];
                let mut share = Share::new(piece.len());
                share.take(piece, vertices, faces, |_| true);
                share
            }
            Self::Left(left) => {
                let mut share = Share::new(0);
                for Left { candidates, .. } in left.iter().filter(|left| left.may_meet(vertices)) {
                    share.take(candidates, vertices, faces, |lower_end| vertices.contains(&lower_end));
                }
                share
            }
        }
    }
}

impl Left {
    /// Adds a candidate.
    pub fn push(&mut self, candidate: Candidate, faces: &[Face]) {
        let lower_end = lower_end(candidate, faces);
        (self.least, self.greatest) = (self.least.min(lower_end), self.greatest.max(lower_end));
        self.candidates.push(candidate);
    }

    fn may_meet(&self, vertices: &Range<u32>) -> bool {
        self.least < vertices.end && vertices.start <= self.greatest
    }
}

impl Share {
    fn new(most: usize) -> Self {
        let left = Left { candidates: Vec::new(), least: u32::MAX, greatest: 0 };
        Self { own: Vec::with_capacity(most), left }
    }

    /// Takes candidates with both ends among `vertices`; leaves those over whose lower end is to be looked after here.
    fn take(
        &mut self,
        candidates: &[Candidate],
        vertices: &Range<u32>,
        faces: &[Face],
        looks_after: impl Fn(u32) -> bool,
    ) {
        for &candidate in candidates {
            let [u, w] = half_edge_ends(candidate.half_edge, faces);
            if vertices.contains(&u) & vertices.contains(&w) {
                self.own.push(candidate);
            } else if looks_after(u.min(w)) {
                self.left.push(candidate, faces);
            }
        }
    }
}

/// The lower end of a candidate.
pub fn lower_end(candidate: Candidate, faces: &[Face]) -> u32 {
    let [u, w] = half_edge_ends(candidate.half_edge, faces);
    u.min(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Face i joins vertices i and i + 1 by its first half-edge, that of the candidate with the key i.
    fn strip(count: u32) -> (Vec<Face>, Vec<Candidate>) {
        let faces = (0..count).map(|i| Face { a: i, b: i + 1, c: i + 2 });
        let candidates = (0..count).map(|i| Candidate { key: i, half_edge: 3 * i });
        (faces.collect(), candidates.collect())
    }

    /// What all patches of this size take and leave over.
    fn deal(pile: Pile<'_>, faces: &[Face], size: usize) -> Vec<Share> {
        let patches = (faces.len() + 1).div_ceil(size);
        let starts = pile.cut(faces, size, patches);
        let vertices = |patch: usize| (patch * size) as u32..((patch + 1) * size) as u32;
        (0..patches).map(|patch| pile.share(&starts, patch, &vertices(patch), faces)).collect()
    }

    fn keys<'c>(candidates: impl IntoIterator<Item = &'c Candidate>) -> Vec<u32> {
        candidates.into_iter().map(|candidate| candidate.key).collect()
    }

    #[test]
    fn every_patch_takes_its_own_and_leaves_what_crosses() {
        let (faces, candidates) = strip(400);
        let pile = Pile::List(&candidates);
        assert_eq!(pile.len(), 400);
        let shares = deal(pile, &faces, 10);
        for (first, share) in (0..).step_by(10).zip(&shares) {
            assert_eq!(keys(&share.own), (first..400.min(first + 9)).collect::<Vec<u32>>());
            assert_eq!(keys(&share.left.candidates), (first + 9..400.min(first + 10)).collect::<Vec<u32>>());
        }
        // Left over are those from 9, 19, 29, …; patches of 25 vertices have all but those from 49, 99, 149, ….
        let left: Vec<Left> = shares.into_iter().map(|share| share.left).collect();
        let pile = Pile::Left(&left);
        assert_eq!(pile.len(), 40);
        let shares = deal(pile, &faces, 25);
        let crossing: Vec<u32> = (49..400).step_by(50).collect();
        assert_eq!(keys(shares.iter().flat_map(|share| &share.left.candidates)), crossing);
        let own: Vec<u32> = (9..400).step_by(10).filter(|key| !crossing.contains(key)).collect();
        assert_eq!(keys(shares.iter().flat_map(|share| &share.own)), own);
    }

    #[test]
    fn nothing_is_lost_in_any_order() {
        let (faces, candidates) = strip(400);
        let shuffled: Vec<Candidate> = (0..400).map(|i| candidates[i * 7 % 400]).collect();
        let mut left: Option<Vec<Left>> = None;
        let mut taken = Vec::new();
        for size in [10, 40, 201] {
            let pile = left.as_deref().map_or(Pile::List(&shuffled), Pile::Left);
            let shares = deal(pile, &faces, size);
            taken.extend(shares.iter().flat_map(|share| &share.own).copied());
            left = Some(shares.into_iter().map(|share| share.left).collect());
        }
        let crossing = left.iter().flatten().flat_map(|left| &left.candidates);
        let mut all = keys(taken.iter().chain(crossing));
        all.sort_unstable();
        assert_eq!(all, (0..400).collect::<Vec<u32>>());
        assert!(taken.len() > 390, "{}", taken.len());
    }
}
