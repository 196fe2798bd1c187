//! Which numbers of a wedge's row mean what, and what they are multiplied by.
//!
//! A row is in units of the normalized frame: a difference between two rows stands beside a distance. Numbers that decide
//! where vertices go come first, as far as the kernels have room for them; those that are carried alone follow.

use crate::kernel::attribute_spreads::MOST_COSTED;
use crate::math::lanes::{NUMBERS, Numbers};
use crate::math::{Vec3, luv};
use crate::mesh::frame::Frame;
use crate::mesh::{ChannelKind, Mesh, Normals};

use super::Metric;
use super::attributes::{Attributes, ColorSpace};
use super::pose::{Motion, Pose};
use super::yielding::Yields;

/// What a difference of 1 in a normal counts as, of the diagonal, times its weight.
const NORMAL_UNIT: f64 = 1e-3;
/// The same of a color, and of the range of a scalar.
const COLOR_UNIT: f64 = 2e-2;
/// What L\*, u\* and v\* are in units of a channel of red, green or blue.
const LUV: f64 = 60.0;

/// Greatest number that decides: sums of its squares stay finite in single precision.
const MOST: f32 = 1e9;

/// How the numbers of a layer become those of a new vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// At unit length, or zero.
    Normal,
    /// Within 0 and 1.
    Color,
    /// A color in CIE L\*u\*v\*, and its alpha.
    Luv,
    /// A pair in which no face turns over.
    Texcoords,
    /// A unit vector and a sign.
    Tangent,
    /// As they are.
    Linear,
    /// Those of one corner.
    Label,
    /// As many joints as weights.
    Joints,
}

impl Kind {
    /// Whether there are names in it, which have no mean.
    pub fn has_names(self) -> bool {
        matches!(self, Self::Label | Self::Joints)
    }
}

/// Where the numbers of a layer come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Normals,
    Colors,
    Texcoords,
    Channel(usize),
    /// How it moves, which decides alone: none of it is written.
    Pose(Motion),
}

/// An attribute in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    pub origin: Origin,
    pub kind: Kind,
    /// Where it stands in the row.
    pub first: usize,
    pub width: usize,
    /// What stored numbers are multiplied by.
    pub scale: f32,
}

impl Layer {
    fn is_shading(&self) -> bool {
        matches!(self.kind, Kind::Normal | Kind::Tangent)
    }

    /// Its part of a row.
    pub fn of<'a>(&self, row: &'a [f32]) -> &'a [f32] {
        &row[self.first..self.first + self.width]
    }

    /// Its part of a row, to change.
    pub fn of_mut<'a>(&self, row: &'a mut [f32]) -> &'a mut [f32] {
        &mut row[self.first..self.first + self.width]
    }

    /// Its numbers of a row, as meshes hold them, of which there are `N`.
    pub fn stored<const N: usize>(&self, row: &[f32]) -> [f32; N] {
        let mut numbers = [0.0; N];
        self.store(row, &mut numbers);
        numbers
    }

    /// [`Layer::stored`] into `out`.
    pub fn store(&self, row: &[f32], out: &mut [f32]) {
        // The greatest of numbers may have become greater by rounding.
        out.iter_mut().zip(self.of(row)).for_each(|(out, x)| *out = (x / self.scale).clamp(f32::MIN, f32::MAX));
        if self.kind == Kind::Luv {
            let color = luv::srgb([0, 1, 2].map(|i| f64::from(out[i]) * LUV));
            out.iter_mut().zip(color).for_each(|(number, channel)| *number = channel as f32);
        }
    }
}

/// The layers of a row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    pub layers: Vec<Layer>,
    /// Numbers of a row that decide.
    pub costed: usize,
    /// These and those after them whose means over faces cost nothing more: they fill up the last vector.
    pub summed: usize,
    /// Of those that are summed, in whole vectors, 1 for a place in a texture and 0 for another.
    pub are_texcoords: Vec<Numbers<f32>>,
    /// Whether there are others.
    pub has_others: bool,
    /// Of all numbers of a row, what those of the mesh are multiplied by, and how far from zero they may be.
    scales: Vec<[f32; 2]>,
    /// Of all numbers of a row, no bits where shading is made of it, all of them where it is not.
    not_shading: Vec<u32>,
    /// Numbers of a row.
    pub width: usize,
    /// Whether borders between materials are seams.
    pub has_materials: bool,
    /// Whether a vertex has one wedge.
    pub is_smooth: bool,
    /// Which seams give way.
    pub yields: Yields,
    /// How vertices move.
    pose: Pose,
}

