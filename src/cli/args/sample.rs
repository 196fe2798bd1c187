//! The arguments of `coarsen sample`.

use clap::Args;

/// Write a built-in sample to a file
///
/// Makes one of the meshes that sample:NAME stands for and writes it. A statue of a million faces or more goes to PLY in slabs
/// and is never in memory as a whole; its vertices and faces are in another order then.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  coarsen sample part part.stl\n  coarsen sample statue@50M statue.ply")]
pub struct Sample {
    /// Sample to make: NAME[@FACES]
    ///
    /// statue, part, terrain, assembly, room or office, and how many faces it is to have.
    #[arg(value_name = "NAME")]
    pub sample: String,

    /// File to write: obj, ply, stl, off, gltf, glb, also with .gz or .zst
    ///
    /// As in `coarsen simplify`, but '-' is refused.
    #[arg(value_name = "OUT")]
    pub output: String,

    /// Replace the output if it exists
    ///
    /// As in `coarsen simplify`.
    #[arg(short = 'w', long)]
    pub overwrite: bool,

    /// Print errors only
    ///
    /// Prints nothing but errors to standard error: not what was written.
    #[arg(short, long)]
    pub quiet: bool,
}
