//! The surface of a run between two rounds, as the start of another.

use crate::kernel::rows::{BORDER, HELD, HUB, JOINED, LOCKED};
use crate::mesh::Rings;
use crate::mesh::fan::fans;
use crate::simplify::{Phases, RoundRecord};

use super::driver::Run;
use super::pace::Pace;
use super::prepare::Prepared;
use super::yielding::Yields;

/// What came before the start of a run, which is where another was between rounds.
#[derive(Debug, Clone, Default)]
pub struct Earlier {
    /// Vertices at the first start.
    pub vertices: usize,
    /// Faces there.
    pub faces: usize,
    pub rounds: Vec<RoundRecord>,
    /// What they took.
    pub seconds: Phases,
    pub bytes_moved: u64,
    pub commits: u32,
    /// Greatest estimated deviation of a contraction, in the normalized frame.
    pub deviation: f32,
    /// None where it is to be found anew.
    pub pace: Option<Pace>,
    /// The seams that yield in the run.
    pub yields: Yields,
}

impl Prepared {
    /// A copy before a run.
    pub fn copy(&self) -> Self {
        Self {
            positions: self.positions.clone(),
            faces: self.faces.clone(),
            rings: self.rings.clone(),
            fans: self.fans.clone(),
            carried: self.carried.copy(self.positions.len(), self.faces.len()),
            lowest: self.lowest.clone(),
            warnings: self.warnings.clone(),
            earlier: self.earlier.clone(),
            ..*self
        }
    }

    /// The start of a run that goes on from where another is between rounds; but for its fans.
    pub(super) fn of_run(run: &Run<'_>) -> Self {
        let (host, prepared) = (&run.host, &run.prepared);
        let (vertices, faces) = (host.vertex_count, host.face_count);
        let starts = host.ring_starts.host()[..=vertices].to_vec();
        Self {
            positions: host.positions.host()[..vertices].to_vec(),
            faces: host.faces.host()[..faces].to_vec(),
            rings: Rings { starts, faces: host.ring_faces.host()[..3 * faces].to_vec() },
            fans: Vec::new(),
            carried: prepared.carried.copy(vertices, faces),
            lowest: None,
            warnings: run.warnings.clone(),
            earlier: Earlier {
                rounds: run.rounds.clone(),
                seconds: run.seconds,
                bytes_moved: run.bytes_moved_by_now(),
                commits: run.committer.commits,
                deviation: run.deviation,
                pace: Some(run.pace.clone()),
                ..prepared.earlier
            },
            ..*prepared
        }
    }

    /// Frees vertices that nothing holds but seams, whose flags are found anew.
    pub(super) fn taken_up(mut self) -> Self {
        self.fans = fans(bytemuck::cast_slice(&self.faces), &self.rings);
        for position in &mut self.positions {
            let locked = if position.flags & HELD == 0 { 0 } else { LOCKED };
            position.flags = position.flags & (BORDER | HUB | HELD | JOINED) | locked;
        }
        self
    }
}
