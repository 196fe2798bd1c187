//! `coarsen compare`: measure, draw, tell.

mod record;
mod table;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use coarsen::backend::Selector;
use coarsen::formats::{self, Document, Format, Looks, Scene, WriteOptions};
use coarsen::metrics::{self, Options, View};
use coarsen::report::{self, ImageDifference, Model, PictureOptions, Up};
use coarsen::{Device, Mesh};

use self::record::{Record, Seconds};
use super::console::{self, Verbosity};
use super::failure::{at, refuse};
use super::resolve::{Problems, selector};
use super::sink::Sink;
use super::source::Source;
use super::{Exit, args, interrupt};

/// Everything `compare` needs to know.
#[derive(Debug)]
pub struct Job {
    a: Source,
    b: Source,
    options: Options,
    view: Option<View>,
    images: bool,
    heatmap: Option<PathBuf>,
    picture: Option<PathBuf>,
    drawing: PictureOptions,
    /// What is up, if not as the format of A has it.
    up: Option<Up>,
    selector: Selector,
    threads: usize,
    json: bool,
    verbosity: Verbosity,
}

impl Job {
    /// Makes a job of the arguments.
    ///
    /// # Errors
    /// All that is wrong with them, one a line; the first decides the exit code.
    pub fn new(args: &args::Compare) -> anyhow::Result<Self> {
        let mut problems = Problems::default();
        let pipes = [&args.a, &args.b].map(|name| name == "-");
        if pipes == [true, true] {
            problems.add("standard input ('-') holds one mesh: name a file for the other");
        }
        let format = problems.format(args.writing.format.as_deref(), pipes);
        let a = problems.source(&args.a, format);
        let b = problems.source(&args.b, format);
        let selector = problems.note(selector(&args.device.device));
        let inputs: Vec<&Source> = [&a, &b].into_iter().flatten().collect();
        let heatmap = args.drawing.heatmap.as_deref().map(PathBuf::from);
        let picture = args.drawing.picture.clone();
        if let Some(path) = &heatmap {
            problems.note(carries_colors(path));
        }
        if let Some(path) =
            picture.as_ref().filter(|path| path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")))
        {
            problems.add(format!("'{}' is no PNG: give the picture a name that ends in .png", path.display()));
        }
        if heatmap.is_some() && heatmap == picture {
            problems.add("--heatmap and --picture name the same file");
        }
        for path in heatmap.iter().chain(&picture) {
            // An input is told before anything is said about a file that exists.
            let input =
                inputs.iter().filter_map(|source| source.path()).find(|input| super::sink::same_file(input, path));
            problems.note(Sink::File(path.clone()).check(input, args.writing.overwrite));
        }
        let (Some(a), Some(b), Some(selector), true) = (a, b, selector, problems.is_empty()) else {
            return Err(problems.into_error());
        };
        Ok(Self {
            a,
            b,
            options: Options {
                samples: args.measuring.samples,
                seed: args.measuring.seed,
                kinds: args.measuring.kinds,
            },
            view: args.measuring.view,
            images: args.measuring.images,
            heatmap,
            picture,
            drawing: PictureOptions {
                width: args.drawing.width.into(),
                views: args.drawing.views.into(),
                limit: args.drawing.heat_limit,
                ..PictureOptions::default()
            },
            up: args.drawing.up.map(|up| match up {
                args::Up::Y => Up::Y,
                args::Up::Z => Up::Z,
            }),
            selector,
            threads: args.device.threads.into(),
            json: args.writing.json,
            verbosity: match (args.writing.quiet, args.writing.verbose) {
                (true, _) => Verbosity::Quiet,
                (_, true) => Verbosity::Verbose,
                _ => Verbosity::Normal,
            },
        })
    }
}

/// Refuses a heat map whose format drops the colors.
fn carries_colors(path: &Path) -> anyhow::Result<()> {
    let (format, _) = Format::from_path(path)?;
    if format.traits().colors.is_empty() {
        let message = format!("{} carries no colors: write the heat map as PLY, OBJ, OFF, glTF or GLB", format.name());
        return Err(refuse(Exit::Unsupported, message));
    }
    Ok(())
}

/// Runs the job.
///
/// # Errors
/// An input that cannot be read or compared, an output that cannot be written.
pub fn run(job: &Job) -> anyhow::Result<Exit> {
    interrupt::listen();
    let clock = Instant::now();
    let device = Device::open(&job.selector, job.threads)?;
    for note in device.notes() {
        console::note(job.verbosity, note);
    }
    let mut seconds = Seconds::default();
    let read = || device.install(|| anyhow::Ok((Input::read(&job.a, job)?, Input::read(&job.b, job)?)));
    let (a, b) = timed(&mut seconds.read, read)?;
    for warning in a.looks.warnings.iter().chain(&b.looks.warnings) {
        console::warning(job.verbosity, warning);
    }
    let names = format!("{} and {}", job.a, job.b);
    let comparison = timed(&mut seconds.measure, || {
        let [a, b] = [a.measured_beside(&b), b.measured_beside(&a)];
        metrics::compare(&a, &b, &job.options, &device)
    })
    .map_err(|error| at(names.as_ref(), error))?;
    let images = timed(&mut seconds.draw, || draw(job, &a, &b, &device))?;
    seconds.total = clock.elapsed().as_secs_f64();
    let record = Record::new(job, &device, comparison, images, seconds);
    if job.json {
        console::print_json(&record)?;
    } else {
        console::print(table::table(&record, job.verbosity == Verbosity::Verbose).as_bytes())?;
    }
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}

/// An input and how its materials look.
struct Input {
    scene: Scene,
    looks: Looks,
}

impl Input {
    /// Reads an input; what its materials look like only where somebody looks.
    fn read(source: &Source, job: &Job) -> anyhow::Result<Self> {
        let (scene, untold) = source.read_scene()?.with_instances();
        let folder = source.path().and_then(Path::parent);
        let are_seen = job.images || job.picture.is_some();
        let mut looks = if are_seen { formats::looks(&scene, folder) } else { Looks::default() };
        looks.warnings.extend(scene.warnings.iter().cloned().chain(untold));
        looks.warnings.iter_mut().for_each(|warning| *warning = format!("'{source}': {warning}"));
        Ok(Self { scene, looks })
    }

