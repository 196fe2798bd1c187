//! The candidates of a round: every vertex costed on a device, the cheapest let through a gate.

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::cost_histogram::{BUCKET_SHIFT, BUCKETS, CostHistogram, threshold};
use crate::kernel::face_normals::FaceNormals;
use crate::kernel::removal_costs::{RemovalCosts, STAYS};
use crate::kernel::rows::Normal;
use crate::math::tie_hash;

use super::examine::Rules;
use super::surface::Surface;

/// A vertex that passed the gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Candidate {
    /// The bits of its cost, which order as the cost does.
    pub key: u32,
    pub vertex: u32,
}

/// How many of the vertices that may go become candidates.
#[derive(Debug, Clone, Copy)]
pub struct Gate {
    /// At most this share of them.
    pub share: f64,
    /// At most this many, before the bucket of the last is completed.
    pub most: usize,
}

/// A round as it is evaluated.
#[derive(Debug, Default)]
pub struct Evaluated {
    /// In the order of (key, hash).
    pub candidates: Vec<Candidate>,
    /// Normals of the faces; only where there are features.
    pub normals: Vec<Normal>,
    /// How many vertices may go at all.
    pub removable: usize,
}

/// Evaluates a round of `surface`, which lies on the host, on the device of `queue`.
pub fn evaluate(queue: &mut Queue, surface: &Surface, rules: &Rules, gate: Gate, round: u32) -> Result<Evaluated> {
    let copy;
    let Surface { positions, faces, ring_starts, ring_faces, deviations, .. } = if queue.is_on_host() {
        surface
    } else {
        copy = surface.copy(queue)?;
        &copy
    };
    let (vertex_count, face_count) = (positions.len() as u32, faces.len() as u32);
    let mut normals = queue.buffer(faces.len())?;
    let mut keys = queue.buffer(positions.len())?;
    let mut buckets = queue.buffer(BUCKETS as usize)?;
    queue.run(FaceNormals { positions, faces, face_count, normals: &mut normals })?;
    queue.run(RemovalCosts {
        positions,
        faces,
        ring_starts,
        ring_faces,
        normals: &normals,
        deviations,
        vertex_count,
        crease_cos: rules.crease_cos,
        keeps_corners: rules.keeps_corners,
        keys: &mut keys,
    })?;
    let total = queue.buffer_from(vec![vertex_count])?;
    let (pair_starts, most_keys, buckets_out) = (&total, vertex_count, &mut buckets);
    queue.run(CostHistogram { keys: &keys, pair_starts, block_count: 0, most_keys, buckets: buckets_out })?;

    let mut histogram = Vec::new();
    queue.read(&buckets, 0..BUCKETS as usize, &mut histogram)?;
    histogram.truncate((STAYS >> BUCKET_SHIFT) as usize);
    let removable = histogram.iter().map(|&count| count as usize).sum();
    let wanted = ((gate.share * removable as f64).ceil() as usize).min(gate.most);
    let (threshold, _) = threshold(&histogram, wanted);
    let mut evaluated = Evaluated { removable, ..Evaluated::default() };
    evaluated.candidates = candidates(&queue.rows(&keys)?, threshold, round);
    if rules.crease_cos >= -1.0 {
        evaluated.normals = queue.rows(&normals)?.into_owned();
    }
    Ok(evaluated)
}

/// The vertices with lesser keys, in order.
fn candidates(keys: &[u32], threshold: u32, round: u32) -> Vec<Candidate> {
    let below = |(vertex, &key): (usize, &u32)| (key < threshold).then_some(Candidate { key, vertex: vertex as u32 });
    let mut candidates: Vec<Candidate> = keys.par_iter().enumerate().with_min_len(1 << 12).filter_map(below).collect();
    candidates.par_sort_unstable_by_key(|candidate| (candidate.key, tie_hash(candidate.vertex, round)));
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_ordered_by_cost_and_then_by_hash() {
        let found = candidates(&[9, 5, 7, 5, STAYS, 5], 8, 3);
        assert_eq!(found.iter().map(|c| c.key).collect::<Vec<_>>(), [5, 5, 5, 7]);
        assert!(found[..3].is_sorted_by_key(|c| tie_hash(c.vertex, 3)));
        assert_eq!(found[3].vertex, 2);
    }
}
