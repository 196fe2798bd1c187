//! What may be written after `coarsen simplify`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{Attributes, FeatureFile, How, MOST_THREADS, Measuring, RegionFiles, after_exit_codes};
use crate::cli::values::{self, Weld};

/// Reduce the faces of a mesh
///
/// Reduces a mesh to a number of faces, to a fraction of them or as far as an error allows, and writes the result. At
/// least one target is needed; with several the run ends at the first that is reached. The result is the same, byte for
/// byte, on every device and with any number of threads.
#[derive(Debug, Args)]
// A negative number reaches the option's own parser, which says what is wanted.
#[command(allow_negative_numbers = true, after_help = EXAMPLES, after_long_help = after_exit_codes(EXAMPLES))]
pub struct Simplify {
    /// Mesh to read: a file, '-', or sample:NAME[@FACES]
    ///
    /// OBJ, PLY, STL, OFF, glTF or GLB, each also with .gz or .zst; '-' reads standard input in the format that --format names;
    /// sample:NAME is a built-in mesh: statue, part, terrain, assembly, room or office, with @FACES of another size.
    #[arg(value_name = "IN")]
    pub input: String,

    /// Mesh to write: a file, or '-'
    ///
    /// The extension names the format. The file appears under its name only when it is complete. '-' writes standard
    /// output in the format that --format names.
    #[arg(value_name = "OUT")]
    pub output: String,

    #[command(flatten)]
    pub target: Target,
    #[command(flatten)]
    pub how: How,
    #[command(flatten)]
    pub region_files: RegionFiles,
    #[command(flatten)]
    pub feature_file: FeatureFile,
    #[command(flatten)]
    pub device: Device,

    /// Folder for parts that do not fit the memory limit
    ///
    /// Where --memory-limit asks for parts, they are kept in files in this folder: 12 bytes a face and what is left of
    /// them. Without it they are beside the output. The files have no name and are gone whenever the program ends.
    #[arg(long, value_name = "DIR", help_heading = "Device")]
    pub temp_dir: Option<PathBuf>,

    #[command(flatten)]
    pub writing: Writing,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Target (at least one; the first reached ends the run)")]
pub struct Target {
    /// Faces to keep: 20000, 20k, 1.5M
    ///
    /// Stops at this many faces: exactly on a closed manifold mesh when the number is even, else one below where parity
    /// forbids it.
    #[arg(short, long, alias = "triangles", value_name = "N", value_parser = values::count)]
    pub faces: Option<usize>,

    /// Fraction of the faces to keep: 0.1 or 10%
    ///
    /// Stops when this fraction of the input's faces is left; 0 asks for as few as can be. (VTK and trimesh give the fraction to
    /// remove: see --reduction.)
    #[arg(short, long, value_name = "R|P%", value_parser = values::fraction)]
    pub ratio: Option<f64>,

    /// Fraction of the faces to remove: 0.9 or 90%
    ///
    /// Stops when this fraction of the input's faces is gone.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub reduction: Option<f64>,

    /// Estimated deviation allowed, of the diagonal
    ///
    /// Stops before the estimated deviation passes this fraction of the bounding box's diagonal. The estimate adds
    /// up how far each contraction leaves the faces around it, no bound; with the metric plane it is the root of a mean
    /// squared distance to planes of the original. With --method cluster it bounds how far a vertex moves, with vsa,
    /// superface and coplanar how far it is from its region's plane and a border from what takes its place.
    #[arg(short, long, value_name = "R|P%", value_parser = values::fraction)]
    pub error: Option<f64>,

    /// Estimated deviation allowed, in model units
    ///
    /// The same limit as --error, as a length in the units of the model.
    #[arg(long, value_name = "D", value_parser = values::length)]
    pub error_abs: Option<f64>,

    /// Cells along the longest side: 200
    ///
    /// With --method cluster, instead of another target: lays a grid of this many cells along the longest side of the
    /// bounding box, up to 2097152.
    #[arg(long, value_name = "N", value_parser = values::cells)]
    pub grid: Option<u32>,

