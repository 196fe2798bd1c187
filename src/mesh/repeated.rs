//! Faces that repeat others, among faces sorted by their lowest corner.

use std::ops::Range;

use super::layers::Layers;

/// Faces of one lowest corner that are compared each with each.
const FEW: usize = 16;

/// Faces sorted by lowest corner, and the input face of each.
#[derive(Clone, Copy)]
pub(super) struct Sorted<'a> {
    pub faces: &'a [[u32; 3]],
    pub sources: &'a [u32],
    pub layers: Layers<'a>,
}

/// What of sorted faces was there before.
#[derive(Debug, Default)]
pub(super) struct Repeated {
    /// Those with the corners, the turning sense and the layer of an earlier one, ascending.
    pub faces: Vec<u32>,
    /// How many have the corners and the turning sense of an earlier one, but a layer that none of these has.
    pub covering: usize,
}

impl Sorted<'_> {
    /// What is repeated, where the faces of each lowest corner end at `ends`.
    pub fn repeated(self, ends: &[u32]) -> Repeated {
        let mut repeated = Repeated::default();
        let mut start = 0;
        for &end in ends {
            if (end - start) as usize > FEW {
                self.compare_sorted(start..end, &mut repeated);
            } else {
                self.compare_each(start..end, &mut repeated);
            }
            start = end;
        }
        repeated
    }

    /// What duplicates share.
    fn key(self, face: u32) -> ([u32; 3], u32) {
        (self.corners(face), self.layers.of(self.sources[face as usize]))
    }

    fn corners(self, face: u32) -> [u32; 3] {
        lowest_first(&self.faces[face as usize])
    }

    fn compare_sorted(self, of_corner: Range<u32>, repeated: &mut Repeated) {
        let mut keys: Vec<_> = of_corner.map(|face| (self.key(face), face)).collect();
        keys.sort_unstable();
        let before = repeated.faces.len();
        for two in keys.windows(2) {
            let [((lower, layer), _), ((corners, own), face)] = [two[0], two[1]];
            if corners == lower && own == layer {
                repeated.faces.push(face);
            } else if corners == lower {
                repeated.covering += 1;
            }
        }
        repeated.faces[before..].sort_unstable();
    }

    fn compare_each(self, of_corner: Range<u32>, repeated: &mut Repeated) {
        for face in of_corner.clone().skip(1) {
            let corners = self.corners(face);
            let mut below = (of_corner.start..face).filter(|&lower| self.corners(lower) == corners).peekable();
            if below.peek().is_none() {
                continue;
            }
            if below.any(|lower| self.key(lower) == self.key(face)) {
                repeated.faces.push(face);
            } else {
                repeated.covering += 1;
            }
        }
    }
}

/// The corners turned so that the lowest comes first.
fn lowest_first(&[a, b, c]: &[u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Materials;
    use super::*;

    /// Few faces of a corner and many are compared in different ways.
    #[test]
    fn repetitions_and_what_covers_others_are_told_apart() {
        let other = |n: u32| [0, 2 * n + 10, 2 * n + 11];
        let faces = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [0, 1, 2], [0, 1, 2]];
        let of_face = [0, 0, 1, 0, 1, 2];
        for others in [0, 40] {
            let faces: Vec<[u32; 3]> = faces.into_iter().chain((0..others).map(other)).collect();
            let end = faces.len() as u32;
            let sources: Vec<u32> = (0..end).rev().collect();
            let of_source = |source: u32| of_face.get((end - 1 - source) as usize).copied().unwrap_or(0);
            let materials = Materials { of_face: (0..end).map(of_source).collect(), names: Vec::new() };
            let found = |layers| Sorted { faces: &faces, sources: &sources, layers }.repeated(&[end, end]);
            let Repeated { faces, covering } = found(Layers::new(Some(&materials)));
            assert_eq!((faces, covering), (vec![1, 4], 2));
            let Repeated { faces, covering } = found(Layers::ONE);
            assert_eq!((faces, covering), (vec![1, 2, 4, 5], 0));
        }
    }
}
