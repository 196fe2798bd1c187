//! The run: faces to regions, regions to chains, chains simplified, regions rebuilt.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::backend::Device;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::simplify::{Blocked, Budget, OnProgress, Outcome, Phases, Progress, StopReason};

use super::Options;
use super::boundary::Boundary;
use super::chains::Chains;
use super::cut::Parts;
use super::find::Search;
use super::fit::fit;
use super::plane::Plane;
use super::queues::Queues;
use super::rebuild::{Light, Rebuilt, Recipe, rebuild};
use super::restore::{Restored, VertexLight, restore};
use super::surface::Surface;

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
    let mut seconds = Phases { build: clock.elapsed().as_secs_f64(), ..Phases::default() };
    let mut queues = Queues::new(device);
    let mut lap = Instant::now();
    let mut lapped = move || std::mem::replace(&mut lap, Instant::now()).elapsed().as_secs_f64();

    let now = Progress { faces: surface.faces.len(), faces_in: mesh.faces.len(), target: 0 };
    let mut report = || progress.as_mut().map_or(ControlFlow::Continue(()), |report| report(now));
    let search =
        Search { mesh, surface: &surface, budget, queues: &mut queues, warnings: &mut warnings, report: &mut report };
    let found = search.find(options)?;
    seconds.select = lapped();
    let mut cancelled = found.is_cancelled;
    let mut parts = Parts::new(found.partition);
    let mut rebuilt = Rebuilt::nothing(&surface, &parts.partition);
    let (mut cuts, mut fills_in_space) = (0, false);
    while !cancelled {
        let boundary = Boundary::new(&surface, &parts.partition);
        let mut chains = Chains::new(&surface, &boundary);
        let colors = found.light.as_ref().map(|light| &light.colors[..]);
        queues.run(&mut warnings, |queue| chains.simplify(found.tolerances, colors, queue))?;
        seconds.cost += lapped();
        // Held to its plane, a region is drawn in no other: that through all of it may be past the limit.
        let planes = match &found.planes {
            Some(planes) => parts.whole.iter().map(|&whole| planes[whole as usize]).collect(),
            None => Plane::of_regions(&surface, &parts.partition),
        };
        let recipe = Recipe {
            planes: &planes,
            triangulation: options.triangulation,
            fills_in_space,
            light: found.light.as_ref().map(|light| Light { colors: &light.colors, limits: light.limits }),
        };
        rebuilt = rebuild(&surface, &parts.partition, &boundary, &mut chains, recipe);
        seconds.apply += lapped();
        if rebuilt.undrawn.is_empty() || fills_in_space {
            break;
        }
        // What cannot be cut any more is filled in space at last.
        cuts += 1;
        fills_in_space = cuts > MOST_CUTS || !parts.cut(&surface, &rebuilt.undrawn);
        cancelled = report().is_break();
    }
    if cancelled {
        rebuilt = Rebuilt::nothing(&surface, &parts.partition);
    }
    if !rebuilt.undrawn.is_empty() {
        let count = rebuilt.undrawn.len();
        warnings.push(format!("{count} regions, or parts of them, cannot be drawn anew and keep their faces"));
    }
    let fitted = found.light.as_ref().filter(|_| !cancelled).and_then(|light| {
        let most = light.most_moved?;
        Some(fit(&surface, &light.colors, &rebuilt.faces, &rebuilt.samples, most))
    });
    let own = found.light.as_ref().map(|light| VertexLight::Own(&light.colors));
    let light = fitted.as_deref().map(VertexLight::Fitted).or(own);
    let error_estimate = surface.frame.length_to_model(rebuilt.deviation);
    let Restored { mesh, vertex_origin, mut regions } = restore(mesh, &surface, &parts, rebuilt, light);
    regions.proxies = found.proxies;
    regions.proxies.iter_mut().for_each(|proxy| *proxy = proxy.in_model(&surface));
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
        error_estimate,
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
