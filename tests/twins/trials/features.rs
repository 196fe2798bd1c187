//! Curvatures, the weights of features, and what they multiply.

use coarsen::Result;
use coarsen::backend::{Buffer, Device, Queue};
use coarsen::kernel::angle_defects::AngleDefects;
use coarsen::kernel::block_sums::{BlockSums, SUM_BLOCK};
use coarsen::kernel::border_curvatures::BorderCurvatures;
use coarsen::kernel::curvatures::Curvatures;
use coarsen::kernel::face_corners::FaceCorners;
use coarsen::kernel::feature_weights::{FeatureWeights, Params};
use coarsen::kernel::pair_quadric::NO_KEY;
use coarsen::kernel::rows::{Corners, Face, Position};
use coarsen::kernel::weigh_keys::WeighKeys;
use coarsen::kernel::weigh_quadrics::WeighQuadrics;

use super::inputs::{Random, Round, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 8] = [
    Trial { name: "angle_defects", run: angle_defects },
    Trial { name: "face_corners", run: face_corners },
    Trial { name: "curvatures", run: curvatures },
    Trial { name: "border_curvatures", run: border_curvatures },
    Trial { name: "block_sums", run: block_sums },
    Trial { name: "feature_weights", run: feature_weights },
    Trial { name: "weigh_quadrics", run: weigh_quadrics },
    Trial { name: "weigh_keys", run: weigh_keys },
];

/// The live mesh on a queue's device.
struct Mesh {
    positions: Buffer<Position>,
    faces: Buffer<Face>,
    ring_starts: Buffer<u32>,
    ring_faces: Buffer<u32>,
    vertex_count: u32,
    face_count: u32,
}

impl Mesh {
    fn new(queue: &mut Queue, round: &Round) -> Result<Self> {
        Ok(Self {
            positions: queue.buffer_from(round.positions.clone())?,
            faces: queue.buffer_from(round.faces.clone())?,
            ring_starts: queue.buffer_from(round.ring_starts.clone())?,
            ring_faces: queue.buffer_from(round.ring_faces.clone())?,
            vertex_count: round.positions.len() as u32,
            face_count: round.faces.len() as u32,
        })
    }

    fn corners(&self, queue: &mut Queue) -> Result<Buffer<Corners>> {
        let mut corners = queue.buffer(self.faces.len())?;
        let Self { positions, faces, face_count, .. } = self;
        queue.run(FaceCorners { positions, faces, face_count: *face_count, corners: &mut corners })?;
        Ok(corners)
    }
}

/// Corners and curvatures of a round, on the host.
fn curved(round: &Round) -> (Vec<Corners>, Vec<f32>) {
    let mut queue = Device::cpu(1).unwrap().cpu_queue();
    let mesh = Mesh::new(&mut queue, round).unwrap();
    let corners = &mesh.corners(&mut queue).unwrap();
    let Mesh { positions, faces, ring_starts, ring_faces, vertex_count, .. } = &mesh;
    let vertex_count = *vertex_count;
    let areas = &mut queue.buffer(round.positions.len()).unwrap();
    let curvatures = &mut queue.buffer(round.positions.len()).unwrap();
    queue
        .run(Curvatures { positions, faces, ring_starts, ring_faces, corners, vertex_count, areas, curvatures })
        .unwrap();
    queue.run(BorderCurvatures { positions, faces, ring_starts, ring_faces, vertex_count, curvatures }).unwrap();
    (corners.host().to_vec(), curvatures.host().to_vec())
}

/// A weight for each of `count` rows: zeros, ones, and others of all magnitudes that are used.
fn some_weights(count: usize) -> Vec<f32> {
    let mut random = Random::new();
    let mut weight = || [0.0, 1.0, 1.5, 1e-3, 5.0, 1e-30, 1e-40, random.centered() + 0.5][random.below(8) as usize];
    (0..count).map(|_| weight()).collect()
}

fn face_corners(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut rows = round.positions.clone();
        flip(&mut rows[round.faces[0].a as usize].x, perturbed);
        let positions = &queue.buffer_from(rows)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let corners = &mut queue.buffer(round.faces.len())?;
        seen.run(queue, FaceCorners { positions, faces, face_count: round.faces.len() as u32, corners })?;
        seen.output(queue, "corners", corners)?;
    }
    Ok(())
}

fn curvatures(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let (mut rows, _) = curved(round);
        flip(&mut rows[round.ring_faces[0] as usize].area_a, perturbed);
        flip(&mut rows[round.ring_faces[0] as usize].cot_b, perturbed);
        let mesh = Mesh::new(queue, round)?;
        let Mesh { positions, faces, ring_starts, ring_faces, vertex_count, .. } = &mesh;
        let (corners, vertex_count) = (&queue.buffer_from(rows)?, *vertex_count);
        let areas = &mut queue.buffer(round.positions.len())?;
        let curvatures = &mut queue.buffer(round.positions.len())?;
        seen.run(
            queue,
            Curvatures { positions, faces, ring_starts, ring_faces, corners, vertex_count, areas, curvatures },
        )?;
        seen.output(queue, "areas", areas)?;
        seen.output(queue, "curvatures", curvatures)?;
    }
    Ok(())
}

