//! Moves in parallel rounds, by kernels: directions go to the device, labels come back.
//!
//! Why no round raises the energy and none tears a region: [`crate::kernel::boundary_gains`] and
//! [`crate::kernel::label_moves`].

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::boundary_gains::BoundaryGains;
use crate::kernel::label_moves::LabelMoves;
use crate::kernel::rows::Face;
use crate::math::DVec3;
use crate::math::exact::{LEAST_FACTOR, flush3};

use super::labeling::{Labeling, Sum};
use super::scene::Scene;

/// A round that lowers the energy by less than this share of it is the last: the rest is for moves one by one, of which a few
/// do as much.
const LEAST_GAIN: f64 = 1e-5;
/// Rounds at most; one to three hundred are usual.
const MOST_ROUNDS: u32 = 2000;

/// A surface and its labels on a device.
#[derive(Debug)]
pub struct Rounds {
    faces: Buffer<Face>,
    neighbors: Buffer<Face>,
    normals: Buffer<[f32; 4]>,
    ring_starts: Buffer<u32>,
    ring_faces: Buffer<u32>,
    labels: Buffer<u32>,
    targets: Buffer<u32>,
}

impl Rounds {
    /// Copies what does not change to the device of `queue`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when the device is out of memory or was lost.
    pub fn new(queue: &mut Queue, scene: &Scene<'_>) -> Result<Self> {
        let surface = scene.surface;
        let face_count = scene.face_count();
        Ok(Self {
            faces: queue.buffer_from(bytemuck::cast_slice(&surface.faces).to_vec())?,
            neighbors: queue.buffer_from(bytemuck::cast_slice(&surface.neighbors).to_vec())?,
            normals: queue.buffer_from(scene.shapes.iter().map(|shape| row(shape.normal)).collect())?,
            ring_starts: queue.buffer_from(surface.rings.starts.clone())?,
            ring_faces: queue.buffer_from(surface.rings.faces.clone())?,
            labels: queue.buffer(face_count)?,
            targets: queue.buffer(face_count)?,
        })
    }

    /// Rounds from number `*round` on, until one gains little or `go_on` says no after one.
    ///
    /// # Errors
    /// [`crate::Error::Device`] when the device was lost; `regions` and `round` are then as after the last round, to go on from.
    pub fn run(
        &mut self,
        queue: &mut Queue,
        scene: &Scene<'_>,
        regions: &mut Labeling,
        round: &mut u32,
        mut go_on: impl FnMut(&Labeling) -> bool,
    ) -> Result<()> {
        queue.write(&mut self.labels, &regions.labels)?;
        let mut energy = regions.energy();
        while *round < MOST_ROUNDS {
            let moves = self.round(queue, scene, regions, *round)?;
            *round += 1;
            let before = std::mem::replace(&mut energy, regions.energy());
            if moves == 0 || !go_on(regions) || before - energy < LEAST_GAIN * before {
                break;
            }
        }
        regions.sum_anew(scene);
        Ok(())
    }

    /// One round. How many faces moved.
    fn round(&mut self, queue: &mut Queue, scene: &Scene<'_>, regions: &mut Labeling, round: u32) -> Result<usize> {
        let face_count = scene.face_count() as u32;
        let Self { faces, neighbors, normals, ring_starts, ring_faces, labels, targets } = self;
        let directions = queue.buffer_from(regions.sums.iter().map(Sum::direction).map(row).collect())?;
        queue.run(BoundaryGains { faces, neighbors, normals, directions: &directions, labels, face_count, targets })?;
        queue.run(LabelMoves { faces, ring_starts, ring_faces, targets, face_count, round, labels })?;
        let mut moves = 0;
        for (face, &label) in (0..).zip(queue.rows(labels)?.iter()) {
            if regions.labels[face as usize] != label {
                regions.shift(scene, face, label);
                moves += 1;
            }
        }
        Ok(moves)
    }
}

/// A unit vector as kernels have it.
fn row(direction: DVec3) -> [f32; 4] {
    let rounded = flush3(direction.as_vec3(), LEAST_FACTOR);
    [rounded.x, rounded.y, rounded.z, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::partition::Partition;
    use crate::partition::vsa::attempt::start;
    use crate::partition::vsa::scene::tests::{bumpy_torus, scene, surface};

    #[test]
    fn rounds_lower_the_energy_and_tear_nothing() {
        let surface = surface(&bumpy_torus(60, 40));
        let scene = scene(&surface);
        for seed in 0..4 {
            let mut regions = start(&scene, 30, seed);
            let mut energies = vec![regions.energy()];
            let device = Device::cpu(2).expect("threads");
            let queue = &mut device.cpu_queue();
            let mut rounds = Rounds::new(queue, &scene).expect("the CPU");
            let mut round = 0;
            let go_on = |regions: &Labeling| {
                let partition = Partition { labels: regions.labels.clone(), region_count: 30 };
                assert_eq!(partition.validate(&surface.neighbors), []);
                energies.push(Labeling::new(&scene, regions.labels.clone(), 30).energy());
                true
            };
            rounds.run(queue, &scene, &mut regions, &mut round, go_on).expect("the CPU");
            assert!(round > 10 && energies.windows(2).all(|pair| pair[1] < pair[0]), "{energies:?}");
            assert!(energies[energies.len() - 1] < 0.9 * energies[0]);
        }
    }
}
