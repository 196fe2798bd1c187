//! Cutting a mesh into parts: runs of cells along a space-filling curve, every face in the part of its lowest corner's cell.
//!
//! Cells are the intervals between a sample of the vertices, so that one far-away vertex does not put all others into one
//! cell. Which cell a vertex is in depends on its position alone: vertices that repeat a position are in one.

use std::ops::Range;

use rayon::prelude::*;

use super::rows::each_chunk;
use crate::error::{Error, Result};
use crate::formats::Stream;
use crate::math::DVec3;

/// Vertices that are looked at for the cells.
const SAMPLES: usize = 1 << 18;
/// Cells at most: their numbers fit 16 bits, and a part is made of many.
const CELLS: usize = 1 << 14;
/// One vertex in so many at either end of an axis does not count for the cube of the curve, and is clamped into it.
const OUTERMOST: usize = 1000;
/// Bits of a coordinate in a key.
const AXIS_BITS: u32 = 21;
/// How much larger than the mesh the cube of the curve is, and how far it is shifted in every pass, in sides of the mesh's own:
/// what borders of parts crossed in one pass lies within parts of the next.
const MARGIN: f64 = 1.5;
const SHIFTS: [f64; 3] = [0.31, 0.23, 0.17];
/// Rows that a thread looks at.
const LEAST_ROWS: usize = 1 << 12;

/// What a first look at the vertices tells.
#[derive(Debug)]
pub struct Survey {
    /// The corners of the bounding box.
    pub bounds: (DVec3, DVec3),
    /// The same of all but the outermost vertices.
    core: (DVec3, DVec3),
    sample: Vec<DVec3>,
}

impl Survey {
    /// Looks at every vertex once.
    ///
    /// # Errors
    /// Those of reading.
    pub fn new(stream: &Stream) -> Result<Self> {
        let step = stream.vertex_count().div_ceil(SAMPLES).max(1);
        let (mut bounds, mut sample) = (None, Vec::new());
        let (mut room, mut positions) = (Vec::new(), Vec::new());
        each_chunk(stream.vertex_count(), |rows| {
            let first = rows.start.next_multiple_of(step) - rows.start;
            stream.positions(rows, &mut room, &mut positions)?;
            sample.extend(positions.iter().skip(first).step_by(step));
            let of_chunk = positions.par_iter().with_min_len(LEAST_ROWS).map(|&p| (p, p)).reduce_with(joined);
            bounds = bounds.into_iter().chain(of_chunk).reduce(joined);
            Ok(())
        })?;
        let bounds = bounds.unwrap_or_default();
        Ok(Self { bounds, core: core(&sample).filter(|(low, high)| low != high).unwrap_or(bounds), sample })
    }

    /// The longest side of the box around all but the outermost vertices.
    pub fn extent(&self) -> f64 {
        let (low, high) = self.core;
        (high - low).max_element()
    }
}

/// The box around all but the outermost of `sample` along each axis.
fn core(sample: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let last = sample.len().checked_sub(1)?;
    let outer = sample.len() / OUTERMOST;
    let sides = [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = sample.iter().map(|p| p[axis]).collect();
        along.par_sort_unstable_by(f64::total_cmp);
        (along[outer], along[last - outer])
    });
    Some((DVec3::from(sides.map(|(low, _)| low)), DVec3::from(sides.map(|(_, high)| high))))
}

fn joined((a, b): (DVec3, DVec3), (c, d): (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.min(c), b.max(d))
}

/// Numbers positions along Morton's curve.
#[derive(Debug, Clone, Copy)]
struct Curve {
    low: DVec3,
    per_unit: f64,
}

impl Curve {
    fn new((low, high): (DVec3, DVec3), pass: usize) -> Self {
        // Halves: the difference of two finite numbers may not be.
        let half = (high * 0.5 - low * 0.5).max_element();
        let shift = DVec3::from(SHIFTS.map(|shift| (shift * pass as f64) % (MARGIN - 1.0)));
        Self { low: low * 0.5 - shift * half, per_unit: f64::from(1 << AXIS_BITS) / (half * MARGIN) }
    }

    /// The key of a position; any at all where the mesh has no extent.
    fn key(self, position: DVec3) -> u64 {
        let cell = ((position * 0.5 - self.low) * self.per_unit).to_array();
        let [x, y, z] = cell.map(|at| spread((at as u64).min((1 << AXIS_BITS) - 1)));
        x | y << 1 | z << 2
    }
}

/// The lowest 21 bits, two apart.
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    let bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    let bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

/// Which part every vertex and face belongs to.
#[derive(Debug)]
pub struct Cut {
    cell_of: Vec<u16>,
    /// Faces before each cell, along the curve, and all of them.
    faces_before: Vec<u64>,
    part_of_cell: Vec<u16>,
    /// The cells of each part.
    parts: Vec<Range<usize>>,
}

impl Cut {
    /// Cuts into parts of `most_faces` at most; each `pass` cuts elsewhere.
    ///
    /// # Errors
    /// Those of reading; [`Error::Limit`] where more faces than that lie in one place.
    pub fn new(stream: &Stream, survey: &Survey, pass: usize, most_faces: usize) -> Result<Self> {
        let curve = Curve::new(survey.core, pass);
        let firsts = first_keys(&survey.sample, curve);
        let cell_of = cells(stream, curve, &firsts)?;
        let mut cut =
            Self { cell_of, faces_before: vec![0; firsts.len() + 2], part_of_cell: Vec::new(), parts: Vec::new() };
        cut.count(stream)?;
        cut.join_cells(most_faces)?;
        Ok(cut)
    }

