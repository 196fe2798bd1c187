//! The order of points along a space-filling curve, in which neighbors in space are mostly neighbors in memory; and which
//! of them repeat.
//!
//! Morton's curve: blocks of 4,096 vertices in a row hold the whole one-ring of 88 to 89 % of theirs, on a statue of a
//! million faces and on a scan. Hilbert's holds as many, within half a percent, at several times the cost of a key.

use rayon::prelude::*;

use super::{PARALLEL_ROWS, task_len};
use crate::math::DVec3;

/// Bits of a coordinate in a key.
const AXIS_BITS: u32 = 10;
/// Bits of a key that one pass sorts by.
const DIGIT_BITS: u32 = 10;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Points that a task turns into keys, at least, and of many.
const CHUNK: (usize, usize) = (1 << 13, 1 << 15);
/// Points that a task sorts, at least, and of many; before its last digit is completed.
const SORTED: (usize, usize) = (1 << 12, 1 << 14);
/// Points of one key that are compared each with each.
const FEW: usize = 16;

/// A key above an index.
type Row = u64;

/// Points in the order of the curve.
pub(super) struct Curve {
    /// Every point, ascending by key and then by index.
    pub order: Vec<u32>,
    /// Points equal to one of lower index, with the lowest of these; in no order. `-0.0` equals `0.0`.
    pub repeats: Vec<[u32; 2]>,
    /// The corners of the bounding box.
    pub bounds: (DVec3, DVec3),
}

impl Curve {
    /// The curve through `points`, which are finite.
    pub fn new(points: &[DVec3]) -> Self {
        let bounds = bounds(points);
        let chunks = keyed_chunks(points, Cells::new(bounds));
        let tasks = tasks(&chunks, task_len(points.len(), SORTED));
        let mut order = vec![0; points.len()];
        let mut rest = order.as_mut_slice();
        let mut outputs = Vec::with_capacity(tasks.len());
        for task in &tasks {
            let (output, after) = rest.split_at_mut(task.len);
            outputs.push((task, output));
            rest = after;
        }
        let repeats: Vec<Vec<[u32; 2]>> = outputs
            .into_par_iter()
            .map_init(<(Vec<Row>, Vec<Row>)>::default, |(rows, room), (task, order)| {
                rows.clear();
                rows.extend(chunks.iter().flat_map(|chunk| chunk.digits(task.first_digit, task.end_digit)));
                sort(rows, room);
                order.iter_mut().zip(rows.iter()).for_each(|(point, &row)| *point = row as u32);
                repeats(points, rows)
            })
            .collect();
        Self { order, repeats: repeats.concat(), bounds }
    }
}

/// The corners of the box around `points`; zeros around none.
fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let Some(&first) = points.first() else { return (DVec3::ZERO, DVec3::ZERO) };
    points
        .par_chunks(PARALLEL_ROWS)
        .map(|points| points.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
        .reduce(|| (first, first), |(a, b), (c, d)| (a.min(c), b.max(d)))
}

/// The grid that keys number, a cube around the points.
#[derive(Clone, Copy)]
struct Cells {
    low: DVec3,
    per_unit: f64,
}

impl Cells {
    fn new((low, high): (DVec3, DVec3)) -> Self {
        // Halves: the difference of two finite numbers may not be.
        let half = (high * 0.5 - low * 0.5).max_element();
        Self { low: low * 0.5, per_unit: f64::from(1 << AXIS_BITS) / half }
    }

    /// The key of a point; any at all for one of a box without extent.
    fn key(self, point: DVec3) -> u64 {
        let cell = ((point * 0.5 - self.low) * self.per_unit).to_array();
        let [x, y, z] = cell.map(|at| spread((at as u32).min((1 << AXIS_BITS) - 1)));
        u64::from(x | y << 1 | z << 2)
    }
}

/// The lowest ten bits, two apart.
fn spread(bits: u32) -> u32 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

fn digit(row: Row, place: u32) -> usize {
    (row >> (32 + place * DIGIT_BITS)) as usize & (DIGITS - 1)
}

const LAST_PLACE: u32 = 3 * AXIS_BITS / DIGIT_BITS - 1;

/// A piece of the points, sorted by the last digit of the key only.
struct Chunk {
    rows: Vec<Row>,
    /// Where the rows of each digit start, and the end.
    starts: Vec<u32>,
}

impl Chunk {
    fn digits(&self, first: usize, end: usize) -> impl Iterator<Item = Row> {
        self.rows[self.starts[first] as usize..self.starts[end] as usize].iter().copied()
    }
}

fn keyed_chunks(points: &[DVec3], cells: Cells) -> Vec<Chunk> {
    let len = task_len(points.len(), CHUNK);
    let chunk = |keyed: &mut Vec<Row>, (number, points): (usize, &[DVec3])| {
        let first = (number * len) as u64;
        keyed.clear();
        keyed.extend((first..).zip(points).map(|(index, &point)| cells.key(point) << 32 | index));
        let mut cursors = vec![0_u32; DIGITS];
        keyed.iter().for_each(|&row| cursors[digit(row, LAST_PLACE)] += 1);
        running_sum(&mut cursors);
        let mut starts = cursors.clone();
        starts.push(points.len() as u32);
        let mut rows = vec![0; points.len()];
        for &row in keyed.iter() {
            let cursor = &mut cursors[digit(row, LAST_PLACE)];
            rows[*cursor as usize] = row;
            *cursor += 1;
        }
        Chunk { rows, starts }
    };
    points.par_chunks(len).enumerate().map_init(Vec::new, chunk).collect()
}

