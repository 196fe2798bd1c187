//! The edges that a sweep line meets, from west to east.

/// Edges of a block, at most: inserting moves no more than that many.
const BLOCK: usize = 512;

/// A sequence kept in blocks, so that inserting does not move all of it. The caller knows its order.
pub struct Line {
    /// None is empty but the only one.
    blocks: Vec<Vec<u32>>,
}

/// A place between two edges: a block, and how many of its edges lie west.
#[derive(Debug, Clone, Copy)]
pub struct Gap {
    block: usize,
    at: usize,
}

impl Line {
    pub fn new() -> Self {
        Self { blocks: vec![Vec::new()] }
    }

    /// The place east of all edges that are west of something.
    pub fn find(&self, is_west: impl Fn(u32) -> bool) -> Gap {
        let starts_west = |block: &Vec<u32>| block.first().is_some_and(|&edge| is_west(edge));
        let block = self.blocks.partition_point(starts_west).saturating_sub(1);
        Gap { block, at: self.blocks[block].partition_point(|&edge| is_west(edge)) }
    }

    pub fn west(&self, gap: Gap) -> Option<u32> {
        match gap.at {
            0 => self.blocks[..gap.block].last()?.last(),
            at => self.blocks[gap.block].get(at - 1),
        }
        .copied()
    }

    pub fn east(&self, gap: Gap) -> Option<u32> {
        let block = &self.blocks[gap.block];
        block.get(gap.at).or_else(|| self.blocks.get(gap.block + 1)?.first()).copied()
    }

    /// Takes out the edge east of a place, which stays where it is.
    pub fn remove_east(&mut self, gap: Gap) {
        if gap.at < self.blocks[gap.block].len() {
            self.blocks[gap.block].remove(gap.at);
        } else if let Some(next) = self.blocks.get_mut(gap.block + 1) {
            next.remove(0);
            if next.is_empty() {
                self.blocks.remove(gap.block + 1);
            }
        }
    }

    /// Puts edges at a place. No place is valid any more.
    pub fn insert(&mut self, gap: Gap, edges: &[u32]) {
        let block = &mut self.blocks[gap.block];
        block.splice(gap.at..gap.at, edges.iter().copied());
        if block.len() > BLOCK {
            let half = block.split_off(block.len() / 2);
            self.blocks.insert(gap.block + 1, half);
        } else if block.is_empty() && self.blocks.len() > 1 {
            self.blocks.remove(gap.block);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::tie_hash;

    /// Against a plain list: insert, look around, take out, in an order without order.
    #[test]
    fn it_is_a_sorted_list() {
        let (mut line, mut list) = (Line::new(), Vec::<u32>::new());
        for step in 0..20_000 {
            let value = tie_hash(step, 1) % 4096;
            let at = list.partition_point(|&other| other < value);
            let gap = line.find(|other| other < value);
            assert_eq!(line.west(gap), at.checked_sub(1).map(|at| list[at]));
            assert_eq!(line.east(gap), list.get(at).copied());
            if list.get(at) == Some(&value) || (step > 10_000 && at < list.len()) {
                list.remove(at);
                line.remove_east(gap);
                line.insert(gap, &[]);
            } else {
                list.insert(at, value);
                line.insert(gap, &[value]);
            }
        }
        assert_eq!(line.blocks.concat(), list);
        assert!(line.blocks.len() == 1 || line.blocks.iter().all(|block| !block.is_empty() && block.len() <= BLOCK));
    }
}
