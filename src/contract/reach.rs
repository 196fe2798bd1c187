//! How far the faces around every vertex reach: the first level of patches that holds them.
//!
//! A face that reaches out of a patch takes part in no contraction within it, and stays at its corners in the patch. So what
//! is told before a commit holds for all of its levels: a candidate is dealt to the first that could contract it.

use std::sync::atomic::{AtomicU8, Ordering};

use rayon::prelude::*;

use crate::kernel::rows::Face;
use crate::kernel::split::CHUNK;

/// The first level of every vertex.
#[derive(Debug, Default)]
pub struct Reach {
    /// One for each vertex of the surface that they were found for.
    levels: Vec<AtomicU8>,
}

impl Reach {
    /// Finds those of so many vertices in patches of so many each; past the last level where none holds a vertex.
    pub fn find(&mut self, faces: &[Face], vertices: usize, sizes: &[usize]) {
        self.levels.truncate(vertices);
        self.levels.iter_mut().for_each(|level| *level.get_mut() = 0);
        self.levels.resize_with(vertices, AtomicU8::default);
        let Some((&smallest, larger)) = sizes.split_first() else { return };
        let smallest = Divisor::new(smallest);
        let reaches_out = |lowest: u32, highest: u32| {
            let holds = |&size: &usize| lowest as usize / size == highest as usize / size;
            (1 + larger.iter().position(holds).unwrap_or(larger.len())) as u8
        };
        faces.par_iter().with_min_len(CHUNK).for_each(|face| {
            let corners = face.corners();
            let [a, b, c] = corners;
            let (lowest, highest) = (a.min(b).min(c), a.max(b).max(c));
            if smallest.quotient(lowest) != smallest.quotient(highest) {
                let level = reaches_out(lowest, highest);
                corners.iter().for_each(|&v| _ = self.levels[v as usize].fetch_max(level, Ordering::Relaxed));
            }
        });
    }

    /// Whether a patch of this level may hold all faces around both vertices.
    #[inline(always)]
    pub fn may_hold(&self, level: usize, vertices: [u32; 2]) -> bool {
        let [first, second] = vertices.map(|v| self.levels[v as usize].load(Ordering::Relaxed));
        usize::from(first.max(second)) <= level
    }
}

/// Divides by the same number, greater than 1, again and again.
#[derive(Debug, Clone, Copy)]
struct Divisor {
    /// 2⁶⁴ over it, rounded up: that adds less than number / 2⁶⁴ to a quotient, which is too little to reach the next one while
    /// both numbers are below 2³².
    inverse: u64,
}

impl Divisor {
    fn new(divisor: usize) -> Self {
        Self { inverse: (u64::MAX / divisor as u64).wrapping_add(1) }
    }

    #[inline(always)]
    fn quotient(self, number: u32) -> u32 {
        ((u128::from(self.inverse) * u128::from(number)) >> 64) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_those_of_a_division() {
        for divisor in [2_usize, 3, 1_024, 4_095, 4_096, 6_250, 2_500_001, 1 << 31] {
            let by = Divisor::new(divisor);
            let numbers = [0, 1, 2, 7].map(|times| times * divisor).into_iter().chain([1 << 32]);
            for number in numbers.flat_map(|at| [at.wrapping_sub(1), at, at + 1]).filter_map(|n| u32::try_from(n).ok())
            {
                assert_eq!(by.quotient(number) as usize, number as usize / divisor, "{number} by {divisor}");
            }
        }
    }

    #[test]
    fn a_vertex_waits_for_patches_that_hold_its_faces() {
        // Patches of 4 and of 8; then faces that reach nowhere, to the next of 4, to the next of 8, and past both from afar.
        let faces = [[0, 1, 2], [2, 3, 4], [8, 7, 6], [1, 16, 20]].map(|[a, b, c]| Face { a, b, c });
        let mut reach = Reach::default();
        for vertices in [40, 24, 30] {
            reach.find(&faces, vertices, &[4, 8]);
            let found: Vec<u8> = reach.levels.iter().map(|level| level.load(Ordering::Relaxed)).collect();
            let mut expected = vec![0; vertices];
            for (level, corners) in [(1, &[2, 3, 4][..]), (2, &[1, 6, 7, 8, 16, 20])] {
                corners.iter().for_each(|&v: &usize| expected[v] = level);
            }
            assert_eq!(found, expected);
        }
        assert!(reach.may_hold(0, [0, 5]) && !reach.may_hold(0, [0, 3]));
        assert!(reach.may_hold(1, [0, 3]) && !reach.may_hold(1, [16, 3]) && reach.may_hold(2, [16, 3]));
        reach.find(&faces, 24, &[]);
        assert!((0..24).all(|v| reach.may_hold(0, [v, 0])));
    }
}
