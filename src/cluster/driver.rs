//! What is wanted, where it is done, and what came of it.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};
use crate::kernel::cell_keys::LEAST_STEPS;
use crate::mesh::Mesh;
use crate::mesh::kept::dropped_through;
use crate::mesh::weld::used_vertices;
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, Phases, Progress, StopReason};

use super::Options;
use super::lattice::Lattice;
use super::work::{Done, Work};

/// The share of the faces that is told if it vanishes: tips of what is curved do everywhere.
const LEAST_TOLD: f64 = 1e-2;

/// Which grid is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// The one of so many steps.
    Grid(u32),
    /// The finest with at most so many faces, of at most so many steps.
    Faces { target: usize, most: u32 },
    /// The coarsest with a face, of at most so many steps.
    Deviation { most: u32 },
}

impl Goal {
    fn new(options: &Options, budget: &Budget, mesh: &Mesh, lattice: &Lattice) -> Result<Self> {
        if let Some(cells) = options.grid {
            return Ok(Self::Grid(lattice.steps_of(cells)));
        }
        let target = budget.target_faces(mesh.faces.len())?;
        let deviation = budget.max_deviation(mesh.diagonal())?;
        let most = lattice.steps_within(deviation);
        if most < LEAST_STEPS {
            let least = lattice.length(f64::from(LEAST_STEPS) * 3_f64.sqrt());
            return Err(Error::Parameter(format!(
                "the error limit {deviation:e} is below {least:e}, the diagonal of the smallest cells here"
            )));
        }
        Ok(if budget.counts_faces() { Self::Faces { target, most } } else { Self::Deviation { most } })
    }

    fn target(self) -> usize {
        if let Self::Faces { target, .. } = self { target } else { 0 }
    }

    /// Why a run ended with this many faces and cells of so many steps.
    fn stop(self, faces: usize, steps: u32, extent: u32) -> StopReason {
        match self {
            Self::Grid(_) => StopReason::GridReached,
            Self::Faces { target, .. } if faces <= target => StopReason::FacesReached,
            Self::Faces { most, .. } | Self::Deviation { most } if steps == most && most < extent => {
                StopReason::ErrorReached
            }
            _ => StopReason::Stuck,
        }
    }
}

/// Clusters on `device`; the calling thread belongs to its pool.
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    let clock = Instant::now();
    mesh.check()?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh("it has no faces".into()));
    }
    let used = used_vertices(&mesh.faces, mesh.positions.len());
    let lattice = Lattice::new(&mesh.positions, &used)
        .ok_or_else(|| Error::Mesh("all its faces are degenerate: their corners lie at one point".into()))?;
    let goal = Goal::new(options, budget, mesh, &lattice)?;
    let mut warnings = dropped_through(mesh, "clustering");
    let mut on = |queue: Queue| {
        let mut report = |faces: usize| {
            let now = Progress { faces, faces_in: mesh.faces.len(), target: goal.target() };
            progress.as_mut().map_or(ControlFlow::Continue(()), |report| report(now))
        };
        Work::new(queue, mesh, lattice, &used, &mut report)?.run(goal, options.representative)
    };
    // One that was taken by itself would not gain: what is left beside the grouping costs less than to move the mesh.
    let gpu = device.gpu_queue().filter(|_| !device.is_auto());
    let (done, on_gpu) = match gpu.map(&mut on) {
        Some(Err(reason @ (Error::Device(_) | Error::Limit(_)))) => {
            warnings.push(fallback(&reason));
            (on(device.cpu_queue())?, false)
        }
        Some(result) => (result?, true),
        None => (on(device.cpu_queue())?, false),
    };
    let stop = match &done {
        ControlFlow::Continue(done) => goal.stop(done.mesh.faces.len(), done.steps, lattice.extent),
        ControlFlow::Break(()) => StopReason::Cancelled,
    };
    let done = match done {
        ControlFlow::Continue(done) => done,
        ControlFlow::Break(()) => Done::nothing(mesh),
    };
    if done.vanished > 0 && done.vanished as f64 >= LEAST_TOLD * mesh.faces.len() as f64 {
        warnings.push(format!("faces of parts thinner than a cell, which are gone: {}", done.vanished));
    }
    let seconds = Phases { total: clock.elapsed().as_secs_f64(), ..done.seconds };
    Ok(Outcome {
        quadrics: None,
        log: None,
        regions: None,
        flips: 0,
        cell_size: (done.steps > 0).then(|| lattice.length(done.steps.into())),
        mesh: done.mesh,
        vertex_origin: done.origin,
        faces_in: mesh.faces.len(),
        target: goal.target(),
        stop,
        blocked: Blocked::default(),
        error_estimate: done.estimate,
        rounds: Vec::new(),
        seconds,
        bytes_moved: done.bytes_moved,
        device: if on_gpu { device.description() } else { device.cpu_description() },
        warnings,
    })
}
