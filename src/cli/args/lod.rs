//! What may be written after `coarsen lod`.

use std::path::PathBuf;

use clap::Args;

use super::{Device, FeatureFile, How, Writing};
use crate::cli::values;

/// Write a chain of levels of detail from one run
///
/// Reduces a mesh to several levels in one run, each a beginning of the next coarser one's contractions, and writes them all,
/// for little more than the coarsest costs alone, by errors for two to three times as much. A level is as near as a run of its
/// own, though not the same bytes. Methods that do not contract run once a level. Level 1 is the finest; the input itself is
/// none, unless 100% asks for it.
#[derive(Debug, Args)]
// A negative number reaches the option's own parser, which says what is wanted.
#[command(
    allow_negative_numbers = true,
    after_help = EXAMPLES,
    mut_arg("memory_limit", |arg| arg.help(MEMORY_HELP).long_help(format!("{MEMORY_HELP}\n\n{MEMORY_SENTENCES}")))
)]
pub struct Lod {
    /// Mesh to read: a file, '-', or sample:NAME[@FACES]
    ///
    /// As in `coarsen simplify`.
    #[arg(value_name = "IN")]
    pub input: String,

    /// Files to write: out-{level}.ply
    ///
    /// The name of each level's file, in which {level} stands for 1, 2, 3, …, {dir} for the folder of the input,
    /// {stem} for its name and {ext} for its extension, {ratio} for the ratio asked for in percent and {faces} for the number of faces asked for. Two levels of
    /// one name are refused before the work starts. The extension names the format. With --shared-vertices one file.
    #[arg(value_name = "OUT_PATTERN")]
    pub pattern: String,

    #[command(flatten)]
    pub levels: Levels,
    #[command(flatten)]
    pub screen: Screen,
    #[command(flatten)]
    pub how: How,
    #[command(flatten)]
    pub feature_file: FeatureFile,
    #[command(flatten)]
    pub device: Device,
    #[command(flatten)]
    pub writing: Writing,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Levels (one list, from fine to coarse)")]
pub struct Levels {
    /// Fractions of the faces to keep: 50%,10%,1%
    ///
    /// Makes a level of each of these fractions of the input's faces, from fine to coarse.
    #[arg(short, long, value_name = "R,R", value_delimiter = ',', value_parser = values::fraction)]
    pub ratios: Vec<f64>,

    /// Numbers of faces to keep: 100k,10k,1k
    ///
    /// Makes a level of each of these numbers of faces, from fine to coarse.
    #[arg(short, long, alias = "triangles", value_name = "N,N", value_delimiter = ',', value_parser = values::count)]
    pub faces: Vec<usize>,

    /// Estimated deviations, of the diagonal
    ///
    /// Makes a level as far as each of these estimated deviations allows, in fractions of the bounding box's diagonal such as
    /// 0.01%,0.1%, from fine to coarse.
    #[arg(short, long, value_name = "R,R", value_delimiter = ',', value_parser = values::fraction)]
    pub errors: Vec<f64>,

    /// The same in model units: 0.1,1,5
    ///
    /// The same limits as --errors, as lengths in the units of the model.
    #[arg(long, value_name = "D,D", value_delimiter = ',', value_parser = values::length)]
    pub errors_abs: Vec<f64>,

    /// As many levels, each of half the faces: 4
    ///
    /// Makes so many levels, each of which keeps --ratio-step of the faces of the one before: 50%, 25%, 12.5% and so on.
    /// Without any list of levels that is 4.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=64))]
    pub levels: Option<u16>,

    /// What each level keeps of the one before
    ///
    /// The fraction of the faces of one level that the next one of --levels keeps. Without the option 50%.
    #[arg(long, value_name = "R|P%", value_parser = values::step)]
    pub ratio_step: Option<f64>,

    /// Exit with 3 if a level is not reached
    ///
    /// Exits with code 3 when a level ends above its face count or, by errors, before its limit. All levels are written all
    /// the same.
    #[arg(long)]
    pub require_target: bool,

    /// One list of vertices for all levels
    ///
    /// Places vertices at ends, as --placement endpoint does, and lists them once, so that each coarser level uses the first
    /// ones. An OBJ then holds all levels as objects lod1, lod2, …; PLY and OFF hold the vertices and the finest level, and
    /// the indices of all levels lie one after another beside it in a file of the extension .idx, as 32-bit numbers, least
    /// byte first; where each begins is in the --manifest, which these formats need.
    #[arg(long)]
    pub shared_vertices: bool,

    /// Write what an engine needs to know: JSON
    ///
    /// Writes this JSON file last, when all others are complete: for every level the file, faces, vertices, errors and the
    /// distance from which on it will do (see --screen-error); for the mesh its box, a sphere around it, its diagonal. It says
    /// the same on every device.
    #[arg(long, value_name = "FILE")]
    pub manifest: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Screen")]
pub struct Screen {
    /// Pixels that a level may be off
    ///
    /// For each level, tells the distance from the eye to the mesh from which on its error covers at most this many pixels:
    /// the greatest distance measured with --measure, the estimate without. 1 without the option.
    #[arg(long, value_name = "P", value_parser = values::positive)]
    pub screen_error: Option<f64>,

    /// Levels for these distances: 10,50,200
    ///
    /// Makes a level for each of these distances from the eye to the mesh, in model units, from near to far: as coarse as an
    /// estimated error of --screen-error pixels allows.
    #[arg(long, value_name = "D,D", value_delimiter = ',', value_parser = values::positive)]
    pub distances: Vec<f64>,

    /// Height of the picture in pixels
    ///
    /// How many pixels high the picture is that --screen-error and --distances are for.
    #[arg(long, value_name = "PIXELS", default_value = "1080", value_parser = values::positive)]
    pub screen_height: f64,

    /// Angle of view in degrees
    ///
    /// The angle from the lower to the upper edge of that picture.
    #[arg(long, value_name = "DEG", default_value = "60", value_parser = values::fov)]
    pub fov: f64,
}

const MEMORY_HELP: &str = "Refuse jobs that need more memory: 8GiB";
const MEMORY_SENTENCES: &str = "\
Refuses the job with code 6, once the input is read, when it is estimated to need more memory than this: 64 MiB and 288 bytes for \
every face of the input, and 40 for every face of the levels but the coarsest. On an adapter 512 bytes are needed for every face; where these are too many, the CPU does the work. Levels \
are not made in parts.";

const EXAMPLES: &str = "\
Examples:
  coarsen lod sample:statue statue-{level}.ply --ratios 50%,10%,1%
  coarsen lod sample:part {stem}-{ratio}.obj --levels 3 --manifest part.json
  coarsen lod sample:part lod.obj --ratios 50%,5% --shared-vertices
  coarsen lod sample:part far-{level}.ply --distances 500,2000,8000";
