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
pub fn sort(candidates: &mut Vec<Candidate>, scratch: &mut Vec<Candidate>, round: u32) {
    if candidates.len() < FEW {
        candidates.sort_unstable_by_key(|c| (c.key, hash(c.half_edge, round)));
        return;
    }
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
        let mut candidates: Vec<Candidate> = (0..100).map(|half_edge| Candidate { key: 5, half_edge }).collect();
        sort(&mut candidates, &mut Vec::new(), 0);
        assert!(candidates.is_sorted_by_key(|c| hash(c.half_edge, 0)));
        assert!(!candidates.is_sorted_by_key(|c| c.half_edge));
    }
}
