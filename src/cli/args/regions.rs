//! What may be written about methods that make regions of faces.

use clap::{Args, ValueEnum};

use crate::cli::values;

#[derive(Debug, PartialEq, Args)]
#[command(next_help_heading = "Regions")]
pub struct Regions {
    /// Angle within a flat region: 1
    ///
    /// With --method coplanar: how far the normal of a face may be from that of its region's plane, in degrees above 0 and
    /// up to 90. Without the option 1.
    #[arg(long, value_name = "DEG", value_parser = values::angle)]
    pub flat_angle: Option<f32>,

    /// Regions of --method vsa: 100
    ///
    /// How many regions --method vsa makes; more where the surface has more parts than that, and fewer where more would be
    /// alike. In its place --energy or --error.
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub regions: Option<usize>,

    /// Energy of --method vsa: 0.1
    ///
    /// Makes as few regions as bring the energy below this: the squared difference of each face's normal from its region's,
    /// times its area where half the bounding box's diagonal is 1.
    #[arg(long, value_name = "E", value_parser = values::length)]
    pub energy: Option<f64>,

    /// Solver: greedy, rounds or lloyd
    ///
    /// How --method vsa finds its regions: with 'greedy', the default, faces on borders move one by one; with 'rounds' many
    /// at once, by kernels on the device; with 'lloyd' regions are grown anew around their directions, which takes longer.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub vsa_solver: Option<Solver>,

    /// Attempts of --method vsa: 3
    ///
    /// From how many sets of seeds --method vsa starts; the best regions are kept. Without the option 3.
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub restarts: Option<usize>,

    /// Bend of a border, of its length: 0.2
    ///
    /// With --method vsa: how far the border between two regions may be from the straight line that takes the place of a
    /// part of it, as a fraction of that line's length. Without the option 0.2.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub chord_ratio: Option<f64>,

    /// Outlines by earcut or ears
    ///
    /// How the outline of a region becomes triangles: with 'earcut' by ears as they come; with 'ears' the roundest first.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub triangulation: Option<Triangulation>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// Faces one by one
    Greedy,
    /// Many faces at once
    Rounds,
    /// Grown anew
    Lloyd,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Triangulation {
    /// Ears as they come
    Earcut,
    /// The roundest ears first
    Ears,
}
