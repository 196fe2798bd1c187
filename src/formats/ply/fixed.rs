//! Rows of one size, which can be taken apart anywhere: where the values stand in them.

use super::face::FaceLayout;
use super::header::{Element, Kind};
use super::scalar::{Order, Scalar};

/// The place of every number of a row of `element`, which has no list.
pub(super) fn fields(element: &Element) -> Vec<(usize, Scalar)> {
    let numbers = element.properties.iter().scan(0, |offset, property| {
        let Kind::Scalar(scalar) = property.kind else { return None };
        *offset += scalar.size();
        Some((*offset - scalar.size(), scalar))
    });
    numbers.collect()
}

/// Where three numbers stand, of which each follows the one before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triple {
    at: usize,
    scalar: Scalar,
}

impl Triple {
    /// The numbers at these places, if they do.
    pub(super) fn of(fields: &[(usize, Scalar)], places: [usize; 3]) -> Option<Self> {
        let [(at, scalar), others @ ..] = places.map(|place| fields[place]);
        let follows = |(i, &other): (usize, &(usize, Scalar))| other == (at + (i + 1) * scalar.size(), scalar);
        others.iter().enumerate().all(follows).then_some(Self { at, scalar })
    }

    /// The numbers of a row that holds single or double precision in the machine's order, as almost every file does.
    #[inline]
    pub(super) fn numbers(self, row: &[u8], order: Order) -> Option<[f64; 3]> {
        let bytes = &row[self.at..];
        match self.scalar {
            Scalar::F32 if order.is_native() => {
                bytes.first_chunk::<12>().map(|&bytes| bytemuck::cast::<_, [f32; 3]>(bytes).map(f64::from))
            }
            Scalar::F64 if order.is_native() => bytes.first_chunk::<24>().map(|&bytes| bytemuck::cast(bytes)),
            _ => None,
        }
    }
}

/// A row that is a triangle: where the items of its lists, and its numbers, start, and their type.
#[derive(Debug)]
pub(super) struct TriangleRow {
    pub(super) bytes: usize,
    pub(super) corners: (usize, Scalar),
    pub(super) texcoords: Option<(usize, Scalar)>,
    /// Of every property; lists have one too, which means nothing.
    pub(super) scalars: Vec<(usize, Scalar)>,
    /// Where the lengths of the lists stand, and what they are in a triangle.
    lengths: Vec<(usize, Scalar, u32)>,
}

impl TriangleRow {
    /// The row with three corners, the texture coordinates of all if any, and no other list.
    pub(super) fn of(element: &Element, layout: &FaceLayout) -> Option<Self> {
        let mut bytes = 0;
        let mut lists: [Option<(usize, Scalar)>; 2] = [None; 2];
        let (mut lengths, mut scalars) = (Vec::new(), Vec::new());
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(scalar) => {
                    scalars.push((bytes, scalar));
                    bytes += scalar.size();
                }
                Kind::List { length, item } => {
                    scalars.push((bytes, length));
                    let (list, count) = match place {
                        place if place == layout.corners => (0, 3),
                        place if layout.texcoords == Some(place) => (1, 6),
                        _ => return None,
                    };
                    lengths.push((bytes, length, count));
                    lists[list] = Some((bytes + length.size(), item));
                    bytes += length.size() + count as usize * item.size();
                }
            }
        }
        Some(Self { bytes, corners: lists[0]?, texcoords: lists[1], scalars, lengths })
    }

    /// Whether a row of so many bytes is a triangle after all: the size of any row follows from what its lists say.
    pub(super) fn is_triangle(&self, row: &[u8], order: Order) -> bool {
        self.lengths.iter().all(|&(at, length, count)| length.decode_index(&row[at..], order) == count)
    }

    /// The corners of a row, each above every index where it can be none.
    pub(super) fn corners(&self, row: &[u8], order: Order) -> [u32; 3] {
        let (at, item) = self.corners;
        match (item, row[at..].first_chunk::<12>()) {
            // As in almost every file.
            (Scalar::I32 | Scalar::U32, Some(corners)) if order.is_native() => bytemuck::cast(*corners),
            _ => std::array::from_fn(|i| item.decode_index(&row[at + i * item.size()..], order)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_side_by_side_are_read_at_once() {
        let native = if cfg!(target_endian = "little") { Order::Little } else { Order::Big };
        let other = if native == Order::Little { Order::Big } else { Order::Little };
        let fields = [(1, Scalar::F32), (5, Scalar::F32), (9, Scalar::F32), (13, Scalar::F64), (21, Scalar::F64)];
        let triple = Triple::of(&fields, [0, 1, 2]).expect("three numbers in a row");
        let mut row = vec![7];
        [1.5_f32, -2.0, 1e30].iter().for_each(|number| row.extend(number.to_ne_bytes()));
        assert_eq!(triple.numbers(&row, native), Some([1.5, -2.0, f64::from(1e30_f32)]));
        assert_eq!(triple.numbers(&row, other), None);
        // In another order, of two types, with a gap, past the end.
        for places in [[0, 2, 1], [1, 2, 3], [0, 2, 2]] {
            assert!(Triple::of(&fields, places).is_none(), "{places:?}");
        }
        assert_eq!(triple.numbers(&row[..12], native), None);
    }
}
