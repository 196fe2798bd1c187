//! What may be written about methods that make regions of faces.

use clap::{Args, ValueEnum};

use crate::cli::values;

#[derive(Debug, Args)]
#[command(next_help_heading = "Regions")]
pub struct Regions {
    /// Angle within a flat region: 1
    ///
    /// With --method coplanar: how far the normal of a face may be from that of its region's plane, in degrees above 0 and
    /// up to 90. Without the option 1.
    #[arg(long, value_name = "DEG", value_parser = values::angle)]
    pub flat_angle: Option<f32>,

    /// Outlines by earcut or ears
    ///
    /// How the outline of a region becomes triangles: with 'earcut' by ears as they come; with 'ears' the roundest first.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub triangulation: Option<Triangulation>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Triangulation {
    /// Ears as they come
    Earcut,
    /// The roundest ears first
    Ears,
}
