//! The order of candidates: ascending by cost, ties by a hash.
//!
//! Not by index: on flats thousands of costs are 0, and taking them by index eats the mesh from one end.

use crate::kernel::rows::Candidate;
use crate::math::tie_hash as hash;

const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Fewer candidates than this are sorted by comparison: the counters of a radix sort alone take longer.
const FEW: usize = 512;

/// Sorts candidates by (key, hash of half-edge and round). `scratch` is overwritten.
pub fn sort(candidates: &mut [Candidate], scratch: &mut Vec<Candidate>, round: u32) {
    if candidates.len() < FEW {
        candidates.sort_unstable_by_key(|c| (c.key, hash(c.half_edge, round)));
        return;
    }
    if scratch.len() < candidates.len() {
        scratch.resize(candidates.len(), Candidate::default());
    }
    radix_sort(candidates, scratch, |candidate| candidate.key);
    for ties in candidates.chunk_by_mut(|a, b| a.key == b.key) {
        let by_hash = |candidate: &Candidate| hash(candidate.half_edge, round);
        match ties.len() {
            1 => {}
            2..FEW => ties.sort_unstable_by_key(by_hash),
            _ => radix_sort(ties, scratch, by_hash),
        }
    }
}

/// Three passes of eleven bits, least significant first; a pass whose digits are all equal is left out. `scratch` has at least
/// as many rows.
fn radix_sort(candidates: &mut [Candidate], scratch: &mut [Candidate], by: impl Fn(&Candidate) -> u32) {
    let mut counts = vec![[0_u32; DIGITS]; 3];
    for candidate in candidates.iter() {
        let key = by(candidate);
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(key, pass)] += 1;
        }
    }
    let count = candidates.len();
    let (mut from, mut to) = (candidates, &mut scratch[..count]);
    let mut is_swapped = false;
    for (pass, starts) in counts.iter_mut().enumerate() {
        if starts.iter().any(|&each| each as usize == count) {
            continue;
        }
        let mut sum = 0;
        for start in starts.iter_mut() {
            sum += std::mem::replace(start, sum);
        }
        for candidate in from.iter() {
            let start = &mut starts[digit(by(candidate), pass)];
            to[*start as usize] = *candidate;
            *start += 1;
        }
        std::mem::swap(&mut from, &mut to);
        is_swapped = !is_swapped;
    }
    if is_swapped {
        to.copy_from_slice(from);
    }
}

fn digit(key: u32, pass: usize) -> usize {
    (key >> (DIGIT_BITS * pass as u32)) as usize & (DIGITS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorts_like_the_standard_sort() {
        for count in [100, 5000_u32] {
            let keys = (0..count).map(|i| if i % 3 == 0 { 0 } else { hash(i, 9) >> (i % 20 + 1) });
            let mut candidates: Vec<Candidate> =
                keys.enumerate().map(|(i, key)| Candidate { key, half_edge: i as u32 }).collect();
            let mut expected = candidates.clone();
            expected.sort_by_key(|c| (c.key, hash(c.half_edge, 4)));
            sort(&mut candidates, &mut Vec::new(), 4);
            assert_eq!(candidates, expected);
        }
    }

    #[test]
    fn equal_keys_alone_are_ordered_by_hash() {
        for count in [100, 511, 512, 9000] {
            let mut candidates: Vec<Candidate> = (0..count).map(|half_edge| Candidate { key: 5, half_edge }).collect();
            sort(&mut candidates, &mut Vec::new(), 3);
            assert_eq!(candidates.len(), count as usize);
            assert!(candidates.is_sorted_by_key(|c| hash(c.half_edge, 3)));
            assert!(!candidates.is_sorted_by_key(|c| c.half_edge));
        }
    }
}
