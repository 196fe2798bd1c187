//! Which attributes are kept.

use std::borrow::Cow;

use super::{ChannelKind, FACE_COLORS_DROPPED, Mesh};

/// Attributes that are left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Normals.
    pub normals: bool,
    /// Colors of vertices.
    pub colors: bool,
    /// Texture coordinates, of all sets.
    pub texcoords: bool,
    /// Materials, and what their borders hold.
    pub materials: bool,
    /// Every channel that is no set of texture coordinates.
    pub channels: bool,
}

/// What becomes of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Normals {
    /// They are carried, and creases, where the faces of a vertex disagree in them, are kept as seams are.
    #[default]
    Keep,
    /// They are left out while the surface is simplified; those of the result, also where the input has none, are the means of its
    /// faces: [`vertex_normals`](crate::mesh::vertex_normals).
    Recompute,
}

impl Dropped {
    /// The mesh without what is left out.
    pub(crate) fn leave<'a>(&self, mesh: &'a Mesh) -> Cow<'a, Mesh> {
        if *self == Self::default() {
            return Cow::Borrowed(mesh);
        }
        let Self { normals, colors, texcoords, materials, channels } = *self;
        let is_kept = |kind: ChannelKind| if kind == ChannelKind::Texcoords { !texcoords } else { !channels };
        Cow::Owned(Mesh {
            positions: mesh.positions.clone(),
            faces: mesh.faces.clone(),
            normals: mesh.normals.clone().filter(|_| !normals),
            colors: mesh.colors.clone().filter(|_| !colors),
            texcoords: mesh.texcoords.clone().filter(|_| !texcoords),
            face_colors: mesh.face_colors.clone(),
            channels: mesh.channels.iter().filter(|channel| is_kept(channel.kind)).cloned().collect(),
            materials: mesh.materials.clone().filter(|_| !materials),
        })
    }
}

/// What a run says that carries normals and colors of vertices alone `through` something.
pub(crate) fn dropped_through(mesh: &Mesh, through: &str) -> Vec<String> {
    let mut dropped = Vec::new();
    for (what, is_there) in [
        ("texture coordinates", mesh.texcoords.is_some()),
        ("further properties of vertices", !mesh.channels.is_empty()),
    ] {
        dropped.extend(is_there.then(|| format!("{what} are dropped: they are not carried through {through}")));
    }
    dropped.extend(mesh.face_colors.is_some().then(|| FACE_COLORS_DROPPED.into()));
    dropped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::mesh::{Channel, Materials, shapes};

    #[test]
    fn what_is_left_out_is_gone() {
        let mut mesh = shapes::tetrahedron();
        mesh.texcoords = Some(vec![[Vec2::ZERO; 3]; 4]);
        mesh.materials = Some(Materials { of_face: vec![0; 4], names: vec![String::new()] });
        for (name, kind, width) in [("TEXCOORD_1", ChannelKind::Texcoords, 2), ("heat", ChannelKind::Linear, 1)] {
            mesh.channels.push(Channel { name: name.into(), kind, width, values: vec![0.0; 4 * width] });
        }
        assert!(matches!(Dropped::default().leave(&mesh), Cow::Borrowed(_)));
        let bare = Dropped { texcoords: true, ..Dropped::default() }.leave(&mesh).into_owned();
        assert_eq!((bare.texcoords.is_none(), bare.channels.len(), bare.channels[0].name.as_str()), (true, 1, "heat"));
        let bare = Dropped { materials: true, channels: true, ..Dropped::default() }.leave(&mesh).into_owned();
        assert_eq!((bare.materials.is_none(), bare.channels.len(), bare.texcoords.is_some()), (true, 1, true));
        bare.check().expect("a valid mesh");
    }
}
