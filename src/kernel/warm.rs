//! Reading rows once in the order of memory, which the hardware foresees, so that reading them in any other order finds them in
//! the cache.

use std::ops::Range;

use bytemuck::NoUninit;

/// Reads a byte of every cache line of `rows`.
pub fn warm_up<T: NoUninit>(rows: &[T]) {
    const LINE: usize = 64;
    let bytes = bytemuck::cast_slice::<T, u8>(rows).iter().step_by(LINE);
    std::hint::black_box(bytes.map(|&byte| usize::from(byte)).sum::<usize>());
}

/// Most of the faces around consecutive vertices of a surface of so many faces, where both follow a curve: a vertex has about
/// two for which it is the lowest.
pub fn faces_near(vertices: Range<usize>, ring_starts: &[u32], ring_faces: &[u32], face_count: usize) -> Range<usize> {
    let first = ring_starts.get(vertices.start).and_then(|&start| ring_faces.get(start as usize));
    let first = first.map_or(0, |&face| face as usize).min(face_count);
    first..(first + 2 * vertices.len()).min(face_count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_near_are_those_that_there_are() {
        let (starts, rings) = ([0, 2, 4, 4], [5, 6, 7, 8]);
        let near = |vertices, count| faces_near(vertices, &starts, &rings, count);
        assert_eq!(near(0..2, 100), 5..9);
        assert_eq!(near(1..3, 10), 7..10);
        // Past the last ring, and of fewer faces than were there once.
        assert_eq!(near(3..5, 10), 0..4);
        assert_eq!(near(1..2, 4), 4..4);
        warm_up::<u32>(&[]);
    }
}
