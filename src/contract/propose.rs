//! Evaluating a round on a GPU: all of it recorded in one submission, with one wait for what it finds.
//!
//! The host knows no more than a bound on how many pairs there are, and kernels find the rest where kernels before them
//! left it. Rows past the pairs hold what earlier rounds left: they are costed with the others and never counted.

use rayon::prelude::*;

use crate::backend::{Buffer, Queue};
use crate::error::{Error, Result};
use crate::kernel::cost_histogram::{BUCKETS, CostHistogram};
use crate::kernel::count_candidates::{CountCandidates, GATE_BLOCK};
use crate::kernel::count_pairs::CountPairs;
use crate::kernel::face_normals::FaceNormals;
use crate::kernel::find_threshold::FindThreshold;
use crate::kernel::gather_candidates::GatherCandidates;
use crate::kernel::gather_pairs::GatherPairs;
use crate::kernel::pairs::{PAIR_BLOCK, Special};
use crate::kernel::plane_costs::PlaneCosts;
use crate::kernel::rows::{BorderSum, Candidate, Edge, Normal, Threshold, VolumeSum};
use crate::kernel::volume_costs::{BORDER_FACTOR, VolumeCosts};
use crate::kernel::volume_sums::VolumeSums;
use crate::kernel::weigh_keys::WeighKeys;

use super::attribute_rows::{Spreads, WedgeBuffers};
use super::evaluate::quadrics;
use super::gate::Gate;
use super::scan::Scan;
use super::surface::Surface;
use super::wedges::Wedges;
use super::weigh::RoundWeights;
use super::{Metric, Options};

/// Candidates that are copied at once with the number of them: this much more than wanted, in 1/8, for the rest of the last
/// one's bucket. Where they are not enough, the host waits once more.
const SPARE_EIGHTHS: usize = 1;
const SPARE: usize = 1 << 12;

/// The buffers of rounds on a GPU, for the largest, which is the first.
#[derive(Debug)]
pub struct Proposal {
    placement: u32,
    border_weight: f32,
    /// Vertices on the border at the start. Contractions make no more of them.
    border_vertices: usize,
    volume: Option<Volume>,
    /// What attributes add to sums, and the wedges that they are of.
    attributes: Option<(Spreads, WedgeBuffers)>,
    weights: Option<RoundWeights>,
    pairs: Buffer<Edge>,
    keys: Buffer<u32>,
    buckets: Buffer<u32>,
    threshold: Buffer<Threshold>,
    /// Of the pairs in every block of vertices, then of the candidates in every block of pairs.
    counts: Buffer<u32>,
    scan: Scan,
    candidates: Buffer<Candidate>,
}

/// What the `volume` metric sums.
#[derive(Debug)]
struct Volume {
    normals: Buffer<Normal>,
    sums: Buffer<VolumeSum>,
    borders: Buffer<BorderSum>,
}

impl Proposal {
    /// Buffers for a surface before its first round.
    pub fn new(
        queue: &Queue,
        surface: &Surface,
        options: &Options,
        border_vertices: usize,
        wedges: Option<&Wedges>,
    ) -> Result<Self> {
        let (vertices, faces) = (surface.vertex_count, surface.face_count);
        let volume = || -> Result<Volume> {
            Ok(Volume {
                normals: queue.buffer(faces)?,
                sums: queue.buffer(vertices)?,
                borders: queue.buffer(if border_vertices > 0 { vertices.max(2) } else { 1 })?,
            })
        };
        let attributes = match (Spreads::new(queue, wedges)?, wedges) {
            (Some(spreads), Some(wedges)) => Some((spreads, WedgeBuffers::with_room(queue, wedges)?)),
            _ => None,
        };
        let pairs = most_pairs(faces, border_vertices);
        let blocks = vertices.div_ceil(PAIR_BLOCK as usize).max(pairs.div_ceil(GATE_BLOCK as usize));
        Ok(Self {
            placement: options.placement.code(),
            border_weight: BORDER_FACTOR * options.border_weight,
            border_vertices,
            volume: (options.metric == Metric::Volume).then(volume).transpose()?,
            attributes,
            weights: RoundWeights::new(queue, surface, options, border_vertices > 0)?,
            pairs: queue.buffer(pairs)?,
            keys: queue.buffer(pairs)?,
            buckets: queue.buffer(BUCKETS as usize)?,
            threshold: queue.buffer(1)?,
            counts: queue.buffer(blocks + 1)?,
            scan: Scan::new(queue, blocks + 1)?,
            candidates: queue.buffer(pairs)?,
        })
    }

    /// Takes the wedges of a round from the host.
    pub fn take_wedges(&mut self, queue: &mut Queue, surface: &Surface, wedges: Option<&Wedges>) -> Result<()> {
        match (&mut self.attributes, wedges) {
            (Some((_, buffers)), Some(wedges)) => buffers.send(queue, wedges, surface),
            _ => Ok(()),
        }
    }

    /// Whether a round waits for the wedges that the host carries.
    pub fn needs_wedges(&self) -> bool {
        self.attributes.is_some()
    }

    /// Whether a round needs the weights that the host carries.
    pub fn needs_weights(&self) -> bool {
        self.weights.as_ref().is_some_and(RoundWeights::are_carried)
    }

