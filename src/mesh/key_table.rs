//! A concurrent hash table: which of many keys are equal.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use crate::math::DVec3;

/// What may be equal: points (where `-0.0` equals `0.0`) and pairs of integers.
pub(crate) trait Key: Copy + PartialEq + Sync {
    /// Three words that are equal for equal keys.
    fn words(self) -> [u64; 3];
}

impl Key for DVec3 {
    fn words(self) -> [u64; 3] {
        // Adding zero turns -0.0 into 0.0.
        (self + 0.0).to_array().map(f64::to_bits)
    }
}

impl Key for [u32; 2] {
    fn words(self) -> [u64; 3] {
        [self[0].into(), self[1].into(), 0]
    }
}

/// Sets of equal keys, each represented by its lowest index.
///
/// Open addressing. Which slot a set gets depends on the timing of the threads, what the slot holds in the end does not:
/// a slot never changes its set, and takes the minimum of its members.
pub(crate) struct KeyTable<'k, K> {
    keys: &'k [K],
    /// 32 bits of hash above the 32 bits of the lowest index so far, or [`EMPTY`].
    slots: Vec<AtomicU64>,
}

const EMPTY: u64 = u64::MAX;

impl<'k, K: Key> KeyTable<'k, K> {
    /// Sorts `keys` into sets; also returns the lowest index equal to each.
    pub fn new(keys: &'k [K]) -> (Self, Vec<u32>) {
        // A quarter free keeps linear probing within a cache line or two.
        let capacity = keys.len() + keys.len() / 3 + 1;
        let slots = (0..capacity).into_par_iter().with_min_len(PARALLEL_ROWS).map(|_| AtomicU64::new(EMPTY)).collect();
        let table = Self { keys, slots };
        let mut lowest: Vec<u32> = (0..keys.len() as u32)
            .into_par_iter()
            .with_min_len(PARALLEL_ROWS)
            .map(|index| table.insert(index) as u32)
            .collect();
        lowest
            .par_iter_mut()
            .with_min_len(PARALLEL_ROWS)
            .for_each(|slot| *slot = table.slots[*slot as usize].load(Relaxed) as u32);
        (table, lowest)
    }

    /// The lowest index of a key equal to `key`.
    pub fn find(&self, key: K) -> Option<u32> {
        let hash = hash(key);
        let mut slot = self.home(hash);
        loop {
            let entry = self.slots[slot].load(Relaxed);
            if entry == EMPTY {
                return None;
            }
            if self.holds(entry, hash, key) {
                return Some(entry as u32);
            }
            slot = self.after(slot);
        }
    }

    /// The slot of the set of the key at `index`, which now knows of it.
    fn insert(&self, index: u32) -> usize {
        let key = self.keys[index as usize];
        let hash = hash(key);
        let own = u64::from(hash as u32) << 32 | u64::from(index);
        let mut slot = self.home(hash);
        loop {
            let mut entry = self.slots[slot].load(Relaxed);
            if entry == EMPTY {
                match self.slots[slot].compare_exchange(EMPTY, own, Relaxed, Relaxed) {
                    Ok(_) => return slot,
                    Err(other) => entry = other,
                }
            }
            if self.holds(entry, hash, key) {
                if own < entry {
                    self.slots[slot].fetch_min(own, Relaxed);
                }
                return slot;
            }
            slot = self.after(slot);
        }
    }

    fn holds(&self, entry: u64, hash: u64, key: K) -> bool {
        (entry >> 32) as u32 == hash as u32 && self.keys[entry as u32 as usize] == key
    }

    fn home(&self, hash: u64) -> usize {
        (((hash >> 32) * self.slots.len() as u64) >> 32) as usize
    }

    fn after(&self, slot: usize) -> usize {
        if slot + 1 < self.slots.len() { slot + 1 } else { 0 }
    }
}

/// The distinct of `points` in the order of their first appearance, and the number of each point's equal among them.
pub(crate) fn distinct(points: &[DVec3]) -> (Vec<DVec3>, Vec<u32>) {
    let (_, mut numbers) = KeyTable::new(points);
    let mut firsts = Vec::new();
    for point in 0..points.len() {
        let lowest = numbers[point] as usize;
        // A lower one has its number already.
        numbers[point] = if lowest < point { numbers[lowest] } else { firsts.len() as u32 };
        if lowest == point {
            firsts.push(points[point]);
        }
    }
    (firsts, numbers)
}

/// Two folded multiplications; the odd constants are digits of π, which spread the short mantissas of rounded input.
fn hash(key: impl Key) -> u64 {
    let fold = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        product as u64 ^ (product >> 64) as u64
    };
    let [x, y, z] = key.words();
    fold(fold(x ^ 0x243f_6a88_85a3_08d3, y ^ 0x1319_8a2e_0370_7345) ^ z, 0xa409_3822_299f_31d1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_points_share_their_lowest_index() {
        let points = [[0.0, 1.0, 2.0], [5.0; 3], [-0.0, 1.0, 2.0], [5.0; 3], [1.0, 0.0, 2.0]].map(DVec3::from);
        let (table, lowest) = KeyTable::new(&points);
        assert_eq!(lowest, [0, 1, 0, 1, 4]);
        assert_eq!(table.find(DVec3::splat(5.0)), Some(1));
        assert_eq!(table.find(DVec3::splat(4.0)), None);
        assert_eq!(distinct(&points), (vec![points[0], points[1], points[4]], vec![0, 1, 0, 1, 2]));
    }

    #[test]
    fn pairs_of_integers_are_keys() {
        let keys = [[1, 2], [2, 1], [1, 2], [0, 0]];
        let (table, lowest) = KeyTable::new(&keys);
        assert_eq!(lowest, [0, 1, 0, 3]);
        assert_eq!((table.find([2, 1]), table.find([2, 2])), (Some(1), None));
    }

    #[test]
    fn no_keys() {
        let (table, lowest) = KeyTable::<DVec3>::new(&[]);
        assert!(lowest.is_empty());
        assert_eq!(table.find(DVec3::ZERO), None);
    }
}
