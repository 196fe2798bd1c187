//! From the arguments of `lod` to a job.

use std::path::{Path, PathBuf};

use coarsen::contract::Placement;
use coarsen::formats::Format;
use coarsen::metrics::View;
use coarsen::{Budget, Method};

use super::pattern::{of_all, of_levels};
use crate::cli::Exit;
use crate::cli::args;
use crate::cli::failure::refuse;
use crate::cli::resolve::{Problems, check_beside};
use crate::cli::setup::{Setup, Shared};
use crate::cli::sink::Sink;
use crate::cli::source::Source;

/// Levels without any list of them.
const LEVELS: u16 = 4;
/// What each keeps of the one before.
const RATIO_STEP: f64 = 0.5;

/// Everything `lod` needs to know.
#[derive(Debug)]
pub struct Job {
    pub setup: Setup,
    pub outputs: Outputs,
    /// One a level, from fine to coarse.
    pub budgets: Vec<Budget>,
    pub screen: Screen,
    pub require_target: bool,
    pub manifest: Option<PathBuf>,
}

/// Where levels go.
#[derive(Debug)]
pub enum Outputs {
    /// A file each.
    Each(Vec<PathBuf>),
    /// One for all, and one for the indices where the first has no room for them.
    Shared { file: PathBuf, indices: Option<PathBuf> },
}

impl Outputs {
    /// All files.
    pub fn paths(&self) -> Vec<&Path> {
        match self {
            Self::Each(files) => files.iter().map(PathBuf::as_path).collect(),
            Self::Shared { file, indices } => {
                [Some(file), indices.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect()
            }
        }
    }

    /// The file that the mesh of a level is in.
    pub fn of_level(&self, number: usize) -> &Path {
        match self {
            Self::Each(files) => &files[number],
            Self::Shared { file, .. } => file,
        }
    }
}

/// The picture that levels are for.
#[derive(Debug, Clone, Copy)]
pub struct Screen {
    /// How far a level may be off.
    pub pixels: f64,
    /// At a distance of 1.
    view: View,
    /// Whether somebody asked for it.
    pub is_asked: bool,
}

impl Screen {
    fn new(args: &args::Screen) -> Self {
        Self {
            pixels: args.screen_error.unwrap_or(1.0),
            view: View { distance: 1.0, fov_rad: args.fov, height: args.screen_height },
            is_asked: args.screen_error.is_some() || !args.distances.is_empty(),
        }
    }

    /// In pixels, and in degrees from its lower to its upper edge.
    pub fn height_and_fov(&self) -> [f64; 2] {
        [self.view.height, self.view.fov_rad.to_degrees()]
    }

    /// The error that is not seen from a distance.
    fn error_at(&self, distance: f64) -> f64 {
        View { distance, ..self.view }.length(self.pixels)
    }

