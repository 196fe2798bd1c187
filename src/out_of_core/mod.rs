//! Meshes larger than memory: contraction in parts, from a file.
//!
//! A binary PLY is read in pieces and cut into parts along a space-filling curve. Each is reduced on its own to one error
//! limit, so that detail keeps the faces, while vertices at positions that several parts share stay where they are. The parts
//! are put together again by vertex, which leaves no crack, and reduced as a whole to what the budget says: in this last pass
//! the borders between parts are contracted too. Where they still do not fit the memory, they are cut again, elsewhere.
//!
//! What is done depends on the file, the options and the memory limit, and on no device or thread. The folder for scratch
//! files must have room for 12 bytes a face and what the passes leave. These files have no name: however the program ends, the
//! system frees them.
//!
//! # What is not as in memory
//! - The estimated deviation is the sum over the passes, each against the surface before it; the metric `plane` begins anew
//!   with the last pass.
//! - Weights of features, a fit, flips and pruning see the surface that parts leave, not the input.
//! - Texture coordinates and colors of faces are dropped. Joining by distance, given weights and locks, and a log are refused.

mod bridges;
mod cut;
mod limit;
mod marks;
mod memory;
mod part;
mod pass;
mod rows;
mod spill;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::backend::Device;
use crate::contract::{self, Texture, Weighting};
use crate::error::{Error, Result};
use crate::formats::{Scratch, Stream};
use crate::mesh::arrange::NO_FACE_LEFT;
use crate::mesh::{FACE_COLORS_DROPPED, Mesh};
use crate::polish::Flips;
use crate::simplify::{self, Budget, Method, OnProgress, Progress, StopReason};
use cut::Survey;
use memory::Room;
use pass::{Notes, Task};

pub use memory::{BYTES_ALWAYS, bytes_needed, estimate};
pub use pass::Pass;

/// Passes at most: each but the first only where parts of the one before still do not fit.
const MOST_PASSES: usize = 8;
/// Parts are reduced as if to this many faces where the target is lower.
const LEAST_TARGET: usize = 1000;
/// The share of an error limit that is the passes' before the last.
const SHARE_OF_ERROR: f64 = 0.25;
/// A pass that leaves more than this share of the faces will not get there.
const LEAST_GAIN: f64 = 0.95;

/// How to work in parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Bytes that the process may have resident at its peak.
    pub memory_limit: u64,
    /// Faces of a part at most, where that is fewer than the memory limit allows.
    pub part_faces: Option<usize>,
    /// The folder for scratch files.
    pub scratch: PathBuf,
}

impl Options {
    /// Parts as large as the limit allows, scratch files in the system's folder for temporary files.
    pub fn new(memory_limit: u64) -> Self {
        Self { memory_limit, part_faces: None, scratch: std::env::temp_dir() }
    }
}

/// A mesh file that can be read in pieces: binary PLY of triangles.
#[derive(Debug)]
pub struct Input(Stream);

impl Input {
    /// Opens the file at `path` and reads its header.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a file that cannot be read in pieces; [`Error::Read`] and [`Error::Format`] as
    /// [`crate::formats::read`].
    pub fn open(path: &Path) -> Result<Self> {
        Stream::open(path).map(Self)
    }

    /// Faces that the header promises.
    pub fn faces(&self) -> usize {
        self.0.face_count()
    }

    /// Vertices that the header promises.
    pub fn vertices(&self) -> usize {
        self.0.vertex_count()
    }
}

/// What a run in parts made.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Of the last pass, where counts and estimates speak of the input; `vertex_origin` is empty.
    pub outcome: simplify::Outcome,
    /// The diagonal of the input's bounding box, in model units.
    pub diagonal: f64,
    /// What the passes before the last did.
    pub passes: Vec<Pass>,
}

/// Whether `method` can work in parts.
///
/// # Errors
/// [`Error::Unsupported`] with what cannot.
pub fn check(method: &Method) -> Result<()> {
    options_of(method).map(drop)
}

fn options_of(method: &Method) -> Result<&contract::Options> {
    let Method::Contract(options) = method else {
        return Err(Error::Unsupported("only contraction works in parts".into()));
    };
    let refused = [
        (options.weld.is_some_and(|distance| distance > 0.0), "joining vertices by distance"),
        (options.join_within > 0.0, "joining parts by distance"),
        (matches!(options.weighting, Weighting::Given(_)), "weights that are given"),
        (options.locked.is_some(), "locks that are given"),
        (options.texture == Texture::Keep, "keeping texture coordinates"),
        (options.log, "a log"),
    ];
    match refused.into_iter().find(|(is_given, _)| *is_given) {
        Some((_, what)) => Err(Error::Unsupported(format!("{what} needs the whole mesh in memory"))),
        None => Ok(options),
    }
}

/// Simplifies the mesh of `input` in parts that fit `options.memory_limit`.
///
/// The result depends on the limit, and not on the device or its thread count.
///
/// # Errors
/// Those of [`crate::simplify()`] and of reading; [`Error::Unsupported`] for a method that does not work in parts, or a face
/// that is no triangle; [`Error::Limit`] for a memory limit that is too low, with the least that would do;
/// [`Error::Write`] where scratch files cannot be written.
pub fn simplify(
    input: &Input,
    method: &Method,
    budget: &Budget,
    options: &Options,
    device: &Device,
    mut progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    let of_method = options_of(method)?;
    let mut report = |step: Progress| progress.as_mut().map_or(ControlFlow::Continue(()), |report| report(step));
    device.install(|| run(&input.0, of_method, budget, options, device, &mut report))
}

