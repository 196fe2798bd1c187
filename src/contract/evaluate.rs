//! Evaluating a round on one device: sums, the cost of every pair, the gate.

use crate::backend::{Buffer, Queue, Row};
use crate::error::{Error, Result};
use crate::kernel::cost_histogram::{BUCKETS, CostHistogram, threshold};
use crate::kernel::count_candidates::{CountCandidates, GATE_BLOCK};
use crate::kernel::count_pairs::CountPairs;
use crate::kernel::face_normals::FaceNormals;
use crate::kernel::gather_candidates::GatherCandidates;
use crate::kernel::gather_pairs::GatherPairs;
use crate::kernel::pairs::PAIR_BLOCK;
use crate::kernel::plane_costs::{self, PlaneBlock, PlaneCosts, PlaneRows};
use crate::kernel::plane_sums::PlaneSums;
use crate::kernel::rows::{BorderSum, Candidate, Edge, HUB, Normal, PlaneQuadric, VolumeSum};
use crate::kernel::stars::Stars;
use crate::kernel::volume_costs::{self, BORDER_FACTOR, VolumeBlock, VolumeCosts, VolumeRows};
use crate::kernel::volume_sums::VolumeSums;
use crate::kernel::weigh_keys::{WeighKeys, weigh_keys, weighed_key};

use super::listing::Listing;
use super::scan::Scan;
use super::surface::{LARGE_VERTICES, Surface};
use super::weigh::RoundWeights;
use super::{Candidates, Metric, Options};

/// The buffers of a round's evaluation on one device.
#[derive(Debug)]
pub struct Evaluation {
    placement: u32,
    border_weight: f32,
    volume: Option<Volume>,
    weights: Option<RoundWeights>,
    /// In place of all that follows, on the host.
    listing: Option<Listing>,
    is_first: bool,
    pairs: Buffer<Edge>,
    keys: Buffer<u32>,
    buckets: Buffer<u32>,
    counts: Buffer<u32>,
    scan: Scan,
    candidates: Buffer<Candidate>,
    histogram: Vec<u32>,
}

/// What the `volume` metric sums.
#[derive(Debug)]
struct Volume {
    normals: Buffer<Normal>,
    sums: Buffer<VolumeSum>,
    borders: Buffer<BorderSum>,
}

/// How many of the live pairs become candidates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// At most this share of the live pairs.
    pub share: f64,
    /// At most this many, before the bucket of the last is completed.
    pub most: usize,
}

/// What the host tells of a round.
#[derive(Debug)]
pub struct Round<'a> {
    pub of: Candidates,
    /// Pairs without an edge, which the host alone evaluates.
    pub joins: &'a [[u32; 2]],
    pub gate: Gate,
    /// Those that the host carries; or they become those that are found for the round.
    pub weights: &'a mut Vec<f32>,
}

