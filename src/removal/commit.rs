//! Removing a round's candidates: holes are examined in parallel and closed in order.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::rows::Face;
use crate::simplify::Blocked;

use super::evaluate::{Candidate, Evaluated};
use super::examine::{Removal, Rules, State};
use super::hole::Hole;
use super::polygon::Rejection;
use super::samples::{Samples, deviations};
use super::surface::Surface;

/// Candidates examined at a time: those that the ones before have blocked are left out. It does not show in the result.
const BLOCK: usize = 1 << 12;

/// How many faces a round may remove.
///
/// Inner vertices remove two and border vertices one. Where one is left to remove, only a border vertex will do, unless the
/// quota may be overshot by one face because no border vertex did.
#[derive(Debug, Clone, Copy)]
pub struct Quota {
    pub faces: usize,
    pub may_overshoot: bool,
}

/// What a round did.
#[derive(Debug, Default)]
pub struct Committed {
    pub vertices: usize,
    pub faces: usize,
    /// Refusals by reason.
    pub blocked: Blocked,
    /// Greatest key of a removed vertex.
    pub greatest_key: u32,
    /// Greatest distance of a sample to its face, or of an edge to the surface of the start.
    pub deviation: f64,
}

/// A round in progress. The surface stays as it began until the end.
struct Work<'a> {
    surface: &'a Surface,
    samples: &'a mut Samples,
    /// Vertices that are removed.
    gone: Vec<bool>,
    /// These and their neighbors.
    blocked: Vec<bool>,
    /// Edges that came.
    edges: FxHashSet<[u32; 2]>,
    /// Faces that came without an edge: into holes of three sides.
    plugs: FxHashSet<[u32; 3]>,
    /// Faces that replace those of these numbers.
    faces: Vec<(u32, Face)>,
    /// The deviations of those that came.
    deviations: Vec<(u32, f32)>,
    /// Those of faces that are left of a hole; two holes may leave the same.
    left: Vec<(u32, f32)>,
    committed: Committed,
}

/// What a round is to do.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    pub evaluated: &'a Evaluated,
    pub rules: &'a Rules,
    pub quota: Quota,
}

/// Removes the legal ones among the candidates until the quota is used up, and compacts.
pub fn commit(surface: &mut Surface, samples: &mut Samples, queue: &mut Queue, task: Task<'_>) -> Result<Committed> {
    let count = surface.vertex_count();
    let mut work = Work {
        surface,
        samples,
        gone: vec![false; count],
        blocked: vec![false; count],
        edges: FxHashSet::default(),
        plugs: FxHashSet::default(),
        faces: Vec::new(),
        deviations: Vec::new(),
        left: Vec::new(),
        committed: Committed::default(),
    };
    work.remove(task);
    let Work { gone, faces, deviations, left, committed, .. } = work;
    if committed.vertices > 0 {
        let rows = surface.faces.host_mut();
        faces.into_iter().for_each(|(slot, face)| rows[slot as usize] = face);
        let rows = surface.deviations.host_mut();
        deviations.into_iter().for_each(|(slot, deviation)| rows[slot as usize] = deviation);
        left.into_iter().for_each(|(slot, deviation)| rows[slot as usize] = rows[slot as usize].max(deviation));
        surface.compact(queue, &gone, samples)?;
    }
    Ok(committed)
}

impl Work<'_> {
    fn remove(&mut self, Task { evaluated, rules, quota }: Task<'_>) {
        let mut overshooting = None;
        for block in evaluated.candidates.chunks(BLOCK) {
            let open: Vec<Candidate> = block.iter().copied().filter(|c| !self.blocked[c.vertex as usize]).collect();
            let state = State {
                stars: self.surface.stars(),
                normals: &evaluated.normals,
                sources: &self.surface.source,
                samples: self.samples,
            };
            let examined: Vec<_> = (open.par_iter().with_min_len(16))
                .map_init(Hole::default, |hole, candidate| state.examine(candidate.vertex, rules, hole))
                .collect();
            for (candidate, verdict) in open.into_iter().zip(examined) {
                let left = quota.faces.saturating_sub(self.committed.faces);
                if left == 0 {
                    return;
                }
                match verdict {
                    _ if self.blocked[candidate.vertex as usize] => {}
                    Err(rejection) => self.count(rejection),
                    Ok(removal) if removal.faces_removed() > left => {
                        overshooting = overshooting.or(Some((candidate, removal)));
                    }
                    Ok(removal) => self.close(candidate, removal),
                }
            }
        }
        if let Some((candidate, removal)) = overshooting
            && quota.may_overshoot
            && !self.blocked[candidate.vertex as usize]
        {
            self.close(candidate, removal);
        }
    }

    fn count(&mut self, rejection: Rejection) {
        let blocked = &mut self.committed.blocked;
        match rejection {
            Rejection::Link => blocked.link += 1,
            Rejection::Flip => blocked.flip += 1,
            Rejection::Aspect => blocked.aspect += 1,
            Rejection::Error => blocked.error += 1,
        }
    }

    /// Closes a hole, unless what others of the round left is in the way.
    fn close(&mut self, candidate: Candidate, removal: Removal) {
        let Removal { ring, old, new, edges, remainder, moved, outward, deviation } = removal;
        let plug = (edges.is_empty() && new.len() == 1).then(|| {
            let mut corners = new[0].corners();
            corners.sort_unstable();
            corners
        });
        let is_taken = edges.iter().any(|edge| self.edges.contains(edge))
            || plug.is_some_and(|plug| self.plugs.contains(&plug))
            || remainder.is_some_and(|[_, across]| self.gone[across as usize]);
        if is_taken {
            self.count(Rejection::Link);
            return;
        }
        self.edges.extend(edges);
        self.plugs.extend(plug);
        self.gone[candidate.vertex as usize] = true;
        // The face that is left takes the samples: it stays for this round.
        let kept = remainder.map(|[_, across]| across);
        for v in ring.into_iter().chain(kept).chain([candidate.vertex]) {
            self.blocked[v as usize] = true;
        }
        let onto = remainder.map_or_else(|| old[..new.len()].to_vec(), |[face, _]| vec![face]);
        self.samples.follow(&old, &onto, &moved, outward);
        let greatest = onto.iter().copied().zip(deviations(&moved, onto.len()));
        if remainder.is_some() {
            self.left.extend(greatest)
        } else {
            self.deviations.extend(greatest)
        }
        let committed = &mut self.committed;
        committed.vertices += 1;
        committed.faces += old.len() - new.len();
        committed.greatest_key = committed.greatest_key.max(candidate.key);
        committed.deviation = committed.deviation.max(deviation);
        let dead = std::iter::repeat(Face::default());
        self.faces.extend(old.into_iter().zip(new.into_iter().chain(dead)));
    }
}