    /// Exit with 3 if the face count is not reached
    ///
    /// Exits with code 3 when the run ends above the face count asked for, or, with only an error limit, before that
    /// limit. The result is written all the same.
    #[arg(long)]
    pub require_target: bool,
}

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Shape")]
pub struct Shape {
    /// Contract, cluster, removal …
    ///
    /// The method: 'contract', the default, contracts pairs of vertices in rounds, the cheapest first; 'feature' does so with the metric
    /// 'plane' and the placement 'endpoint', where nothing else is said, and counts vertices more where the curvature
    /// changes; 'average' with the metric 'plane', whose planes then count alike, from average quadrics in the format that
    /// --quadric-format names. 'cluster' makes one vertex of all in a cell of a grid, a fast first pass for enormous or broken meshes that
    /// ignores topology: with --faces, --ratio or --reduction the finest grid found that leaves at most as many faces,
    /// mostly 98% or more of them; with --error the coarsest grid that moves no vertex farther than that; or with --grid.
    /// 'removal' takes the vertices nearest to their neighborhood away in rounds and fills the holes: what is left are
    /// vertices of the input, and --error bounds how far each of those that went is from the result, and holds middles of edges to about that.
    /// 'vsa' parts the surface into regions that face one way as nearly as can be, --regions of them or as many as --energy or
    /// --error ask for, and draws each anew between borders that both sides share.
    /// 'superface' does so with regions that are flat and lit alike, by the colors of faces or vertices, where shadows stay.
    /// 'coplanar' draws what is flat anew with the fewest faces, and leaves all else: no target is needed, and --error is how
    /// far from a plane its vertices may be, 0.001% of the diagonal without it.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Method::Contract, hide_possible_values = true,
        hide_default_value = true)]
    pub method: Method,

    /// Cost: volume or plane
    ///
    /// What a contraction costs: with 'volume' the volume that it sweeps over the current faces, which is the more
    /// accurate; with 'plane' the squared distances to the planes of the original, accumulated over the run. Without the
    /// option 'volume', and 'plane' with --method feature or average or --candidates triangles.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub metric: Option<Metric>,

    /// Stored as full, f32, f16 ... local8
    ///
    /// What the initial quadrics of the metric 'plane' are stored as: 'full' leaves them as they were found; 'f32', 'f16',
    /// 'snorm16' and 'rgba8' store ten or 16 numbers about one origin in 40, 20, 20 and 16 bytes a vertex; 'local16' and
    /// 'local8' six about the vertex itself in 12 and 6. The fewer bits, the farther off. Without the option 'full', and
    /// 'f32' with --method average.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub quadric_format: Option<QuadricFormat>,

    /// Their coordinates: normalized or raw
    ///
    /// What the quadrics that --quadric-format stores about one origin are in: with 'normalized' about the middle of the
    /// bounding box in half its diagonal, which is the default; with 'raw' in the model's own coordinates, as the method
    /// was published.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub quadric_frame: Option<QuadricFrame>,

    /// Vertex of a cell: quadric, mean or input
    ///
    /// Where the vertices of a cell go with --method cluster: with 'quadric' where the distances to the planes of its faces
    /// are least, with 'mean' to the mean of their corners, with 'input' to the input's vertex nearest to where 'quadric'
    /// is.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub representative: Option<Representative>,

    /// Keep border vertices where they are
    ///
    /// Keeps every vertex on a border of the surface at its position, so that pieces cut from one mesh still fit.
    #[arg(long)]
    pub lock_border: bool,

    /// Vertices that stay: NAME or FILE
    ///
    /// Keeps vertices of the input where they are: with the NAME of a number that they have in the file, such as a property
    /// of a PLY, those where it is greater than 0; with a FILE those whose numbers it lists, one a line, from 0 on. What has
    /// a '.' or a '/' in it is a FILE.
    #[arg(long, value_name = "WHICH", value_parser = values::lock)]
    pub lock: Option<values::Lock>,

    /// Weight of borders against faces
    ///
    /// How much the shape of borders counts against the shape of faces: 0 lets borders move freely, 10 holds them firmly.
    #[arg(long, value_name = "W", default_value = "1", value_parser = values::weight)]
    pub border_weight: f32,

    /// Where a new vertex may go
    ///
    /// Where the vertex of a contraction goes: with 'optimal' where its cost is least; with 'segment' where it is least
    /// between the two ends; with 'endpoint-or-middle' to an end or midway; with 'endpoint' to one of the two ends, so that
    /// the result's vertices are vertices of the input. Without the option 'optimal', and 'endpoint' with --method
    /// feature.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub placement: Option<Placement>,

    /// Contract pairs or triangles
    ///
    /// What becomes one vertex: with 'pairs' the two ends of an edge; with 'triangles' the three corners of a face, by the
    /// metric 'plane': up to four faces at once, at a deviation that is larger by a quarter on scans and several times as
    /// large on CAD parts. The last faces before the target are contracted by pairs all the same.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Candidates::Pairs, hide_possible_values = true)]
    pub candidates: Candidates,

    /// Largest turn of a face in one contraction
    ///
    /// Refuses a contraction that turns a face's normal by more than this, in degrees above 0 and up to 90. Without the option that is
    /// 78.5 degrees.
    #[arg(long, value_name = "DEG", value_parser = values::angle)]
    pub max_flip: Option<f32>,

    /// Sweeps of a fit, or 'off'
    ///
    /// Moves the result's vertices to where they measure least against the input, in this many sweeps after the run. One
    /// lowers the deviation by about a tenth and takes about as long as the run, three a little more. Borders stay.
    #[arg(long, value_name = "N", default_value = "off", value_parser = values::sweeps)]
    pub fit: u32,

    /// Sweeps of edge flips, or 'off'
    ///
    /// Turns edges of the result to the other diagonal of their faces where that brings it closer to the input, in at most
    /// this many sweeps after the run, with any method. No vertex moves. It lowers the sum of squared distances; the greatest
    /// may rise.
    #[arg(long, value_name = "N", default_value = "off", value_parser = values::sweeps)]
    pub flips: u32,

    /// By distance, bend or shape
    ///
    /// What flips are to lessen: with 'distance' the squared distances of samples of the input; with 'bend' the bends of
    /// edges; with 'shape' obtuse angles where the result is flat.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = FlipBy::Distance, hide_possible_values = true)]
    pub flip_by: FlipBy,

    /// Contract pairs without an edge this close
    ///
    /// Pairs of vertices that lie closer than this, in model units, are contracted as edges are: across parts, and from
    /// border to border. For what edges alone cannot reduce: thousands of small shells, surfaces in pieces. The result may
    /// meet itself in vertices and edges. 0 leaves it at edges.
    #[arg(long, value_name = "D", default_value = "0", hide_default_value = true, value_parser = values::length)]
    pub join_within: f64,

    /// Where it touches itself: cut or hold
    ///
    /// What becomes of vertices and edges where the surface is not manifold: with 'cut' parts that only touch there go
    /// their own ways, and no border opens; where three faces meet on an edge vertices stay, unless they would keep too many
    /// faces. With 'hold', and with --placement endpoint, --join-within or --write-log, all stay.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value_t = NonManifold::Cut,
        hide_possible_values = true,
        hide_default_value = true
    )]
    pub non_manifold: NonManifold,

    /// Join vertices this close, or 'off'
    ///
    /// Joins vertices at most this far apart before anything else, in model units: 0 joins equal positions, 'off' nothing.
    #[arg(long, value_name = "D", default_value = "0", value_parser = values::weld)]
    pub weld: Weld,

    /// Drop parts smaller than this of the diagonal
    ///
    /// Drops connected parts whose bounding box's diagonal is below this fraction of the whole mesh's, before the run: with 0 none.
    /// Without the option only those go that keep a run from its number of faces, and are smaller than what it came to is off.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub prune: Option<f64>,

    /// Close holes smaller than this of the diagonal
    ///
    /// Closes holes whose border's bounding box has a diagonal below this fraction of the mesh's, before the run: with 0 none. No outlines
    /// of sheets, and none of more than 64 sides or where faces disagree in winding, material or texture. Without the option those close
    /// across which the surface goes on, where they would keep more than half of the faces asked for and are too small for
    /// these to show.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub close_holes: Option<f64>,

    #[command(flatten)]
    pub attributes: Attributes,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Device")]