    /// Counts the faces of every cell.
    fn count(&mut self, stream: &Stream) -> Result<()> {
        let (mut room, mut faces) = (Vec::new(), Vec::new());
        let mut counts = vec![0_u64; self.faces_before.len()];
        each_chunk(stream.face_count(), |rows| {
            stream.faces(rows, &mut room, &mut faces)?;
            faces.iter().for_each(|&face| counts[self.cell(face) + 1] += 1);
            Ok(())
        })?;
        let mut sum = 0;
        self.faces_before = counts.into_iter().map(|count| (sum += count, sum).1).collect();
        Ok(())
    }

    /// Joins consecutive cells to parts of about one size, as few as can be.
    fn join_cells(&mut self, most_faces: usize) -> Result<()> {
        let cells = self.faces_before.len() - 1;
        let total = self.faces_before[cells];
        // A cell more or less is what parts differ by.
        let parts = (total as f64 / (0.95 * most_faces as f64)).ceil().max(1.0);
        let goal = total as f64 / parts;
        let mut start = 0;
        for cell in 0..cells {
            let in_part = (self.faces_before[cell + 1] - self.faces_before[start]) as usize;
            if in_part > most_faces && cell > start {
                self.end_part(&mut start, cell);
            }
            let in_part = (self.faces_before[cell + 1] - self.faces_before[start]) as usize;
            if in_part > most_faces {
                return Err(Error::Limit(format!(
                    "{in_part} faces lie in one place, and only {most_faces} of a part fit the memory limit"
                )));
            }
            if self.faces_before[cell + 1] as f64 >= goal * (self.parts.len() + 1) as f64 {
                self.end_part(&mut start, cell + 1);
            }
        }
        if start < cells && self.faces_before[start] < total {
            self.end_part(&mut start, cells);
        }
        self.part_of_cell.resize(cells, self.parts.len().saturating_sub(1) as u16);
        Ok(())
    }

    fn end_part(&mut self, start: &mut usize, end: usize) {
        self.part_of_cell.resize(end, self.parts.len() as u16);
        self.parts.push(*start..end);
        *start = end;
    }

    /// Lets go which cell every vertex is in: faces and vertices have no part after that.
    pub fn forget_cells(&mut self) {
        self.cell_of = Vec::new();
    }

    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// The faces of a part, numbered along the curve.
    pub fn faces_of_part(&self, part: usize) -> Range<u64> {
        let Range { start, end } = self.parts[part];
        self.faces_before[start]..self.faces_before[end]
    }

    /// The cells in the middle of a part that hold about `faces` faces.
    pub fn middle(&self, part: usize, faces: usize) -> Range<usize> {
        let of_part = self.faces_of_part(part);
        let least = (of_part.start + of_part.end - (faces as u64).min(of_part.end - of_part.start)) / 2;
        let Range { start, end } = self.parts[part];
        let before = &self.faces_before;
        let start = (start..end).rfind(|&cell| before[cell] <= least).unwrap_or(start);
        let end = (start + 1..end).find(|&cell| before[cell] - before[start] >= faces as u64).unwrap_or(end);
        start..end
    }

    /// The cell of a face.
    pub fn cell(&self, face: [u32; 3]) -> usize {
        face.iter().map(|&v| self.cell_of[v as usize]).fold(u16::MAX, u16::min).into()
    }

    /// The part of a face.
    pub fn part(&self, face: [u32; 3]) -> u16 {
        self.part_of_cell[self.cell(face)]
    }

    /// The part of a vertex's position: that of all its faces, unless the border of a part passes there.
    pub fn part_of_vertex(&self, vertex: u32) -> u16 {
        self.part_of_cell[usize::from(self.cell_of[vertex as usize])]
    }
}

/// The first key of every cell but the first.
fn first_keys(sample: &[DVec3], curve: Curve) -> Vec<u64> {
    let mut keys: Vec<u64> = sample.par_iter().with_min_len(LEAST_ROWS).map(|&p| curve.key(p)).collect();
    keys.par_sort_unstable();
    let mut firsts: Vec<u64> = keys.iter().copied().step_by(keys.len().div_ceil(CELLS).max(1)).skip(1).collect();
    firsts.dedup();
    firsts
}

/// The cell of every vertex.
fn cells(stream: &Stream, curve: Curve, firsts: &[u64]) -> Result<Vec<u16>> {
    let mut cells = Vec::with_capacity(stream.vertex_count());
    let (mut room, mut positions, mut of_chunk) = (Vec::new(), Vec::new(), Vec::new());
    each_chunk(stream.vertex_count(), |rows| {
        stream.positions(rows, &mut room, &mut positions)?;
        let cell = |&p: &DVec3| firsts.partition_point(|&first| first <= curve.key(p)) as u16;
        positions.par_iter().with_min_len(LEAST_ROWS).map(cell).collect_into_vec(&mut of_chunk);
        cells.extend_from_slice(&of_chunk);
        Ok(())
    })?;
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_two_apart() {
        for bit in 0..AXIS_BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << AXIS_BITS) - 1).count_ones(), AXIS_BITS);
    }

    #[test]
    fn keys_follow_positions_in_every_pass() {
        let bounds = (DVec3::splat(-2.0), DVec3::new(6.0, 0.0, 1.0));
        let keys: Vec<u64> = (0..5)
            .map(|pass| {
                let curve = Curve::new(bounds, pass);
                let [low, high] = [bounds.0, bounds.1].map(|corner| curve.key(corner));
                assert!(low < high && high < 1 << (3 * AXIS_BITS), "{pass}");
                curve.key(DVec3::new(1.0, -1.0, 0.5))
            })
            .collect();
        assert!(keys.windows(2).all(|pair| pair[0] != pair[1]), "{keys:?}");
    }
}
