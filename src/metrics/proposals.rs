//! A GPU's part in measuring: for every sample, a face that may be the closest.
//!
//! The host looks again from there, so that the result has the same bits with any proposals and with none.

use crate::backend::{Buffer, Device, Queue};
use crate::error::Result;
use crate::kernel::rows::{Face, Position, TreeNode};
use crate::kernel::sample_distances::{STACK, SampleDistances};
use crate::math::DVec3;
use crate::spatial::Bvh;
use crate::spatial::bvh::{LEAF, MOST_LEVELS};

// What the kernel takes for granted.
const _: () = assert!(STACK as usize >= MOST_LEVELS && LEAF <= 4);

/// Fewest samples for which a GPU that was taken by itself gains: below, copying the tree takes longer.
const AUTO_SAMPLES: usize = 100_000;

/// A tree on a GPU.
pub(super) struct Proposals {
    queue: Queue,
    nodes: Buffer<TreeNode>,
    faces: Buffer<Face>,
    positions: Buffer<Position>,
    samples: Buffer<Position>,
    nearest: Buffer<[u32; 2]>,
}

impl Proposals {
    /// The tree on the device, for batches of samples up to `batch`; `None` without a GPU, where it gains nothing for so
    /// many `samples`, and where it fails.
    pub fn of(bvh: &Bvh<'_>, device: &Device, samples: usize, batch: usize) -> Option<Self> {
        let gains = !device.is_auto() || samples >= AUTO_SAMPLES;
        let queue = device.gpu_queue().filter(|_| gains)?;
        Self::on(queue, bvh, batch).ok()
    }

    fn on(mut queue: Queue, bvh: &Bvh<'_>, batch: usize) -> Result<Self> {
        let mut nodes = queue.buffer(bvh.nodes().len())?;
        queue.write(&mut nodes, bytemuck::cast_slice(bvh.nodes()))?;
        let mut faces = queue.buffer(bvh.corners().len())?;
        queue.write(&mut faces, bytemuck::cast_slice(bvh.corners()))?;
        let positions = bvh.mesh().positions.iter().map(|&p| row(bvh.frame().to_frame(p))).collect();
        let positions = queue.buffer_from(positions)?;
        let (samples, nearest) = (queue.buffer(batch)?, queue.buffer(batch)?);
        Ok(Self { queue, nodes, faces, positions, samples, nearest })
    }

    /// For each point of the frame a triangle of the tree; `None` when the GPU fails.
    pub fn propose(&mut self, points: impl Iterator<Item = DVec3>) -> Option<Vec<u32>> {
        self.nearest(points.map(row).collect()).ok()
    }

    fn nearest(&mut self, rows: Vec<Position>) -> Result<Vec<u32>> {
        let Self { queue, nodes, faces, positions, samples, nearest } = self;
        queue.write(samples, &rows)?;
        queue.run(SampleDistances { samples, sample_count: rows.len() as u32, nodes, faces, positions, nearest })?;
        let mut found = Vec::with_capacity(rows.len());
        queue.read(nearest, 0..rows.len(), &mut found)?;
        Ok(found.into_iter().map(|[triangle, _]| triangle).collect())
    }
}

/// In single precision; an unused vertex beyond it stays finite.
fn row(p: DVec3) -> Position {
    let p = p.clamp(DVec3::splat(-4.0), DVec3::splat(4.0)).as_vec3();
    Position { x: p.x, y: p.y, z: p.z, flags: 0 }
}
