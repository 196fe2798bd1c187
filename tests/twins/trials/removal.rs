//! What removing vertices costs.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::removal_costs::RemovalCosts;

use super::inputs::{flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 1] = [Trial { name: "removal_costs", run: removal_costs }];

/// Without features, with those of more than 20 degrees, and all that bend at all.
fn removal_costs(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut rows = round.positions.clone();
        for row in &mut rows[..4] {
            flip(&mut row.z, perturbed);
        }
        let positions = &queue.buffer_from(rows)?;
        let faces = &queue.buffer_from(round.faces.clone())?;
        let ring_starts = &queue.buffer_from(round.ring_starts.clone())?;
        let ring_faces = &queue.buffer_from(round.ring_faces.clone())?;
        let normals = &queue.buffer_from(round.normals.clone())?;
        let vertex_count = round.positions.len() as u32;
        let deviations = &queue.buffer_from(round.normals.iter().map(|n| n.root).collect())?;
        for (crease_cos, keeps_corners) in [(-2.0, false), (0.94, true), (0.94, false), (1.0, false)] {
            let keys = &mut queue.buffer(round.positions.len())?;
            let kernel = RemovalCosts {
                positions,
                faces,
                ring_starts,
                ring_faces,
                normals,
                deviations,
                vertex_count,
                crease_cos,
                keeps_corners,
                keys,
            };
            seen.run(queue, kernel)?;
            seen.output(queue, "keys", keys)?;
        }
    }
    Ok(())
}