fn angle_defects(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let (mut rows, _) = curved(round);
        let row = &mut rows[round.ring_faces[0] as usize];
        [&mut row.cot_a, &mut row.cot_b, &mut row.cot_c].into_iter().for_each(|cot| flip(cot, perturbed));
        let mesh = Mesh::new(queue, round)?;
        let Mesh { positions, faces, ring_starts, ring_faces, vertex_count, .. } = &mesh;
        let (corners, vertex_count) = (&queue.buffer_from(rows)?, *vertex_count);
        let defects = &mut queue.buffer(round.positions.len())?;
        seen.run(queue, AngleDefects { positions, faces, ring_starts, ring_faces, corners, vertex_count, defects })?;
        seen.output(queue, "defects", defects)?;
    }
    Ok(())
}

fn border_curvatures(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let (_, mut rows) = curved(round);
        // All neighbors of a corner of a sheet may lie on its border; not all of them all around.
        rows.iter_mut().for_each(|row| flip(row, perturbed));
        let mesh = Mesh::new(queue, round)?;
        let Mesh { positions, faces, ring_starts, ring_faces, vertex_count, .. } = &mesh;
        let (curvatures, vertex_count) = (&mut queue.buffer_from(rows)?, *vertex_count);
        seen.run(queue, BorderCurvatures { positions, faces, ring_starts, ring_faces, vertex_count, curvatures })?;
        seen.output(queue, "curvatures", curvatures)?;
    }
    Ok(())
}

fn block_sums(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    let block = SUM_BLOCK as usize;
    for (name, count) in [("a block", block), ("a value more", block + 1), ("some", 70_000), ("one", 1)] {
        seen.input(name);
        let mut random = Random::new();
        let mut rows: Vec<f32> = (0..count).map(|_| 1e3 * (random.centered() + 0.5)).collect();
        rows[0] = if perturbed { rows[0] + 1.0 } else { rows[0] };
        // Far below the rest: lost in the sum, on any device.
        rows.last_mut().into_iter().for_each(|row| *row = 1e-40);
        let values = &queue.buffer_from(rows)?;
        let sums = &mut queue.buffer(count.div_ceil(block))?;
        seen.run(queue, BlockSums { values, value_count: count as u32, sums })?;
        seen.output(queue, "sums", sums)?;
    }
    Ok(())
}

fn feature_weights(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    let affine =
        Params { floor_share: 1e-3, least_sum: 1e-2, gated: 0, base: 1.0, slope: 4.0, least: 0.0, of_fixed: 5.0 };
    let modes = [
        affine,
        Params { gated: 1, ..affine },
        Params { floor_share: 0.0, base: 1.0, slope: -1.0, least: 1e-3, of_fixed: 1.0, ..affine },
    ];
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let (_, mut rows) = curved(round);
        rows.iter_mut().for_each(|row| flip(row, perturbed));
        let mesh = Mesh::new(queue, round)?;
        let Mesh { positions, faces, ring_starts, ring_faces, vertex_count, .. } = &mesh;
        let (curvatures, vertex_count) = (&queue.buffer_from(rows.clone())?, *vertex_count);
        let curvature_sum = &queue.buffer_from(vec![rows.iter().sum::<f32>()])?;
        for params in modes {
            let weights = &mut queue.buffer(round.positions.len())?;
            seen.run(
                queue,
                FeatureWeights {
                    positions,
                    faces,
                    ring_starts,
                    ring_faces,
                    curvatures,
                    curvature_sum,
                    vertex_count,
                    params,
                    weights,
                },
            )?;
            seen.output(queue, "weights", weights)?;
        }
    }
    Ok(())
}

fn weigh_quadrics(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut rows = some_weights(round.quadrics.len());
        rows.iter_mut().for_each(|row| flip(row, perturbed));
        let quadrics = &queue.buffer_from(round.quadrics.clone())?;
        let weights = &queue.buffer_from(rows)?;
        let weighed_quadrics = &mut queue.buffer(round.quadrics.len())?;
        let vertex_count = round.quadrics.len() as u32;
        seen.run(queue, WeighQuadrics { quadrics, weights, vertex_count, weighed_quadrics })?;
        seen.output(queue, "weighed_quadrics", weighed_quadrics)?;
    }
    Ok(())
}

fn weigh_keys(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut random = Random::new();
        // Any cost, those that may be flushed too: no sign, no infinity but that of what has no key.
        let mut rows: Vec<u32> =
            round.pairs.iter().map(|_| random.below(0x7f80) << 16 | random.below(1 << 16)).collect();
        rows.iter_mut().for_each(|row| *row ^= u32::from(perturbed) << 12);
        rows.iter_mut().step_by(7).for_each(|row| *row = NO_KEY);
        let keys = &mut queue.buffer_from(rows)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let pairs = &queue.buffer_from(round.pairs.clone())?;
        let weights = &queue.buffer_from(some_weights(round.positions.len()))?;
        seen.run(queue, WeighKeys { faces, pairs, weights, pair_count: round.pairs.len() as u32, keys })?;
        seen.output(queue, "keys", keys)?;
    }
    Ok(())
}
