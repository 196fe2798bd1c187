//! Joins vertices at bit-equal positions, numbered in the order of their first appearance.

use std::hash::{BuildHasher, Hash};

use rustc_hash::FxBuildHasher;

/// An open-addressing table of vertex numbers; the positions themselves are stored once, in order.
pub(super) struct Joiner<P> {
    slots: Vec<u32>,
    /// The distinct positions.
    pub(super) positions: Vec<P>,
}

const EMPTY: u32 = u32::MAX;

impl<P: Hash + Eq + Copy> Joiner<P> {
    /// With room for about `expected` distinct positions.
    pub(super) fn new(expected: usize) -> Self {
        Self { slots: vec![EMPTY; (2 * expected).next_power_of_two().max(16)], positions: Vec::with_capacity(expected) }
    }

    /// The number of `position`. There must be fewer than `u32::MAX` distinct ones.
    #[inline]
    pub(super) fn number(&mut self, position: P) -> u32 {
        let slot = self.slot(position);
        if self.slots[slot] != EMPTY {
            return self.slots[slot];
        }
        let number = self.positions.len() as u32;
        self.slots[slot] = number;
        self.positions.push(position);
        if 2 * self.positions.len() > self.slots.len() {
            self.grow();
        }
        number
    }

    /// The slot that holds `position` or is free for it.
    fn slot(&self, position: P) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = FxBuildHasher.hash_one(position) as usize & mask;
        while self.slots[slot] != EMPTY && self.positions[self.slots[slot] as usize] != position {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self) {
        self.slots = vec![EMPTY; 2 * self.slots.len()];
        for number in 0..self.positions.len() {
            let slot = self.slot(self.positions[number]);
            self.slots[slot] = number as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_follow_first_appearance_while_the_table_grows() {
        let mut joiner = Joiner::new(0);
        for round in 0..2 {
            for i in 0..10_000_u32 {
                let number = joiner.number([i.wrapping_mul(0x9e37_79b9), 0, i]);
                assert_eq!(number, i, "round {round}");
            }
        }
        assert_eq!(joiner.positions.len(), 10_000);
    }
}