impl Layout {
    /// For what `mesh` carries and these options keep; `None` when that is nothing. `is_smooth` leaves out what a log cannot
    /// hold, all but one normal and one color a vertex, and these decide nothing.
    pub fn new(mesh: &Mesh, options: &Attributes, metric: Metric, frame: Frame, is_smooth: bool) -> Option<Self> {
        let Attributes { weights, normals, dropped, .. } = options;
        let diagonal = frame.length_to_rows(mesh.diagonal());
        let counts = if metric == Metric::Volume && !is_smooth { 1.0 } else { 0.0 };
        let unit = |share: f64, weight: f32| (share * diagonal * f64::from(weight)) as f32 * counts;
        let mut all: Vec<(Layer, bool)> = Vec::new();
        let mut add = |origin: Origin, kind: Kind, width: usize, factor: f32| {
            let is_costed = factor > 0.0 && factor.is_finite() && !kind.has_names() && width <= 4;
            let scale = if is_costed { factor } else { 1.0 };
            all.push((Layer { origin, kind, first: 0, width, scale }, is_costed));
        };
        if mesh.normals.is_some() && !dropped.normals && *normals == Normals::Keep {
            add(Origin::Normals, Kind::Normal, 3, unit(NORMAL_UNIT, weights.normal));
        }
        if let Some(rows) = &mesh.texcoords
            && !dropped.texcoords
            && !is_smooth
        {
            let corners = |f: usize| rows[f].map(|uv| [uv.x, uv.y]);
            let factor = frame.length_to_rows(mesh.length_of_texture(corners)) as f32 * weights.texcoord * counts;
            add(Origin::Texcoords, Kind::Texcoords, 2, factor);
        }
        if mesh.colors.is_some() && !dropped.colors {
            let factor = unit(COLOR_UNIT, weights.color);
            let in_luv = options.color_space == ColorSpace::Luv && factor > 0.0;
            add(Origin::Colors, if in_luv { Kind::Luv } else { Kind::Color }, 4, factor);
        }
        for (number, channel) in mesh.channels.iter().enumerate().filter(|_| !is_smooth) {
            let origin = Origin::Channel(number);
            let given = weights.of_channel(&channel.name);
            match channel.kind {
                ChannelKind::Texcoords if !dropped.texcoords => {
                    let corners = |f: usize| mesh.faces[f].map(|v| [0, 1].map(|i| channel.row(v as usize)[i]));
                    let length = frame.length_to_rows(mesh.length_of_texture(corners)) as f32;
                    let factor = length * given.unwrap_or(weights.texcoord) * counts;
                    add(origin, Kind::Texcoords, 2, factor);
                }
                ChannelKind::Texcoords => {}
                _ if dropped.channels => {}
                ChannelKind::Tangent => add(origin, Kind::Tangent, 4, unit(NORMAL_UNIT, given.unwrap_or(0.0))),
                ChannelKind::Joints => add(origin, Kind::Joints, channel.width, 0.0),
                ChannelKind::Label if given.is_none() => add(origin, Kind::Label, channel.width, 0.0),
                // A label with a weight is an amount.
                ChannelKind::Linear | ChannelKind::Displacement | ChannelKind::Label => {
                    let finite = || channel.values.iter().copied().filter(|x| x.is_finite());
                    let range = finite().fold(f32::NEG_INFINITY, f32::max) - finite().fold(f32::INFINITY, f32::min);
                    let factor = unit(COLOR_UNIT, given.unwrap_or(0.0)) / range;
                    add(origin, Kind::Linear, channel.width, if range > 0.0 { factor } else { 0.0 });
                }
            }
        }
        let length = (frame.length_to_rows(1.0) * f64::from(weights.pose)) as f32 * counts;
        let counts_no_pose = is_smooth || dropped.channels || length <= 0.0;
        let pose = if counts_no_pose {
            Pose::default()
        } else {
            Pose::of(mesh, |channel| weights.of_channel(&channel.name).is_some())
        };
        pose.motions().for_each(|motion| add(Origin::Pose(motion), Kind::Linear, 3, length));
        let has_materials = mesh.materials.is_some() && !dropped.materials && !is_smooth;
        (!all.is_empty() || has_materials).then(|| Self { is_smooth, pose, ..Self::arranged(all, has_materials) })
    }

