//! A GPU's copy of the surface: it follows the host's and proposes the candidates of every round.

use std::time::Duration;

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::rows::{Candidate, Contraction, HUB_FACES, LOCKED};

use super::apply::{Apply, Left};
use super::evaluate::{Gate, plane_sums};
use super::propose::Proposal;
use super::surface::Surface;
use super::weigh::{start_weights, weigh_start};
use super::{Metric, Options};

/// A surface on a GPU, with what its rounds need.
#[derive(Debug)]
pub struct Follower {
    queue: Queue,
    surface: Surface,
    /// Applies the contractions to the copy; without it the copy is sent anew, which a device with the host's own memory
    /// prefers.
    apply: Option<Apply>,
    proposal: Proposal,
    /// Whether some vertex was locked at the start; contractions lock none.
    has_locked: bool,
    /// No ring is longer. A contraction joins two.
    longest_ring: u32,
    /// The gate of the round that was submitted.
    begun: Option<Gate>,
}

impl Follower {
    /// Copies a host's surface before its first round, and finds the weights that are found once and not known yet.
    /// `applies` chooses how the copy follows.
    pub fn new(
        mut queue: Queue,
        host: &Surface,
        options: &Options,
        border_vertices: usize,
        weights: &mut Vec<f32>,
        applies: bool,
    ) -> Result<Self> {
        let mut surface = Surface::copy(&mut queue, host, options.metric == Metric::Plane)?;
        plane_sums(&mut queue, &mut surface, options.border_weight)?;
        start_weights(&mut queue, &surface, options, border_vertices > 0, weights)?;
        weigh_start(&mut queue, &mut surface, weights)?;
        let proposal = Proposal::new(&queue, &surface, options, border_vertices)?;
        let apply = applies.then(|| Apply::new(&queue, &surface)).transpose()?;
        let has_locked = host.positions.host().par_iter().any(|position| position.flags & LOCKED != 0);
        Ok(Self { queue, surface, apply, proposal, has_locked, longest_ring: longest_ring(host), begun: None })
    }

    /// Starts the evaluation of a round, so that it goes on while the host works. `weights` are those that it carries.
    pub fn begin(&mut self, gate: Gate, weights: &[f32]) -> Result<()> {
        let has_held = self.has_locked || self.longest_ring > HUB_FACES;
        self.proposal.begin(&mut self.queue, &self.surface, gate, weights, has_held)?;
        self.begun = Some(gate);
        Ok(())
    }

    /// Appends the round's candidates in the order of the pairs; returns how many pairs there were. Weights that were found
    /// for the round become those that the host carries.
    pub fn propose(&mut self, gate: Gate, weights: &mut Vec<f32>, candidates: &mut Vec<Candidate>) -> Result<usize> {
        if self.begun != Some(gate) {
            self.begin(gate, weights)?;
        }
        self.proposal.finish(&mut self.queue, &self.surface, weights, candidates)
    }

    /// Applies a round's contractions, before the host compacts, and starts the next round if nothing is missing.
    pub fn follow(&mut self, contractions: &[Contraction], left: Left, gate: Gate) -> Result<()> {
        self.begun = None;
        let Some(apply) = &mut self.apply else { return Ok(()) };
        self.longest_ring = self.longest_ring.saturating_mul(2);
        apply.run(&mut self.queue, &mut self.surface, contractions, left)?;
        if self.proposal.needs_weights() {
            return self.queue.submit();
        }
        self.begin(gate, &[])
    }

    /// Takes what the host's compaction left, unless it is here already, and starts the next round, if it is not begun.
    pub fn catch_up(&mut self, host: &Surface, weights: &[f32], gate: Gate) -> Result<()> {
        self.longest_ring = longest_ring(host);
        if self.apply.is_none() {
            self.surface.send(&mut self.queue, host)?;
        }
        if self.begun.is_some() {
            return Ok(());
        }
        self.begin(gate, weights)
    }

    /// Time spent moving bytes so far.
    pub fn time_moving(&self) -> Duration {
        self.queue.time_moving()
    }

    /// Bytes moved so far.
    pub fn bytes_moved(&self) -> u64 {
        self.queue.bytes_moved()
    }
}

fn longest_ring(surface: &Surface) -> u32 {
    let starts = &surface.ring_starts.host()[..=surface.vertex_count];
    starts.par_windows(2).map(|ends| ends[1] - ends[0]).max().unwrap_or(0)
}
