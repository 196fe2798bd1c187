//! Points of the original, each with the face of the result that it is nearest to.

use rayon::prelude::*;

use crate::kernel::rows::Position;
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::spatial::triangle::closest_point;
use crate::spatial::{self, Bvh};

/// Samples for every face of the result, at most.
const SAMPLES_EACH: usize = 12;
/// Samples that a thread places at a time: each search starts at the face of the one before.
const CHUNK: usize = 1 << 10;

/// Weighted points and where they belong.
#[derive(Debug, Default)]
pub struct Samples {
    points: Vec<[f32; 4]>,
    /// The nearest face of each.
    faces: Vec<u32>,
}

impl Samples {
    /// Every so many of the vertices and of the middles of faces of `original`, weighted by area.
    pub fn new(original: &Mesh, result: &Mesh, frame: Frame) -> Self {
        let rows: Vec<DVec3> = original.positions.par_iter().map(|&p| frame.to_rows(p).as_dvec3()).collect();
        let areas: Vec<f64> = (original.faces.par_iter())
            .map(|face| {
                let [a, b, c] = face.map(|v| rows[v as usize]);
                (b - a).cross(c - a).length() / 2.0
            })
            .collect();
        let mut shares = vec![0.0; rows.len()];
        for (face, area) in original.faces.iter().zip(&areas) {
            face.iter().for_each(|&v| shares[v as usize] += area / 3.0);
        }
        let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
        let weight = |area: f64| if mean > 0.0 { (area / mean) as f32 } else { 0.0 };

        let (vertices, total) = (rows.len(), rows.len() + areas.len());
        let step = (total / (SAMPLES_EACH * result.faces.len()).max(1)).max(1);
        let of = |i: usize| {
            if i < vertices {
                return (rows[i], original.positions[i], weight(shares[i]));
            }
            let face = original.faces[i - vertices];
            // A third of each first: the sum of finite numbers may not be.
            let [a, b, c] = face.map(|v| original.positions[v as usize] / 3.0);
            let middle = a + b + c;
            (frame.to_rows(middle).as_dvec3(), middle, weight(areas[i - vertices]))
        };
        let taken: Vec<(DVec3, DVec3, f32)> =
            (0..total).into_par_iter().filter(|i| i % step == 0).map(of).filter(|(.., weight)| *weight > 0.0).collect();
        let space = spatial::Frame::of(original, result);
        let bvh = Bvh::new(result, space);
        let mut faces = vec![0; taken.len()];
        faces.par_chunks_mut(CHUNK).zip(taken.par_chunks(CHUNK)).for_each(|(faces, taken)| {
            let mut guess = 0;
            for (face, (_, p, _)) in faces.iter_mut().zip(taken) {
                guess = bvh.closest(space.to_frame(*p), guess).map_or(guess, |hit| hit.face);
                *face = guess;
            }
        });
        let row = |(p, _, weight): (DVec3, DVec3, f32)| [p.x as f32, p.y as f32, p.z as f32, weight];
        Self { points: taken.into_iter().map(row).collect(), faces }
    }

    /// The points by face: where those of each start, and their rows; also the samples in that order.
    pub fn by_face(&self, face_count: usize) -> (Vec<u32>, Vec<[f32; 4]>, Vec<u32>) {
        let mut starts = vec![0_u32; face_count + 1];
        self.faces.iter().for_each(|&face| starts[face as usize + 1] += 1);
        for face in 0..face_count {
            starts[face + 1] += starts[face];
        }
        let (mut next, mut order) = (starts.clone(), vec![0; self.faces.len()]);
        for (sample, &face) in (0..).zip(&self.faces) {
            order[next[face as usize] as usize] = sample;
            next[face as usize] += 1;
        }
        let rows = order.iter().map(|&sample: &u32| self.points[sample as usize]).collect();
        (starts, rows, order)
    }

    /// Gives each of these samples to the nearer of two faces.
    pub fn follow<'s>(
        &mut self,
        samples: impl Iterator<Item = &'s u32>,
        faces: [(u32, [u32; 3]); 2],
        positions: &[Position],
    ) {
        let shapes = faces.map(|(_, corners)| corners.map(|v| positions[v as usize].xyz().as_dvec3()));
        for &sample in samples {
            let [x, y, z, _] = self.points[sample as usize].map(f64::from);
            let [first, second] = shapes.map(|shape| closest_point(DVec3::new(x, y, z), shape).distance_sq);
            self.faces[sample as usize] = faces[usize::from(second < first)].0;
        }
    }
}
