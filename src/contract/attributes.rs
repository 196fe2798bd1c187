//! What becomes of attributes in a run: which are kept, and what they count against distances.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::mesh::{Channel, ChannelKind, Dropped, Mesh, Normals};

/// Greatest weight of an attribute.
const MOST_WEIGHT: f32 = 1e6;

/// What a difference in an attribute counts against a distance; 0 for one that is carried along and decides nothing, but that its
/// seams hold: leaving it out frees what they hold ([`Attributes::dropped`]).
///
/// By the [`Volume`](super::Metric::Volume) metric alone. The other accumulates quadrics of planes, and attributes are carried.
#[derive(Debug, Clone, PartialEq)]
pub struct AttributeWeights {
    /// Normals: a difference of 1, about a radian, counts as a distance of this share of a thousandth of the diagonal.
    pub normal: f32,
    /// Texture coordinates: a slip of the texture along the surface counts as this share of its length.
    pub texcoord: f32,
    /// Colors: a difference of 1, from black to full red, counts as a distance of this share of a fiftieth of the diagonal.
    pub color: f32,
    /// How vertices move: what a morph target displaces counts as this share of its length, and where limbs bend the distance of
    /// the joints on either side; as far as there is room for numbers that decide, 16 in all. Targets that are given a weight by
    /// name are left out of it.
    pub pose: f32,
    /// Further channels by name: the whole range of a channel counts as a distance of this share of a fiftieth of the
    /// diagonal; texture coordinates and tangents as those above. Labels that are given one, be it 0, are amounts.
    pub channels: Arc<[(String, f32)]>,
}

impl Default for AttributeWeights {
    fn default() -> Self {
        Self { normal: 0.7, texcoord: 0.25, color: 1.0, pose: 0.1, channels: Arc::new([]) }
    }
}

impl AttributeWeights {
    /// Attributes are carried and decide nothing.
    pub fn none() -> Self {
        Self { normal: 0.0, texcoord: 0.0, color: 0.0, pose: 0.0, channels: Arc::new([]) }
    }

    /// What a user should know of weights for channels that `mesh` has not.
    pub(super) fn warnings<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = String> + 'a {
        let is_known = |name: &str| mesh.channels.iter().any(|channel| channel.name == name);
        let unknown = self.channels.iter().filter(move |(name, _)| !is_known(name));
        let unknown = unknown
            .map(|(name, _)| format!("no channel '{name}' to give a weight to: the mesh has {}", mesh.channel_names()));
        let joints = mesh.channels.iter().filter(|channel| channel.kind == ChannelKind::Joints);
        let given = joints.filter(|channel| self.of_channel(&channel.name).is_some());
        let named = |channel: &Channel| {
            format!("the weight of '{}' counts nothing: the one of joints is called 'pose'", channel.name)
        };
        unknown.chain(given.map(named))
    }

    /// The weight of the channel of this name, if it was given.
    pub(super) fn of_channel(&self, name: &str) -> Option<f32> {
        self.channels.iter().find(|(known, _)| known == name).map(|(_, weight)| *weight)
    }
}

/// What a difference between two colors is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorSpace {
    /// That of red, green and blue, as they are stored.
    #[default]
    Rgb,
    /// That of CIE L\*u\*v\*, where equal differences look about equal: 60 count as a channel from 0 to 1.
    Luv,
}

/// What becomes of seams of the texture, creases and borders between materials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seams {
    /// Where they would keep more faces than are asked for, they yield: creases first, then corners of other seams, then all.
    /// Where creases would keep more than a fifth of the faces asked for, and most of the others have to go, they yield if the
    /// estimated error is lower then, but not under a limit to the error.
    /// Where at last seams refuse an eighth of the pairs, or, of a third of the faces or fewer, keep two fifths by themselves, or
    /// the estimated error is past 2 % of the diagonal and they refuse any, all yield if it is at most 0.8 times as great then.
    /// Textures do not fold for it, and materials stay closed. Not with [`Placement::Endpoint`](super::Placement::Endpoint),
    /// whose vertices are those of the input, nor where parts join, nor for a log.
    #[default]
    Yield,
    /// A vertex where they meet or end stays, and a run may get stuck.
    Hold,
}

/// What becomes of what vertices, corners and faces carry.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Attributes {
    /// What they count.
    pub weights: AttributeWeights,
    /// What becomes of normals.
    pub normals: Normals,
    /// What is left out.
    pub dropped: Dropped,
    /// What differences between colors are, where these decide.
    pub color_space: ColorSpace,
    /// What becomes of seams that are in the way of the number of faces asked for.
    pub seams: Seams,
    /// Whether vertices on seams, creases and borders between materials stay where they are.
    pub lock_seams: bool,
    /// Whether a vertex has one normal and one color, the means of what its corners have, and nothing tears: what a log holds,
    /// and what parts of a mesh can be put together by. Texture coordinates, materials and channels are left out then.
    pub smooth: bool,
}

impl Attributes {
    /// Positions alone.
    pub fn drop_all() -> Self {
        let dropped = Dropped { normals: true, colors: true, texcoords: true, materials: true, channels: true };
        Self { dropped, ..Self::default() }
    }

    /// Whether the result's normals are found from its faces, also where the input has none.
    pub(super) fn recomputes(&self) -> bool {
        self.normals == Normals::Recompute && !self.dropped.normals
    }

    pub(super) fn check(&self) -> Result<()> {
        let AttributeWeights { normal, texcoord, color, pose, channels } = &self.weights;
        let own = [("normal", *normal), ("uv", *texcoord), ("color", *color), ("pose", *pose)];
        let channels = channels.iter().map(|(name, weight)| (name.as_str(), *weight));
        for (name, weight) in own.into_iter().chain(channels) {
            if !(0.0..=MOST_WEIGHT).contains(&weight) {
                return Err(Error::Parameter(format!(
                    "the weight of '{name}' is {weight}, not in 0 … {MOST_WEIGHT:e}"
                )));
            }
        }
        Ok(())
    }
}
