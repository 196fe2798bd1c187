//! The run: faces to regions, regions to chains, chains simplified, regions rebuilt.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::backend::Device;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, Phases, Progress, StopReason};

use super::boundary::Boundary;
use super::chains::{Chains, Vertices};
use super::cut::Parts;
use super::find::{Found, Partitioner, SurfaceLight};
use super::fit::fit;
use super::queues::{OnDevice, Queues};
use super::rebuild::{Light, Rebuilt, Recipe, rebuild};
use super::restore::{Carried, Restored, VertexLight, restore};
use super::slide::{Bounds, Scene, Slid, slide};
use super::surface::Surface;
use super::{By, Options};

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
    mesh.materials.iter().for_each(|materials| surface.wall_off(materials));
    let mut run = Run {
        queues: Queues::new(device),
        warnings: warnings(mesh, &mut surface, &options.by),
        seconds: Phases { build: clock.elapsed().as_secs_f64(), ..Phases::default() },
        lap: Instant::now(),
    };
    let now = Progress { faces: surface.faces.len(), faces_in: mesh.faces.len(), target: 0 };
    let mut report = || progress.as_mut().map_or(ControlFlow::Continue(()), |report| report(now));
    let Run { queues, warnings, .. } = &mut run;
    let mut found =
        Partitioner { mesh, surface: &surface, budget, queues, warnings, report: &mut report }.find(options)?;
    run.seconds.select = run.lapped();
    let mut parts = Parts::new(std::mem::take(&mut found.partition));
    let rebuilt = run.rebuild(&surface, &found, &mut parts, options, &mut report)?;
    let cancelled = rebuilt.is_none();
    let (rebuilt, settled) = rebuilt.unwrap_or_else(|| (Rebuilt::nothing(&surface, &parts.partition), None));
    let error_estimate = surface.frame.length_to_model(rebuilt.deviation);
    let Restored { mesh, vertex_origin, mut regions } =
        restore_found(mesh, &surface, &parts, rebuilt, &found, settled.as_ref());
    regions.proxies = found.proxies.iter().map(|proxy| proxy.in_model(&surface)).collect();
    regions.energies = found.energies;
    run.seconds.apply += run.lapped();
    run.seconds.transfer = run.queues.seconds_moving();
    run.seconds.total = clock.elapsed().as_secs_f64();
    Ok(Outcome {
        mesh,
        vertex_origin,
        faces_in: regions.labels.len(),
        target: 0,
        stop: if cancelled { StopReason::Cancelled } else { StopReason::RegionsRebuilt },
        blocked: Blocked::default(),
        error_estimate,
        flips: 0,
        cell_size: None,
        quadrics: None,
        log: None,
        regions: Some(regions),
        rounds: Vec::new(),
        seconds: run.seconds,
        bytes_moved: run.queues.bytes_moved(),
        device: run.queues.description(device),
        warnings: run.warnings,
    })
}

/// What the surface tells, and what is left behind.
fn warnings(mesh: &Mesh, surface: &mut Surface, by: &By) -> Vec<String> {
    let mut warnings = std::mem::take(&mut surface.warnings);
    if matches!(by, By::Coplanar(_)) {
        return warnings;
    }
    if mesh.texcoords.is_some() {
        warnings.push("texture coordinates are dropped: they are not carried through regions that are not flat".into());
    }
    if !mesh.channels.is_empty() {
        warnings.push("further properties of vertices are dropped: only flat regions carry them".into());
    }
    warnings
}

/// [`restore`] with what corners carry, or with the light that was found, moved where it may be.
fn restore_found(
    mesh: &Mesh,
    surface: &Surface,
    parts: &Parts,
    rebuilt: Rebuilt,
    found: &Found,
    settled: Option<&Settled>,
) -> Restored {
    let Some(SurfaceLight { colors, .. }) = &found.light else {
        let carried = if found.keeps_corners { Carried::Corners } else { Carried::Vertices };
        return restore(mesh, surface, parts, rebuilt, carried, &[]);
    };
    match settled {
        Some(Settled { colors, slid }) => {
            restore(mesh, surface, parts, rebuilt, Carried::Light(VertexLight::Fitted(colors)), &slid.moved)
        }
        None => restore(mesh, surface, parts, rebuilt, Carried::Light(VertexLight::Own(colors)), &[]),
    }
}