fn run(
    input: &Stream,
    method: &contract::Options,
    budget: &Budget,
    options: &Options,
    device: &Device,
    report: &mut OnProgress<'_>,
) -> Result<Outcome> {
    let clock = Instant::now();
    let (faces_in, target) = (input.face_count(), budget.target_faces(input.face_count())?);
    let counts = budget.counts_faces();
    if faces_in == 0 {
        return Err(Error::Mesh("it has no faces".into()));
    }
    if input.vertex_count() > u32::MAX as usize / 2 {
        return Err(Error::Limit(format!("{} vertices are more than 32-bit indices can hold", input.vertex_count())));
    }
    let room = Room::new(options.memory_limit, input.vertex_count(), target)?;
    let most_faces = options.part_faces.unwrap_or(usize::MAX).clamp(1, room.part_faces);
    let mut survey = Survey::new(input)?;
    let (low, high) = survey.bounds;
    let diagonal = Mesh::new(vec![low, high], Vec::new()).diagonal();
    let max_deviation = budget.max_deviation(diagonal)?;
    let in_parts = contract::Options { fit: 0, flips: Flips::default(), prune: 0.0, ..method.clone() };

    let mut notes = Notes::default();
    let [texcoords, face_colors, channels] = input.leaves_out();
    if texcoords {
        notes.add("texture coordinates are dropped: they are not carried through parts".into());
    }
    if face_colors {
        notes.add(FACE_COLORS_DROPPED.into());
    }
    if channels {
        notes.add("further properties of vertices are dropped: they are not carried through parts".into());
    }
    let mut passes: Vec<Pass> = Vec::new();
    let mut left: Option<Stream> = None;
    let mut report = |step: Progress| report(Progress { faces_in, target, ..step });
    loop {
        let stream = left.as_ref().unwrap_or(input);
        let spent = passes.iter().map(|pass| pass.error_estimate).sum::<f64>();
        let task = Task {
            options: &in_parts,
            number: passes.len(),
            most_faces,
            aim: if counts { room.aim(stream.face_count(), target.max(LEAST_TARGET)) } else { 0 },
            greatest_limit: (max_deviation * SHARE_OF_ERROR - spent).max(0.0),
            scratch: Scratch(&options.scratch),
            device,
        };
        let Some((next, pass)) = pass::run(stream, &survey, &task, &mut notes, &mut report)? else {
            return Ok(cancelled(faces_in, target, diagonal, device));
        };
        passes.push(pass);
        if next.face_count() <= room.whole_faces {
            left = Some(next);
            break;
        }
        if passes.len() == MOST_PASSES || pass.faces_out as f64 > LEAST_GAIN * pass.faces_in as f64 {
            let (faces, need) = (pass.faces_out, estimate(pass.faces_out, true));
            return Err(Error::Limit(format!(
                "parts leave {faces} faces, which need {need} bytes together: give a higher memory limit or a coarser target"
            )));
        }
        survey = Survey::new(&next)?;
        left = Some(next);
    }
    drop(survey);

    let rest = left.as_ref().unwrap_or(input);
    let whole = whole(rest)?;
    drop(left);
    let spent = passes.iter().map(|pass| pass.error_estimate).sum::<f64>();
    let last = Budget {
        faces: counts.then_some(target),
        error_abs: max_deviation.is_finite().then(|| (max_deviation - spent).max(0.0)),
        ..Budget::default()
    };
    let method = Method::Contract(method.clone());
    let mut outcome = simplify::simplify(&whole, &method, &last, device, Some(&mut report))?;
    outcome.warnings.drain(..).for_each(|warning| notes.add(warning));
    Ok(Outcome {
        outcome: simplify::Outcome {
            faces_in,
            target,
            vertex_origin: Vec::new(),
            error_estimate: outcome.error_estimate + spent,
            seconds: simplify::Phases { total: clock.elapsed().as_secs_f64(), ..outcome.seconds },
            warnings: notes.into_texts().collect(),
            ..outcome
        },
        diagonal,
        passes,
    })
}

/// The mesh that passes left.
fn whole(stream: &Stream) -> Result<Mesh> {
    let mut mesh = stream.no_mesh();
    let mut room = Vec::new();
    let mut vertices = Vec::new();
    rows::each_chunk(stream.vertex_count(), |rows| {
        vertices.clear();
        vertices.extend(rows.start as u32..rows.end as u32);
        stream.append_vertices(&vertices, &mut room, &mut mesh)
    })?;
    let mut faces = Vec::new();
    rows::each_chunk(stream.face_count(), |rows| {
        stream.faces(rows, &mut room, &mut faces)?;
        mesh.faces.extend_from_slice(&faces);
        Ok(())
    })?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh(NO_FACE_LEFT.into()));
    }
    Ok(mesh)
}

/// What is told of a run that was stopped: nothing of its mesh.
fn cancelled(faces_in: usize, target: usize, diagonal: f64, device: &Device) -> Outcome {
    let outcome = simplify::Outcome {
        mesh: Mesh::default(),
        vertex_origin: Vec::new(),
        faces_in,
        target,
        stop: StopReason::Cancelled,
        blocked: simplify::Blocked::default(),
        error_estimate: 0.0,
        cell_size: None,
        quadrics: None,
        flips: 0,
        log: None,
        regions: None,
        rounds: Vec::new(),
        seconds: simplify::Phases::default(),
        bytes_moved: 0,
        device: device.description(),
        warnings: Vec::new(),
    };
    Outcome { outcome, diagonal, passes: Vec::new() }
}
