//! What may be written about the weights of vertices.

use clap::{Args, ValueEnum};
use coarsen::formats;

use crate::cli::values;

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Weights")]
pub struct Weights {
    /// Weights: FILE, or ply:PROPERTY
    ///
    /// How much each vertex of the input counts: a text file of one number a line, in the order of the vertices, or with
    /// 'ply:NAME' the number NAME that the vertices of the input, a PLY file, have. Only their ratios count; 0 lets a vertex
    /// go for nothing, but for all it is as good as 1. (A file called ply:NAME is ./ply:NAME.)
    #[arg(long, value_name = "FILE", value_parser = values::weight_source)]
    pub weight: Option<formats::Weights>,

    /// Features: affine, gated, contrast, entropy
    ///
    /// What the feature degree d of a vertex makes of its weight, with --method feature: with 'affine' 1 + λd, which is the
    /// default; with 'gated' less beside a crease than on it; with 'contrast' d and with 'entropy' 1 − d, the two readings
    /// of the paper.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub feature_mode: Option<FeatureMode>,

    /// How much features count: λ
    ///
    /// How much more a feature counts than a region of even curvature, for the modes 'affine' (4 without the option) and
    /// 'gated' (16).
    #[arg(long, value_name = "X", value_parser = values::weight)]
    pub feature_lambda: Option<f32>,

    /// Curvature that drowns, over the mean
    ///
    /// Curvatures below this many times the mean of all are no feature: 1 without the option, and 0, as in the paper, for the
    /// modes 'contrast' and 'entropy', where the noise on a flat counts as well.
    #[arg(long, value_name = "X", value_parser = values::weight)]
    pub feature_floor: Option<f32>,

    /// When: static or recompute
    ///
    /// When features are found: with 'static' once, on the input, which is the default; with 'recompute' in every round, on
    /// the surface as it is then.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub feature_update: Option<FeatureUpdate>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Weights")]
pub struct FeatureFile {
    /// Write the feature degrees to a PLY
    ///
    /// Writes the input to this PLY file with the feature degree of every vertex, from 0 to 1, as its color and as the
    /// property 'feature', which `--weight ply:feature` reads. With any method.
    #[arg(long, value_name = "FILE")]
    pub write_feature: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FeatureMode {
    /// 1 + λd
    Affine,
    /// 1 + λd, less beside a crease
    Gated,
    /// d
    Contrast,
    /// 1 − d
    Entropy,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FeatureUpdate {
    /// Once, on the input
    Static,
    /// In every round
    Recompute,
}