impl Evaluation {
    /// Buffers for a surface, on its device.
    pub fn new(queue: &mut Queue, surface: &Surface, options: &Options, has_border: bool) -> Result<Self> {
        let blocks = if queue.is_on_host() { 0 } else { most_blocks(surface.vertex_count, 3 * surface.face_count) };
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
            weights: RoundWeights::new(queue, surface, options, has_border)?,
            listing: queue.is_on_host().then(Listing::default),
            is_first: true,
            pairs: queue.buffer(0)?,
            keys: queue.buffer(0)?,
            buckets: queue.buffer(BUCKETS as usize)?,
            counts: queue.buffer(blocks + 1)?,
            scan: Scan::new(queue, blocks + 1)?,
            candidates: queue.buffer(0)?,
            histogram: Vec::new(),
        })
    }

    /// Appends the round's candidates in the order of the pairs; returns how many pairs there were.
    pub fn run(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        Round { joins, gate, weights, .. }: Round<'_>,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        self.sums(queue, surface)?;
        if let Some(round_weights) = &mut self.weights {
            round_weights.begin(queue, surface, weights)?;
        }
        let pairs = self.find_candidates(queue, surface, joins, gate, candidates)?;
        if let Some(round_weights) = &self.weights {
            round_weights.end(queue, surface.vertex_count, weights)?;
        }
        Ok(pairs)
    }

    fn find_candidates(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        joins: &[[u32; 2]],
        gate: Gate,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        if let Some(listing) = &mut self.listing {
            let costs = Costs {
                volume: self.volume.as_ref(),
                weights: self.weights.as_ref(),
                placement: self.placement,
                border_weight: self.border_weight,
            };
            let histogram = costs.list(listing, surface, joins);
            let pairs = listing.len();
            listing.gate(threshold(&histogram, wanted(gate, pairs)).0, candidates);
            if std::mem::take(&mut self.is_first) && surface.vertex_count >= LARGE_VERTICES {
                self.release(queue)?;
            }
            return Ok(pairs);
        }
        let pairs = self.find_pairs(queue, surface)?;
        self.costs(queue, surface, pairs)?;
        let key_count = pairs as u32;
        queue.clear(&mut self.buckets, BUCKETS as usize)?;
        queue.run(CostHistogram { keys: &self.keys, key_count, buckets: &mut self.buckets })?;
        self.histogram.clear();
        queue.read(&self.buckets, 0..BUCKETS as usize, &mut self.histogram)?;
        let (threshold, count) = threshold(&self.histogram, wanted(gate, pairs));
        if count == 0 {
            return Ok(pairs);
        }
        grow(queue, &mut self.candidates, count)?;
        let (keys, counts) = (&self.keys, &mut self.counts);
        queue.run(CountCandidates { keys, key_count, threshold, counts })?;
        self.scan.run(queue, &mut self.counts, pairs.div_ceil(GATE_BLOCK as usize) + 1)?;
        queue.run(GatherCandidates {
            keys,
            pairs: &self.pairs,
            key_count,
            threshold,
            starts: &self.counts,
            candidates: &mut self.candidates,
        })?;
        queue.read(&self.candidates, 0..count, candidates)?;
        let half_edges = 3 * surface.face_count as u32;
        if candidates.iter().any(|candidate| candidate.half_edge >= half_edges) {
            return Err(Error::Device("it returned pairs that do not exist".into()));
        }
        Ok(pairs)
    }

    /// Frees what the largest round needed before its commit takes more. The next allocates what it needs, for good.
    fn release(&mut self, queue: &Queue) -> Result<()> {
        self.listing = self.listing.as_ref().map(|_| Listing::default());
        if let Some(Volume { normals, sums, .. }) = &mut self.volume {
            (*normals, *sums) = (queue.buffer(0)?, queue.buffer(0)?);
        }
        Ok(())
    }

    /// Lists the pairs; returns how many.
    fn find_pairs(&mut self, queue: &mut Queue, surface: &Surface) -> Result<usize> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let vertex_count = surface.vertex_count as u32;
        let counts = &mut self.counts;
        queue.run(CountPairs { positions, faces, ring_starts, ring_faces, vertex_count, counts })?;
        let blocks = surface.vertex_count.div_ceil(PAIR_BLOCK as usize);
        self.scan.run(queue, &mut self.counts, blocks + 1)?;
        let mut total = Vec::new();
        queue.read(&self.counts, blocks..blocks + 1, &mut total)?;
        let pairs = total.iter().sum::<u32>() as usize;
        if pairs > 3 * surface.face_count {
            return Err(Error::Device(format!("it counted {pairs} pairs on {} faces", surface.face_count)));
        }
        grow(queue, &mut self.pairs, pairs)?;
        grow(queue, &mut self.keys, pairs)?;
        let starts = &self.counts;
        queue.run(GatherPairs {
            positions,
            faces,
            ring_starts,
            ring_faces,
            vertex_count,
            starts,
            pairs: &mut self.pairs,
        })?;
        Ok(pairs)
    }

    /// Sums what the metric needs of the surface as it is.
    fn sums(&mut self, queue: &mut Queue, surface: &Surface) -> Result<()> {
        let Surface { positions, faces, ring_starts, ring_faces, .. } = surface;
        let Some(Volume { normals, sums, borders }) = &mut self.volume else { return Ok(()) };
        grow(queue, normals, surface.face_count)?;
        grow(queue, sums, surface.vertex_count)?;
        let (vertex_count, face_count) = (surface.vertex_count as u32, surface.face_count as u32);
        queue.run(FaceNormals { positions, faces, face_count, normals })?;
        queue.run(VolumeSums { positions, faces, ring_starts, ring_faces, normals, vertex_count, sums, borders })
    }

    fn costs(&mut self, queue: &mut Queue, surface: &Surface, pairs: usize) -> Result<()> {
        let Surface { positions, faces, .. } = surface;
        let (placement, border_weight, pair_count) = (self.placement, self.border_weight, pairs as u32);
        let (pairs, keys) = (&self.pairs, &mut self.keys);
        match (&self.volume, quadrics(surface, self.weights.as_ref())) {
            (Some(Volume { normals, sums, borders }), _) => {
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
                match self.weights.as_ref().map(RoundWeights::weights) {
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
}

/// A surface's quadrics, times the weights of the round if there are any.
fn quadrics<'a>(surface: &'a Surface, weights: Option<&'a RoundWeights>) -> Option<&'a Buffer<PlaneQuadric>> {
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
        let past = 3 * *face_count as u32;
        match (self.volume, quadrics(surface, self.weights)) {
            (Some(Volume { normals, sums, borders }), _) => {
                let params = volume_costs::Params::new(self.placement, self.border_weight);
                let rows = VolumeRows::on_host(positions, faces, normals, sums, borders, params);
                let weights = self.weights.map(|weights| weights.weights().host());
                let mut histogram = listing.list(*vertex_count, &stars, || {
                    let mut block = VolumeBlock::new();
                    move |pairs: &[Edge], keys: &mut [u32]| {
                        rows.keys(pairs, &mut block, keys);
                        if let Some(weights) = weights {
                            weigh_keys(pairs, faces.host(), weights, keys);
                        }
                    }
                });
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
                let mut histogram = listing.list(*vertex_count, &stars, || {
                    let mut block = PlaneBlock::new();
                    move |pairs: &[Edge], keys: &mut [u32]| rows.keys(pairs, &mut block, keys)
                });
                listing.list_apart(joins, past, &mut histogram, |pair| (!has_hub(pair)).then(|| rows.key_apart(pair)));
                histogram
            }
            (None, None) => Vec::new(),
        }
    }
}

/// Fills a surface's quadrics from its faces.
pub fn plane_sums(queue: &mut Queue, surface: &mut Surface, options: &Options) -> Result<()> {
    let Surface { positions, faces, ring_starts, ring_faces, quadrics, vertex_count, .. } = surface;
    let Some(quadrics) = quadrics else { return Ok(()) };
    let (vertex_count, border_weight) = (*vertex_count as u32, options.border_weight);
    let by_area = options.quadrics.planes.by_area();
    queue.run(PlaneSums { positions, faces, ring_starts, ring_faces, vertex_count, border_weight, by_area, quadrics })
}

/// Blocks that either the vertices or the pairs of a surface are counted in, at most.
fn most_blocks(vertices: usize, pairs: usize) -> usize {
    vertices.div_ceil(PAIR_BLOCK as usize).max(pairs.div_ceil(GATE_BLOCK as usize))
}

/// Replaces a buffer that cannot hold `len` rows; what it held is lost.
pub fn grow<T: Row>(queue: &Queue, buffer: &mut Buffer<T>, len: usize) -> Result<()> {
    if buffer.len() < len {
        *buffer = queue.buffer(len)?;
    }
    Ok(())
}

/// How many pairs a gate wants of so many.
pub fn wanted(gate: Gate, pairs: usize) -> usize {
    ((gate.share * pairs as f64).ceil() as usize).min(gate.most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gate_takes_the_lesser_of_share_and_need() {
        assert_eq!(wanted(Gate { share: 0.5, most: 100 }, 30), 15);
        assert_eq!(wanted(Gate { share: 0.5, most: 3 }, 30), 3);
    }
}
