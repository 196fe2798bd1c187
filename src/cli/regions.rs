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

/// The options of the method that `method` names, with an error limit or without one; `shared` are those of shape, as
/// contraction would take them.
///
/// # Errors
/// An option that it does not have, and a goal that is missing or given twice.
pub fn options(
    method: args::Method,
    args: &args::Regions,
    by_error: bool,
    shared: &contract::Options,
) -> anyhow::Result<Method> {
    let by = match method {
        args::Method::Vsa => variational(args, by_error)?,
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
    let angle_rad = args.flat_angle.unwrap_or(defaults.angle_rad);
    Ok(By::Coplanar(Flatness { angle_rad, ..defaults }))
}

fn variational(args: &args::Regions, by_error: bool) -> anyhow::Result<By> {
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
    let &args::Regions {
        flat_angle,
        light_step,
        light_range,
        area_unit,
        border_color,
        keep_colors,
        keep_vertices,
        triangulation,
        ..
    } = args;
    let taken = args::Regions {
        flat_angle,
        light_step,
        light_range,
        area_unit,
        border_color,
        keep_colors,
        keep_vertices,
        triangulation,
        ..NONE
    };
    if *args != taken {
        let message = "--method superface takes --flat-angle, --light-step, --light-range, --area-unit, --border-color, \
                       --keep-colors, --keep-vertices and --triangulation of the options of regions: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let mut found = Superfaces::default();
    found.regions.criterion = match area_unit {
        Some(area_unit) => Criterion::Paper { epsilon: light_step.unwrap_or(LIGHT_STEP), area_unit },
        None => Criterion::Contrast {
            epsilon: light_step.unwrap_or(f64::INFINITY),
            range_cap: light_range.unwrap_or(RANGE_CAP),
        },
    };
    found.regions.guard.angle_rad = flat_angle.unwrap_or(found.regions.guard.angle_rad);
    found.border_color = border_color.unwrap_or(found.border_color);
    found.fits_light = !keep_colors;
    found.slides = !keep_vertices;
    Ok(By::Superfaces(found))
}

fn with_shape(by: By, args: &args::Regions, shared: &contract::Options) -> anyhow::Result<Method> {
    let contract::Options { weld, flips, .. } = *shared;
    let attributes = contract::Attributes {
        normals: shared.attributes.normals,
        dropped: shared.attributes.dropped.clone(),
        ..contract::Attributes::default()
    };
    let contract::Attributes { normals, dropped, .. } = attributes.clone();
    if *shared != (contract::Options { weld, flips, attributes, ..contract::Options::default() }) {
        let message = "methods that make regions take --weld and --flips of the options of shape, and --normals and --drop of those \
                       of attributes: leave the others away";
        return Err(refuse(Exit::Usage, message));
    }
    let triangulation = match args.triangulation {
        Some(Triangulation::Earcut) => partition::Triangulation::Earcut,
        Some(Triangulation::Ears) => partition::Triangulation::Ears,
        None if matches!(by, By::Superfaces(_)) => partition::Triangulation::Ears,
        None => partition::Triangulation::default(),
    };
    Ok(Method::Partition(partition::Options { by, triangulation, weld, flips, normals, dropped }))
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
    keep_colors: false,
    keep_vertices: false,
    triangulation: None,
};

/// Whether an option is given that only regions have.
pub fn is_asked(args: &args::Regions) -> bool {
    *args != NONE
}

/// Whether a run made the regions that were asked for: of others than variational shape approximation it always does.
pub fn are_reached(job: &Job, outcome: &Outcome) -> bool {
    let Method::Partition(partition::Options { by: By::Variational(variational), .. }) = &job.setup.method else {
        return true;
    };
    let Some(regions) = &outcome.regions else { return true };
    let budget = &job.budget;
    match variational.regions.goal {
        _ if budget.error.is_some() || budget.error_abs.is_some() => true,
        vsa::Goal::Regions(count) => regions.count <= count,
        vsa::Goal::Energy(most) => regions.energies.last().is_some_and(|energy| *energy <= most),
        vsa::Goal::Deviation(_) => true,
    }
}

/// Notes what contradicts itself in the arguments for polygons and the file of the regions.
pub fn check_files(args: &args::Simplify, source: Option<&Source>, sink: Option<&Sink>, problems: &mut Problems) {
    let args::RegionFiles { polygons, write_regions } = &args.region_files;
    for (name, is_given) in [("--polygons", *polygons), ("--write-regions", write_regions.is_some())] {
        if is_given && !args.how.shape.method.makes_regions() {
            problems.add(format!("{name} is for --method vsa, superface and coplanar: nothing else makes regions"));
        }
    }
    if args.target.require_target && matches!(args.how.shape.method, args::Method::Superface | args::Method::Coplanar) {
        problems.add("--require-target is for methods that have a target: superface and coplanar have none");
    }
    if *polygons && args.how.shape.flips > 0 {
        problems.add("--polygons and --flips contradict each other: what is turned are edges inside polygons");
    }
    if let Some(format) = sink.and_then(Sink::format)
        && *polygons
        && !format.writes_polygons()
    {
        problems.add(format!("--polygons writes OBJ or PLY, not {}", format.name()));
    }
    let Some(file) = write_regions else { return };
    if args.feature_file.write_feature.as_ref().is_some_and(|other| Path::new(other) == file) {
        let name = file.display();
        problems.add(format!("--write-feature writes '{name}' as well: give --write-regions another name"));
    }
    let outputs: Vec<&Path> = sink.and_then(Sink::path).into_iter().collect();
    let input = source.and_then(Source::path);
    check_beside("--write-regions", file, input, &outputs, args.writing.overwrite, problems);
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
    let (Some(path), Some(regions), Method::Partition(options)) =
        (&job.write_regions, &outcome.regions, &job.setup.method)
    else {
        return Ok(());
    };
    let mut bytes = serde_json::to_vec(&Told::new(&options.by, regions))?;
    bytes.push(b'\n');
    Ok(formats::write_file(path, &bytes)?)
}

#[cfg(test)]
mod tests {
    use clap::FromArgMatches;
    use coarsen::mesh::{Dropped, Normals};
    use coarsen::polish::Flips;

    use super::*;
    use crate::cli::{Arguments, args::Verb, method};

    fn method_of(line: &str) -> anyhow::Result<Method> {
        let words = ["coarsen", "simplify", "in.ply", "out.ply"].into_iter().chain(line.split_whitespace());
        let matches = args::command().try_get_matches_from(words)?;
        let Verb::Simplify(args) = Arguments::from_arg_matches(&matches)?.verb else { panic!("{line}") };
        let asked = method::Asked {
            how: &args.how,
            grid: args.target.grid,
            by_error: args.target.error.is_some() || args.target.error_abs.is_some(),
            with_log: args.writing.write_log.is_some(),
        };
        method::method(&asked)
    }

    fn with(by: By, triangulation: partition::Triangulation) -> Method {
        let flips = Flips { sweeps: 2, ..Flips::default() };
        let dropped = Dropped { texcoords: true, ..Dropped::default() };
        let normals = Normals::Recompute;
        Method::Partition(partition::Options { by, triangulation, weld: Some(0.5), flips, normals, dropped })
    }

    #[test]
    fn options_reach_the_engine() {
        let shape = "--weld 0.5 --flips 2 --drop uv --normals recompute";
        let flat = By::Coplanar(Flatness { angle_rad: 5_f64.to_radians(), ..Flatness::default() });
        let wanted = [
            ("--method coplanar --flat-angle 5 --triangulation ears", with(flat, partition::Triangulation::Ears)),
            (
                "--method vsa --energy 0.3 --vsa-solver rounds --restarts 5 --chord-ratio 0.4",
                with(
                    By::Variational(Variational {
                        regions: vsa::Options {
                            solver: vsa::Solver::Rounds,
                            restarts: 5,
                            ..vsa::Options::new(vsa::Goal::Energy(0.3))
                        },
                        chord_ratio: 0.4,
                    }),
                    partition::Triangulation::Earcut,
                ),
            ),
            (
                "--method vsa --regions 7 --vsa-solver lloyd",
                with(
                    By::Variational(Variational {
                        regions: vsa::Options {
                            solver: vsa::Solver::Lloyd,
                            ..vsa::Options::new(vsa::Goal::Regions(7))
                        },
                        ..Variational::new(vsa::Goal::Regions(7))
                    }),
                    partition::Triangulation::Earcut,
                ),
            ),
        ];
        for (line, wanted) in wanted {
            assert_eq!(method_of(&format!("{line} {shape}")).expect(line), wanted, "{line}");
        }
    }

    #[test]
    fn light_reaches_the_engine() {
        let superfaces = |line: &str| match method_of(&format!("--method superface {line}")).expect(line) {
            Method::Partition(partition::Options { by: By::Superfaces(superfaces), triangulation, .. }) => {
                (superfaces, triangulation)
            }
            other => panic!("{line}: {other:?}"),
        };
        let (found, triangulation) = superfaces("--light-step 0.2 --light-range 40% --border-color 3");
        assert_eq!(found.regions.criterion, Criterion::Contrast { epsilon: 0.2, range_cap: 0.4 });
        assert_eq!((found.border_color, triangulation), (3.0, partition::Triangulation::Ears));
        let (found, triangulation) =
            superfaces("--light-step 0.2 --area-unit 4 --flat-angle 20 --triangulation earcut");
        assert_eq!(found.regions.criterion, Criterion::Paper { epsilon: 0.2, area_unit: 4.0 });
        assert_eq!(found.regions.guard.angle_rad, 20_f64.to_radians());
        assert_eq!(triangulation, partition::Triangulation::Earcut);
        assert_eq!(superfaces("").0, Superfaces::default());
        assert_eq!(superfaces("--flat-angle 1 --light-range 100%").0, Superfaces::default());
        assert!(!superfaces("--keep-colors").0.fits_light);
        assert_eq!(superfaces("--keep-vertices").0, Superfaces { slides: false, ..Superfaces::default() });
    }

    #[test]
    fn contradictions_are_told() {
        let wrong = [
            ("--method vsa", "--regions, --energy"),
            ("--method vsa --regions 3 --energy 1", "contradict"),
            ("--method vsa --regions 3 --error 1%", "contradict"),
            ("--method vsa --regions 3 --light-step 1", "--vsa-solver"),
            ("--method coplanar --regions 3", "--method coplanar takes"),
            ("--method superface --regions 3", "--method superface takes"),
            ("--method coplanar --metric plane", "--weld and --flips"),
            ("--method coplanar --lock-seams", "--normals and --drop"),
            ("--ratio 0.5 --regions 3", "options of regions are for"),
        ];
        for (line, part) in wrong {
            let message = method_of(line).expect_err(line).to_string();
            assert!(message.contains(part), "{line}: {message}");
        }
    }
}
