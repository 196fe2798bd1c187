//! Which faces would change their region, and which of them do.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::boundary_gains::{BoundaryGains, NONE};
use coarsen::kernel::label_moves::LabelMoves;
use coarsen::kernel::rows::Face;
use coarsen::math::Vec3;
use coarsen::math::exact::{LEAST_FACTOR, flush3};
use coarsen::mesh::Rings;
use coarsen::mesh::dual::neighbors;

use super::inputs::{Random, Round, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 2] =
    [Trial { name: "boundary_gains", run: boundary_gains }, Trial { name: "label_moves", run: label_moves }];

/// Few enough that many faces choose between several, and some directions are equal.
const REGIONS: u32 = 23;

fn unit(v: Vec3) -> [f32; 4] {
    let [x, y, z] = flush3(v.normalize_or_zero(), LEAST_FACTOR).to_array();
    [x, y, z, 0.0]
}

/// The faces across the edges of every face.
fn across(round: &Round) -> Vec<Face> {
    let faces: Vec<[u32; 3]> = round.faces.iter().map(|face| face.corners()).collect();
    let rings = Rings { starts: round.ring_starts.clone(), faces: round.ring_faces.clone() };
    neighbors(&faces, &rings).into_iter().map(|[a, b, c]| Face { a, b, c }).collect()
}

/// Directions of all kinds: random ones, equal ones, and none.
fn directions(random: &mut Random) -> Vec<[f32; 4]> {
    let mut directions: Vec<[f32; 4]> =
        (0..REGIONS).map(|_| unit(Vec3::new(random.centered(), random.centered(), random.centered()))).collect();
    directions[5] = directions[9];
    directions[6] = directions[9];
    directions[7] = [0.0; 4];
    directions[8] = unit(Vec3::Z);
    directions
}

/// Labels in stripes, where most moves are legal, and at random, where few are.
fn boundary_gains(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut random = Random::new();
        let face_count = round.faces.len() as u32;
        let striped: Vec<u32> = (0..face_count).map(|face| face / 29 % REGIONS).collect();
        let scattered = (0..face_count).map(|_| random.below(REGIONS)).collect();
        let mut directions = directions(&mut random);

        directions[..4].iter_mut().for_each(|direction| direction[0] *= if perturbed { -1.0 } else { 1.0 });
        let faces = &queue.buffer_from(round.faces.clone())?;
        let neighbors = &queue.buffer_from(across(round))?;
        let normals = &queue.buffer_from(round.normals.iter().map(|normal| unit(normal.weighted())).collect())?;
        let directions = &queue.buffer_from(directions)?;
        for labels in [striped, scattered] {
            let labels = &queue.buffer_from(labels)?;
            let targets = &mut queue.buffer(round.faces.len())?;
            let kernel = BoundaryGains { faces, neighbors, normals, directions, labels, face_count, targets };
            seen.run(queue, kernel)?;
            seen.output(queue, "targets", targets)?;
        }
    }
    Ok(())
}

/// With every face a candidate, and every third.
fn label_moves(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (number, (round, perturbed)) in (0..).zip(rounds(perturbed)) {
        seen.input(round.name);
        let mut random = Random::new();
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        for share in [1, 3] {
            let mut targets: Vec<u32> = round
                .faces
                .iter()
                .map(|_| if random.below(share) == 0 { random.below(REGIONS) } else { NONE })
                .collect();
            if perturbed {
                targets.iter_mut().filter(|target| **target != NONE).for_each(|target| *target ^= 1);
            }
            let targets = &queue.buffer_from(targets)?;
            let labels = &mut queue.buffer_from(vec![REGIONS; round.faces.len()])?;
            let face_count = round.faces.len() as u32;
            let kernel = LabelMoves { faces, ring_starts, ring_faces, targets, face_count, round: number, labels };
            seen.run(queue, kernel)?;
            seen.output(queue, "labels", labels)?;
        }
    }
    Ok(())
}
