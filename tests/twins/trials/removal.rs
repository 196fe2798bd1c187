//! What removing vertices costs, and what turning edges gains.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::flip_gains::{BY_BEND, BY_DISTANCE, BY_SHAPE, FlipGains};
use coarsen::kernel::removal_costs::RemovalCosts;

use super::inputs::{Random, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 2] =
    [Trial { name: "removal_costs", run: removal_costs }, Trial { name: "flip_gains", run: flip_gains }];

/// Without features, with those of more than 20 degrees, and all that bend at all.
fn removal_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut rows = round.positions.clone();
        for row in &mut rows[..4] {
            flip(&mut row.z, perturbed);
        }
        let positions = &queue.buffer_from(rows)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let normals = &queue.buffer_from(round.normals.clone())?;
        let deviations = &queue.buffer_from(round.normals.iter().map(|n| n.root).collect())?;
        let vertex_count = round.positions.len() as u32;
        for (crease_cos, keeps_corners) in [(-2.0, false), (0.94, true), (0.94, false), (1.0, false)] {
            let keys = &mut queue.buffer(round.positions.len())?;
            let kernel = RemovalCosts {
                positions,
                faces,
                ring_starts,
                ring_faces,
                normals,
                deviations,
                vertex_count,
                crease_cos,
                keeps_corners,
                keys,
            };
            seen.run(queue, kernel)?;
            seen.output(queue, "keys", keys)?;
        }
    }
    Ok(())
}

/// With up to three samples near each face.
fn flip_gains(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut random = Random::new();
        let (mut starts, mut samples) = (vec![0], Vec::new());
        for face in &round.faces {
            let [a, b, c] = face.corners().map(|v| round.positions[v as usize].xyz());
            for _ in 0..random.below(4) {
                let p = (a + b + c) / 3.0 + (b - a) * random.centered() + (c - a) * random.centered();
                samples.push([p.x, p.y, p.z, 0.5 + random.centered()]);
            }
            starts.push(samples.len() as u32);
        }
        for sample in &mut samples[..2] {
            flip(&mut sample[2], perturbed);
        }
        let mut rows = round.positions.clone();
        rows.iter_mut().take(8).for_each(|row| flip(&mut row.z, perturbed));
        let positions = &queue.buffer_from(rows)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let pairs = &queue.buffer_from(round.pairs.clone())?;
        let sample_starts = &queue.buffer_from(starts)?;
        let samples = &queue.buffer_from(samples)?;
        let pair_count = round.pairs.len() as u32;
        for objective in [BY_DISTANCE, BY_BEND, BY_SHAPE] {
            let gains = &mut queue.buffer(round.pairs.len())?;
            let kernel = FlipGains {
                positions,
                faces,
                ring_starts,
                ring_faces,
                pairs,
                pair_count,
                sample_starts,
                samples,
                objective,
                gains,
            };
            seen.run(queue, kernel)?;
            seen.output(queue, "gains", gains)?;
        }
    }
    Ok(())
}