/// Colors that were moved, and where vertices are that slid.
struct Settled {
    colors: Vec<[f32; 4]>,
    slid: Slid,
}

/// Fits the colors of what was rebuilt, and slides its vertices, where that may be.
fn settle(scene: Scene<'_>, light: &SurfaceLight) -> Option<Settled> {
    // What was not rebuilt has no samples.
    let most_moved = light.most_moved.filter(|_| !scene.rebuilt.samples.is_empty())?;
    let beside = scene.beside_losses();
    let Rebuilt { faces, samples, .. } = scene.rebuilt;
    let mut colors = fit(scene.surface, &beside, &light.colors, faces, samples, most_moved);
    let bounds = Bounds { most_moved, most: light.limits.most, worth: light.limits.worth };
    let slid = light.slides.then(|| slide(scene, &beside, &mut colors, bounds));
    Some(Settled { colors, slid: slid.unwrap_or_default() })
}

/// Where a run is done, what it tells, and how long it takes.
struct Run {
    queues: Queues,
    warnings: Vec<String>,
    seconds: Phases,
    /// When the last phase ended.
    lap: Instant,
}

/// May ask to stop.
type Report<'a> = dyn FnMut() -> ControlFlow<()> + Send + 'a;

impl Run {
    fn lapped(&mut self) -> f64 {
        std::mem::replace(&mut self.lap, Instant::now()).elapsed().as_secs_f64()
    }

    /// Rebuilds all regions, those cut in two that cannot be drawn; nothing when it was asked to stop.
    fn rebuild(
        &mut self,
        surface: &Surface,
        found: &Found,
        parts: &mut Parts,
        options: &Options,
        report: &mut Report<'_>,
    ) -> Result<Option<(Rebuilt, Option<Settled>)>> {
        if found.is_cancelled {
            return Ok(None);
        }
        let colors = found.light.as_ref().map(|light| &light.colors[..]);
        let mut vertices = OnDevice::new();
        let (mut cuts, mut fills_in_space) = (0, false);
        loop {
            let boundary = Boundary::new(surface, &parts.partition);
            let mut chains = Chains::new(surface, &boundary);
            self.queues.run(&mut self.warnings, |queue| {
                let vertices = vertices.get(queue, |queue| Vertices::new(surface, colors, queue))?;
                chains.simplify(found.tolerances, vertices, queue)
            })?;
            self.seconds.cost += self.lapped();
            let recipe = Recipe {
                planes: &found.planes_of(parts, surface),
                triangulation: options.triangulation,
                fills_in_space,
                light: found.light.as_ref().map(|light| Light { colors: &light.colors, limits: light.limits }),
            };
            let mut rebuilt = rebuild(surface, &parts.partition, &boundary, &mut chains, recipe);
            self.seconds.apply += self.lapped();
            if rebuilt.undrawn.is_empty() || fills_in_space {
                self.tell_of(&rebuilt);
                let planes = recipe.planes;
                let partition = &parts.partition;
                let mut settled = found.light.as_ref().and_then(|light| {
                    let scene = Scene {
                        surface,
                        partition,
                        boundary: &boundary,
                        chains: &chains,
                        planes,
                        rebuilt: &rebuilt,
                        light: &light.colors,
                    };
                    settle(scene, light)
                });
                if let Some(Settled { slid, .. }) = &mut settled {
                    rebuilt.replace(std::mem::take(&mut slid.regions));
                }
                self.seconds.apply += self.lapped();
                return Ok(Some((rebuilt, settled)));
            }
            // What cannot be cut any more is filled in space at last.
            cuts += 1;
            fills_in_space = cuts > MOST_CUTS || !parts.cut(surface, &rebuilt.undrawn);
            if report().is_break() {
                return Ok(None);
            }
        }
    }

    fn tell_of(&mut self, rebuilt: &Rebuilt) {
        if !rebuilt.undrawn.is_empty() {
            let count = rebuilt.undrawn.len();
            self.warnings
                .push(format!("regions of which all or a part cannot be drawn anew and keeps its faces: {count}"));
        }
    }
}
