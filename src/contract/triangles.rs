//! A round over triangles instead of pairs: costs, the gate, candidates.

use crate::backend::{Buffer, Queue};
use crate::error::{Error, Result};
use crate::kernel::cost_histogram::{BUCKET_SHIFT, BUCKETS, CostHistogram, threshold};
use crate::kernel::count_candidates::{CountCandidates, GATE_BLOCK};
use crate::kernel::gather_candidates::GatherCandidates;
use crate::kernel::pair_quadric::NO_KEY;
use crate::kernel::rows::{Candidate, Edge};
use crate::kernel::triangle_costs::TriangleCosts;

use super::evaluate::{Gate, grow, wanted};
use super::scan::Scan;
use super::surface::Surface;
use super::{Candidates, Options};

/// The buffers of a round's evaluation on one device.
#[derive(Debug)]
pub struct Triangles {
    placement: u32,
    triangles: Buffer<Edge>,
    keys: Buffer<u32>,
    buckets: Buffer<u32>,
    counts: Buffer<u32>,
    scan: Scan,
    candidates: Buffer<Candidate>,
    histogram: Vec<u32>,
}

impl Triangles {
    /// Buffers for a surface, on its device; none where pairs are contracted.
    pub fn new(queue: &mut Queue, surface: &Surface, options: &Options) -> Result<Option<Self>> {
        if options.candidates == Candidates::Pairs {
            return Ok(None);
        }
        let blocks = surface.face_count.div_ceil(GATE_BLOCK as usize);
        Ok(Some(Self {
            placement: options.placement.code(),
            triangles: queue.buffer(surface.face_count)?,
            keys: queue.buffer(surface.face_count)?,
            buckets: queue.buffer(BUCKETS as usize)?,
            counts: queue.buffer(blocks + 1)?,
            scan: Scan::new(queue, blocks + 1)?,
            candidates: queue.buffer(0)?,
            histogram: Vec::new(),
        }))
    }

    /// Appends the round's candidates in the order of the faces, each by its first half-edge; returns how many triangles
    /// there were to choose from.
    pub fn run(
        &mut self,
        queue: &mut Queue,
        surface: &Surface,
        gate: Gate,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        let (faces, key_count) = (surface.face_count, surface.face_count as u32);
        let Some(quadrics) = &surface.quadrics else { return Ok(0) };
        queue.run(TriangleCosts {
            positions: &surface.positions,
            faces: &surface.faces,
            quadrics,
            face_count: key_count,
            placement: self.placement,
            triangles: &mut self.triangles,
            keys: &mut self.keys,
        })?;
        queue.clear(&mut self.buckets, BUCKETS as usize)?;
        queue.run(CostHistogram { keys: &self.keys, key_count, buckets: &mut self.buckets })?;
        self.histogram.clear();
        queue.read(&self.buckets, 0..BUCKETS as usize, &mut self.histogram)?;
        // What is no candidate has a bucket above all costs.
        self.histogram.truncate((NO_KEY >> BUCKET_SHIFT) as usize);
        let total = self.histogram.iter().map(|&count| count as usize).sum();
        let (threshold, count) = threshold(&self.histogram, wanted(gate, total));
        if count == 0 {
            return Ok(total);
        }
        grow(queue, &mut self.candidates, count)?;
        let (keys, counts) = (&self.keys, &mut self.counts);
        queue.run(CountCandidates { keys, key_count, threshold, counts })?;
        self.scan.run(queue, &mut self.counts, faces.div_ceil(GATE_BLOCK as usize) + 1)?;
        queue.run(GatherCandidates {
            keys,
            pairs: &self.triangles,
            key_count,
            threshold,
            starts: &self.counts,
            candidates: &mut self.candidates,
        })?;
        queue.read(&self.candidates, 0..count, candidates)?;
        if candidates.iter().any(|candidate| candidate.half_edge >= 3 * key_count) {
            return Err(Error::Device("it returned triangles that do not exist".into()));
        }
        Ok(total)
    }
}
