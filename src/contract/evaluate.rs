//! Evaluating a round on the host: sums, the cost of every pair, the gate. A GPU does the same in [`super::propose`].

use std::ops::Range;

use crate::backend::{Buffer, Queue, Row};
use crate::error::Result;
use crate::kernel::face_normals::FaceNormals;
use crate::kernel::find_threshold::threshold;
use crate::kernel::plane_costs::{self, PlaneBlock, PlaneRows};
use crate::kernel::plane_sums::PlaneSums;
use crate::kernel::rows::{BorderSum, Candidate, Edge, HUB, Normal, PlaneQuadric, VolumeSum};
use crate::kernel::stars::Stars;
use crate::kernel::volume_costs::{self, BORDER_FACTOR};
use crate::kernel::volume_rows::{VolumeBlock, VolumeRows};
use crate::kernel::volume_sums::VolumeSums;
use crate::kernel::warm::faces_near;
use crate::kernel::weigh_keys::{weigh_keys, weighed_key};

use super::attribute_rows::Spreads;
use super::gate::Gate;
use super::listing::Listing;
use super::surface::{LARGE_VERTICES, Surface};
use super::wedges::Wedges;
use super::weigh::RoundWeights;
use super::{Metric, Options};

/// The buffers of a round's evaluation on the host.
#[derive(Debug)]
pub struct Evaluation {
    queue: Queue,
    placement: u32,
    border_weight: f32,
    volume: Option<Volume>,
    spreads: Option<Spreads>,
    weights: Option<RoundWeights>,
    listing: Listing,
    is_first: bool,
}

/// What the `volume` metric sums.
#[derive(Debug)]
struct Volume {
    normals: Buffer<Normal>,
    sums: Buffer<VolumeSum>,
    borders: Buffer<BorderSum>,
}

/// What a round is evaluated with, beside the surface.
#[derive(Debug)]
pub struct Round<'a> {
    /// Pairs without an edge.
    pub joins: &'a [[u32; 2]],
    pub gate: Gate,
    /// Those that the host carries; or they become those that are found for the round.
    pub weights: &'a mut Vec<f32>,
    pub wedges: Option<&'a Wedges>,
}

impl Evaluation {
    /// For a surface.
    pub fn new(
        queue: Queue,
        surface: &Surface,
        options: &Options,
        has_border: bool,
        wedges: Option<&Wedges>,
    ) -> Result<Self> {
        let volume = match options.metric {
            Metric::Volume => Some(Volume {
                normals: queue.buffer(0)?,
                sums: queue.buffer(0)?,
                borders: queue.buffer(if has_border { surface.vertex_count.max(2) } else { 1 })?,
            }),
            Metric::Plane => None,
        };
        Ok(Self {
            placement: options.placement.code(),
            border_weight: BORDER_FACTOR * options.border_weight,
            volume,
            spreads: Spreads::new(&queue, wedges)?,
            weights: RoundWeights::new(&queue, surface, options, has_border)?,
            queue,
            listing: Listing::default(),
            is_first: true,
        })
    }

    /// Appends the round's candidates in the order of the pairs, at last those without an edge; returns how many pairs there
    /// were.
    pub fn run(
        &mut self,
        surface: &Surface,
        Round { joins, gate, weights, wedges }: Round<'_>,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        self.find_sums(surface, wedges)?;
        if let Some(round_weights) = &mut self.weights {
            round_weights.begin(&mut self.queue, surface, weights)?;
        }
        let costs = Costs {
            volume: self.volume.as_ref(),
            weights: self.weights.as_ref(),
            placement: self.placement,
            border_weight: self.border_weight,
        };
        let histogram = costs.list(&mut self.listing, surface, joins);
        let pairs = self.listing.len();
        let threshold = threshold(&histogram, pairs as u32, gate);
        self.listing.gate(threshold.key, candidates);
        if let Some(round_weights) = &self.weights {
            round_weights.end(&mut self.queue, surface.vertex_count, weights)?;
        }
        if std::mem::take(&mut self.is_first) && surface.vertex_count >= LARGE_VERTICES {
            self.release()?;
        }
        Ok(pairs)
    }

    /// Frees what the largest round needed before its commit takes more. The next allocates what it needs, for good.
    fn release(&mut self) -> Result<()> {
        self.listing = Listing::default();
        if let Some(Volume { normals, sums, .. }) = &mut self.volume {
            (*normals, *sums) = (self.queue.buffer(0)?, self.queue.buffer(0)?);
        }
        if let Some(spreads) = &mut self.spreads {
            spreads.release(&self.queue)?;
        }
        Ok(())
    }

