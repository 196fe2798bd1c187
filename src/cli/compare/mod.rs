//! `coarsen compare`: measure, draw, tell.

mod record;
mod table;

use std::path::PathBuf;
use std::time::Instant;

use coarsen::backend::Selector;
use coarsen::formats::{self, Format, WriteOptions};
use coarsen::metrics::{self, Options, View};
use coarsen::report::{self, PictureOptions, Up};
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
    heatmap: Option<PathBuf>,
    picture: Option<PathBuf>,
    drawing: PictureOptions,
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
            heatmap,
            picture,
            drawing: PictureOptions {
                width: args.drawing.width.into(),
                views: args.drawing.views.into(),
                up: match args.drawing.up {
                    args::Up::Y => Up::Y,
                    args::Up::Z => Up::Z,
                },
                limit: args.drawing.heat_limit,
            },
            selector,
            threads: args.device.threads.into(),
            json: args.writing.json,
            verbosity: if args.writing.quiet { Verbosity::Quiet } else { Verbosity::Normal },
        })
    }
}

/// Refuses a heat map whose format drops the colors.
fn carries_colors(path: &std::path::Path) -> anyhow::Result<()> {
    let (format, _) = Format::from_path(path)?;
    if format.traits().colors.is_empty() {
        let message = format!("{} carries no colors: write the heat map as PLY, OBJ or OFF", format.name());
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
    let (a, b) = timed(&mut seconds.read, || device.install(|| anyhow::Ok((job.a.read()?, job.b.read()?))))?;
    let names = format!("{} and {}", job.a, job.b);
    let comparison = timed(&mut seconds.measure, || metrics::compare(&a, &b, &job.options, &device))
        .map_err(|error| at(names.as_ref(), error))?;
    timed(&mut seconds.draw, || draw(job, &a, &b, &device))?;
    seconds.total = clock.elapsed().as_secs_f64();
    let record = Record::new(job, &device, comparison, seconds);
    if job.json {
        console::print_json(&record)?;
    } else {
        console::print(table::table(&record).as_bytes())?;
    }
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}

/// Writes heat map and picture, if they are asked for.
fn draw(job: &Job, a: &Mesh, b: &Mesh, device: &Device) -> anyhow::Result<()> {
    if job.heatmap.is_none() && job.picture.is_none() {
        return Ok(());
    }
    let distances = metrics::vertex_distances(a, b, device)?;
    device.install(|| {
        if let Some(path) = &job.heatmap {
            let map = report::heatmap(a, &distances, job.drawing.limit)?;
            interrupt::shielded(|| formats::write(&map, path, &WriteOptions::default()))?;
        }
        if let Some(path) = &job.picture {
            let png = report::picture(a, b, &distances, &job.drawing)?;
            interrupt::shielded(|| formats::write_file(path, &png))?;
        }
        Ok(())
    })
}

fn timed<R>(seconds: &mut f64, work: impl FnOnce() -> R) -> R {
    let clock = Instant::now();
    let result = work();
    *seconds = clock.elapsed().as_secs_f64();
    result
}
