//! What may be written after `coarsen bench`.

use std::path::PathBuf;

use clap::Args;

use super::MOST_THREADS;
use crate::cli::values;

/// Time the same job on every device, side by side
///
/// Simplifies each mesh on every device, and with meshoptimizer in a program built with it (cargo build --release
/// --features baseline), in turns, so that a machine that slows down slows all of them. Prints Markdown: the machine,
/// medians, phases, memory, whether the devices gave the same bytes, and how far each result is from the input.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, after_help = EXAMPLES)]
pub struct Bench {
    /// Meshes to take: files, or sample:NAME[@FACES]
    ///
    /// As in `coarsen simplify`, without standard input. By default every built-in sample with 100,000 faces.
    #[arg(value_name = "MESH", conflicts_with = "scale")]
    pub meshes: Vec<String>,

    #[command(flatten)]
    pub job: Job,
    #[command(flatten)]
    pub contenders: Contenders,
    #[command(flatten)]
    pub writing: Writing,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Job")]
pub struct Job {
    /// Fraction of the faces to keep: 0.1 or 10%
    ///
    /// Simplifies to this fraction of the faces. Repeat it for several; without it and --faces 10% and 1%.
    #[arg(short, long, value_name = "R|P%", value_parser = values::fraction)]
    pub ratio: Vec<f64>,

    /// Faces to keep: 20000, 20k, 1.5M
    ///
    /// Simplifies to this many faces. Repeat it for several.
    #[arg(short, long, value_name = "N", value_parser = values::count)]
    pub faces: Vec<usize>,

    /// Sample to take in several sizes
    ///
    /// Takes this built-in sample in several sizes and prints by what power of the size the time grows. The deviation of
    /// the results is left out.
    #[arg(long, value_name = "NAME")]
    pub scale: Option<String>,

    /// Sizes for --scale: 100k,1M
    ///
    /// The numbers of faces for --scale, with commas between. Without the option: 100k,300k,1M,3M.
    #[arg(long, value_name = "N,N", value_delimiter = ',', requires = "scale", value_parser = values::count,
        hide_default_value = true, default_values = ["100k", "300k", "1M", "3M"])]
    pub sizes: Vec<usize>,

    /// The papers' tables instead
    ///
    /// Prints what this program makes of the tables and claims of the papers behind it, beside their own figures where they
    /// print any: quadric pair contraction, visual features, average quadrics, regions by variational shape approximation,
    /// and superfaces for meshes with colors, such as sample:room. On the CPU, with as many threads as -j names; by default
    /// with every built-in sample at 20,000 faces, which takes minutes.
    #[arg(long, conflicts_with_all = ["scale", "ratio", "faces", "samples", "device", "json"])]
    pub papers: bool,

    /// Times that each job is done
    ///
    /// How many times each job is done on each device, after once that is not counted. The median and the spread from the
    /// least to the greatest are printed.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub repeats: u16,

    /// Points to measure the deviation at
    ///
    /// At how many points of the faces of either surface, beside its vertices and edges, the distance to the other is
    /// measured.
    #[arg(long, value_name = "N", default_value = "1M", value_parser = values::samples)]
    pub samples: usize,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Device")]
pub struct Contenders {
    /// Devices: cpu, gpu, software, baseline
    ///
    /// Who takes part, with commas between. 'cpu' is the CPU with 1, 2, 4 … threads, up to one a core, 'cpu:N' with N
    /// threads; 'gpu' is every hardware adapter; 'baseline' is meshoptimizer's simplify and simplifyWithUpdate. Other
    /// texts name a device as in `coarsen simplify`. Without the option: cpu,gpu,software,baseline.
    #[arg(short = 'g', long, value_name = "NAME,NAME", value_delimiter = ',',
        hide_default_value = true,
        default_values = ["cpu", "gpu", "software", "baseline"])]
    pub device: Vec<String>,

    /// Threads of 'cpu': 1,2
    ///
    /// The numbers of threads for 'cpu', with commas between. An adapter's part on the CPU takes the greatest of them, and
    /// one a core without the option.
    #[arg(short = 'j', long, value_name = "N,N", value_delimiter = ',',
        value_parser = clap::value_parser!(u16).range(1..=MOST_THREADS))]
    pub threads: Vec<u16>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Writing {
    /// Draw the times: an SVG file
    ///
    /// Draws the times as an SVG picture: bars by device, or with --scale lines over the size. With --papers the faces of
    /// superfaces over either tolerance.
    #[arg(long, value_name = "SVG")]
    pub plot: Option<PathBuf>,

    /// Replace the picture if it exists
    ///
    /// Replaces a picture that is already there. Without it an existing file is refused before the work starts.
    #[arg(short = 'w', long)]
    pub overwrite: bool,

    /// Print one JSON object on standard output
    ///
    /// Prints all figures as one JSON object on one line instead of Markdown. Its fields are stable under "schema": 1.
    #[arg(long)]
    pub json: bool,

    /// Print errors only on standard error
    ///
    /// Prints nothing but errors to standard error: no progress, no notes.
    #[arg(short, long)]
    pub quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  coarsen bench
  coarsen bench sample:statue@1M --device cpu,software,baseline
  coarsen bench sample:part --ratio 5% --repeats 9 --json
  coarsen bench --scale statue --sizes 100k,1M --plot growth.svg -w
  coarsen bench --papers sample:statue sample:part@20k
  coarsen bench --papers sample:room sample:office --plot curves.svg -w";