    /// The mesh with its materials, primitives and groups of one together; with its textures up the picture, where the
    /// other's are up and a glTF's own are not.
    fn measured_beside(&self, other: &Self) -> Cow<'_, Mesh> {
        let materials = self.scene.materials();
        let is_turned = self.is_gltf() && !other.is_gltf();
        if !is_turned && materials == self.mesh().materials {
            return Cow::Borrowed(self.mesh());
        }
        let scene = self.scene.clone();
        Cow::Owned(Mesh { materials, ..if is_turned { scene.into_mesh() } else { scene.mesh } })
    }

    fn is_gltf(&self) -> bool {
        matches!(self.scene.document, Document::Gltf(_))
    }

    fn mesh(&self) -> &Mesh {
        &self.scene.mesh
    }

    fn model(&self) -> Model<'_> {
        Model { mesh: self.mesh(), looks: &self.looks.of_material }
    }
}

/// Writes heat map and picture and compares images, if they are asked for.
fn draw(job: &Job, a: &Input, b: &Input, device: &Device) -> anyhow::Result<Option<ImageDifference>> {
    if job.heatmap.is_some() || job.picture.is_some() {
        let distances = metrics::vertex_distances(a.mesh(), b.mesh(), device)?;
        device.install(|| {
            if let Some(path) = &job.heatmap {
                let map = report::heatmap(a.mesh(), &distances, job.drawing.limit)?;
                interrupt::shielded(|| formats::write(&map, path, &WriteOptions::default()))?;
            }
            if let Some(path) = &job.picture {
                let up = job.up.unwrap_or(if a.is_gltf() { Up::Y } else { Up::Z });
                let png = report::picture(a.model(), b.model(), &distances, &PictureOptions { up, ..job.drawing })?;
                interrupt::shielded(|| formats::write_file(path, &png))?;
            }
            anyhow::Ok(())
        })?;
    }
    let compared = job.images.then(|| device.install(|| report::image_difference(a.model(), b.model())));
    Ok(compared.transpose()?)
}

fn timed<R>(seconds: &mut f64, work: impl FnOnce() -> R) -> R {
    let clock = Instant::now();
    let result = work();
    *seconds = clock.elapsed().as_secs_f64();
    result
}
