//! The fit of a result to its original: here each round's surface to itself before some noise.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::fit_points::FACE_POINTS;
use coarsen::kernel::fit_steps::FitSteps;
use coarsen::kernel::fit_sums::FitSums;
use coarsen::kernel::nearest_faces::NearestFaces;
use coarsen::kernel::opposite_faces::OppositeFaces;
use coarsen::kernel::rows::{FaceFit, Position};

use super::inputs::{Random, Round, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 4] = [
    Trial { name: "nearest_faces", run: nearest_faces },
    Trial { name: "opposite_faces", run: opposite_faces },
    Trial { name: "fit_sums", run: fit_sums },
    Trial { name: "fit_steps", run: fit_steps },
];

/// A round's own vertices as samples, up to three a vertex: itself and those after it; every seventh has none.
struct Samples {
    starts: Vec<u32>,
    rows: Vec<[f32; 4]>,
    vertices: Vec<u32>,
}

fn samples(round: &Round) -> Samples {
    let mut random = Random::new();
    let count = round.positions.len() as u32;
    let mut samples = Samples { starts: vec![0], rows: Vec::new(), vertices: Vec::new() };
    for vertex in 0..count {
        for k in 0..if vertex % 7 == 0 { 0 } else { 1 + vertex % 3 } {
            let taken = (vertex + k) % count;
            let p = round.positions[taken as usize];
            samples.rows.push([p.x, p.y, p.z, 0.75 + 0.5 * random.centered()]);
            samples.vertices.push(taken);
        }
        samples.starts.push(samples.rows.len() as u32);
    }
    samples
}

/// The round's surface a little off.
fn shaken(round: &Round) -> Vec<Position> {
    let mut random = Random::new();
    let mut shaken = round.positions.clone();
    for p in &mut shaken {
        *p = Position {
            x: p.x + 0.125 * random.centered(),
            y: p.y + 0.125 * random.centered(),
            z: p.z + 0.125 * random.centered(),
            ..*p
        };
    }
    shaken
}

/// Any face for each of `count`, and none for some.
fn any_faces(count: usize, faces: usize) -> Vec<u32> {
    let mut random = Random::new();
    (0..count).map(|i| if i % 11 == 3 { u32::MAX } else { random.below(faces as u32) }).collect()
}

fn nearest_faces(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let Samples { starts, mut rows, .. } = samples(round);
        for row in &mut rows {
            row[0] += 3.0 * f32::from(u8::from(perturbed));
        }
        let positions = &queue.buffer_from(shaken(round))?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let sample_starts = &queue.buffer_from(starts)?;
        let nearest_faces = &mut queue.buffer(rows.len())?;
        let samples = &queue.buffer_from(rows)?;
        let vertex_count = round.positions.len() as u32;
        seen.run(
            queue,
            NearestFaces {
                positions,
                faces,
                ring_starts,
                ring_faces,
                sample_starts,
                samples,
                vertex_count,
                nearest_faces,
            },
        )?;
        seen.output(queue, "nearest_faces", nearest_faces)?;
    }
    Ok(())
}

fn opposite_faces(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let Samples { starts, rows, vertices } = samples(round);
        let mut own = shaken(round);
        for position in &mut own {
            position.x += 3.0 * f32::from(u8::from(perturbed));
        }
        let positions = &queue.buffer_from(round.positions.clone())?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let sample_starts = &queue.buffer_from(starts)?;
        let samples = &queue.buffer_from(rows)?;
        let sample_vertices = &queue.buffer_from(vertices)?;
        let own_positions = &queue.buffer_from(own)?;
        let own_faces = &queue.buffer_from(round.faces.clone())?;
        let face_count = round.faces.len() as u32;
        let opposite_faces = &mut queue.buffer(round.faces.len() * FACE_POINTS as usize)?;
        seen.run(
            queue,
            OppositeFaces {
                positions,
                faces,
                ring_starts,
                ring_faces,
                sample_starts,
                samples,
                sample_vertices,
                own_positions,
                own_faces,
                face_count,
                opposite_faces,
            },
        )?;
        seen.output(queue, "opposite_faces", opposite_faces)?;
    }
    Ok(())
}

