//! A GPU's copy of the surface: it follows the host's and proposes the candidates of every round.

use std::time::Duration;

use rayon::prelude::*;

use crate::backend::{Device, Queue};
use crate::error::Result;
use crate::kernel::rows::{Candidate, Contraction, HUB_FACES, LOCKED};

use super::apply::{Apply, Left};
use super::carry::Carried;
use super::evaluate::plane_sums;
use super::gate::Gate;
use super::propose::Proposal;
use super::quantize::{Storage, quantize};
use super::surface::Surface;
use super::triangle::in_two_steps;
use super::triangles::Triangles;
use super::weigh::{start_weights, weigh_start};
use super::{Candidates, Metric, Options};

/// A round on a GPU takes a millisecond at least. What it saves, evaluating pairs, takes 2 threads as long at 150,000 faces, and
/// 16 at 600,000: by what runs of two million took beside an H100, in proportion.
const AUTO_FACES: usize = 75_000;
const AUTO_FACES_A_THREAD: usize = 35_000;
/// Live faces below which a GPU hands over to the CPU: a round there costs more than its work.
const HANDOVER_FACES: usize = 20_000;
/// The share of the faces below which software does, which runs on the CPU's cores and never gains: with one round there a run
/// takes 1.4 to 1.5 times as long as on the CPU, with attributes up to twice.
const SOFTWARE_HANDOVER: f64 = 0.75;

/// A surface on a GPU, with what its rounds need.
#[derive(Debug)]
pub struct Follower {
    queue: Queue,
    surface: Surface,
    /// Applies the contractions to the copy; without it the copy is sent anew, which a device with the host's own memory
    /// prefers.
    apply: Option<Apply>,
    proposal: Proposal,
    /// Where triangles are contracted. They wait for the round before.
    triangles: Option<Triangles>,
    /// Whether some vertex was locked at the start; contractions lock none.
    has_locked: bool,
    /// No ring is longer. A contraction joins two.
    longest_ring: u32,
    /// The gate of the round that was submitted.
    begun: Option<Gate>,
}

impl Follower {
    /// Copies a host's surface before its first round, finds the weights that are found once and not known yet, and stores
    /// the initial quadrics as asked for. `applies` chooses how the copy follows.
    pub fn new(
        mut queue: Queue,
        host: &Surface,
        (options, storage): (&Options, Option<Storage>),
        border_vertices: usize,
        carried: &mut Carried,
        applies: bool,
    ) -> Result<Self> {
        let (weights, wedges) = (&mut carried.weights, carried.wedges.as_ref());
        let mut surface = Surface::copy(&mut queue, host, options.metric == Metric::Plane)?;
        let normals = plane_sums(&mut queue, &mut surface, options)?;
        start_weights(&mut queue, &surface, options, border_vertices > 0, weights)?;
        weigh_start(&mut queue, &mut surface, weights)?;
        quantize(&mut queue, &mut surface, normals.as_ref(), storage)?;
        let triangles = Triangles::new(&queue, &surface, options)?;
        let mut proposal = Proposal::new(&queue, &surface, options, border_vertices, wedges)?;
        proposal.take_wedges(&mut queue, &surface, wedges)?;
        let apply = applies.then(|| Apply::new(&queue, &surface)).transpose()?;
        let has_locked = host.positions.host().par_iter().any(|position| position.flags & LOCKED != 0);
        let longest_ring = longest_ring(host);
        Ok(Self { queue, surface, apply, proposal, triangles, has_locked, longest_ring, begun: None })
    }

    /// Starts the evaluation of a round, so that it goes on while the host works. `weights` are those that it carries.
    pub fn begin(&mut self, of: Candidates, gate: Gate, weights: &[f32]) -> Result<()> {
        if of == Candidates::Triangles {
            return self.queue.submit();
        }
        let has_held = self.has_locked || self.longest_ring > HUB_FACES;
        self.proposal.begin(&mut self.queue, &self.surface, gate, weights, has_held)?;
        self.begun = Some(gate);
        Ok(())
    }

    /// Appends the round's candidates in the order of the pairs; returns how many pairs there were. Weights that were found
    /// for the round become those that the host carries.
    pub fn propose(
        &mut self,
        of: Candidates,
        gate: Gate,
        weights: &mut Vec<f32>,
        candidates: &mut Vec<Candidate>,
    ) -> Result<usize> {
        if let (Candidates::Triangles, Some(triangles)) = (of, &mut self.triangles) {
            return triangles.run(&mut self.queue, &self.surface, gate, candidates);
        }
        if self.begun != Some(gate) {
            self.begin(of, gate, weights)?;
        }
        self.proposal.finish(&mut self.queue, &self.surface, weights, candidates)
    }

    /// Applies a round's contractions, before the host compacts, and starts the next round, of what is told, if nothing is
    /// missing.
    pub fn follow(&mut self, contractions: &[Contraction], left: Left, next: Candidates, gate: Gate) -> Result<()> {
        self.begun = None;
        self.apply(contractions, left)?;
        if self.apply.is_none() || self.proposal.needs_weights() || self.proposal.needs_wedges() {
            return self.queue.submit();
        }
        self.begin(next, gate, &[])
    }

    /// The same of triangles, two contractions each, the first of which remove `by_first_steps` faces.
    pub fn follow_triangles(
        &mut self,
        contractions: &[Contraction],
        by_first_steps: usize,
        left: Left,
        next: Candidates,
        gate: Gate,
    ) -> Result<()> {
        let [first, second] = in_two_steps(contractions);
        let faces = self.surface.face_count - by_first_steps;
        self.apply(&first, Left { vertices: left.vertices + second.len(), faces })?;
        self.follow(&second, left, next, gate)
    }

    fn apply(&mut self, contractions: &[Contraction], left: Left) -> Result<()> {
        let Some(apply) = &mut self.apply else { return Ok(()) };
        self.longest_ring = self.longest_ring.saturating_mul(2);
        apply.run(&mut self.queue, &mut self.surface, contractions, left)
    }

    /// Takes what the host's compaction left, unless it is here already, and starts the next round, if it is not begun.
    pub fn catch_up(&mut self, host: &Surface, carried: &Carried, of: Candidates, gate: Gate) -> Result<()> {
        self.longest_ring = longest_ring(host);
        if self.apply.is_none() {
            self.surface.send(&mut self.queue, host)?;
        }
        if self.begun.is_some() {
            return Ok(());
        }
        self.proposal.take_wedges(&mut self.queue, &self.surface, carried.wedges.as_ref())?;
        self.begin(of, gate, &carried.weights)
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

/// Faces from which a GPU that was taken by itself is used, beside so many threads.
pub fn auto_faces(threads: usize) -> usize {
    AUTO_FACES + AUTO_FACES_A_THREAD * threads
}

/// Live faces below which a run that starts with so many goes on on the CPU.
pub fn handover_faces(device: &Device, faces: usize) -> usize {
    device.options().handover_faces.unwrap_or_else(|| match device.is_software() {
        true => (faces as f64 * SOFTWARE_HANDOVER) as usize,
        // Small meshes are given to a GPU only where it was asked for by name: it does some rounds.
        false => HANDOVER_FACES.min(faces / 4),
    })
}
