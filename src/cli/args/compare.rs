//! What may be written after `coarsen compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use coarsen::metrics::{Kinds, View};

use super::MOST_THREADS;
use crate::cli::values;

/// Measure how far two meshes are apart
///
/// Measures the distance between two surfaces from either side, at their vertices, along their edges and at random points
/// of their faces, as Metro does, and prints it with the deviation of normals, the shape of triangles and the topology
/// side by side. Takes about six seconds for a million faces on two cores, less with fewer --samples.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, after_help = EXAMPLES)]
pub struct Compare {
    /// First mesh: a file, '-', or sample:NAME[@FACES]
    ///
    /// As in `coarsen simplify`. Its diagonal is what deviations are told in percent of.
    #[arg(value_name = "A")]
    pub a: String,

    /// Second mesh: the same
    ///
    /// As the first.
    #[arg(value_name = "B")]
    pub b: String,

    #[command(flatten)]
    pub measuring: Measuring,
    #[command(flatten)]
    pub drawing: Drawing,
    #[command(flatten)]
    pub device: Device,
    #[command(flatten)]
    pub writing: Writing,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
pub struct Measuring {
    /// Samples on the faces of each side: 500k
    ///
    /// How many random points to take on the faces of each mesh, beside all vertices and points along the edges. Without it
    /// ten times the faces of the larger mesh. Time grows with it; four times the samples halve the noise of the mean.
    #[arg(long, value_name = "N", value_parser = values::samples)]
    pub samples: Option<usize>,

    /// Which samples: vertices,edges,faces
    ///
    /// The kinds of samples to take, with commas between: all vertices, points along the edges, random points of the faces.
    /// Without faces, mean and root mean square are those of the vertices. Without the option all three.
    #[arg(long, value_name = "KIND,KIND", value_parser = values::kinds, default_value = "vertices,edges,faces",
        hide_default_value = true)]
    pub kinds: Kinds,

    /// Where the samples are
    ///
    /// The seed of the random points. Equal seeds give equal results, on every device and with any number of threads.
    #[arg(long, value_name = "N", default_value_t = coarsen::metrics::Options::default().seed)]
    pub seed: u64,

    /// Tell the deviation in pixels of this view
    ///
    /// Tells how many pixels the deviation covers at most when it is seen from DISTANCE, in model units, by a camera of
    /// FOV degrees from the lower to the upper edge of a picture HEIGHT pixels high.
    #[arg(long, value_name = "DISTANCE,FOV,HEIGHT", value_parser = values::view)]
    pub view: Option<View>,

    /// Compare images of both from six sides
    ///
    /// Draws both meshes as --picture does, with colors and textures, from six sides and 512 pixels high, by the same camera,
    /// and tells the root of the mean square difference of all pixels that either covers, of 1 for black against white, and
    /// where it is the greatest. Takes a second or two.
    #[arg(long)]
    pub images: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Drawing")]
pub struct Drawing {
    /// Write A colored by deviation: a mesh
    ///
    /// Writes the first mesh with a color at each vertex by its distance to the second: dark blue is none, yellow much.
    /// PLY, OBJ, OFF, glTF or GLB.
    #[arg(long, value_name = "MESH")]
    pub heatmap: Option<String>,

    /// Draw A, B and the deviation: a PNG file
    ///
    /// Draws the first mesh, the second, and the first colored by deviation, all from the same eye. Meshes with colors or
    /// textures (glTF; OBJ with its materials beside it; PNG and JPEG) are drawn with them. It is drawn on the CPU, with the
    /// same bytes everywhere, in about a second for a million faces.
    #[arg(long, value_name = "PNG")]
    pub picture: Option<PathBuf>,

    /// Deviation with the last color
    ///
    /// The deviation, in model units, that the last color of heat map and picture stands for, so that several can be
    /// compared. Without it the one that 99 in 100 vertices do not pass.
    #[arg(long, value_name = "D", value_parser = values::length)]
    pub heat_limit: Option<f64>,

    /// Axis that points up: y or z
    ///
    /// What is up in the picture: 'z' as in the built-in samples, drawings and terrains, 'y' as in many scans and in every
    /// glTF. Without it 'y' if A is a glTF, otherwise 'z'.
    #[arg(long, value_name = "AXIS", value_enum, hide_possible_values = true)]
    pub up: Option<Up>,

    /// Width of the picture in pixels
    ///
    /// How many pixels wide the picture is, from 240 to 9600; its height follows from the mesh.
    #[arg(long, value_name = "PIXELS", default_value_t = 1800, value_parser = clap::value_parser!(u16).range(240..=9600))]
    pub width: u16,

    /// Views: 1 from the front, 2 also the back
    ///
    /// The rows of the picture: one seen from the front, or a second one seen from the back.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub views: u8,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Device")]
pub struct Device {
    /// cpu, gpu, gpu:N, software, name
    ///
    /// Where to compute, as in `coarsen simplify`. The result does not depend on it.
    #[arg(short = 'g', long, value_name = "NAME", default_value = "auto")]
    pub device: String,

    /// Threads to use; 0 for one a core
    ///
    /// Threads for the CPU's part of the work, 0 for one a core. The result does not depend on it.
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0,
        value_parser = clap::value_parser!(u16).range(0..=MOST_THREADS))]
    pub threads: u16,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Writing {
    /// Replace heat map and picture if they exist
    ///
    /// Replaces files that are already there. Without it an existing file is refused before the work starts.
    #[arg(short = 'w', long)]
    pub overwrite: bool,

    /// Format of '-': obj, ply, stl, off, gltf or glb
    ///
    /// The format of standard input, needed where A or B is '-'.
    #[arg(long, value_name = "EXT")]
    pub format: Option<String>,

    /// Print one JSON object on standard output
    ///
    /// Prints all figures as one JSON object on one line instead of the table. Its fields are stable under "schema": 1;
    /// lengths are in model units, angles in radians, and 'relative' is of the diagonal.
    #[arg(long)]
    pub json: bool,

    /// Tell of every material's texture
    ///
    /// Lists in the table how far the texture of every material has moved, and which have faces in one mesh alone. --json
    /// has them always.
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,

    /// Print errors only on standard error
    ///
    /// Prints nothing but errors to standard error: no notes about the device.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Up {
    /// The second axis
    Y,
    /// The third axis
    Z,
}

const EXAMPLES: &str = "\
Examples:
  coarsen compare sample:statue@100k sample:statue@10k
  coarsen compare sample:part@50k sample:part@5k --json
  coarsen compare sample:statue sample:statue@20k --picture statue.png
  coarsen compare sample:part sample:part@5k --view 10,45,1080
  coarsen compare sample:terrain@50k sample:terrain@5k --heatmap hot.ply";
