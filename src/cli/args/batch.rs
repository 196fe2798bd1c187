//! What may be written after `coarsen batch`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use coarsen::batch::Shard;

use super::{Device, How, Measuring, Progress};
use crate::cli::values;

/// Reduce many meshes in one run
///
/// Reduces every mesh that is named to one level or several, and writes them into a folder. A file that fails stops no other
/// and is told at the end; a run that is killed goes on with --resume. What is written is the same, byte for byte, in any
/// order, with any number of threads, on every device, and by any shards.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = EXAMPLES,
    after_long_help = NOTES,
    mut_arg("measure", |arg| arg.long_help(format!("Measure the result against the input\n\n{MEASURE_SENTENCES}"))),
    mut_arg("memory_limit", |arg| arg.help(MEMORY_HELP).long_help(format!("{MEMORY_HELP}\n\n{MEMORY_SENTENCES}")))
)]
pub struct Batch {
    /// Meshes to read: files, folders, globs
    ///
    /// A file; a folder, searched with all its folders; a glob such as 'scans/**/*.ply', in quotes if the shell is not to
    /// see it; or sample:NAME[@FACES]. Of folders and globs the files whose extension names a format: OBJ, PLY, STL, OFF,
    /// glTF or GLB, each also with .gz or .zst.
    #[arg(value_name = "INPUTS", required_unless_present = "manifest")]
    pub inputs: Vec<String>,

    #[command(flatten)]
    pub files: Files,
    #[command(flatten)]
    pub each: Each,
    #[command(flatten)]
    pub device: Device,
    #[command(flatten)]
    pub telling: Telling,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Files")]
pub struct Files {
    /// Folder to write into
    ///
    /// Where the levels go, and their records: DIR/coarsen.jsonl has a line of JSON for every level of every file, written
    /// as it is done. The folder is made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    pub dir: PathBuf,

    /// Inputs and their options, a line each
    ///
    /// A file with a JSON object a line: "input", a file named from the folder of the manifest or a sample, and any of the
    /// options that go for each file, such as "ratios": ["50%", "10%"] or "lock-border": true, which come before those of
    /// the command line; false takes one of these off.
    #[arg(long, value_name = "FILE")]
    pub manifest: Option<PathBuf>,

    /// Go on with a run that was ended
    ///
    /// Skips what is done: where input, output, what lies beside them, options and version are those of a record, by their
    /// hashes. Does the rest, and removes what a killed run left half written. Records of all shards in the folder count.
    #[arg(long)]
    pub resume: bool,

    /// Do a part of the files: 2/3
    ///
    /// Does the second of three parts, with records of its own in DIR/coarsen-2-of-3.jsonl. A file belongs to a part by a
    /// hash of its name below the folder that all inputs have in common, so that it stays there when others come or go.
    #[arg(long, value_name = "I/N", value_parser = values::shard)]
    pub shard: Option<Shard>,

    /// Start anew, replace what is there
    ///
    /// Forgets the records of an earlier run and replaces outputs that exist. Without it, and without --resume, both are
    /// refused before the work starts.
    #[arg(short = 'w', long, conflicts_with = "resume")]
    pub overwrite: bool,
}

/// What goes for each file, and may be said for each in a manifest.
#[derive(Debug, Args)]
pub struct Each {
    #[command(flatten)]
    pub levels: Levels,
    #[command(flatten)]
    pub how: How,
    #[command(flatten)]
    pub measuring: Measuring,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Levels")]
pub struct Levels {
    /// Fractions to keep: 50%,10%,1%
    ///
    /// A level for each of these fractions of the input's faces, all from one run.
    #[arg(short, long, visible_alias = "ratio", value_name = "LIST", value_delimiter = ',', value_parser = values::fraction)]
    pub ratios: Vec<f64>,

    /// Faces to keep: 100k,10k
    ///
    /// A level for each of these numbers of faces, instead of fractions.
    #[arg(short, long, value_name = "LIST", value_delimiter = ',', value_parser = values::count, conflicts_with = "ratios")]
    pub faces: Vec<usize>,

