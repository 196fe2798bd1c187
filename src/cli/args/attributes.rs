//! The options of attributes.

use clap::{Args, ValueEnum};

use crate::cli::values;

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Attributes")]
pub struct Attributes {
    /// What they count: normal=0.7,uv=0.25
    ///
    /// What a difference in an attribute counts against a distance, as NAME=WEIGHT, by commas; 0 for one that is carried
    /// along and decides nothing, but that its seams hold: --drop frees what they hold. 'normal': a difference of 1, about a
    /// radian, is a thousandth of the diagonal. 'uv': a slip of the texture along the surface counts as its length. 'color': a difference of 1, from black to full red, is a
    /// fiftieth of the diagonal. 'pose' (0.1 unless given): what a morph target displaces counts as its length, and where limbs
    /// bend the distance of the joints on either side. A further channel by its name, which counts 0 unless it is given: its
    /// whole range is a fiftieth of the diagonal; whole numbers that are not given are labels, which are not blended. For --metric volume; 'plane' carries attributes along.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::weight_of)]
    pub attribute_weights: Vec<(String, f32)>,

    /// Normals: keep, recompute or drop
    ///
    /// With 'keep' they are carried, and creases, where the faces of a vertex disagree in them, are kept. With 'recompute'
    /// those of the result are the means of its faces, exact on a sphere, and creases hold nothing. With 'drop' there are none.
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Normals::Keep, hide_possible_values = true, hide_default_value = true)]
    pub normals: Normals,

    /// Leave out: normal, uv, color, material, other
    ///
    /// Leaves attributes out, and what their seams hold; several by commas. With --method coplanar flats then collapse across
    /// what these had parted.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum, hide_possible_values = true)]
    pub drop: Vec<Dropped>,

    /// Differences between colors: rgb or luv
    ///
    /// In what a difference between two colors is measured, where colors count: with 'rgb' in red, green and blue as they are
    /// stored; with 'luv' in CIE L*u*v*, where equal differences look about equal.
    #[arg(long, value_name = "SPACE", value_enum, default_value_t = ColorSpace::Rgb, hide_possible_values = true, hide_default_value = true)]
    pub color_space: ColorSpace,

    /// Seams that hold too much: yield or hold
    ///
    /// What becomes of seams of the texture, creases and borders between materials where they would keep more faces than are
    /// asked for. With 'yield' they give way, which a warning tells: creases first, then corners of other seams, then all;
    /// textures do not fold for it, and materials stay closed. Where creases would keep more than a fifth of the faces
    /// asked for, and most of the others have to go, a run in which they yield is compared with one in which they hold, and
    /// taken if its estimated error is lower. Where at last seams refuse an eighth of the pairs, or, of a third of the faces or
    /// fewer, keep two fifths by themselves, or the result is more than 2 % of the diagonal off, one in which all yield is taken if it
    /// is at most 0.8 times as far off. Neither under a limit to the error. With 'hold', and with --placement endpoint or
    /// --join-within, the run ends with the faces that are left.
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Seams::Yield, hide_possible_values = true, hide_default_value = true)]
    pub seams: Seams,

    /// Keep vertices on seams where they are
    ///
    /// Keeps the vertices of seams of the texture, of creases and of borders between materials where they are. Without it
    /// they move along these lines, both sides together.
    #[arg(long)]
    pub lock_seams: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Normals {
    /// They follow the surface
    Keep,
    /// They are found anew
    Recompute,
    /// There are none
    Drop,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorSpace {
    /// Red, green and blue
    Rgb,
    /// CIE L*u*v*
    Luv,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Seams {
    /// They give way
    Yield,
    /// They stay
    Hold,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Dropped {
    /// Normals
    Normal,
    /// Texture coordinates
    Uv,
    /// Colors of vertices
    Color,
    /// Materials
    Material,
    /// Further channels
    Other,
}