/// Digits that one task sorts.
struct Task {
    first_digit: usize,
    end_digit: usize,
    len: usize,
}

/// Tasks of so many points at least.
fn tasks(chunks: &[Chunk], sorted: usize) -> Vec<Task> {
    let mut tasks = Vec::new();
    let mut task = Task { first_digit: 0, end_digit: 0, len: 0 };
    for digit in 0..DIGITS {
        task.end_digit = digit + 1;
        task.len += chunks.iter().map(|chunk| chunk.digits(digit, digit + 1).size_hint().0).sum::<usize>();
        if task.len >= sorted || digit + 1 == DIGITS {
            tasks.push(std::mem::replace(&mut task, Task { first_digit: digit + 1, end_digit: 0, len: 0 }));
        }
    }
    tasks
}

/// Sorts by key, digit by digit from the lowest; rows of one key stay in their order.
fn sort(rows: &mut Vec<Row>, room: &mut Vec<Row>) {
    if rows.len() < DIGITS / 4 {
        rows.sort_unstable();
        return;
    }
    room.resize(rows.len(), 0);
    for place in 0..=LAST_PLACE {
        let mut cursors = [0_u32; DIGITS];
        rows.iter().for_each(|&row| cursors[digit(row, place)] += 1);
        running_sum(&mut cursors);
        for &row in rows.iter() {
            let cursor = &mut cursors[digit(row, place)];
            room[*cursor as usize] = row;
            *cursor += 1;
        }
        std::mem::swap(rows, room);
    }
}

/// Replaces every number by the sum of those before it.
fn running_sum(numbers: &mut [u32]) {
    let mut sum = 0;
    for number in numbers {
        sum += std::mem::replace(number, sum);
    }
}

/// The points of sorted rows that equal one of lower index, each with the lowest.
fn repeats(points: &[DVec3], rows: &[Row]) -> Vec<[u32; 2]> {
    let mut repeats = Vec::new();
    for run in rows.chunk_by(|a, b| a >> 32 == b >> 32).filter(|run| run.len() > 1) {
        let point = |&row: &Row| points[row as u32 as usize];
        if run.len() <= FEW {
            for (i, row) in run.iter().enumerate() {
                if let Some(lower) = run[..i].iter().find(|lower| point(lower) == point(row)) {
                    repeats.push([*row as u32, *lower as u32]);
                }
            }
        } else {
            // Adding zero turns -0.0 into 0.0.
            let mut sorted: Vec<([u64; 3], u32)> =
                run.iter().map(|row| ((point(row) + 0.0).to_array().map(f64::to_bits), *row as u32)).collect();
            sorted.sort_unstable();
            for equal in sorted.chunk_by(|a, b| a.0 == b.0) {
                repeats.extend(equal[1..].iter().map(|&(_, index)| [index, equal[0].1]));
            }
        }
    }
    repeats
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn bits_are_spread() {
        assert_eq!(spread(0b11_1111_1111), 0b1001_0010_0100_1001_0010_0100_1001);
        assert_eq!(spread(0b10_0000_0101), 1 << 27 | 1 << 6 | 1);
    }

    #[test]
    fn a_cube_is_walked_in_a_z() {
        let corners: Vec<DVec3> =
            (0..8).rev().map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect();
        assert_eq!(Curve::new(&corners).order, [7, 6, 5, 4, 3, 2, 1, 0]);
    }

    #[test]
    fn extreme_points_have_an_order() {
        let points = [f64::MAX, f64::MIN, 0.0, -0.0, 1e-308].map(DVec3::splat);
        assert_eq!(Curve::new(&points).order, [1, 2, 3, 4, 0]);
        assert_eq!(Curve::new(&points).repeats, [[3, 2]]);
        assert_eq!(Curve::new(&[DVec3::ONE; 3]).repeats, [[1, 0], [2, 0]]);
        assert_eq!(Curve::new(&[]).order, [] as [u32; 0]);
    }

    #[test]
    fn large_sets_are_sorted_whatever_the_threads() {
        let points: Vec<DVec3> =
            (0..100_000_u32).map(|i| [79, 104, 129].map(|k| f64::from(i * k % 997))).map(DVec3::from).collect();
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let curve = pool(3).install(|| Curve::new(&points));
        let cells = Cells::new(curve.bounds);
        assert!(curve.order.is_sorted_by_key(|&i| (cells.key(points[i as usize]), i)));
        assert_eq!(pool(1).install(|| Curve::new(&points)).repeats, curve.repeats);
        // The pattern repeats after 997 points.
        assert_eq!(curve.repeats.len(), 100_000 - 997);
        assert!(curve.repeats.iter().all(|&[index, lowest]| lowest == index % 997));
    }

    proptest! {
        #[test]
        fn repeats_are_as_defined(coordinates in prop::collection::vec([-1i8..2, -1i8..1, 0i8..2], 0..60)) {
            let points: Vec<DVec3> = coordinates.iter().map(|c| DVec3::from(c.map(f64::from)) * -1.0).collect();
            let plain: Vec<[u32; 2]> = (0..points.len())
                .filter_map(|i| Some([i as u32, (0..i).find(|&lower| points[lower] == points[i])? as u32]))
                .collect();
            let mut repeats = Curve::new(&points).repeats;
            repeats.sort_unstable();
            prop_assert_eq!(repeats, plain);
        }
    }
}
