//! The light of faces.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::light_changes::LightChanges;
use coarsen::kernel::pairs::NO_FACE;
use coarsen::kernel::rows::Face;

use super::inputs::{Random, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 1] = [Trial { name: "light_changes", run: light_changes }];

/// Lights that are equal, all but equal, dark or black, of faces of all sizes, beside any faces and none.
fn light_changes(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut random = Random::new();
        let count = round.faces.len() as u32;
        let mut across = || if random.below(5) == 0 { NO_FACE } else { random.below(count) };
        let neighbors = (0..count).map(|_| Face { a: across(), b: across(), c: across() }).collect();
        let mut channel =
            || [0.0, 0.5, 0.500_000_06, 1.0, 1e-4, 1e-30, random.centered() + 0.5][random.below(7) as usize];
        let mut lights: Vec<[f32; 4]> = (0..count).map(|_| [channel(), channel(), channel(), channel()]).collect();
        (0..lights.len().min(4)).for_each(|face| flip(&mut lights[face][face % 3], perturbed));
        let (lights, neighbors) = (&queue.buffer_from(lights)?, &queue.buffer_from(neighbors)?);
        for (floor, by_area) in [(1.0 / 1024.0, false), (0.25, true), (0.0, true)] {
            let changes = &mut queue.buffer(count as usize)?;
            seen.run(queue, LightChanges { lights, neighbors, face_count: count, floor, by_area, changes })?;
            seen.output(queue, "changes", changes)?;
        }
    }
    Ok(())
}
