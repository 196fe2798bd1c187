//! Disjoint sets whose representative is always the lowest member, so that the outcome depends on no order of joining.

/// Disjoint sets over `0..len`.
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// Every element on its own.
    pub fn new(len: usize) -> Self {
        Self { parents: (0..len as u32).collect() }
    }

    /// The lowest member of the set of `element`.
    pub fn find(&mut self, mut element: u32) -> u32 {
        while self.parents[element as usize] != element {
            let parent = self.parents[element as usize];
            self.parents[element as usize] = self.parents[parent as usize];
            element = parent;
        }
        element
    }

    /// Makes one set of two; whether they were two.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_member_represents() {
        let mut sets = DisjointSets::new(6);
        assert!(sets.join(5, 4));
        assert!(sets.join(4, 2));
        assert!(!sets.join(2, 5));
        assert_eq!((0..6).map(|e| sets.find(e)).collect::<Vec<_>>(), [0, 1, 2, 3, 2, 2]);
    }
}
