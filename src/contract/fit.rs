//! The fit: moves the vertices of a result to where they measure least against the original.
//!
//! A sweep finds for samples of the original the nearest face of the result and for points of the result the nearest face
//! of the original, both from the history of contractions and a short walk; sums per face what they ask of its corners;
//! steps to the least of the sums; and takes back, vertex by vertex, what the guards or the samples themselves refuse.

use rayon::prelude::*;

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::fit_points::FACE_POINTS;
use crate::kernel::fit_steps::FitSteps;
use crate::kernel::fit_sums::FitSums;
use crate::kernel::nearest_faces::NearestFaces;
use crate::kernel::opposite_faces::OppositeFaces;
use crate::kernel::rows::{Face, FaceFit, Position};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, flush};

use super::fit_guard::{Guard, refused_by_samples};
use super::surface::Start;

/// Samples a vertex of the result at most: where a vertex stands for a hundred, 24 gain half a percent more.
const MOST_SAMPLES: usize = 12;
/// Times that a sweep is measured, each time without what the samples refused before.
const TRIES: usize = 2;
/// Steps a sweep: six reach what twenty do, and a second sweep gains more.
const STEPS: usize = 3;

/// The result as a fit sees it, in host memory.
#[derive(Debug, Clone, Copy)]
pub struct Shape<'a> {
    pub faces: &'a [Face],
    pub ring_starts: &'a [u32],
    pub ring_faces: &'a [u32],
}

/// Samples of the original by the vertex of the result that they became.
#[derive(Debug)]
struct Samples {
    /// One more than vertices.
    starts: Vec<u32>,
    /// Vertices of the original.
    vertices: Vec<u32>,
}

impl Samples {
    /// Up to [`MOST_SAMPLES`] for each of `vertex_count` vertices, evenly from those that `owners` gives it.
    fn new(owners: &[u32], vertex_count: usize) -> Self {
        let mut ends = vec![0_u32; vertex_count + 1];
        for &owner in owners {
            ends[owner as usize + 1] += 1;
        }
        for vertex in 0..vertex_count {
            ends[vertex + 1] += ends[vertex];
        }
        let all_starts = ends.clone();
        let mut all = vec![0_u32; owners.len()];
        for (vertex, &owner) in (0..).zip(owners) {
            let end = &mut ends[owner as usize];
            all[*end as usize] = vertex;
            *end += 1;
        }
        let (mut starts, mut vertices) = (vec![0], Vec::with_capacity(all.len().min(MOST_SAMPLES * vertex_count)));
        for bounds in all_starts.windows(2) {
            let own = &all[bounds[0] as usize..bounds[1] as usize];
            let taken = own.len().min(MOST_SAMPLES);
            vertices.extend((0..taken).map(|k| own[k * own.len() / taken]));
            starts.push(vertices.len() as u32);
        }
        Self { starts, vertices }
    }

    /// Their points, each with its share of the area around its vertex: both directions weigh the same.
    fn rows(&self, original: &[Position], areas: &[f32]) -> Vec<[f32; 4]> {
        let mut rows = Vec::with_capacity(self.vertices.len());
        for (bounds, area) in self.starts.windows(2).zip(areas) {
            let own = &self.vertices[bounds[0] as usize..bounds[1] as usize];
            let weight = flush(area / own.len() as f32, LEAST_FACTOR);
            rows.extend(own.iter().map(|&vertex| {
                let p = original[vertex as usize];
                [p.x, p.y, p.z, weight]
            }));
        }
        rows
    }
}

/// The buffers of a fit.
struct Buffers {
    positions: Buffer<Position>,
    faces: Buffer<Face>,
    ring_starts: Buffer<u32>,
    ring_faces: Buffer<u32>,
    face_weights: Buffer<f32>,
    sample_starts: Buffer<u32>,
    samples: Buffer<[f32; 4]>,
    sample_vertices: Buffer<u32>,
    original_positions: Buffer<Position>,
    original_faces: Buffer<Face>,
    original_ring_starts: Buffer<u32>,
    original_ring_faces: Buffer<u32>,
    nearest_faces: Buffer<u32>,
    opposite_faces: Buffer<u32>,
    sums: Buffer<FaceFit>,
    offsets: Buffer<[f32; 4]>,
    ahead: Buffer<[f32; 4]>,
    next_ahead: Buffer<[f32; 4]>,
}

/// Moves `positions` until no sweep is left or one gains nothing; `owners` tells which vertex of `shape` each one of `original` became.
///
/// On an error `positions` are as the last sweep that ended left them, and another queue can go on.
pub fn fit(
    queue: &mut Queue,
    original: Start,
    owners: &[u32],
    shape: Shape<'_>,
    positions: &mut Vec<Position>,
    sweeps_left: &mut u32,
    guard: &Guard,
) -> Result<()> {
    let samples = Samples::new(owners, positions.len());
    let areas: Vec<f32> = shape.faces.par_iter().map(|&face| area(face, positions)).collect();
    let around = |bounds: &[u32]| {
        let ring = &shape.ring_faces[bounds[0] as usize..bounds[1] as usize];
        ring.iter().map(|&face| areas[face as usize] / 3.0).sum()
    };
    let vertex_areas: Vec<f32> = shape.ring_starts.par_windows(2).map(around).collect();
    let rows = samples.rows(&original.positions, &vertex_areas);
    let face_weights = areas.into_iter().map(|area| flush(area / FACE_POINTS as f32, LEAST_FACTOR)).collect();
    let (vertex_count, face_count) = (positions.len(), shape.faces.len());
    let mut buffers = Buffers {
        positions: queue.buffer_from(positions.clone())?,
        faces: queue.buffer_from(shape.faces.to_vec())?,
        ring_starts: queue.buffer_from(shape.ring_starts.to_vec())?,
        ring_faces: queue.buffer_from(shape.ring_faces.to_vec())?,
        face_weights: queue.buffer_from(face_weights)?,
        nearest_faces: queue.buffer(rows.len())?,
        sample_starts: queue.buffer_from(samples.starts)?,
        samples: queue.buffer_from(rows)?,
        sample_vertices: queue.buffer_from(samples.vertices)?,
        original_positions: queue.buffer_from(original.positions)?,
        original_faces: queue.buffer_from(original.faces)?,
        original_ring_starts: queue.buffer_from(original.ring_starts)?,
        original_ring_faces: queue.buffer_from(original.ring_faces)?,
        opposite_faces: queue.buffer(face_count * FACE_POINTS as usize)?,
        sums: queue.buffer(face_count)?,
        offsets: queue.buffer(vertex_count)?,
        ahead: queue.buffer(vertex_count)?,
        next_ahead: queue.buffer(vertex_count)?,
    };
    while *sweeps_left > 0 {
        let Some(moved) = buffers.sweep(queue, shape, positions, guard)? else { break };
        *positions = moved;
        *sweeps_left -= 1;
    }
    Ok(())
}

