//! A round over triangles instead of pairs: costs, the gate, candidates.

use crate::backend::{Buffer, Queue};
use crate::error::{Error, Result};
use crate::kernel::cost_histogram::{BUCKET_SHIFT, BUCKETS, CostHistogram};
use crate::kernel::count_candidates::{CountCandidates, GATE_BLOCK};
use crate::kernel::find_threshold::threshold;
use crate::kernel::gather_candidates::GatherCandidates;
use crate::kernel::pair_quadric::NO_KEY;
use crate::kernel::rows::{Candidate, Edge, Threshold};
use crate::kernel::triangle_costs::TriangleCosts;

use super::evaluate::grow;
use super::gate::Gate;
use super::scan::Scan;
use super::surface::Surface;
use super::{Candidates, Options};

/// The buffers of a round's evaluation on one device.
#[derive(Debug)]
pub struct Triangles {
    placement: u32,
    triangles: Buffer<Edge>,
    keys: Buffer<u32>,
    /// How many there are.
    total: Buffer<u32>,
    threshold: Buffer<Threshold>,
    buckets: Buffer<u32>,
    counts: Buffer<u32>,
    scan: Scan,
    candidates: Buffer<Candidate>,
    histogram: Vec<u32>,
}

impl Triangles {
    /// Buffers for a surface, on its device; none where pairs are contracted.
    pub fn new(queue: &Queue, surface: &Surface, options: &Options) -> Result<Option<Self>> {
        if options.candidates == Candidates::Pairs {
            return Ok(None);
        }
        let blocks = surface.face_count.div_ceil(GATE_BLOCK as usize);
        Ok(Some(Self {
            placement: options.placement.code(),
            triangles: queue.buffer(surface.face_count)?,
            keys: queue.buffer(surface.face_count)?,
            total: queue.buffer(1)?,
            threshold: queue.buffer(1)?,
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
        let most_keys = surface.face_count as u32;
        let Some(quadrics) = &surface.quadrics else { return Ok(0) };
        queue.run(TriangleCosts {
            positions: &surface.positions,
            faces: &surface.faces,
            quadrics,
            face_count: most_keys,
            placement: self.placement,
            triangles: &mut self.triangles,
            keys: &mut self.keys,
        })?;
        queue.clear(&mut self.buckets, BUCKETS as usize)?;
        queue.write(&mut self.total, &[most_keys])?;
        let (pair_starts, buckets) = (&self.total, &mut self.buckets);
        queue.run(CostHistogram { keys: &self.keys, pair_starts, block_count: 0, most_keys, buckets })?;
        self.histogram.clear();
        queue.read(&self.buckets, 0..BUCKETS as usize, &mut self.histogram)?;
        // What is no candidate has a bucket above all costs.
        self.histogram.truncate((NO_KEY >> BUCKET_SHIFT) as usize);
        let counted = self.histogram.iter().map(|&count| u64::from(count)).sum::<u64>();
        if counted > u64::from(most_keys) {
            return Err(Error::Device(format!("it counted {counted} triangles on {most_keys} faces")));
        }
        let total = counted as u32;
        let found = threshold(&self.histogram, total, gate);
        let count = found.passing as usize;
        if count == 0 {
            return Ok(total as usize);
        }
        grow(queue, &mut self.candidates, count)?;
        let (keys, counts) = (&self.keys, &mut self.counts);
        // Of all keys: those of what is no candidate are never below.
        queue.write(&mut self.threshold, &[Threshold { pairs: most_keys, ..found }])?;
        let threshold = &self.threshold;
        queue.run(CountCandidates { keys, threshold, most_keys, counts })?;
        self.scan.run(queue, &mut self.counts, most_keys.div_ceil(GATE_BLOCK) as usize + 1)?;
        queue.run(GatherCandidates {
            keys,
            pairs: &self.triangles,
            threshold,
            most_keys,
            starts: &self.counts,
            candidates: &mut self.candidates,
        })?;
        queue.read(&self.candidates, 0..count, candidates)?;
        if candidates.iter().any(|candidate| candidate.half_edge >= 3 * most_keys) {
            return Err(Error::Device("it returned triangles that do not exist".into()));
        }
        Ok(total as usize)
    }
}
