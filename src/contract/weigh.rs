//! Weights on their way into costs: into the quadrics once, or into what is evaluated in every round.

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::rows::PlaneQuadric;
use crate::kernel::weigh_quadrics::WeighQuadrics;

use super::features::Features;
use super::surface::Surface;
use super::weighting::{Update, Weighting};
use super::{Metric, Options};

/// Finds the weights of a run that are found once, unless they are given or found already.
pub fn start_weights(
    queue: &mut Queue,
    surface: &Surface,
    options: &Options,
    has_border: bool,
    weights: &mut Vec<f32>,
) -> Result<()> {
    match options.weighting {
        Weighting::Feature(feature) if feature.update == Update::Static && weights.is_empty() => {
            let mut features = Features::new(queue, surface, feature, has_border)?;
            features.weigh(queue, surface)?;
            queue.read(features.weights(), 0..surface.vertex_count, weights)
        }
        _ => Ok(()),
    }
}

/// Multiplies a surface's quadrics by weights that are found once, if there are any: they add up like any others.
pub fn weigh_start(queue: &mut Queue, surface: &mut Surface, weights: &[f32]) -> Result<()> {
    let Some(quadrics) = surface.quadrics.as_mut().filter(|_| !weights.is_empty()) else { return Ok(()) };
    let mut weighed_quadrics = queue.buffer(surface.vertex_count)?;
    let weights = &queue.buffer_from(weights.to_vec())?;
    let vertex_count = surface.vertex_count as u32;
    queue.run(WeighQuadrics { quadrics, weights, vertex_count, weighed_quadrics: &mut weighed_quadrics })?;
    *quadrics = weighed_quadrics;
    Ok(())
}

/// Weights that no quadric holds, on the device of an evaluation.
#[derive(Debug)]
pub struct RoundWeights {
    source: Source,
    /// For `plane`.
    weighed_quadrics: Option<Buffer<PlaneQuadric>>,
}

/// Where the weights of a round come from.
#[derive(Debug)]
enum Source {
    /// The surface, as it is on the device.
    Features(Box<Features>),
    /// The host, which carries them.
    Host(Buffer<f32>),
}

impl Source {
    fn weights(&self) -> &Buffer<f32> {
        match self {
            Self::Features(features) => features.weights(),
            Self::Host(weights) => weights,
        }
    }
}

impl RoundWeights {
    /// What these options need; `None` for uniform weights and for those that the quadrics hold.
    pub fn new(queue: &Queue, surface: &Surface, options: &Options, has_border: bool) -> Result<Option<Self>> {
        let source = match (&options.weighting, options.metric) {
            (Weighting::Feature(feature), _) if feature.update == Update::Recompute => {
                Source::Features(Box::new(Features::new(queue, surface, *feature, has_border)?))
            }
            (Weighting::Uniform, _) | (_, Metric::Plane) => return Ok(None),
            (_, Metric::Volume) => Source::Host(queue.buffer(surface.vertex_count)?),
        };
        let accumulates = options.metric == Metric::Plane;
        let weighed_quadrics = accumulates.then(|| queue.buffer(surface.vertex_count)).transpose()?;
        Ok(Some(Self { source, weighed_quadrics }))
    }

    /// Finds the weights of this round, or takes the host's.
    pub fn begin(&mut self, queue: &mut Queue, surface: &Surface, carried: &[f32]) -> Result<()> {
        match &mut self.source {
            Source::Features(features) => features.weigh(queue, surface)?,
            Source::Host(weights) => queue.write(weights, carried)?,
        }
        match (&mut self.weighed_quadrics, &surface.quadrics) {
            (Some(weighed_quadrics), Some(quadrics)) => {
                let (weights, vertex_count) = (self.source.weights(), surface.vertex_count as u32);
                queue.run(WeighQuadrics { quadrics, weights, vertex_count, weighed_quadrics })
            }
            _ => Ok(()),
        }
    }

    /// Whether the host's weights are needed, which it has once it compacted.
    pub fn are_carried(&self) -> bool {
        matches!(self.source, Source::Host(_))
    }

    /// Has the weights that were found here copied along, for [`RoundWeights::end`].
    pub fn prefetch(&self, queue: &mut Queue, vertices: usize) -> Result<()> {
        match &self.source {
            Source::Features(features) => queue.prefetch(features.weights(), 0..vertices),
            Source::Host(_) => Ok(()),
        }
    }

    /// Those of the round.
    pub fn weights(&self) -> &Buffer<f32> {
        self.source.weights()
    }

    /// The surface's quadrics times the weights, for `plane`.
    pub fn quadrics(&self) -> Option<&Buffer<PlaneQuadric>> {
        self.weighed_quadrics.as_ref()
    }

    /// Gives the host the weights that were found here.
    pub fn end(&self, queue: &mut Queue, vertices: usize, carried: &mut Vec<f32>) -> Result<()> {
        if let Source::Features(features) = &self.source {
            carried.clear();
            queue.read(features.weights(), 0..vertices, carried)?;
        }
        Ok(())
    }
}
