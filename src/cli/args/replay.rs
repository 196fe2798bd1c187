//! What may be written after `coarsen replay`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::values;

/// Reduce a mesh again by the log of an earlier run
///
/// Follows the contractions that `coarsen simplify --write-log` wrote, from the same mesh to any number of faces down to
/// that run's own, without computing any of them again: one run gives every level of detail.
#[derive(Debug, Args)]
// A negative number reaches the option's own parser, which says what is wanted.
#[command(allow_negative_numbers = true, after_help = EXAMPLES)]
pub struct Replay {
    /// Mesh that the log is of: a file, '-', or sample:NAME[@FACES]
    ///
    /// As in `coarsen simplify`. It must have the positions and faces that it had there.
    #[arg(value_name = "IN")]
    pub input: String,

    /// Log to follow
    ///
    /// A file that `coarsen simplify --write-log` wrote.
    #[arg(value_name = "LOG")]
    pub log: PathBuf,

    /// Mesh to write: a file, or '-'
    ///
    /// As in `coarsen simplify`.
    #[arg(value_name = "OUT")]
    pub output: String,

    #[command(flatten)]
    pub target: Target,
    #[command(flatten)]
    pub writing: Writing,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Target (at least one; the first reached ends the replay)")]
pub struct Target {
    /// Faces to keep: 20000, 20k, 1.5M
    ///
    /// Stops at the first state with at most this many faces. A number that the log does not reach is refused.
    #[arg(short, long, alias = "triangles", value_name = "N", value_parser = values::count)]
    pub faces: Option<usize>,

    /// Fraction of the faces to keep: 0.1 or 10%
    ///
    /// Stops when at most this fraction of the input's faces is left.
    #[arg(short, long, value_name = "R|P%", value_parser = values::fraction)]
    pub ratio: Option<f64>,

    /// Fraction of the faces to remove: 0.9 or 90%
    ///
    /// Stops when at least this fraction of the input's faces is gone.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub reduction: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Writing {
    /// Replace the output if it exists
    ///
    /// Replaces a file that is already there, in one step when the new one is complete. Without it an existing file is
    /// refused before the work starts.
    #[arg(short = 'w', long)]
    pub overwrite: bool,

    /// Write text where binary is the default
    ///
    /// Writes the text form of PLY and STL; OBJ, OFF and glTF are text anyway.
    #[arg(long)]
    pub ascii: bool,

    /// Format of '-': obj, ply, stl, off, gltf or glb
    ///
    /// The format of standard input and output, needed where IN or OUT is '-'.
    #[arg(long, value_name = "EXT")]
    pub format: Option<String>,

    /// Print one JSON object on standard output
    ///
    /// Prints what was done as one JSON object on one line to standard output. Its fields are stable under "schema": 1.
    #[arg(long)]
    pub json: bool,

    /// Print errors only
    ///
    /// Prints nothing but errors to standard error: no summary.
    #[arg(short, long)]
    pub quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  coarsen simplify sample:part low.ply --ratio 5% --write-log part.clog
  coarsen replay sample:part part.clog mid.ply --ratio 20%
  coarsen replay sample:part part.clog - --format ply --ratio 50% > high.ply";
