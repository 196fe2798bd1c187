//! A set of vertices in one bit each, whose members are numbered in their order.

use std::ops::Range;

/// Vertices below a number that is fixed at the start.
#[derive(Debug)]
pub struct Marks {
    words: Vec<u64>,
    /// Members below each word, once they are counted.
    below: Vec<u32>,
}

impl Marks {
    /// None of `count` vertices.
    pub fn new(count: usize) -> Self {
        Self { words: vec![0; count.div_ceil(64)], below: Vec::new() }
    }

    pub fn insert(&mut self, vertex: u32) {
        self.words[vertex as usize / 64] |= 1 << (vertex % 64);
    }

    pub fn contains(&self, vertex: u32) -> bool {
        self.words[vertex as usize / 64] >> (vertex % 64) & 1 != 0
    }

    /// Takes all vertices out.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Numbers the members, and returns how many there are.
    pub fn count(&mut self) -> usize {
        let mut sum = 0;
        self.below.clear();
        self.below.extend(self.words.iter().map(|word| {
            sum += word.count_ones();
            sum - word.count_ones()
        }));
        sum as usize
    }

    /// The number of a member, since the last [`Marks::count`].
    pub fn number(&self, vertex: u32) -> u32 {
        let (word, bit) = (vertex as usize / 64, vertex % 64);
        self.below[word] + (self.words[word] & ((1 << bit) - 1)).count_ones()
    }

    /// The members in a range, ascending.
    pub fn members(&self, range: Range<usize>) -> impl Iterator<Item = u32> {
        let words = range.start / 64..range.end.div_ceil(64);
        let first = words.start as u32 * 64;
        let members = (first..).step_by(64).zip(&self.words[words]).flat_map(move |(first, &word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros())?;
                left &= left - 1;
                Some(first + bit)
            })
        });
        members.filter(move |&vertex| range.contains(&(vertex as usize)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_numbered_in_their_order() {
        let mut marks = Marks::new(200);
        let all = [0, 5, 63, 64, 128, 199];
        all.iter().rev().for_each(|&vertex| marks.insert(vertex));
        assert_eq!(marks.count(), all.len());
        assert_eq!(marks.members(0..200).collect::<Vec<_>>(), all);
        assert_eq!(marks.members(5..128).collect::<Vec<_>>(), [5, 63, 64]);
        assert!((0..).zip(all).all(|(number, vertex)| marks.number(vertex) == number));
        assert!(!marks.contains(1) && marks.contains(63));
        marks.clear();
        assert_eq!(marks.count(), 0);
    }
}