pub struct Device {
    /// cpu, gpu, gpu:N, software, name
    ///
    /// Where to compute. 'auto' takes a hardware GPU when there is one and it would gain, else the CPU, and never a
    /// software adapter: for one mesh it looks for a GPU if a file is to be contracted that has about 1.5 million
    /// faces a thread by its size; 'gpu' takes the first hardware GPU; 'gpu:N' the adapter of that index in `coarsen
    /// devices`; 'software' a software adapter; any other text the first adapter whose name contains it.
    #[arg(short = 'g', long, value_name = "NAME", default_value = "auto")]
    pub device: String,

    /// Threads to use; 0 for one a core
    ///
    /// Threads for the CPU's part of the work, 0 for one a core. The result does not depend on it.
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0,
        value_parser = clap::value_parser!(u16).range(0..=MOST_THREADS))]
    pub threads: u16,

    /// Work in parts above this, or refuse: 8GiB
    ///
    /// Keeps the memory below this. A mesh that is estimated to need more, 64 MiB and 288 bytes for every face, is
    /// simplified in parts where it is a binary PLY of triangles or a binary STL: parts are reduced to one error limit, put together
    /// without cracks, and reduced as a whole to the target. The target must fit: 820 bytes for each of its faces. Any
    /// other job is refused with code 6, once the input is read. On an adapter 512 bytes are needed for every face; where
    /// these are too many, the CPU does the work. The result depends on the limit, and on no device or thread.
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub memory_limit: Option<u64>,
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

    /// Write a log for `coarsen replay`
    ///
    /// Writes every contraction to this file, from which `coarsen replay` makes the mesh of any number of faces between the
    /// input's and the result's. -w replaces it as it does the output. Not together with --fit, which moves vertices
    /// without contracting any.
    #[arg(long, value_name = "FILE")]
    pub write_log: Option<PathBuf>,

    #[command(flatten)]
    pub measuring: Measuring,

    /// Print one JSON object on standard output
    ///
    /// Prints what was done as one JSON object on one line to standard output. Its fields are stable under "schema": 1.
    #[arg(long)]
    pub json: bool,

    /// Print errors only
    ///
    /// Prints nothing but errors to standard error: no summary, no warnings, no progress.
    #[arg(short, long)]
    pub quiet: bool,

    /// Print a table of the rounds
    ///
    /// Prints a line for every round to standard error: faces, pairs, contractions, refusals.
    #[arg(short, long)]
    pub verbose: bool,

    /// Progress: auto, bar, json or never
    ///
    /// How to show progress on standard error: 'bar' draws a bar if that is a terminal; 'auto' does the same except where
    /// CI is set or --quiet is given; 'json' prints a JSON object on a line after every round; 'never' shows nothing.
    #[arg(long, value_name = "HOW", value_enum, default_value_t = Progress::Auto, hide_possible_values = true)]
    pub progress: Progress,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Quadric pair contraction in rounds
    Contract,
    /// The same, features first
    Feature,
    /// The same, from average quadrics
    Average,
    /// Vertex clustering on a grid
    Cluster,
    /// Vertex removal with retriangulation
    Removal,
    /// Variational shape approximation
    Vsa,
    /// Regions lit alike
    Superface,
    /// Flat regions drawn anew
    Coplanar,
}

