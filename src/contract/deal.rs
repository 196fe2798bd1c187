//! Dealing a round's candidates to patches: each looks through those whose lower end may be its own, takes what lies inside,
//! and leaves the rest to the larger patches of the next levels. No list is sorted for it, and nobody waits.

use std::ops::Range;

use crate::kernel::pairs::half_edge_ends;
use crate::kernel::rows::{Candidate, Face};

use super::reach::Reach;

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

/// Whom is dealt to.
#[derive(Debug, Clone)]
pub struct Taker<'a> {
    /// The number of the patch, and its vertices.
    pub patch: usize,
    pub vertices: Range<u32>,
    /// Its level.
    pub level: usize,
    pub reach: &'a Reach,
}

impl Taker<'_> {
    /// Whether a pair may be contracted within the patch.
    fn may_contract(&self, ends: [u32; 2]) -> bool {
        let [u, w] = ends;
        self.vertices.contains(&u) & self.vertices.contains(&w) && self.reach.may_hold(self.level, ends)
    }
}

/// What is dealt to a patch.
#[derive(Debug)]
pub struct Share {
    /// Candidates whose faces may lie inside.
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

    /// The share of a patch, of a pile cut so.
    pub fn share(&self, starts: &[usize], taker: &Taker<'_>, faces: &[Face]) -> Share {
        match *self {
            Self::List(candidates) => {
                let piece = &candidates[starts[taker.patch]..starts[taker.patch + 1]];
                let mut share = Share::new(piece.len());
                share.take(piece, taker, faces, |_| true);
                share
            }
            Self::Left(left) => {
                let (mut share, vertices) = (Share::new(0), &taker.vertices);
                for Left { candidates, .. } in left.iter().filter(|left| left.may_meet(vertices)) {
                    share.take(candidates, taker, faces, |lower_end| vertices.contains(&lower_end));
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

    /// Takes candidates that may be contracted here; leaves those over whose lower end is to be looked after here.
    fn take(&mut self, candidates: &[Candidate], taker: &Taker<'_>, faces: &[Face], looks_after: impl Fn(u32) -> bool) {
        for &candidate in candidates {
            let [u, w] = half_edge_ends(candidate.half_edge, faces);
            if taker.may_contract([u, w]) {
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

    /// Face i joins vertices i and i + 1 by its first half-edge, that of the candidate with the key i. Faces around its ends
    /// have the vertices from i − 1 to i + 2.
    fn strip(count: u32) -> (Vec<Face>, Vec<Candidate>) {
        let faces = (0..count).map(|i| Face { a: i, b: i + 1, c: i });
        let candidates = (0..count).map(|i| Candidate { key: i, half_edge: 3 * i });
        (faces.collect(), candidates.collect())
    }

    /// What all patches of a level of these sizes take and leave over.
    fn deal(pile: Pile<'_>, faces: &[Face], sizes: &[usize], level: usize) -> Vec<Share> {
        let (size, vertices) = (sizes[level], faces.len() + 1);
        let patches = vertices.div_ceil(size);
        let starts = pile.cut(faces, size, patches);
        let mut reach = Reach::default();
        reach.find(faces, vertices, sizes);
        let share = |patch: usize| {
            let vertices = (patch * size) as u32..((patch + 1) * size) as u32;
            pile.share(&starts, &Taker { patch, vertices, level, reach: &reach }, faces)
        };
        (0..patches).map(share).collect()
    }

    fn keys<'c>(candidates: impl IntoIterator<Item = &'c Candidate>) -> Vec<u32> {
        candidates.into_iter().map(|candidate| candidate.key).collect()
    }

    /// Whether the candidate with this key reaches from one patch of a size to the next.
    fn crosses(key: u32, size: u32) -> bool {
        key.saturating_sub(1) / size != (key + 2).min(400) / size
    }

    #[test]
    fn every_patch_takes_its_own_and_leaves_what_crosses() {
        let (faces, candidates) = strip(400);
        let (pile, sizes) = (Pile::List(&candidates), [10, 25]);
        assert_eq!(pile.len(), 400);
        let shares = deal(pile, &faces, &sizes, 0);
        for (first, share) in (0..).step_by(10).zip(&shares) {
            let (crossing, own): (Vec<u32>, Vec<u32>) = (first..400.min(first + 10)).partition(|&key| crosses(key, 10));
            assert_eq!(keys(&share.own), own);
            assert_eq!(keys(&share.left.candidates), crossing);
        }
        // Left over are those around 10, 20, 30, …; patches of 25 vertices have all but those around 50, 100, 150, ….
        let left: Vec<Left> = shares.into_iter().map(|share| share.left).collect();
        let pile = Pile::Left(&left);
        assert_eq!(pile.len(), 3 * 40 - 1);
        let shares = deal(pile, &faces, &sizes, 1);
        let (crossing, own): (Vec<u32>, Vec<u32>) =
            (0..400).filter(|&key| crosses(key, 10)).partition(|&key| crosses(key, 25));
        assert_eq!(keys(shares.iter().flat_map(|share| &share.left.candidates)), crossing);
        assert_eq!(keys(shares.iter().flat_map(|share| &share.own)), own);
    }

    #[test]
    fn nothing_is_lost_in_any_order() {
        let (faces, candidates) = strip(400);
        let shuffled: Vec<Candidate> = (0..400).map(|i| candidates[i * 7 % 400]).collect();
        let mut left: Option<Vec<Left>> = None;
        let mut taken = Vec::new();
        let sizes = [10, 40, 201];
        for level in 0..sizes.len() {
            let pile = left.as_deref().map_or(Pile::List(&shuffled), Pile::Left);
            let shares = deal(pile, &faces, &sizes, level);
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