    /// Submits a round. `weights` are those that the host carries; `has_held` unless it is sure that no vertex is locked or
    /// a hub.
    pub fn begin(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        gate: Gate,
        weights: &[f32],
        has_held: bool,
    ) -> Result<()> {
        if let Some(round_weights) = &mut self.weights {
            round_weights.begin(queue, surface, weights)?;
            round_weights.prefetch(queue, surface.vertex_count)?;
        }
        self.list(queue, surface, Special { has_border: self.border_vertices > 0, has_held })?;
        self.cost(queue, surface)?;
        self.gate(queue, surface, gate)?;
        let most = most_pairs(surface.face_count, self.border_vertices);
        let wanted = gate.wanted(most);
        queue.prefetch(&self.threshold, 0..1)?;
        queue.prefetch(&self.candidates, 0..(wanted + wanted / 8 * SPARE_EIGHTHS + SPARE).min(most))?;
        queue.submit()
    }

    /// Waits for the round that was submitted; appends its candidates in the order of the pairs and returns how many pairs
    /// there were. Weights that were found for the round become those that the host carries.
    pub fn finish(
        &self,
        queue: &mut Queue,
        surface: &Surface,
        weights: &mut Vec<f32>,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        let mut found = Vec::with_capacity(1);
        queue.read(&self.threshold, 0..1, &mut found)?;
        let Threshold { pairs, passing, .. } = found[0];
        let most = most_pairs(surface.face_count, self.border_vertices);
        if pairs as usize > most || passing > pairs {
            return Err(Error::Device(format!("it counted {pairs} pairs and lets {passing} of at most {most} pass")));
        }
        queue.read(&self.candidates, 0..passing as usize, candidates)?;
        let half_edges = 3 * surface.face_count as u32;
        if candidates.par_iter().any(|candidate| candidate.half_edge >= half_edges) {
            return Err(Error::Device("it returned pairs that do not exist".into()));
        }
        if let Some(round_weights) = &self.weights {
            round_weights.end(queue, surface.vertex_count, weights)?;
        }
        Ok(pairs as usize)
    }

    fn list(&mut self, queue: &mut Queue, surface: &Surface, special: Special) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        let counts = &mut self.counts;
        queue.clear(counts, pair_blocks(surface) + 1)?;
        queue.run(CountPairs {
            positions,
            faces,
            ring_starts,
            ring_faces,
            vertex_count,
            special,
            face_count,
            counts,
        })?;
        self.scan.run(queue, &mut self.counts, pair_blocks(surface) + 1)?;
        let (starts, pairs) = (&self.counts, &mut self.pairs);
        queue.run(GatherPairs { positions, faces, ring_starts, ring_faces, vertex_count, special, starts, pairs })
    }

    fn cost(&mut self, queue: &mut Queue, surface: &Surface) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        let pair_count = most_pairs(surface.face_count, self.border_vertices) as u32;
        let (placement, border_weight) = (self.placement, self.border_weight);
        let (pairs, keys) = (&self.pairs, &mut self.keys);
        let weights = self.weights.as_ref();
        match (&mut self.volume, quadrics(surface, weights)) {
            (Some(Volume { normals, sums, borders }), _) => {
                queue.run(FaceNormals { positions, faces, face_count, normals })?;
                queue.run(VolumeSums {
                    positions,
                    faces,
                    ring_starts,
                    ring_faces,
                    normals,
                    vertex_count,
                    sums,
                    borders,
                })?;
                if let Some((spreads, wedges)) = &mut self.attributes {
                    spreads.add_to(queue, surface, wedges, normals, sums)?;
                }
                queue.run(VolumeCosts {
                    positions,
                    faces,
                    normals,
                    sums,
                    borders,
                    pairs,
                    pair_count,
                    border_weight,
                    placement,
                    keys,
                })?;
                match weights.map(RoundWeights::weights) {
                    Some(weights) => queue.run(WeighKeys { faces, pairs, weights, pair_count, keys }),
                    None => Ok(()),
                }
            }
            (None, Some(quadrics)) => {
                queue.run(PlaneCosts { positions, faces, quadrics, pairs, pair_count, placement, keys })
            }
            (None, None) => Ok(()),
        }
    }

    fn gate(&mut self, queue: &mut Queue, surface: &Surface, gate: Gate) -> Result<()> {
        let (keys, pairs, block_count) = (&self.keys, &self.pairs, pair_blocks(surface) as u32);
        let most_keys = most_pairs(surface.face_count, self.border_vertices) as u32;
        let (buckets, pair_starts) = (&mut self.buckets, &self.counts);
        queue.clear(buckets, BUCKETS as usize)?;
        queue.run(CostHistogram { keys, pair_starts, block_count, most_keys, buckets })?;
        let threshold = &mut self.threshold;
        queue.run(FindThreshold { pair_starts, block_count, buckets, gate, threshold })?;

        let (threshold, counts) = (&self.threshold, &mut self.counts);
        queue.run(CountCandidates { keys, threshold, most_keys, counts })?;
        self.scan.run(queue, &mut self.counts, most_keys.div_ceil(GATE_BLOCK) as usize + 1)?;
        let (starts, candidates) = (&self.counts, &mut self.candidates);
        queue.run(GatherCandidates { keys, pairs, threshold, most_keys, starts, candidates })
    }
}

/// Blocks that a surface's pairs are counted in.
fn pair_blocks(surface: &Surface) -> usize {
    surface.vertex_count.div_ceil(PAIR_BLOCK as usize)
}

/// A bound on the pairs of a surface. One on the border has an end that is not locked, at which the border is a line.
fn most_pairs(faces: usize, border_vertices: usize) -> usize {
    (3 * faces + (2 * border_vertices).min(3 * faces)) / 2
}
