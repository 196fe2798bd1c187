//! The weights of features on one device: curvatures, their floor, the entropy about every vertex.

use crate::backend::{Buffer, Device, Queue};
use crate::error::Result;
use crate::kernel::block_sums::{BlockSums, SUM_BLOCK};
use crate::kernel::border_curvatures::BorderCurvatures;
use crate::kernel::curvatures::Curvatures;
use crate::kernel::face_corners::FaceCorners;
use crate::kernel::feature_weights::{FeatureWeights, Params};
use crate::kernel::rows::Corners;
use crate::mesh::Mesh;
use crate::mesh::weld::lowest_at_position;

use super::prepare::{Prepared, prepare};
use super::surface::Surface;
use super::weighting::Feature;
use super::{Metric, NonManifold, Options};

/// The buffers of the kernels, on one device.
#[derive(Debug)]
pub struct Features {
    feature: Feature,
    has_border: bool,
    corners: Buffer<Corners>,
    areas: Buffer<f32>,
    curvatures: Buffer<f32>,
    /// Sums of blocks, and of blocks of those, in turns.
    sums: [Buffer<f32>; 2],
    weights: Buffer<f32>,
}

impl Features {
    /// For a surface and what it becomes, on its device.
    pub fn new(queue: &Queue, surface: &Surface, feature: Feature, has_border: bool) -> Result<Self> {
        let (vertices, blocks) = (surface.vertex_count, surface.vertex_count.div_ceil(SUM_BLOCK as usize));
        Ok(Self {
            feature,
            has_border,
            corners: queue.buffer(surface.face_count)?,
            areas: queue.buffer(vertices)?,
            curvatures: queue.buffer(vertices)?,
            sums: [queue.buffer(blocks)?, queue.buffer(blocks.div_ceil(SUM_BLOCK as usize))?],
            weights: queue.buffer(vertices)?,
        })
    }

    /// Finds the weights of the surface as it is now.
    pub fn weigh(&mut self, queue: &mut Queue, surface: &Surface) -> Result<()> {
        self.run(queue, surface, self.feature.params(surface.vertex_count))
    }

    /// What was found last.
    pub fn weights(&self) -> &Buffer<f32> {
        &self.weights
    }

    fn run(&mut self, queue: &mut Queue, surface: &Surface, params: Params) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let vertex_count = surface.vertex_count as u32;
        let Self { corners, areas, curvatures, weights, .. } = self;
        queue.run(FaceCorners { positions, faces, face_count: surface.face_count as u32, corners })?;
        queue.run(Curvatures {
            positions,
            faces,
            ring_starts,
            ring_faces,
            corners,
            vertex_count,
            areas,
            curvatures,
        })?;
        if self.has_border {
            queue.run(BorderCurvatures { positions, faces, ring_starts, ring_faces, vertex_count, curvatures })?;
        }
        let curvature_sum = sum(queue, curvatures, vertex_count, &mut self.sums)?;
        queue.run(FeatureWeights {
            positions,
            faces,
            ring_starts,
            ring_faces,
            curvatures,
            curvature_sum,
            vertex_count,
            params,
            weights,
        })
    }
}

/// Sums `count` values; the sum is the first row of one of `sums`.
fn sum<'a>(
    queue: &mut Queue,
    values: &Buffer<f32>,
    count: u32,
    sums: &'a mut [Buffer<f32>; 2],
) -> Result<&'a Buffer<f32>> {
    let [to, from] = sums;
    queue.run(BlockSums { values, value_count: count, sums: to })?;
    let (mut to, mut from) = (from, to);
    let mut left = count.div_ceil(SUM_BLOCK);
    while left > 1 {
        queue.run(BlockSums { values: from, value_count: left, sums: to })?;
        std::mem::swap(&mut to, &mut from);
        left = left.div_ceil(SUM_BLOCK);
    }
    Ok(from)
}

/// The feature degree of every vertex of `mesh`, in `[0, 1]`, found on the CPU of `device`.
///
/// Vertices at one position have one degree. Where the surface is not manifold it is 1, at a vertex without a face 0.
///
/// # Errors
/// As [`run`](super::run()).
pub fn feature_degrees(mesh: &Mesh, feature: &Feature, device: &Device) -> Result<Vec<f32>> {
    let options = Options { metric: Metric::Plane, non_manifold: NonManifold::Hold, ..Options::default() };
    super::Weighting::Feature(*feature).check(mesh.positions.len())?;
    device.install(|| {
        let mut prepared = prepare(mesh, &options)?;
        let start = prepared.take_start();
        let Prepared { carried, border_vertices, .. } = prepared;
        let mut queue = device.cpu_queue();
        let surface = Surface::new(&mut queue, start, false)?;
        let mut features = Features::new(&queue, &surface, *feature, border_vertices > 0)?;
        features.run(&mut queue, &surface, feature.degree_params(surface.vertex_count))?;
        let degrees = features.weights().host();
        let mut of_input = vec![0.0; mesh.positions.len()];
        carried.origin.iter().zip(degrees).for_each(|(&v, &degree)| of_input[v as usize] = degree);
        let lowest = lowest_at_position(&mesh.positions);
        Ok(lowest.into_iter().map(|v| of_input[v as usize]).collect())
    })
}