impl Method {
    /// Whether it makes regions of faces, and draws these anew.
    pub fn makes_regions(self) -> bool {
        matches!(self, Self::Vsa | Self::Superface | Self::Coplanar)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Metric {
    /// The volume swept over the current faces
    Volume,
    /// Squared distances to the planes of the original
    Plane,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Candidates {
    /// Two vertices
    Pairs,
    /// The corners of a face
    Triangles,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Placement {
    /// Where the cost is least
    Optimal,
    /// Where the cost is least between the two ends
    Segment,
    /// At an end or midway
    EndpointOrMiddle,
    /// At one of the two ends
    Endpoint,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum NonManifold {
    /// A vertex for each fan
    Cut,
    /// As it is
    Hold,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum QuadricFormat {
    /// As they were found
    Full,
    /// Ten numbers in single precision
    F32,
    /// Ten numbers in half precision
    F16,
    /// Ten numbers of 16 bits in even steps
    Snorm16,
    /// Four pixels of four times 8 bits
    Rgba8,
    /// Six numbers of 16 bits about the vertex
    Local16,
    /// Six numbers of 8 bits about the vertex
    Local8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum QuadricFrame {
    /// In half the diagonal of the bounding box
    Normalized,
    /// In the model's own
    Raw,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Representative {
    /// Where the distances to the planes of the faces are least
    Quadric,
    /// The mean of the corners
    Mean,
    /// The nearest vertex of the input
    Input,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FlipBy {
    /// Squared distances of samples
    Distance,
    /// Lengths of edges by their bend
    Bend,
    /// Obtuse angles on flats
    Shape,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Progress {
    /// A bar on a terminal unless CI is set
    Auto,
    /// A bar on a terminal
    Bar,
    /// A JSON object a line after every round
    Json,
    /// Nothing
    Never,
}

const EXAMPLES: &str = "\
Examples:
  coarsen simplify sample:statue out.ply --faces 20k
  coarsen simplify sample:part part.stl --ratio 10% --metric plane
  coarsen simplify sample:terrain@100k tile.obj.gz --error 0.1% --lock-border
  coarsen simplify sample:statue@5M small.ply --ratio 1% --method cluster
  coarsen simplify sample:statue@50k - --format ply --faces 5k > small.ply

All options in full sentences: coarsen simplify --help";
