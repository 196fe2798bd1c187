//! A set of numbers, a bit each, that knows how many of them are below another: sorting without comparing.

/// Bits of a word.
const BITS: usize = u64::BITS as usize;

/// Some of the numbers below a bound.
#[derive(Debug)]
pub struct Ranks {
    /// A bit for every number below the bound.
    words: Vec<u64>,
    /// How many members come before each word, and how many there are.
    before: Vec<u32>,
}

impl Ranks {
    /// Those of `numbers`, all below `bound`, as a set.
    pub fn new(numbers: impl IntoIterator<Item = u32>, bound: usize) -> Self {
        let mut words = vec![0_u64; bound.div_ceil(BITS)];
        numbers.into_iter().for_each(|number| words[number as usize / BITS] |= 1 << (number as usize % BITS));
        let mut before = Vec::with_capacity(words.len() + 1);
        before.push(0);
        before.extend(words.iter().scan(0, |count, word| {
            *count += word.count_ones();
            Some(*count)
        }));
        Self { words, before }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.before[self.words.len()] as usize
    }

    /// How many members are less than a member.
    pub fn of(&self, member: u32) -> usize {
        let (word, bit) = (member as usize / BITS, member as usize % BITS);
        (self.before[word] + (self.words[word] & ((1 << bit) - 1)).count_ones()) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_counted_in_ascending_order() {
        let members = [0, 1, 63, 64, 65, 127, 128, 200, 319];
        let ranks = Ranks::new(members.into_iter().rev().chain([63, 200]), 320);
        assert_eq!(ranks.len(), members.len());
        assert_eq!(members.map(|member| ranks.of(member)), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(Ranks::new([], 0).len(), 0);
    }
}
