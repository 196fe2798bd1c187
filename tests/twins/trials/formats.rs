//! What bounds average quadrics, their codes and back.

use coarsen::Result;
use coarsen::backend::{Buffer, Queue};
use coarsen::kernel::block_maxima::{BlockMaxima, MAXIMUM_BLOCK};
use coarsen::kernel::decode_quadrics::DecodeQuadrics;
use coarsen::kernel::encode_quadrics::{EncodeQuadrics, word_count};
use coarsen::kernel::format_frame::FormatFrame;
use coarsen::kernel::quadric_bounds::QuadricBounds;
use coarsen::kernel::quadric_format::{F16, F32, LOCAL8, LOCAL16, RGBA8, SNORM16};
use coarsen::kernel::rows::{Position, QuadricBound};

use super::inputs::{Random, Round, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 4] = [
    Trial { name: "quadric_bounds", run: quadric_bounds },
    Trial { name: "block_maxima", run: block_maxima },
    Trial { name: "encode_quadrics", run: encode_quadrics },
    Trial { name: "decode_quadrics", run: decode_quadrics },
];

const FORMATS: [u32; 6] = [F32, F16, SNORM16, RGBA8, LOCAL16, LOCAL8];
/// About the middle, and about a far origin.
const FRAMES: [FormatFrame; 2] = [
    FormatFrame { origin_x: 0.0, origin_y: 0.0, origin_z: 0.0, unit: 0.037 },
    FormatFrame { origin_x: -130.0, origin_y: 7.5, origin_z: 1e-3, unit: 4.0 },
];

fn positions(queue: &mut Queue, round: &Round, perturbed: bool) -> Result<Buffer<Position>> {
    let mut rows = round.positions.clone();
    rows.iter_mut().for_each(|row| flip(&mut row.y, perturbed));
    queue.buffer_from(rows)
}

/// The greatest weight of a round's quadrics, and a distance.
fn bound(queue: &mut Queue, round: &Round) -> Result<Buffer<QuadricBound>> {
    let weight = round.quadrics.iter().map(|quadric| quadric.weight).fold(0.0, f32::max);
    queue.buffer_from(vec![QuadricBound { weight, offset_sq: 3.7 }])
}

fn quadric_bounds(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let positions = &positions(queue, round, perturbed)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let normals = &queue.buffer_from(round.normals.clone())?;
        let quadrics = &queue.buffer_from(round.quadrics.clone())?;
        let vertex_count = round.positions.len() as u32;
        for frame in FRAMES {
            let bounds = &mut queue.buffer(round.positions.len())?;
            seen.run(
                queue,
                QuadricBounds {
                    positions,
                    faces,
                    ring_starts,
                    ring_faces,
                    normals,
                    quadrics,
                    vertex_count,
                    frame,
                    bounds,
                },
            )?;
            seen.output(queue, "bounds", bounds)?;
        }
    }
    Ok(())
}

fn block_maxima(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    let block = MAXIMUM_BLOCK as usize;
    for (name, count) in [("a block", block), ("a row more", block + 1), ("some", 70_000), ("one", 1)] {
        seen.input(name);
        let mut random = Random::new();
        let mut number = || 1e3 * (random.centered() + 0.5);
        let mut rows: Vec<QuadricBound> =
            (0..count).map(|_| QuadricBound { weight: number(), offset_sq: number() }).collect();
        rows[0].offset_sq += if perturbed { 2e3 } else { 0.0 };
        let bounds = &queue.buffer_from(rows)?;
        let maxima = &mut queue.buffer(count.div_ceil(block))?;
        seen.run(queue, BlockMaxima { bounds, bound_count: count as u32, maxima })?;
        seen.output(queue, "maxima", maxima)?;
    }
    Ok(())
}

fn encode_quadrics(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let positions = &positions(queue, round, perturbed)?;
        let quadrics = &queue.buffer_from(round.quadrics.clone())?;
        let bound = &bound(queue, round)?;
        let vertex_count = round.positions.len() as u32;
        for (frame, format) in FRAMES.into_iter().flat_map(|frame| FORMATS.map(|format| (frame, format))) {
            let words = &mut queue.buffer(word_count(format, round.positions.len()))?;
            seen.run(queue, EncodeQuadrics { positions, quadrics, bound, vertex_count, frame, format, words })?;
            seen.output(queue, "words", words)?;
        }
    }
    Ok(())
}

fn decode_quadrics(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let bound = &bound(queue, round)?;
        let vertex_count = round.positions.len() as u32;
        for (frame, format) in FRAMES.into_iter().flat_map(|frame| FORMATS.map(|format| (frame, format))) {
            let mut random = Random::new();
            // Numbers of the format: any codes, but for those of single and half precision that are none.
            let mut word = || match format {
                F32 => (2.0 * random.centered()).to_bits(),
                F16 => random.bits() & 0xbbff_bbff,
                _ => random.bits(),
            };
            let mut rows: Vec<u32> = (0..word_count(format, round.positions.len())).map(|_| word()).collect();
            rows[0] ^= u32::from(perturbed) << 6;
            let words = &queue.buffer_from(rows)?;
            let positions = &positions(queue, round, false)?;
            let quadrics = &mut queue.buffer(round.positions.len())?;
            seen.run(queue, DecodeQuadrics { positions, words, bound, vertex_count, frame, format, quadrics })?;
            seen.output(queue, "quadrics", quadrics)?;
        }
    }
    Ok(())
}
