//! The order of candidates: ascending by cost, ties by a hash.
//!
//! Not by index: on flats thousands of costs are 0, and taking them by index eats the mesh from one end.

use crate::kernel::rows::Candidate;
use crate::math::tie_hash as hash;

const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Costs that differ in no more than so many of their last bits are ties, to be told apart by two digits: by less than a part in
/// 8,192, which is less than they change until their turn comes.
const TIED_BITS: u32 = u32::BITS - 2 * DIGIT_BITS;
/// Fewer candidates than this are sorted by comparison: the counters of a radix sort alone take longer.
const FEW: usize = 512;

/// Sorts candidates by (cost, first digit of the hash of half-edge and round), the rest as they stand. `scratch` is overwritten.
pub fn sort(candidates: &mut [Candidate], scratch: &mut Vec<Candidate>, round: u32) {
    let cost = |c: &Candidate| c.key >> TIED_BITS;
    let first = |c: &Candidate| hash(c.half_edge, round) >> (u32::BITS - DIGIT_BITS);
    if candidates.len() < FEW {
        candidates.sort_by_key(|c| (cost(c), first(c)));
        return;
    }
    if scratch.len() < candidates.len() {
        scratch.resize(candidates.len(), Candidate::default());
    }
    let digit = |c: &Candidate, pass: usize| match pass {
        0 => first(c) as usize,
        1 => cost(c) as usize % DIGITS,
        _ => cost(c) as usize / DIGITS,
    };
    radix_sort(candidates, scratch, digit);
}

/// Three passes, the least significant digit first; a pass whose digits are all equal is left out. `scratch` has at least as many
/// rows.
fn radix_sort(candidates: &mut [Candidate], scratch: &mut [Candidate], digit: impl Fn(&Candidate, usize) -> usize) {
    let mut counts = vec![[0_u32; DIGITS]; 3];
    for candidate in candidates.iter() {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(candidate, pass)] += 1;
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
            let start = &mut starts[digit(candidate, pass)];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorts_like_a_stable_sort() {
        for count in [100, 5000_u32] {
            let keys = (0..count).map(|i| if i % 3 == 0 { 0 } else { hash(i, 9) >> (i % 20 + 1) });
            let mut candidates: Vec<Candidate> =
                keys.enumerate().map(|(i, key)| Candidate { key, half_edge: i as u32 }).collect();
            let mut expected = candidates.clone();
            expected.sort_by_key(|c| (c.key >> 10, hash(c.half_edge, 4) >> 21));
            sort(&mut candidates, &mut Vec::new(), 4);
            assert_eq!(candidates, expected);
        }
    }

    #[test]
    fn equal_costs_are_ordered_by_hash() {
        for count in [100, 511, 512, 9000] {
            let mut candidates: Vec<Candidate> = (0..count).map(|half_edge| Candidate { key: 5, half_edge }).collect();
            sort(&mut candidates, &mut Vec::new(), 3);
            assert_eq!(candidates.len(), count as usize);
            assert!(candidates.is_sorted_by_key(|c| hash(c.half_edge, 3) >> 21));
            assert!(!candidates.is_sorted_by_key(|c| c.half_edge));
        }
    }
}
