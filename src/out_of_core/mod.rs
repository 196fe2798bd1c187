//! Meshes larger than memory: contraction in parts, from a file.
//!
//! A binary PLY or STL is read in pieces and cut into parts along a space-filling curve. Each is reduced on its own to one error
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
mod run;
mod spill;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::backend::Device;
use crate::contract::{self, Weighting};
use crate::error::{Error, Result};
use crate::formats::Stream;
use crate::simplify::{self, Budget, Method, OnProgress, Progress};

pub use memory::{BYTES_ALWAYS, bytes_needed, bytes_of_levels, estimate};
pub use pass::Pass;

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

/// A mesh file that can be read in pieces: a binary PLY of triangles, or a binary STL.
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
        (options.locked.is_some() || options.lock.is_some(), "locks that are given"),
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
    device.install(|| run::run(&input.0, of_method, budget, options, device, &mut report))
}