    /// Puts what is costed first, as far as the kernels have room, and the others after it.
    fn arranged(all: Vec<(Layer, bool)>, has_materials: bool) -> Self {
        let mut layout = Self { has_materials, ..Self::default() };
        let mut used = 0;
        let mut carried = Vec::new();
        for (layer, is_costed) in all {
            if is_costed && used + layer.width <= MOST_COSTED {
                layout.layers.push(Layer { first: used, ..layer });
                used += layer.width;
            } else if !matches!(layer.origin, Origin::Pose(_)) {
                carried.push(Layer { scale: 1.0, ..layer });
            }
        }
        (layout.costed, layout.summed, layout.width) = (used, used, used);
        for layer in carried {
            let averaged = match layer.kind {
                kind if kind.has_names() => None,
                // But for its sign.
                Kind::Tangent => Some(3),
                _ => Some(layer.width),
            };
            let room = used.next_multiple_of(NUMBERS) - layout.summed;
            match averaged.filter(|&numbers| layout.summed == layout.width && numbers <= room) {
                Some(numbers) => layout.summed += numbers,
                None => layout.has_others = true,
            }
            layout.layers.push(Layer { first: layout.width, ..layer });
            layout.width += layer.width;
        }
        for layer in &layout.layers {
            let most = if layer.first < layout.costed { MOST } else { f32::INFINITY };
            layout.scales.extend(std::iter::repeat_n([layer.scale, most], layer.width));
        }
        layout.not_shading = vec![u32::MAX; layout.width];
        for layer in layout.layers.iter().filter(|layer| layer.is_shading()) {
            layout.not_shading[layer.first..layer.first + layer.width].fill(0);
        }
        layout.are_texcoords = vec![[0.0; NUMBERS]; layout.summed.div_ceil(NUMBERS)];
        for layer in layout.layers.iter().filter(|layer| layer.kind == Kind::Texcoords) {
            for number in (layer.first..layer.first + layer.width).take_while(|&number| number < layout.summed) {
                layout.are_texcoords[number / NUMBERS][number % NUMBERS] = 1.0;
            }
        }
        layout
    }

    /// Writes the row of a corner of `mesh`; what is not finite is zero.
    pub fn read(&self, mesh: &Mesh, face: usize, corner: usize, row: &mut [f32]) {
        let vertex = mesh.faces[face][corner] as usize;
        for layer in &self.layers {
            let out = layer.of_mut(row);
            match layer.origin {
                Origin::Normals => {
                    let normal = mesh.normals.as_ref().map_or(Vec3::ZERO, |rows| rows[vertex]);
                    out.copy_from_slice(&normal.to_array());
                }
                Origin::Colors => {
                    let mut color = mesh.colors.as_ref().map_or([0.0; 4], |rows| rows[vertex]);
                    if layer.kind == Kind::Luv {
                        let [r, g, b, alpha] = color;
                        let luv = luv::luv([r, g, b].map(|channel| f64::from(channel.clamp(0.0, 1.0))));
                        let [l, u, v] = luv.map(|x| (x / LUV) as f32);
                        color = [l, u, v, alpha];
                    }
                    out.copy_from_slice(&color);
                }
                Origin::Texcoords => {
                    let at = mesh.texcoords.as_ref().map_or([0.0; 2], |rows| rows[face][corner].to_array());
                    out.copy_from_slice(&at);
                }
                Origin::Channel(number) => out.copy_from_slice(mesh.channels[number].row(vertex)),
                Origin::Pose(motion) => out.copy_from_slice(&self.pose.read(mesh, vertex, motion)),
            }
        }
        // Side by side, whatever they are: rows are read for every wedge.
        for (x, &[scale, most]) in row.iter_mut().zip(&self.scales) {
            let (scaled, is_finite) = (*x * scale, x.is_finite());
            let low = if scaled < -most { -most } else { scaled };
            let held = if low > most { most } else { low };
            *x = if is_finite { held } else { 0.0 };
        }
    }

    /// The material of a face, where materials count.
    pub fn material(&self, mesh: &Mesh, face: usize) -> u32 {
        mesh.materials.as_ref().filter(|_| self.has_materials).map_or(0, |materials| materials.of_face[face])
    }

    /// Whether there is anything that shading is made of.
    pub fn has_shading(&self) -> bool {
        self.layers.iter().any(Layer::is_shading)
    }