    /// The distance from which on an error is not seen.
    pub fn distance_for(&self, error: f64) -> f64 {
        self.view.distance_for(error, self.pixels)
    }
}

impl Job {
    /// Makes a job of the arguments.
    ///
    /// # Errors
    /// All that is wrong with them, one a line; the first decides the exit code.
    pub fn new(args: &args::Lod) -> anyhow::Result<Self> {
        let mut problems = Problems::default();
        let screen = Screen::new(&args.screen);
        let budgets = problems.note(budgets(args, &screen));
        let format = problems.format(args.writing.format.as_deref(), [args.input == "-", false]);
        let source = problems.source(&args.input, format);
        let outputs = match (&source, &budgets) {
            (Some(source), Some(budgets)) => problems.note(outputs(args, source, budgets)),
            _ => None,
        };
        let input = source.as_ref().and_then(Source::path);
        let paths = outputs.as_ref().map(Outputs::paths).unwrap_or_default();
        for &path in &paths {
            problems.note(Sink::File(path.to_path_buf()).check(input, args.writing.overwrite));
        }
        if let Some(manifest) = &args.levels.manifest {
            check_beside("--manifest", manifest, input, &paths, args.writing.overwrite, &mut problems);
            if args.writing.write_log.as_ref() == Some(manifest) {
                let name = manifest.display();
                problems.add(format!("--write-log writes '{name}' as well: give --manifest another name"));
            }
        }
        let shared = Shared {
            how: &how(args),
            feature_file: &args.feature_file,
            device: &args.device,
            writing: &args.writing,
            grid: None,
            by_error: budgets.iter().flatten().any(|budget| budget.error.is_some() || budget.error_abs.is_some()),
        };
        let setup = Setup::new(shared, source.clone(), &paths, &mut problems);
        if let Some(setup) = &setup
            && args.levels.shared_vertices
            && !matches!(&setup.method, Method::Contract(options) if options.placement == Placement::Endpoint)
        {
            problems
                .add("--shared-vertices needs contraction with --placement endpoint: nothing else nests its levels");
        }
        drop(paths);
        let (Some(setup), Some(outputs), Some(budgets), true) = (setup, outputs, budgets, problems.is_empty()) else {
            return Err(problems.into_error());
        };
        let require_target = args.levels.require_target;
        Ok(Self { setup, outputs, budgets, screen, require_target, manifest: args.levels.manifest.clone() })
    }
}

/// How to simplify, with what levels of one list of vertices need.
fn how(args: &args::Lod) -> args::How {
    let mut how = args.how.clone();
    let shape = &mut how.shape;
    let contracts = matches!(shape.method, args::Method::Contract | args::Method::Feature | args::Method::Average);
    if args.levels.shared_vertices && contracts {
        // Coordinates are of corners, not of vertices.
        shape.attributes.drop.push(args::Dropped::Uv);
        shape.placement = shape.placement.or(Some(args::Placement::Endpoint));
    }
    how
}

/// The budgets of the one list that is given.
fn budgets(args: &args::Lod, screen: &Screen) -> anyhow::Result<Vec<Budget>> {
    let args::Levels { ratios, faces, errors, errors_abs, levels, ratio_step, .. } = &args.levels;
    let distances = &args.screen.distances;
    let chain = levels.is_some() || ratio_step.is_some();
    let lists = [
        ("--ratios", !ratios.is_empty()),
        ("--faces", !faces.is_empty()),
        ("--errors", !errors.is_empty()),
        ("--errors-abs", !errors_abs.is_empty()),
        ("--distances", !distances.is_empty()),
        ("--levels", chain),
    ];
    let given: Vec<&str> = lists.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name).collect();
    if given.len() > 1 {
        let message = format!("{} contradict each other: give one list of levels", given.join(" and "));
        return Err(refuse(Exit::Usage, message));
    }
    let falls = |list: &[f64]| list.is_sorted_by(|a, b| a > b);
    let rises = |list: &[f64]| list.is_sorted_by(|a, b| a < b);
    let in_order = falls(ratios)
        && faces.is_sorted_by(|a, b| a > b)
        && [errors, errors_abs, distances].into_iter().all(|l| rises(l));
    if !in_order {
        let list = given.join("");
        let example = match list.as_str() {
            "--ratios" => "50%,10%,1%",
            "--faces" => "10k,5k,1k",
            "--errors" => "0.1%,0.5%,1%",
            _ => "0.5,5,50",
        };
        let message = format!("{list} go from fine to coarse, without repeats: such as {example}");
        return Err(refuse(Exit::Usage, message));
    }
    let step = ratio_step.unwrap_or(RATIO_STEP);
    let of_list = |list: &[f64], budget: fn(f64) -> Budget| list.iter().map(|&value| budget(value)).collect();
    Ok(match given.first() {
        Some(&"--ratios") => of_list(ratios, Budget::keep),
        Some(&"--faces") => faces.iter().map(|&faces| Budget::faces(faces)).collect(),
        Some(&"--errors") => of_list(errors, Budget::error),
        Some(&"--errors-abs") => of_list(errors_abs, Budget::error_abs),
        Some(&"--distances") => distances.iter().map(|&far| Budget::error_abs(screen.error_at(far))).collect(),
        _ => (1..=levels.unwrap_or(LEVELS)).map(|level| Budget::keep(step.powi(level.into()))).collect(),
    })
}

/// Where the levels go.
fn outputs(args: &args::Lod, source: &Source, budgets: &[Budget]) -> anyhow::Result<Outputs> {
    if args.pattern == "-" {
        return Err(refuse(Exit::Usage, "levels go to files: give a pattern such as out-{level}.ply"));
    }
    if !args.levels.shared_vertices {
        let files = of_levels(&args.pattern, source, budgets)?;
        files.iter().try_for_each(|file| Format::from_path(file).map(drop))?;
        return Ok(Outputs::Each(files));
    }
    let file = of_all(&args.pattern, source)?;
    let (format, compression) = Format::from_path(&file)?;
    let indices = match format {
        Format::Obj => None,
        Format::Stl => return Err(refuse(Exit::Usage, "STL has no vertices to share: write OBJ, PLY or OFF")),
        Format::Gltf | Format::Glb => {
            let message = format!("--shared-vertices in {}: write OBJ, PLY or OFF", format.name());
            return Err(refuse(Exit::Usage, message));
        }
        Format::Ply | Format::Off if args.levels.manifest.is_none() => {
            let message = "--shared-vertices in PLY and OFF needs --manifest: where each level begins is there";
            return Err(refuse(Exit::Usage, message));
        }
        Format::Ply | Format::Off => {
            let plain =
                if compression == coarsen::formats::Compression::None { file.clone() } else { file.with_extension("") };
            Some(plain.with_extension("idx"))
        }
    };
    Ok(Outputs::Shared { file, indices })
}
