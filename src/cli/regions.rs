//! From arguments to the options of methods that make regions of faces.

use std::path::Path;

use coarsen::partition::superface::{Criterion, RANGE_CAP};
use coarsen::partition::{self, By, Flatness, NO_REGION, Regions, Superfaces, Variational, vsa};
use coarsen::{Method, Outcome, contract, formats};
use serde::Serialize;

use super::Exit;
use super::args::{self, Solver, Triangulation};
use super::failure::refuse;
use super::record::regions_name;
use super::resolve::{Job, Problems, check_beside};
use super::sink::Sink;
use super::source::Source;

/// The options of the method that `method` names; `shared` are those of shape, as contraction would take them.
///
/// # Errors
/// An option that it does not have, and a goal that is missing or given twice.
pub fn options(
    method: args::Method,
    args: &args::Regions,
    target: &args::Target,
    shared: &contract::Options,
) -> anyhow::Result<Method> {
    let by = match method {
        args::Method::Vsa => variational(args, target)?,
        args::Method::Superface => superfaces(args)?,
        _ => coplanar(args)?,
    };
    with_shape(by, args, shared)
}

fn coplanar(args: &args::Regions) -> anyhow::Result<By> {
    if *args != (args::Regions { flat_angle: args.flat_angle, triangulation: args.triangulation, ..NONE }) {
        let message =
            "--method coplanar takes --flat-angle and --triangulation of the options of regions: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let defaults = Flatness::default();
    let angle_rad = args.flat_angle.map_or(defaults.angle_rad, f64::from);
    Ok(By::Coplanar(Flatness { angle_rad, ..defaults }))
}

fn variational(args: &args::Regions, target: &args::Target) -> anyhow::Result<By> {
    let by_error = target.error.is_some() || target.error_abs.is_some();
    let goal = match (args.regions, args.energy, by_error) {
        (Some(count), None, false) => vsa::Goal::Regions(count),
        (None, Some(energy), false) => vsa::Goal::Energy(energy),
        // The budget takes its place.
        (None, None, true) => vsa::Goal::Regions(1),
        (None, None, false) => {
            return Err(refuse(Exit::Usage, "--method vsa needs one of --regions, --energy, --error and --error-abs"));
        }
        _ => return Err(refuse(Exit::Usage, "--regions, --energy and an error limit contradict each other: give one")),
    };
    let &args::Regions { regions, energy, vsa_solver, restarts, chord_ratio, triangulation, .. } = args;
    if *args != (args::Regions { regions, energy, vsa_solver, restarts, chord_ratio, triangulation, ..NONE }) {
        let message = "--method vsa takes --regions, --energy, --vsa-solver, --restarts, --chord-ratio and \
                       --triangulation of the options of regions: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let mut found = Variational::new(goal);
    found.chord_ratio = args.chord_ratio.unwrap_or(found.chord_ratio);
    found.regions.restarts = args.restarts.unwrap_or(found.regions.restarts);
    found.regions.solver = match args.vsa_solver {
        Some(Solver::Greedy) | None => vsa::Solver::Greedy,
        Some(Solver::Rounds) => vsa::Solver::Rounds,
        Some(Solver::Lloyd) => vsa::Solver::Lloyd,
    };
    Ok(By::Variational(found))
}

fn superfaces(args: &args::Regions) -> anyhow::Result<By> {
    let &args::Regions { flat_angle, light_step, light_range, area_unit, border_color, triangulation, .. } = args;
    if *args != (args::Regions { flat_angle, light_step, light_range, area_unit, border_color, triangulation, ..NONE })
    {
        let message = "--method superface takes --flat-angle, --light-step, --light-range, --area-unit, --border-color and \
                       --triangulation of the options of regions: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let mut found = Superfaces::default();
    let epsilon = light_step.unwrap_or(LIGHT_STEP);
    found.regions.criterion = match area_unit {
        Some(area_unit) => Criterion::Paper { epsilon, area_unit },
        None => Criterion::Contrast { epsilon, range_cap: light_range.unwrap_or(RANGE_CAP) },
    };
    found.regions.guard.angle_rad = flat_angle.map_or(found.regions.guard.angle_rad, f64::from);
    found.border_color = border_color.unwrap_or(found.border_color);
    Ok(By::Superfaces(found))
}

fn with_shape(by: By, args: &args::Regions, shared: &contract::Options) -> anyhow::Result<Method> {
    let contract::Options { weld, flips, .. } = *shared;
    if *shared != (contract::Options { weld, flips, ..contract::Options::default() }) {
        let message =
            "methods that make regions take --weld and --flips of the options of shape: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let triangulation = match args.triangulation {
        Some(Triangulation::Earcut) => partition::Triangulation::Earcut,
        Some(Triangulation::Ears) => partition::Triangulation::Ears,
        None if matches!(by, By::Superfaces(_)) => partition::Triangulation::Ears,
        None => partition::Triangulation::default(),
    };
    Ok(Method::Partition(partition::Options { by, triangulation, weld, flips }))
}

/// The step of light that the paper's first pictures have.
const LIGHT_STEP: f64 = 0.1;

/// Nothing given.
const NONE: args::Regions = args::Regions {
    flat_angle: None,
    regions: None,
    energy: None,
    vsa_solver: None,
    restarts: None,
    chord_ratio: None,
    light_step: None,
    light_range: None,
    area_unit: None,
    border_color: None,
    triangulation: None,
};

/// Whether an option is given that only regions have.
pub fn is_asked(args: &args::Regions) -> bool {
    *args != NONE
}

/// Notes what contradicts itself in the arguments for polygons and the file of the regions.
pub fn check_files(args: &args::Simplify, source: Option<&Source>, sink: Option<&Sink>, problems: &mut Problems) {
    let args::RegionFiles { polygons, write_regions } = &args.region_files;
    for (name, is_given) in [("--polygons", *polygons), ("--write-regions", write_regions.is_some())] {
        if is_given && !args.shape.method.makes_regions() {
            problems.add(format!("{name} is for --method vsa, superface and coplanar: nothing else makes regions"));
        }
    }
    if *polygons && args.shape.flips > 0 {
        problems.add("--polygons and --flips contradict each other: what is turned are edges inside polygons");
    }
    if let Some(format) = sink.and_then(Sink::format)
        && *polygons
        && !format.writes_polygons()
    {
        problems.add(format!("--polygons writes OBJ or PLY, not {}", format.name()));
    }
    let Some(file) = write_regions else { return };
    if args.weights.write_feature.as_ref().is_some_and(|other| Path::new(other) == file) {
        let name = file.display();
        problems.add(format!("--write-feature writes '{name}' as well: give --write-regions another name"));
    }
    let beside = [source.and_then(Source::path), sink.and_then(Sink::path)];
    check_beside("--write-regions", file, beside, args.writing.overwrite, problems);
}

/// The regions of a run, as `--write-regions` writes them. Fields are only ever added under this `schema`.
#[derive(Serialize)]
struct Told<'a> {
    schema: u32,
    method: &'static str,
    count: usize,
    /// The region of every face of the input; null where it was dropped.
    labels: Vec<Option<u32>>,
    /// Of variational shape approximation; null otherwise.
    proxies: Option<Vec<Proxy>>,
    /// After every pass, where half the diagonal is 1.
    energies: Option<&'a [f64]>,
}

/// A region on the whole, in model units but for its energy.
#[derive(Serialize)]
struct Proxy {
    normal: [f64; 3],
    point: [f64; 3],
    area: f64,
    energy: f64,
}

impl<'a> Told<'a> {
    fn new(by: &By, regions: &'a Regions) -> Self {
        let is_variational = matches!(by, By::Variational(_));
        let proxy = |&vsa::Proxy { normal, point, area, energy }: &vsa::Proxy| Proxy {
            normal: normal.to_array(),
            point: point.to_array(),
            area,
            energy,
        };
        Self {
            schema: 1,
            method: regions_name(by),
            count: regions.count,
            labels: regions.labels.iter().map(|&label| (label != NO_REGION).then_some(label)).collect(),
            proxies: is_variational.then(|| regions.proxies.iter().map(proxy).collect()),
            energies: is_variational.then_some(regions.energies.as_slice()),
        }
    }
}

/// Writes the regions where the job says so.
///
/// # Errors
/// As [`formats::write_file`].
pub fn write(job: &Job, outcome: &Outcome) -> anyhow::Result<()> {
    let (Some(path), Some(regions), Method::Partition(options)) = (&job.write_regions, &outcome.regions, &job.method)
    else {
        return Ok(());
    };
    let mut bytes = serde_json::to_vec(&Told::new(&options.by, regions))?;
    bytes.push(b'\n');
    Ok(formats::write_file(path, &bytes)?)
}