    /// Sums what the metric needs of the surface as it is.
    fn find_sums(&mut self, surface: &Surface, wedges: Option<&Wedges>) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (queue, Some(Volume { normals, sums, borders })) = (&mut self.queue, &mut self.volume) else {
            return Ok(());
        };
        grow(queue, normals, surface.face_count)?;
        grow(queue, sums, surface.vertex_count)?;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        queue.run(FaceNormals { positions, faces, face_count, normals })?;
        queue.run(VolumeSums { positions, faces, ring_starts, ring_faces, normals, vertex_count, sums, borders })?;
        if let (Some(spreads), Some(wedges)) = (&mut self.spreads, wedges) {
            spreads.add_to(queue, surface, &wedges.buffers, normals, sums)?;
        }
        Ok(())
    }
}

/// A surface's quadrics, times the weights of the round if there are any.
pub fn quadrics<'a>(surface: &'a Surface, weights: Option<&'a RoundWeights>) -> Option<&'a Buffer<PlaneQuadric>> {
    weights.and_then(RoundWeights::quadrics).or(surface.quadrics.as_ref())
}

/// What the host costs pairs by.
struct Costs<'a> {
    volume: Option<&'a Volume>,
    weights: Option<&'a RoundWeights>,
    placement: u32,
    border_weight: f32,
}

impl Costs<'_> {
    /// Lists and costs the pairs of a surface; returns the histogram of their keys.
    fn list(&self, listing: &mut Listing, surface: &Surface, joins: &[[u32; 2]]) -> Vec<u32> {
        let Surface { positions, faces, ring_starts, ring_faces, vertex_count, face_count, .. } = surface;
        let stars = Stars::on_host(positions, faces, ring_starts, ring_faces);
        let has_hub = |pair: [u32; 2]| pair.into_iter().any(|v| stars.positions[v as usize].flags & HUB != 0);
        let near = |vertices| faces_near(vertices, stars.ring_starts, stars.ring_faces, *face_count);
        let past = 3 * *face_count as u32;
        match (self.volume, quadrics(surface, self.weights)) {
            (Some(Volume { normals, sums, borders }), _) => {
                let params = volume_costs::Params::new(self.placement, self.border_weight);
                let rows = VolumeRows::on_host(positions, faces, normals, sums, borders, params);
                let weights = self.weights.map(|weights| weights.weights().host());
                let costing = || {
                    let mut block = VolumeBlock::default();
                    move |pairs: &[Edge], keys: &mut [u32]| {
                        rows.keys(pairs, &mut block, keys);
                        if let Some(weights) = weights {
                            weigh_keys(pairs, faces.host(), weights, keys);
                        }
                    }
                };
                let warm_up = |vertices: Range<usize>| rows.warm_up(vertices.clone(), near(vertices));
                let mut histogram = listing.list(*vertex_count, &stars, costing, warm_up);
                let key_apart = |pair: [u32; 2]| match weights.map(|weights| pair.map(|v| weights[v as usize])) {
                    Some([first, second]) => weighed_key(rows.key_apart(pair), first, second),
                    None => rows.key_apart(pair),
                };
                listing.list_apart(joins, past, &mut histogram, |pair| (!has_hub(pair)).then(|| key_apart(pair)));
                histogram
            }
            (None, Some(quadrics)) => {
                let params = plane_costs::Params::new(self.placement);
                let rows = PlaneRows::on_host(positions, faces, quadrics, params);
                let costing = || {
                    let mut block = PlaneBlock::new();
                    move |pairs: &[Edge], keys: &mut [u32]| rows.keys(pairs, &mut block, keys)
                };
                let warm_up = |vertices: Range<usize>| rows.warm_up(vertices.clone(), near(vertices));
                let mut histogram = listing.list(*vertex_count, &stars, costing, warm_up);
                listing.list_apart(joins, past, &mut histogram, |pair| (!has_hub(pair)).then(|| rows.key_apart(pair)));
                histogram
            }
            (None, None) => Vec::new(),
        }
    }
}

/// Fills a surface's quadrics, if it has any, from its faces; returns the normals of these.
pub fn plane_sums(queue: &mut Queue, surface: &mut Surface, options: &Options) -> Result<Option<Buffer<Normal>>> {
    let Surface { positions, faces, ring_starts, ring_faces, quadrics, vertex_count, face_count, .. } = surface;
    let Some(quadrics) = quadrics else { return Ok(None) };
    let mut normals = queue.buffer(*face_count)?;
    queue.run(FaceNormals { positions, faces, face_count: *face_count as u32, normals: &mut normals })?;
    queue.run(PlaneSums {
        positions,
        faces,
        ring_starts,
        ring_faces,
        normals: &normals,
        vertex_count: *vertex_count as u32,
        border_weight: options.border_weight,
        by_area: options.quadrics.planes.by_area(),
        quadrics,
    })?;
    Ok(Some(normals))
}

/// Replaces a buffer that cannot hold `len` rows; what it held is lost.
pub fn grow<T: Row>(queue: &Queue, buffer: &mut Buffer<T>, len: usize) -> Result<()> {
    if buffer.len() < len {
        *buffer = queue.buffer(len)?;
    }
    Ok(())
}