    /// Whether two rows agree in all but what shading is made of. Without a branch: along seams half of them do.
    pub fn agree_but_in_shading(&self, a: &[f32], b: &[f32]) -> bool {
        let differ = |((a, b), mask): ((&f32, &f32), &u32)| (a.to_bits() ^ b.to_bits()) & mask;
        a.iter().zip(b).zip(&self.not_shading).map(differ).fold(0, |all, bits| all | bits) == 0
    }

    /// The layers of a kind.
    pub fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &Layer> {
        self.layers.iter().filter(move |layer| layer.kind == kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn shading_is_not_asked_where_rows_agree_but_in_it() {
        let layer =
            |kind, width| (Layer { origin: Origin::Normals, kind, first: 0, width, scale: 1.0 }, kind == Kind::Normal);
        let layout =
            Layout::arranged(vec![layer(Kind::Color, 4), layer(Kind::Normal, 3), layer(Kind::Tangent, 4)], false);
        let row = [0.5_f32; 11];
        // The normal first, for it decides.
        let agree = (0..11).map(|number| {
            let mut other = row;
            other[number] = 0.25;
            layout.agree_but_in_shading(&row, &other)
        });
        let expected = [[true; 3].as_slice(), &[false; 4], &[true; 4]].concat();
        assert!(agree.eq(expected) && layout.agree_but_in_shading(&row, &row));
    }

    #[test]
    fn what_is_carried_fills_up_the_last_vector() {
        let layer = |kind, width| Layer { origin: Origin::Normals, kind, first: 0, width, scale: 1.0 };
        let decide = [(layer(Kind::Normal, 3), true), (layer(Kind::Texcoords, 2), true)];
        let counts = |carried: &[(Kind, usize)]| {
            let carried = carried.iter().map(|&(kind, width)| (layer(kind, width), false));
            let layout = Layout::arranged(decide.into_iter().chain(carried).collect(), false);
            (layout.costed, layout.summed, layout.width, layout.has_others)
        };
        // Of a normal and a place in a texture the latter are told apart, also where they are in two vectors.
        let of = Layout::arranged(decide.to_vec(), false).are_texcoords;
        assert_eq!(of, [[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]]);
        let three = [decide[0], decide[0], (layer(Kind::Linear, 1), true), decide[1]];
        let of = Layout::arranged(three.to_vec(), false).are_texcoords;
        assert_eq!([of[0][6], of[0][7], of[1][0], of[1][1]], [0.0, 1.0, 1.0, 0.0]);
        assert_eq!(counts(&[]), (5, 5, 5, false));
        assert_eq!(counts(&[(Kind::Tangent, 4)]), (5, 8, 9, false));
        assert_eq!(counts(&[(Kind::Linear, 2), (Kind::Linear, 1), (Kind::Linear, 1)]), (5, 8, 9, true));
        assert_eq!(counts(&[(Kind::Joints, 2), (Kind::Linear, 1)]), (5, 5, 8, true));
        // Where nothing decides, nothing is summed.
        let plane = Layout::arranged(vec![(layer(Kind::Linear, 1), false)], false);
        assert_eq!((plane.summed, plane.has_others), (0, true));
    }

    #[test]
    fn numbers_that_decide_come_first_and_stay_finite() {
        let mut mesh = shapes::plane(2, 2);
        mesh.colors = Some(vec![[f32::MAX, f32::NAN, 0.5, -1.0]; mesh.positions.len()]);
        mesh.normals = Some(vec![Vec3::Z; mesh.positions.len()]);
        let frame = Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds());
        let mut options = Attributes::default();
        (options.weights.normal, options.weights.color) = (0.0, 1e6);
        let layout = Layout::new(&mesh, &options, Metric::Volume, frame, false).expect("attributes");
        assert_eq!((layout.costed, layout.width), (4, 7));
        let mut row = vec![7.0; layout.width];
        layout.read(&mesh, 0, 0, &mut row);
        let [colors, normals] = [Origin::Colors, Origin::Normals]
            .map(|origin| *layout.layers.iter().find(|layer| layer.origin == origin).expect("a layer"));
        assert_eq!(
            (colors.first, &colors.of(&row)[..2], normals.of(&row)),
            (0, &[MOST, 0.0][..], &[0.0, 0.0, 1.0][..])
        );
        assert!(row.iter().all(|x| x.is_finite()));
    }
}
