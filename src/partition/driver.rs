//! The run: faces to regions, regions to chains, chains simplified, regions rebuilt.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::backend::{Device, Queue, fallback};
use crate::error::{Error, Result};
use crate::mesh::{FACE_COLORS_DROPPED, Mesh};
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, Phases, Progress, StopReason};

use super::boundary::Boundary;
use super::chains::{Chains, Tolerances};
use super::coplanar;
use super::cut::Parts;
use super::rebuild::{Rebuilt, Recipe, rebuild};
use super::restore::{Restored, restore};
use super::surface::Surface;
use super::{By, Options, Partition, Variational, vsa};

/// How often regions that cannot be drawn are cut in two.
const MOST_CUTS: usize = 8;

/// Partitions and rebuilds on `device`; the calling thread belongs to its pool.
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    let clock = Instant::now();
    let mut surface = Surface::new(mesh, options.weld)?;
    let mut warnings = std::mem::take(&mut surface.warnings);
    if mesh.texcoords.is_some() {
        warnings.push("texture coordinates are dropped: they are not carried through regions".into());
    }
    warnings.extend(mesh.face_colors.is_some().then(|| FACE_COLORS_DROPPED.into()));
    let mut seconds = Phases { build: clock.elapsed().as_secs_f64(), ..Phases::default() };
    let mut queues = Queues::new(device);
    let mut lap = Instant::now();
    let mut lapped = move || std::mem::replace(&mut lap, Instant::now()).elapsed().as_secs_f64();

    let now = Progress { faces: surface.faces.len(), faces_in: mesh.faces.len(), target: 0 };
    let mut report = || progress.as_mut().map_or(ControlFlow::Continue(()), |report| report(now));
    let found = find(&surface, options, budget, device, &mut warnings, &mut report)?;
    seconds.select = lapped();
    let cancelled = found.is_cancelled;
    let mut parts = Parts::new(found.partition);
    let mut rebuilt = Rebuilt::nothing(&surface, &parts.partition);
    for cuts in 0..=MOST_CUTS {
        if cancelled {
            break;
        }
        let boundary = Boundary::new(&surface, &parts.partition);
        let mut chains = Chains::new(&surface, &boundary);
        queues.run(&mut warnings, |queue| chains.simplify(found.tolerances, None, queue))?;
        seconds.cost += lapped();
        let recipe = Recipe { triangulation: options.triangulation, fills_in_space: cuts == MOST_CUTS };
        rebuilt = rebuild(&surface, &parts.partition, &boundary, &mut chains, recipe);
        seconds.apply += lapped();
        if cuts == MOST_CUTS || !parts.cut(&surface, &rebuilt.undrawn) {
            break;
        }
    }
    if !rebuilt.undrawn.is_empty() {
        let count = rebuilt.undrawn.len();
        warnings.push(format!("{count} regions, or parts of them, cannot be drawn anew and keep their faces"));
    }
    let Restored { mesh, vertex_origin, mut regions } = restore(mesh, &surface, &parts, rebuilt);
    regions.proxies = found.proxies;
    regions.energies = found.energies;
    seconds.apply += lapped();
    seconds.transfer = queues.seconds_moving();
    seconds.total = clock.elapsed().as_secs_f64();
    Ok(Outcome {
        mesh,
        vertex_origin,
        faces_in: regions.labels.len(),
        target: 0,
        stop: if cancelled { StopReason::Cancelled } else { StopReason::RegionsRebuilt },
        blocked: Blocked::default(),
        error_estimate: 0.0,
        flips: 0,
        cell_size: None,
        quadrics: None,
        log: None,
        regions: Some(regions),
        rounds: Vec::new(),
        seconds,
        bytes_moved: queues.bytes_moved(),
        device: queues.description(device),
        warnings,
    })
}

/// What the rebuilding starts from.
struct Found {
    partition: Partition,
    tolerances: Tolerances,
    proxies: Vec<vsa::Proxy>,
    energies: Vec<f64>,
    is_cancelled: bool,
    on_gpu: bool,
}

/// No limit.
const ANY: Tolerances = Tolerances { distance: f64::INFINITY, chord_ratio: f64::INFINITY, color: f64::INFINITY };

impl Found {
    fn new(partition: Partition, tolerances: Tolerances) -> Self {
        Self { partition, tolerances, proxies: Vec::new(), energies: Vec::new(), is_cancelled: false, on_gpu: false }
    }
}

fn find(
    surface: &Surface,
    options: &Options,
    budget: &Budget,
    device: &Device,
    warnings: &mut Vec<String>,
    report: &mut (dyn FnMut() -> ControlFlow<()> + Send),
) -> Result<Found> {
    let limit = budget.max_deviation(surface.frame.length_to_model(surface.diagonal))?;
    match &options.by {
        By::Coplanar(flatness) => {
            let given = flatness.distance * surface.diagonal;
            let distance = if limit.is_finite() { surface.frame.length_to_rows(limit) } else { given };
            let partition = coplanar::partition(surface, flatness.angle_rad, distance, |_, _| false);
            Ok(Found { is_cancelled: report().is_break(), ..Found::new(partition, Tolerances { distance, ..ANY }) })
        }
        By::Variational(Variational { regions, chord_ratio }) => {
            let goal = if limit.is_finite() { vsa::Goal::Deviation(limit) } else { regions.goal };
            let mut on_pass = |_| report();
            let found = vsa::partition(surface, &vsa::Options { goal, ..*regions }, device, Some(&mut on_pass))?;
            warnings.extend(found.warnings);
            Ok(Found {
                proxies: found.proxies,
                energies: found.energies,
                is_cancelled: found.is_cancelled,
                on_gpu: found.on_gpu,
                ..Found::new(found.partition, Tolerances { chord_ratio: *chord_ratio, ..ANY })
            })
        }
    }
}

/// A GPU's queue while it works, and the host's.
struct Queues {
    gpu: Option<Queue>,
    host: Queue,
    used_gpu: bool,
}

impl Queues {
    fn new(device: &Device) -> Self {
        // One that was taken by itself would not gain: what kernels do here takes less than moving the mesh.
        let gpu = device.gpu_queue().filter(|_| !device.is_auto());
        Self { used_gpu: gpu.is_some(), gpu, host: device.cpu_queue() }
    }

    /// Runs `work` on the GPU, or on the host when there is none or it fails.
    fn run<T>(&mut self, warnings: &mut Vec<String>, mut work: impl FnMut(&mut Queue) -> Result<T>) -> Result<T> {
        if let Some(queue) = &mut self.gpu {
            match work(queue) {
                Err(reason @ (Error::Device(_) | Error::Limit(_))) => {
                    warnings.push(fallback(&reason));
                    self.gpu = None;
                    self.used_gpu = false;
                }
                result => return result,
            }
        }
        work(&mut self.host)
    }

    fn bytes_moved(&self) -> u64 {
        self.gpu.as_ref().map_or(0, Queue::bytes_moved)
    }

    fn seconds_moving(&self) -> f64 {
        self.gpu.as_ref().map_or(0.0, |queue| queue.time_moving().as_secs_f64())
    }

    fn description(&self, device: &Device) -> String {
        if self.used_gpu { device.description() } else { device.cpu_description() }
    }
}