fn fit_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let Samples { starts, mut rows, .. } = samples(round);
        flip(&mut rows[0][3], perturbed);
        // Every sample belongs to a face around its vertex.
        let owner = |i: u32| starts.partition_point(|&start| start <= i) as u32 - 1;
        let of_vertex = |v: u32| {
            let ring =
                &round.ring_faces[round.ring_starts[v as usize] as usize..round.ring_starts[v as usize + 1] as usize];
            ring.first().copied().map_or(u32::MAX, |face| face | (v % 5 / 4) << 31)
        };
        let nearest: Vec<u32> = (0..rows.len() as u32).map(|i| of_vertex(owner(i))).collect();
        let positions = &queue.buffer_from(shaken(round))?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let face_weights = &queue.buffer_from(vec![0.125; round.faces.len()])?;
        let nearest_faces = &queue.buffer_from(nearest)?;
        let sample_starts = &queue.buffer_from(starts)?;
        let samples = &queue.buffer_from(rows)?;
        let original_positions = &queue.buffer_from(round.positions.clone())?;
        let original_faces = &queue.buffer_from(round.faces.clone())?;
        let points = round.faces.len() * FACE_POINTS as usize;
        let opposite_faces = &queue.buffer_from(any_faces(points, round.faces.len()))?;
        let face_count = round.faces.len() as u32;
        let sums = &mut queue.buffer(round.faces.len())?;
        seen.run(
            queue,
            FitSums {
                positions,
                faces,
                face_weights,
                sample_starts,
                samples,
                nearest_faces,
                original_positions,
                original_faces,
                opposite_faces,
                face_count,
                sums,
            },
        )?;
        seen.output(queue, "sums", sums)?;
    }
    Ok(())
}

/// Sums as of a few points of every face, of any sign and size.
fn any_sums(count: usize) -> Vec<FaceFit> {
    let mut random = Random::new();
    let mut sum = |i: usize| {
        let scale = [1.0, 1e-6, 0.0, 1e5][i % 4];
        let mut next = || random.centered();
        let (aa, bb, cc) = (next().abs() + 0.1, next().abs() + 0.1, next().abs() + 0.1);
        FaceFit {
            nx: next(),
            ny: next(),
            nz: next() + 0.7,
            aa: scale * aa,
            ab: scale * 0.1 * next().abs(),
            ac: scale * 0.1 * next().abs(),
            bb: scale * bb,
            bc: scale * 0.1 * next().abs(),
            cc: scale * cc,
            a: scale * next(),
            b: scale * next(),
            c: scale * next(),
            error: 0.0,
        }
    };
    (0..count).map(&mut sum).collect()
}

fn fit_steps(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut sums = any_sums(round.faces.len());
        sums.iter_mut().for_each(|sum| flip(&mut sum.a, perturbed));
        let mut random = Random::new();
        let mut offsets: Vec<[f32; 4]> = Vec::new();
        offsets.resize_with(round.positions.len(), || [random.centered(), random.centered(), random.centered(), 0.0]);
        let positions = &queue.buffer_from(round.positions.clone())?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let sums = &queue.buffer_from(sums)?;
        let ahead = &queue.buffer_from(offsets.iter().map(|offset| offset.map(|x| 1.25 * x)).collect())?;
        let next_ahead = &mut queue.buffer(offsets.len())?;
        let offsets = &mut queue.buffer_from(offsets)?;
        let (vertex_count, momentum) = (round.positions.len() as u32, 0.25);
        seen.run(
            queue,
            FitSteps {
                positions,
                faces,
                ring_starts,
                ring_faces,
                sums,
                ahead,
                vertex_count,
                momentum,
                offsets,
                next_ahead,
            },
        )?;
        seen.output(queue, "offsets", offsets)?;
        seen.output(queue, "next_ahead", next_ahead)?;
    }
    Ok(())
}