    /// Estimated deviation allowed, of the diagonal
    ///
    /// Stops every level before the estimated deviation passes this fraction of the bounding box's diagonal; alone it makes
    /// one level.
    #[arg(short, long, value_name = "R|P%", value_parser = values::fraction)]
    pub error: Option<f64>,

    /// Estimated deviation allowed, in model units
    ///
    /// The same limit as --error, as a length in the units of the model.
    #[arg(long, value_name = "D", value_parser = values::length)]
    pub error_abs: Option<f64>,

    /// Names: {dir}/{stem}-{level}.{ext}
    ///
    /// What the outputs are called, below DIR: {dir} is the folder of the input below the one that all inputs have in
    /// common, {stem} its name, {ext} its extension, {level} 1 for the finest, {ratio} in percent or {faces} what was asked
    /// for. Without the option '{dir}/{stem}-{level}.{ext}', and '{dir}/{stem}.{ext}' for one level. Two outputs of one
    /// name are refused before the work starts.
    #[arg(long, value_name = "PATTERN")]
    pub pattern: Option<String>,

    /// Write text where binary is the default
    ///
    /// Writes the text form of PLY and STL; OBJ, OFF and glTF are text anyway.
    #[arg(long)]
    pub ascii: bool,

    /// Seconds that a file may take: 600
    ///
    /// Fails a file that takes longer than this to be read and reduced, which is looked at after every round. Waiting for
    /// memory or other files does not count.
    #[arg(long, value_name = "S", value_parser = values::seconds)]
    pub timeout: Option<Duration>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Telling {
    /// Print one JSON object on standard output
    ///
    /// Prints what the run did as one JSON object on one line: how many files are done, skipped and failed, and why.
    #[arg(long)]
    pub json: bool,

    /// Print errors only
    ///
    /// Prints nothing but errors to standard error: no summary, no progress, no line for a file that fails.
    #[arg(short, long)]
    pub quiet: bool,

    /// Progress: auto, bar, json or never
    ///
    /// How to show progress on standard error: 'bar' draws a bar if that is a terminal; 'auto' does the same except where
    /// CI is set or --quiet is given; 'json' prints a JSON object on a line whenever a file starts or ends, and once a
    /// second between; 'never' shows nothing.
    #[arg(long, value_name = "HOW", value_enum, default_value_t = Progress::Auto, hide_possible_values = true)]
    pub progress: Progress,
}

const MEMORY_HELP: &str = "Stay within this memory: 8GiB";
const MEMORY_SENTENCES: &str = "\
Starts no file while those at work and it are estimated to need more than this together, and fails a file that needs more \
by itself. The estimate is 64 MiB and 288 bytes for every face of an input, 512 on an adapter, and 40 for every face of its \
levels but the coarsest. Without the option three \
quarters of what is free, and no file fails for it.";

const MEASURE_SENTENCES: &str = "\
Measures how far every level is from its input, from both sides, as `coarsen compare` does, and tells it as 'error.measured' in \
its record. With ten samples a face of the input that takes longer than the reduction. What --resume skips is not measured.";

const EXAMPLES: &str = "\
Examples:
  coarsen batch sample:part@20k sample:terrain@20k -d out --ratios 50%,10%
  coarsen batch scans -d out --ratios 50%,10%,1% --resume
  coarsen batch 'scans/*.stl' -d out --faces 10k --pattern {stem}-{faces}.ply
  coarsen batch --manifest jobs.jsonl -d out --ratios 10% --timeout 600
  coarsen batch scans -d out --ratios 10% --shard 2/3 --memory-limit 8GiB

All options in full sentences: coarsen batch --help";

const NOTES: &str = "\
Exit codes:
  0  all files are done            7    device missing
  2  usage                         8    folder or records not written
  4  manifest, records unreadable  9    some files failed
  5  unsupported extension         130  interrupted; --resume goes on

Examples:
  coarsen batch sample:part@20k sample:terrain@20k -d out --ratios 50%,10%
  coarsen batch scans -d out --ratios 50%,10%,1% --resume
  coarsen batch 'scans/*.stl' -d out --faces 10k --pattern {stem}-{faces}.ply
  coarsen batch --manifest jobs.jsonl -d out --ratios 10% --timeout 600
  coarsen batch scans -d out --ratios 10% --shard 2/3 --memory-limit 8GiB";
