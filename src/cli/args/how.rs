//! How a mesh is simplified: what every verb takes that does so.

use clap::Args;

use super::{Regions, Removal, Shape, Weights};
use crate::cli::values;

#[derive(Debug, Clone, Args)]
pub struct How {
    #[command(flatten)]
    pub shape: Shape,
    #[command(flatten)]
    pub removal: Removal,
    #[command(flatten)]
    pub regions: Regions,
    #[command(flatten)]
    pub weights: Weights,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Measuring {
    /// Measure the result against the input
    ///
    /// Measures how far the result is from the input, from both sides, as `coarsen compare` does, once the result is
    /// written, and tells it in the summary and as 'error.measured' in the record. With ten samples a face of the input
    /// that takes longer than the reduction: about six seconds for a million faces on two cores.
    #[arg(long)]
    pub measure: bool,

    /// Samples for --measure: 500k
    ///
    /// How many random points --measure takes on the faces of each side. Without it ten times the faces of the input.
    #[arg(long, value_name = "N", requires = "measure", value_parser = values::samples)]
    pub samples: Option<usize>,
}
