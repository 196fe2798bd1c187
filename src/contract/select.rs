//! Selection: in ascending order of cost, every candidate whose ends are still free takes them.
//!
//! Ties go by a hash and not by index: on flats thousands of costs are 0, and taking them by index eats the mesh from one
//! end.

use crate::kernel::pairs::half_edge_corners;
use crate::kernel::rows::{Candidate, Face};

const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Buffers of the selection that outlive a round.
#[derive(Debug)]
pub struct Selector {
    /// The round in which a vertex was last taken.
    taken: Vec<u32>,
    round: u32,
    scratch: Vec<Candidate>,
}

impl Selector {
    /// For a surface of `vertex_count` vertices.
    pub fn new(vertex_count: usize) -> Self {
        Self { taken: vec![0; vertex_count], round: 0, scratch: Vec::new() }
    }

    /// Sorts candidates by cost, ties by a hash of half-edge and round.
    pub fn sort(&mut self, candidates: &mut Vec<Candidate>) {
        sort(candidates, &mut self.scratch, self.round);
        self.round += 1;
    }

    /// Writes at most `most` of the sorted `candidates` to `selected`: the cheapest of which no two share an end, in the
    /// order of their half-edges, which is that of memory.
    pub fn select(&mut self, candidates: &[Candidate], faces: &[Face], most: usize, selected: &mut Vec<Candidate>) {
        selected.clear();
        for &candidate in candidates {
            if selected.len() == most {
                break;
            }
            let [u, w, _] = half_edge_corners(candidate.half_edge, faces);
            if self.taken[u as usize] != self.round && self.taken[w as usize] != self.round {
                self.taken[u as usize] = self.round;
                self.taken[w as usize] = self.round;
                selected.push(candidate);
            }
        }
        radix_sort(selected, &mut self.scratch, |candidate| candidate.half_edge);
    }
}

/// Sorts candidates by (key, hash of half-edge and round). `scratch` is overwritten.
fn sort(candidates: &mut Vec<Candidate>, scratch: &mut Vec<Candidate>, round: u32) {
    radix_sort(candidates, scratch, |candidate| candidate.key);
    for ties in candidates.chunk_by_mut(|a, b| a.key == b.key) {
        if ties.len() > 1 {
            ties.sort_unstable_by_key(|c| hash(c.half_edge, round));
        }
    }
}

/// Three passes of eleven bits, least significant first; a pass whose digits are all equal is left out.
fn radix_sort(candidates: &mut Vec<Candidate>, scratch: &mut Vec<Candidate>, by: impl Fn(&Candidate) -> u32) {
    scratch.clear();
    scratch.resize(candidates.len(), Candidate::default());
    let mut counts = vec![[0_u32; DIGITS]; 3];
    for candidate in candidates.iter() {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(by(candidate), pass)] += 1;
        }
    }
    for (pass, starts) in counts.iter_mut().enumerate() {
        if starts.iter().any(|&count| count as usize == candidates.len()) {
            continue;
        }
        let mut sum = 0;
        for start in starts.iter_mut() {
            sum += std::mem::replace(start, sum);
        }
        for candidate in candidates.iter() {
            let start = &mut starts[digit(by(candidate), pass)];
            scratch[*start as usize] = *candidate;
            *start += 1;
        }
        std::mem::swap(candidates, scratch);
    }
}

fn digit(key: u32, pass: usize) -> usize {
    (key >> (DIGIT_BITS * pass as u32)) as usize & (DIGITS - 1)
}

/// A bijective mix of 32 bits: no two half-edges tie.
fn hash(half_edge: u32, round: u32) -> u32 {
    let mut x = half_edge ^ round.wrapping_mul(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorts_like_the_standard_sort() {
        let keys = (0..5000_u32).map(|i| if i % 3 == 0 { 0 } else { hash(i, 9) >> (i % 20 + 1) });
        let mut candidates: Vec<Candidate> =
            keys.enumerate().map(|(i, key)| Candidate { key, half_edge: i as u32 }).collect();
        let mut expected = candidates.clone();
        expected.sort_by_key(|c| (c.key, hash(c.half_edge, 4)));
        sort(&mut candidates, &mut Vec::new(), 4);
        assert_eq!(candidates, expected);
    }

    #[test]
    fn cheaper_candidates_take_their_ends() {
        // A strip 0–1–2–3 in one row of faces: pairs 0–1, 1–2 and 2–3 of costs 3, 1, 2.
        let faces = [Face { a: 0, b: 1, c: 4 }, Face { a: 1, b: 2, c: 4 }, Face { a: 2, b: 3, c: 4 }];
        let mut candidates = vec![
            Candidate { key: 3, half_edge: 0 },
            Candidate { key: 1, half_edge: 3 },
            Candidate { key: 2, half_edge: 6 },
        ];
        let mut selector = Selector::new(5);
        let mut selected = Vec::new();
        selector.sort(&mut candidates);
        selector.select(&candidates, &faces, 9, &mut selected);
        assert_eq!(selected, [Candidate { key: 1, half_edge: 3 }]);

        let rest = [Candidate { key: 2, half_edge: 6 }, Candidate { key: 3, half_edge: 0 }];
        selector.sort(&mut rest.to_vec());
        selector.select(&rest, &faces, 9, &mut selected);
        assert_eq!(selected, [rest[1], rest[0]], "in the order of half-edges");
        selector.sort(&mut rest.to_vec());
        selector.select(&rest, &faces, 1, &mut selected);
        assert_eq!(selected, [rest[0]], "the cheapest fits");
    }

    #[test]
    fn equal_keys_alone_are_ordered_by_hash() {
        let mut candidates: Vec<Candidate> = (0..100).map(|half_edge| Candidate { key: 5, half_edge }).collect();
        sort(&mut candidates, &mut Vec::new(), 0);
        assert!(candidates.is_sorted_by_key(|c| hash(c.half_edge, 0)));
        assert!(!candidates.is_sorted_by_key(|c| c.half_edge));
    }
}
