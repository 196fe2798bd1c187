//! What a round leaves, on the host: the bytes that the kernels of [`Apply::run`](super::apply::Apply::run)
//! leave on a GPU, in fewer passes.
//!
//! The host counts rings anew from the faces, which a GPU cannot do in a fixed order; it merges them instead.

use std::ops::Range;

use rayon::prelude::*;

use crate::kernel::contract_vertices::{GONE, VERTEX};
use crate::kernel::rows::{Face, Position, with_hub};
use crate::kernel::split::{CHUNK, chunk_bounds, join};
use crate::mesh::adjacency::Stretch;

/// Numbers live vertices without gaps: `new_vertex` becomes how many come before each, and every role the new number of
/// what its vertex has become.
pub fn number(roles: &mut [u32], new_vertex: &mut [u32]) {
    let lives = |role: u32| u32::from(role & GONE == 0);
    let counts: Vec<u32> = roles.par_chunks(CHUNK).map(|roles| roles.iter().map(|&role| lives(role)).sum()).collect();
    let firsts = counts.iter().scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count)));
    let firsts: Vec<u32> = firsts.collect();
    let (last, numbers) = (roles.len(), &mut new_vertex[..roles.len()]);
    numbers.par_chunks_mut(CHUNK).zip(roles.par_chunks(CHUNK)).zip(firsts).for_each(|((numbers, roles), mut next)| {
        for (number, &role) in numbers.iter_mut().zip(roles) {
            *number = next;
            next += lives(role);
        }
    });
    new_vertex[last] = counts.iter().sum();
    let new_vertex = &*new_vertex;
    roles.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(vertex, role)| {
        let live = if *role & GONE == 0 { vertex } else { (*role & VERTEX) as usize };
        *role = new_vertex[live];
    });
}

/// Renames the corners of all faces, moves those that still live to the front, and the rows that go with them; returns the
/// vertices that stretches of them have, in ranges that hold those of faces that died, too.
pub fn faces(renamed: &[u32], faces: &mut [Face], rows: &mut Vec<u32>) -> Vec<Stretch> {
    let chunks = faces.par_chunks_mut(CHUNK).zip(rows.par_chunks_mut(CHUNK)).map(|(faces, rows)| {
        let (mut live, mut low, mut high) = (0, u32::MAX, 0);
        for i in 0..faces.len() {
            let [a, b, c] = faces[i].corners().map(|corner| renamed[corner as usize]);
            let face = Face { a, b, c };
            (faces[live], rows[live]) = (face, rows[i]);
            live += usize::from(face.is_live());
            (low, high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
        }
        (live, low as usize..high as usize + 1)
    });
    let (counts, keys): (Vec<usize>, Vec<Range<usize>>) = chunks.unzip();
    let (_, left) = join(faces.len(), || close_gaps(faces, 1, &counts), || close_gaps(rows, 1, &counts));
    rows.truncate(left);
    let stretch = |end: &mut usize, (count, keys)| {
        let first = std::mem::replace(end, *end + count);
        Some(Stretch { items: first..*end, keys })
    };
    counts.into_iter().zip(keys).scan(0, stretch).collect()
}

/// Keeps the rows of live vertices: where the next entry of `new_vertex` is greater.
pub fn keep_live<T: Copy + Send>(rows: &mut Vec<T>, new_vertex: &[u32]) {
    let left = keep_live_in(rows, new_vertex);
    rows.truncate(left);
}

/// [`keep_live`] of rows that stay as many; returns how many are kept.
pub fn keep_live_in<T: Copy + Send>(rows: &mut [T], new_vertex: &[u32]) -> usize {
    let vertices = new_vertex.len() - 1;
    rows[..vertices].par_chunks_mut(CHUNK).zip(new_vertex.par_chunks(CHUNK)).for_each(|(rows, numbers)| {
        for i in 0..rows.len() {
            // A dead vertex has the number of the next that lives, which overwrites it.
            rows[(numbers[i] - numbers[0]) as usize] = rows[i];
        }
    });
    close_gaps(rows, 1, &live_in_chunks(new_vertex, vertices))
}

/// [`keep_live_in`] of rows of so many numbers each.
pub fn keep_live_rows(rows: &mut [f32], width: usize, new_vertex: &[u32]) {
    let vertices = new_vertex.len() - 1;
    let chunks = rows[..vertices * width].par_chunks_mut((CHUNK * width).max(1));
    chunks.zip(new_vertex.par_chunks(CHUNK)).for_each(|(rows, numbers)| {
        for i in 0..rows.len() / width {
            rows.copy_within(i * width..(i + 1) * width, (numbers[i] - numbers[0]) as usize * width);
        }
    });
    close_gaps(rows, width, &live_in_chunks(new_vertex, vertices));
}

/// How many of so many vertices live, by chunks.
fn live_in_chunks(new_vertex: &[u32], vertices: usize) -> Vec<usize> {
    let firsts: Vec<u32> = chunk_bounds(vertices).map(|vertex| new_vertex[vertex]).collect();
    firsts.windows(2).map(|ends| (ends[1] - ends[0]) as usize).collect()
}

/// Moves the first rows of every chunk, as many as counted, of `width` each, together; returns how many there are.
pub fn close_gaps<T: Copy>(rows: &mut [T], width: usize, counts: &[usize]) -> usize {
    let mut end = 0;
    for (chunk, &count) in counts.iter().enumerate() {
        let start = chunk * CHUNK;
        if start != end {
            rows.copy_within(start * width..(start + count) * width, end * width);
        }
        end += count;
    }
    end
}

/// Tells which vertices are hubs.
pub fn mark_hubs(positions: &mut [Position], ring_starts: &[u32]) {
    let rows = positions.par_iter_mut().zip(ring_starts.par_windows(2)).with_min_len(CHUNK);
    rows.for_each(|(position, ends)| position.flags = with_hub(position.flags, ends[1] - ends[0]));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three chunks of a strip, of which the second dies.
    #[test]
    fn stretches_hold_the_corners_of_what_lives() {
        let count = 2 * CHUNK + 100;
        let dies = |face: usize| (CHUNK..2 * CHUNK).contains(&face) || face.is_multiple_of(3);
        let face = |f: usize| {
            let a = f as u32;
            if dies(f) { Face { a, b: a, c: a + 2 } } else { Face { a, b: a + 2, c: a + 4 } }
        };
        let mut strip: Vec<Face> = (0..count).map(face).collect();
        let mut rows: Vec<u32> = (0..count as u32).collect();
        let renamed: Vec<u32> = (0..count as u32 + 4).map(|vertex| vertex / 2).collect();
        let stretches = faces(&renamed, &mut strip, &mut rows);
        assert!(rows.iter().copied().eq((0..count as u32).filter(|&f| !dies(f as usize))));
        let mut end = 0;
        for Stretch { items, keys } in stretches {
            assert_eq!(items.start, end);
            end = items.end;
            let corners = || strip[items.clone()].iter().flat_map(|face| face.corners().map(|v| v as usize));
            assert!(corners().all(|vertex| keys.contains(&vertex)), "{keys:?}");
            assert!(keys.len() <= CHUNK / 2 + 3);
        }
        assert_eq!(end, rows.len());
    }
}
