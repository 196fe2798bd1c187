//! What a chain came to: for people, for programs, and for engines.

use std::fmt;
use std::path::{Component, Path, PathBuf};

use coarsen::batch::Deviation;
use coarsen::metrics::Deviation as Measurement;
use coarsen::{Device, Mesh, Outcome, StopReason};
use serde::Serialize;

use super::job::{Job, Outputs, Screen};
use super::write::Ranges;
use crate::cli::memory;
use crate::cli::record::{Clocks, Seconds, blocked_by, driver, name, percent, words_of};

/// A chain, as `--json` prints it. Fields are only ever added under this `schema`.
#[derive(Debug, Serialize)]
pub struct Record {
    schema: u32,
    version: &'static str,
    input: String,
    method: &'static str,
    /// What a contraction costs; null with another method.
    metric: Option<&'static str>,
    device: String,
    driver: Option<String>,
    faces_in: usize,
    vertices_in: usize,
    screen: Told,
    pub levels: Vec<Level>,
    /// Milliseconds from mesh in memory to meshes in memory.
    simplify_ms: f64,
    seconds: Seconds,
    /// Bytes resident at most; null where the system does not tell.
    peak_memory: Option<u64>,
    pub warnings: Vec<String>,
    #[serde(skip)]
    tells_distances: bool,
}

/// A level.
#[derive(Debug, Clone, Serialize)]
pub struct Level {
    /// From 1, the finest.
    pub level: usize,
    output: String,
    pub faces: usize,
    vertices: usize,
    /// The face count asked for; null with only error limits.
    target: Option<usize>,
    pub reached: bool,
    stop_reason: StopReason,
    error: Deviation,
    /// From which on the error covers at most the pixels of the screen.
    switch_distance: f64,
    /// Rounds from the input on.
    rounds: usize,
    flips: usize,
    /// Where its indices are, of levels that share their vertices in a file of indices.
    indices: Option<Range>,
    #[serde(skip)]
    reasons: String,
}

/// A part of a file of indices, in indices.
#[derive(Debug, Clone, Copy, Serialize)]
struct Range {
    first: usize,
    count: usize,
}

/// The picture that distances are for.
#[derive(Debug, Clone, Copy, Serialize)]
struct Told {
    pixels: f64,
    height: f64,
    fov_degrees: f64,
    /// Which error distances are for: "measured" the greatest distance measured, or "estimate".
    error: &'static str,
}

impl Record {
    /// The record of a chain that is done; `measured` as many as levels, or none.
    pub fn new(
        job: &Job,
        input: &Mesh,
        outcomes: &[Outcome],
        (ranges, measured): (&Ranges, &[Measurement]),
        device: &Device,
        clocks: &Clocks,
    ) -> Self {
        let (method, metric) = words_of(&job.setup.method);
        let level = |(number, outcome): (usize, &Outcome)| {
            let budget = &job.budgets[number];
            let error = Deviation::new(outcome.error_estimate, input.diagonal(), measured.get(number));
            let off = error.measured.as_ref().map_or(error.estimate, |measured| measured.max);
            Level {
                level: number + 1,
                output: job.outputs.of_level(number).display().to_string(),
                faces: outcome.mesh.faces.len(),
                vertices: outcome.mesh.positions.len(),
                target: budget.counts_faces().then_some(outcome.target),
                reached: budget.is_reached(outcome.stop),
                stop_reason: outcome.stop,
                switch_distance: job.screen.distance_for(off),
                error,
                rounds: outcome.rounds.len(),
                flips: outcome.flips,
                indices: ranges.get(number).map(|&[first, count]| Range { first, count }),
                reasons: blocked_by(&outcome.blocked),
            }
        };
        let worked = outcomes.last().map(|outcome| outcome.device.clone()).unwrap_or_default();
        let mut warnings: Vec<String> = Vec::new();
        for warning in outcomes.iter().flat_map(|outcome| &outcome.warnings) {
            if !warnings.contains(warning) {
                warnings.push(warning.clone());
            }
        }
        Self {
            schema: 1,
            version: env!("CARGO_PKG_VERSION"),
            input: job.setup.source.to_string(),
            method,
            metric,
            driver: driver(device, &worked),
            device: worked,
            faces_in: input.faces.len(),
            vertices_in: input.positions.len(),
            screen: Told::new(&job.screen, !measured.is_empty()),
            levels: outcomes.iter().enumerate().map(level).collect(),
            simplify_ms: clocks.solve * 1e3,
            seconds: Seconds::new(&super::phases(&job.setup.method, outcomes), clocks),
            peak_memory: memory::peak(),
            warnings,
            tells_distances: job.screen.is_asked,
        }
    }

