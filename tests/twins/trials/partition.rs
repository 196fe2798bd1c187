//! How far chains are from their segments.

use coarsen::Result;
use coarsen::backend::Queue;
use coarsen::kernel::chain_deviations::ChainDeviations;

use super::inputs::{Random, flip, rounds};
use super::{Seen, Trial};

pub const TRIALS: [Trial; 1] = [Trial { name: "chain_deviations", run: chain_deviations }];

/// Vertices against edges nearby and against any two others, with colors and without.
fn chain_deviations(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (round, perturbed) in rounds(perturbed) {
        seen.input(round.name);
        let mut random = Random::new();
        let vertex_count = round.positions.len() as u32;
        let mut spans: Vec<[u32; 4]> = round.faces.iter().map(|face| [face.a, face.b, face.c, 0]).collect();
        spans.extend((0..200).map(|_| [0; 3].map(|_| random.below(vertex_count))).map(|[a, b, c]| [a, b, c, 0]));
        spans.extend((0..vertex_count.min(50)).map(|v| [v, v, v, 0]));
        let colors = round.positions.iter().map(|_| [0; 4].map(|_| 255.0 * random.centered())).collect();
        let mut rows = round.positions.clone();
        for row in &mut rows[..4] {
            flip(&mut row.z, perturbed);
        }
        let positions = &queue.buffer_from(rows)?;
        let span_count = spans.len() as u32;
        let spans = &queue.buffer_from(spans)?;
        let with_colors = queue.buffer_from(colors)?;
        let without = queue.buffer_from(vec![[0.0; 4]])?;
        for (colors, has_colors) in [(&with_colors, true), (&without, false)] {
            let deviations = &mut queue.buffer(span_count as usize)?;
            seen.run(queue, ChainDeviations { positions, colors, spans, span_count, has_colors, deviations })?;
            seen.output(queue, "deviations", deviations)?;
        }
    }
    Ok(())
}
