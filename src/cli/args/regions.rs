//! What may be written about methods that make regions of faces.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::values;

#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Regions")]
pub struct Regions {
    /// Angle within a flat region, in degrees
    ///
    /// With --method coplanar and superface: how far the normal of a face may be from that of its region, and of a superface
    /// from that of the face it began with, in degrees above 0 and up to 90. Without the option 1; superfaces of what is curved
    /// take 20. With coplanar faces that are lower than --error, as noise turns them, may be off by 45 in any case.
    #[arg(long, value_name = "DEG", value_parser = values::flat_angle)]
    pub flat_angle: Option<f64>,

    /// Regions of --method vsa
    ///
    /// How many regions --method vsa makes; more where the surface has more parts than that, and fewer where more would be
    /// alike. In its place --energy or --error.
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub regions: Option<usize>,

    /// Energy of --method vsa
    ///
    /// Makes as few regions as bring the energy below this: the squared difference of each face's normal from its region's,
    /// times its area where half the bounding box's diagonal is 1.
    #[arg(long, value_name = "E", value_parser = values::length)]
    pub energy: Option<f64>,

    /// Solver: greedy, rounds or lloyd
    ///
    /// How --method vsa finds its regions: with 'greedy', the default, faces on borders move one by one; with 'rounds' many
    /// at once, by kernels, on an adapter only where --device names one; with 'lloyd' regions are grown anew around their directions, which takes longer.
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

    /// Step of light in a superface: any
    ///
    /// With --method superface: how much the light of neighboring faces may differ, as a share of the darker; with
    /// --area-unit also over their area in that unit, as the method was published. Without the option anything, so that
    /// regions are as large as they are flat and light comes back inside them; 0.1 with --area-unit.
    #[arg(long, value_name = "E", value_parser = values::length)]
    pub light_step: Option<f64>,

    /// Range of light in a superface: any
    ///
    /// With --method superface: how much of its greatest light the light within a superface may range over. Without the
    /// option anything.
    #[arg(long, value_name = "R|P%", value_parser = values::fraction)]
    pub light_range: Option<f64>,

    /// Unit of area of the light's step
    ///
    /// With --method superface: steps of light count less the larger the faces are, in this unit of squared model units, and
    /// there is no limit to their range. Without the option areas do not count.
    #[arg(long, value_name = "A", conflicts_with = "light_range", value_parser = values::length)]
    pub area_unit: Option<f64>,

    /// Color off along borders: 2 of 255
    ///
    /// With --method superface: how far the color of a vertex on a border may be from that of what takes its place, in 255ths
    /// of a channel; four times as far inside a region. Without the option 2. Colors that are moved after that, unless
    /// --keep-colors is given, may add as much.
    #[arg(long, value_name = "D", value_parser = values::length)]
    pub border_color: Option<f64>,

    /// Keep the colors of vertices as they are
    ///
    /// With --method superface: vertices keep the input's colors, and so their places. Without the option they are moved, by at
    /// most --border-color, so that the light between them is right on average.
    #[arg(long)]
    pub keep_colors: bool,

    /// Keep vertices where they are
    ///
    /// With --method superface: vertices of the result are the input's. Without the option, or --keep-colors, they slide in the
    /// plane of what is flat, and along its straight borders, to where the light bends: the shape stays, and the light is off by
    /// about a fifth less.
    #[arg(long)]
    pub keep_vertices: bool,

    /// Outlines by earcut or ears
    ///
    /// How the outline of a region becomes triangles, before edges inside it are turned for rounder ones: with 'earcut' by ears
    /// as they come; with 'ears' the roundest first. Without the option 'earcut', and 'ears' with --method superface.
    #[arg(long, value_name = "NAME", value_enum, hide_possible_values = true)]
    pub triangulation: Option<Triangulation>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Regions")]
pub struct RegionFiles {
    /// Write polygons instead of triangles
    ///
    /// With methods that make regions: writes each region as one polygon, without the edges inside; its holes are joined to what
    /// surrounds them by bridges, edges that it has both ways. A region that keeps its faces, or has vertices inside, is a
    /// polygon a face. Polygons of --method vsa are not planar: programs that project them to a plane may tear them. OBJ or
    /// PLY only, and not together with --flips.
    #[arg(long)]
    pub polygons: bool,

    /// Write the regions to a JSON file
    ///
    /// With methods that make regions: writes one JSON object with the region of every face of the input, null where it was
    /// dropped; with --method vsa also the normal, point, area and energy of each region, in model units but for the energy, and
    /// the energy after every pass. -w replaces the file as it does the output.
    #[arg(long, value_name = "FILE")]
    pub write_regions: Option<PathBuf>,
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