/// The area of a face.
fn area(face: Face, positions: &[Position]) -> f32 {
    let [a, b, c] = face.corners().map(|v| positions[v as usize].xyz());
    (b - a).cross(c - a).length() * 0.5
}

impl Buffers {
    /// One sweep from `positions`, which the buffers hold too; `None` when it gains nothing.
    fn sweep(
        &mut self,
        queue: &mut Queue,
        shape: Shape<'_>,
        positions: &[Position],
        guard: &Guard,
    ) -> Result<Option<Vec<Position>>> {
        let before = self.measure(queue)?;
        let offsets = self.step(queue)?;
        let mut held = vec![false; positions.len()];
        let total = |sums: &[FaceFit]| sums.iter().map(|sum| f64::from(sum.error)).sum::<f64>();
        for attempt in 1..=TRIES {
            guard.hold(shape, positions, &offsets, &mut held);
            let moved = moved(positions, &offsets, &held);
            queue.write(&mut self.positions, &moved)?;
            // With the nearest faces found anew: at creases the heights over held ones fall while distances rise.
            let after = self.measure(queue)?;
            let refused = refused_by_samples(shape, &before, &after, &mut held);
            if (refused == 0 || attempt == TRIES) && total(&after) < total(&before) {
                return Ok(Some(moved));
            }
        }
        queue.write(&mut self.positions, positions)?;
        Ok(None)
    }

    /// Finds the nearest faces and sums.
    fn measure(&mut self, queue: &mut Queue) -> Result<Vec<FaceFit>> {
        queue.run(NearestFaces {
            positions: &self.positions,
            faces: &self.faces,
            ring_starts: &self.ring_starts,
            ring_faces: &self.ring_faces,
            sample_starts: &self.sample_starts,
            samples: &self.samples,
            vertex_count: self.positions.len() as u32,
            nearest_faces: &mut self.nearest_faces,
        })?;
        queue.run(OppositeFaces {
            positions: &self.original_positions,
            faces: &self.original_faces,
            ring_starts: &self.original_ring_starts,
            ring_faces: &self.original_ring_faces,
            sample_starts: &self.sample_starts,
            samples: &self.samples,
            sample_vertices: &self.sample_vertices,
            own_positions: &self.positions,
            own_faces: &self.faces,
            face_count: self.faces.len() as u32,
            opposite_faces: &mut self.opposite_faces,
        })?;
        queue.run(FitSums {
            positions: &self.positions,
            faces: &self.faces,
            face_weights: &self.face_weights,
            sample_starts: &self.sample_starts,
            samples: &self.samples,
            nearest_faces: &self.nearest_faces,
            original_positions: &self.original_positions,
            original_faces: &self.original_faces,
            opposite_faces: &self.opposite_faces,
            face_count: self.faces.len() as u32,
            sums: &mut self.sums,
        })?;
        let mut sums = Vec::new();
        queue.read(&self.sums, 0..self.sums.len(), &mut sums)?;
        Ok(sums)
    }

    /// The offsets of all vertices towards the least of the sums.
    fn step(&mut self, queue: &mut Queue) -> Result<Vec<[f32; 4]>> {
        let vertices = self.positions.len();
        queue.clear(&mut self.offsets, vertices)?;
        queue.clear(&mut self.ahead, vertices)?;
        for step in 0..STEPS {
            queue.run(FitSteps {
                positions: &self.positions,
                faces: &self.faces,
                ring_starts: &self.ring_starts,
                ring_faces: &self.ring_faces,
                sums: &self.sums,
                ahead: &self.ahead,
                vertex_count: vertices as u32,
                momentum: (step + 1) as f32 / (step + 4) as f32,
                offsets: &mut self.offsets,
                next_ahead: &mut self.next_ahead,
            })?;
            std::mem::swap(&mut self.ahead, &mut self.next_ahead);
        }
        let mut offsets = Vec::new();
        queue.read(&self.offsets, 0..vertices, &mut offsets)?;
        Ok(offsets)
    }
}

/// The positions with the offsets of all that are not held.
fn moved(positions: &[Position], offsets: &[[f32; 4]], held: &[bool]) -> Vec<Position> {
    let rows = positions.iter().zip(offsets).zip(held);
    rows.map(|((&position, &offset), &held)| if held { position } else { shifted(position, offset) }).collect()
}

/// A position and its offset.
pub fn shifted(position: Position, [x, y, z, _]: [f32; 4]) -> Position {
    let p = position.xyz() + Vec3::new(x, y, z);
    Position { x: p.x, y: p.y, z: p.z, flags: position.flags }
}