    /// What was missed, for `--require-target`; nothing where all levels are where they were to go.
    pub fn shortfall(&self) -> Option<String> {
        let level = self.levels.iter().find(|level| !level.reached)?;
        let (number, faces, stop, reasons) = (level.level, level.faces, name(level.stop_reason), &level.reasons);
        let asked = level.target.map(|target| format!(" of {target} asked for")).unwrap_or_default();
        Some(format!("level {number} is not reached: {faces} faces are left{asked} (stop={stop}{reasons})"))
    }

    /// The bytes of the manifest of a chain of `input`, which lies at `path`; its bounds are of what is `shown` of it.
    ///
    /// # Errors
    /// None that numbers and texts can cause.
    pub fn manifest(&self, [input, shown]: [&Mesh; 2], outputs: &Outputs, path: &Path) -> serde_json::Result<Vec<u8>> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let beside = |file: &Path| from_folder(file, folder).display().to_string();
        let (low, high) = shown.bounds();
        let center = (low + high) / 2.0;
        let radius = shown.positions.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        let level = |level: &Level| Entry {
            level: level.level,
            file: beside(outputs.of_level(level.level - 1)),
            faces: level.faces,
            vertices: level.vertices,
            error: level.error,
            switch_distance: level.switch_distance,
            indices: level.indices,
        };
        let manifest = Manifest {
            schema: 1,
            version: self.version,
            input: &self.input,
            faces: self.faces_in,
            vertices: self.vertices_in,
            bounds: [low.to_array(), high.to_array()],
            sphere: Sphere { center: center.to_array(), radius },
            diagonal: input.diagonal(),
            screen: self.screen,
            indices: match outputs {
                Outputs::Shared { indices, .. } => indices.as_deref().map(beside),
                Outputs::Each(_) => None,
            },
            levels: self.levels.iter().map(level).collect(),
        };
        let mut bytes = serde_json::to_vec_pretty(&manifest)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

/// The way to a file from a folder.
fn from_folder(file: &Path, folder: &Path) -> PathBuf {
    let absolute = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
    };
    let (file, folder) = (absolute(file), absolute(folder));
    let common = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

impl Told {
    fn new(screen: &Screen, is_measured: bool) -> Self {
        let [height, fov_degrees] = screen.height_and_fov();
        // As written: an angle went through radians.
        let fov_degrees = (fov_degrees * 1e9).round() / 1e9;
        Self { pixels: screen.pixels, height, fov_degrees, error: if is_measured { "measured" } else { "estimate" } }
    }
}

/// What an engine needs to know. Fields are only ever added under this `schema`; names of files are from its folder.
#[derive(Debug, Serialize)]
struct Manifest<'a> {
    schema: u32,
    version: &'static str,
    input: &'a str,
    faces: usize,
    vertices: usize,
    /// The least and the greatest corner of the box of what the input shows.
    bounds: [[f64; 3]; 2],
    sphere: Sphere,
    diagonal: f64,
    screen: Told,
    /// The file of the indices of all levels, where there is one.
    indices: Option<String>,
    levels: Vec<Entry>,
}

/// A sphere around the input, about the middle of its box.
#[derive(Debug, Serialize)]
struct Sphere {
    center: [f64; 3],
    radius: f64,
}

#[derive(Debug, Serialize)]
struct Entry {
    level: usize,
    file: String,
    faces: usize,
    /// With shared vertices the first so many.
    vertices: usize,
    error: Deviation,
    switch_distance: f64,
    indices: Option<Range>,
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for level in &self.levels {
            write!(
                f,
                "level {}: {} faces, stop={}{}, estimated error {} of the diagonal",
                level.level,
                level.faces,
                name(level.stop_reason),
                if level.reached { "" } else { &level.reasons },
                percent(level.error.estimate_relative),
            )?;
            if let Some(measured) = &level.error.measured {
                let [max, rms] = [measured.max_relative, measured.rms_relative];
                write!(f, ", measured {:.4}%, root mean square {:.4}%", max * 100.0, rms * 100.0)?;
            }
            if self.tells_distances {
                write!(f, ", from a distance of {:.4}", level.switch_distance)?;
            }
            writeln!(f, ", '{}'", level.output)?;
        }
        let Seconds { read, write, measure, .. } = self.seconds;
        write!(
            f,
            "{} faces → {} levels, read {read:.2} solve {:.2} write {write:.2} s, {}",
            self.faces_in,
            self.levels.len(),
            self.simplify_ms / 1e3,
            self.device
        )?;
        let is_measured = self.levels.iter().any(|level| level.error.measured.is_some());
        if is_measured { write!(f, ", measured in {measure:.2} s") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_from_the_manifest_s_folder() {
        let way = |file: &str, folder: &str| from_folder(Path::new(file), Path::new(folder)).display().to_string();
        assert_eq!(way("lods/x-1.ply", "lods"), "x-1.ply");
        assert_eq!(way("lods/x-1.ply", ""), "lods/x-1.ply");
        assert_eq!(way("lods/x-1.ply", "meta/deep"), "../../lods/x-1.ply");
        assert_eq!(way("x-1.ply", "meta"), "../x-1.ply");
    }
}
