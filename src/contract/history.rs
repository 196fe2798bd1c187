//! Where every vertex of the start of a run went: the contractions of all rounds, composed.

use rayon::prelude::*;

use crate::kernel::rows::Contraction;

/// Vertices a thread takes at a time.
const CHUNK: usize = 1 << 14;

/// What a round made of every vertex, from its contractions and the live vertices before each vertex after it.
pub fn became(contractions: &[Contraction], new_vertex: &[u32]) -> Vec<u32> {
    let mut map = new_vertex.to_vec();
    for contraction in contractions {
        map[contraction.gone as usize] = new_vertex[contraction.keep as usize];
    }
    map
}

/// One map a round: from the round's numbers to the next one's.
#[derive(Debug, Default)]
pub struct History {
    rounds: Vec<Vec<u32>>,
}

impl History {
    /// Notes a round: what it contracted, and the live vertices before each vertex after it.
    pub fn follow(&mut self, contractions: &[Contraction], new_vertex: &[u32]) {
        self.rounds.push(became(contractions, new_vertex));
    }

    /// For each of the `vertex_count` vertices of the start, the vertex that it is part of by now.
    pub fn owners(&mut self, vertex_count: usize) -> &[u32] {
        // From the last round to the first: each map is read once by the one before, so the work is that of the maps'
        // lengths, which shrink with the mesh.
        let mut owners = self.rounds.pop().unwrap_or_else(|| (0..vertex_count as u32).collect());
        while let Some(mut map) = self.rounds.pop() {
            map.par_iter_mut().with_min_len(CHUNK).for_each(|vertex| *vertex = owners[*vertex as usize]);
            owners = map;
        }
        // As one map for what follows.
        self.rounds.push(owners);
        &self.rounds[0]
    }
}
