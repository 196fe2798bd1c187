//! What may be written about vertex removal.

use clap::{Args, ValueEnum};

use crate::cli::values;

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Vertex removal")]
pub struct Removal {
    /// Fill: fan, ears, dynamic or exhaustive
    ///
    /// How the hole of a vertex is filled with --method removal, sharp edges avoided first and slivers next: with 'fan' by
    /// the best fan around one of its vertices; with 'ears' by cutting off the roundest ear, again and again; with
    /// 'dynamic', the default, by dynamic programming over all triangulations; with 'exhaustive' by trying them all, up to
    /// seven sides.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub fill: Option<Fill>,

    /// Keep edges that bend by more: 40
    ///
    /// With --method removal: edges whose faces' normals are more than this apart, in degrees up to 180, are features.
    /// Vertices go along them, and stay where they meet or end, so that a run may get stuck above its target. Without the
    /// option edges of more than 60 degrees guide, and no vertex stays.
    #[arg(long, value_name = "DEG", value_parser = values::feature_angle)]
    pub feature_angle: Option<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Fill {
    /// The best fan
    Fan,
    /// The roundest ears
    Ears,
    /// The least bend, by dynamic programming
    Dynamic,
    /// The least bend of all triangulations
    Exhaustive,
}
