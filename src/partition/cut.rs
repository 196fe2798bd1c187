//! Cuts regions that cannot be drawn in two, so that their halves may be.

use super::Partition;
use super::surface::Surface;
use crate::mesh::dual::NONE;

/// Fewest faces of a region that is cut.
const LEAST_FACES: usize = 4;

/// Regions, some of them parts, and the region that each was at first.
#[derive(Debug)]
pub struct Parts {
    pub partition: Partition,
    pub whole: Vec<u32>,
}

impl Parts {
    /// Every region whole.
    pub fn new(partition: Partition) -> Self {
        Self { whole: (0..partition.region_count as u32).collect(), partition }
    }

    /// Cuts these regions; whether there was any to cut.
    ///
    /// The ends of a longest path through a region, as far as two walks find one, grow toward each other step by step: both
    /// halves hang together.
    pub fn cut(&mut self, surface: &Surface, regions: &[u32]) -> bool {
        let before = self.partition.region_count;
        let mut first = vec![NONE; before];
        let mut size = vec![0; before];
        for (face, &label) in (0..).zip(&self.partition.labels) {
            size[label as usize] += 1;
            first[label as usize] = face.min(first[label as usize]);
        }
        let mut walk = Walk { surface, seen: vec![0; surface.faces.len()], walks: 0, order: Vec::new() };
        for &region in regions.iter().filter(|&&region| size[region as usize] >= LEAST_FACES) {
            let labels = &mut self.partition.labels;
            walk.spread(&[first[region as usize]], labels);
            let one = walk.last();
            walk.spread(&[one], labels);
            let other = walk.last();
            walk.spread(&[one, other], labels);
            let half = self.partition.region_count as u32;
            for &(face, seed) in &walk.order {
                labels[face as usize] = if seed == 0 { region } else { half };
            }
            self.whole.push(self.whole[region as usize]);
            self.partition.region_count += 1;
        }
        self.partition.region_count > before
    }
}

/// Walks through regions, breadth first.
struct Walk<'a> {
    surface: &'a Surface,
    /// The last walk that came to each face.
    seen: Vec<u32>,
    walks: u32,
    /// The faces of the last walk in its order, and which of the seeds each was reached from.
    order: Vec<(u32, u8)>,
}

impl Walk<'_> {
    /// Walks through the region of `seeds`.
    fn spread(&mut self, seeds: &[u32], labels: &[u32]) {
        self.walks += 1;
        self.order.clear();
        for (i, &seed) in (0..).zip(seeds) {
            self.seen[seed as usize] = self.walks;
            self.order.push((seed, i));
        }
        let mut done = 0;
        while let Some(&(face, seed)) = self.order.get(done) {
            done += 1;
            for &other in &self.surface.neighbors[face as usize] {
                if other != NONE
                    && labels[other as usize] == labels[face as usize]
                    && std::mem::replace(&mut self.seen[other as usize], self.walks) != self.walks
                {
                    self.order.push((other, seed));
                }
            }
        }
    }

    /// Where the last walk ended.
    fn last(&self) -> u32 {
        self.order.last().map_or(0, |&(face, _)| face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn halves_hang_together_and_know_their_whole() {
        let surface = Surface::new(&shapes::torus(20, 8), Some(0.0)).expect("a valid mesh");
        let mut parts = Parts::new(Partition { labels: vec![0; surface.faces.len()], region_count: 1 });
        for (cut, whole) in [(vec![0], 2), (vec![0, 1], 4), (vec![2], 5)] {
            assert!(parts.cut(&surface, &cut));
            assert_eq!((parts.partition.region_count, parts.whole.clone()), (whole, vec![0; whole]));
            assert_eq!(parts.partition.validate(&surface.neighbors), []);
        }
        let sizes = parts.partition.faces_by_region().0.windows(2).map(|ends| ends[1] - ends[0]).collect::<Vec<_>>();
        assert!(sizes.iter().all(|&size| size > 10), "{sizes:?}");
    }

    #[test]
    fn few_faces_are_not_cut() {
        let surface = Surface::new(&shapes::plane(1, 1), Some(0.0)).expect("a valid mesh");
        let mut parts = Parts::new(Partition { labels: vec![0; 2], region_count: 1 });
        assert!(!parts.cut(&surface, &[0]));
    }
}
