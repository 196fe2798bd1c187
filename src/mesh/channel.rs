//! What vertices and faces carry beside the standard attributes: channels of numbers, materials.

use super::{Mesh, first_where};
use crate::error::{Error, Result};

/// How the numbers of a [`Channel`] pass from the vertices of a face to a point between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChannelKind {
    /// Each by itself, linearly: a scalar, a color.
    Linear,
    /// What a morph target adds to a position: three lengths, linearly.
    Displacement,
    /// Pairs u, v of a further set of texture coordinates: linearly, and a face may not turn over in them.
    Texcoords,
    /// A unit vector and a sign, as the tangents of glTF: the vector linearly and at unit length, the sign of the nearest.
    Tangent,
    /// Whole numbers that name something, a class or an object: those of the nearest corner, never any between. Exact up to 2²⁴.
    Label,
    /// Numbers of joints, then as many weights of them: weights of a joint add up, the greatest stay, their sum is 1.
    Joints,
}

/// Numbers at every vertex, under the name that they have in files.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Its name: `confidence`, `TANGENT`, `TEXCOORD_1`.
    pub name: String,
    /// How they are interpolated.
    pub kind: ChannelKind,
    /// Numbers a vertex.
    pub width: usize,
    /// `width` numbers for each vertex.
    pub values: Vec<f32>,
}

impl Channel {
    /// The numbers of a vertex.
    pub fn row(&self, vertex: usize) -> &[f32] {
        &self.values[vertex * self.width..(vertex + 1) * self.width]
    }

    /// The channel of the vertices `order`.
    pub(crate) fn take(&self, order: &[u32]) -> Self {
        let values = order.iter().flat_map(|&vertex| self.row(vertex as usize)).copied().collect();
        Self { name: self.name.clone(), kind: self.kind, width: self.width, values }
    }

    /// Whether it has a row for each of so many vertices, of numbers that go with its kind.
    pub(super) fn check(&self, vertices: usize) -> Result<()> {
        let Self { name, width, .. } = self;
        let fits = match self.kind {
            ChannelKind::Linear | ChannelKind::Label => *width > 0,
            ChannelKind::Displacement => *width == 3,
            ChannelKind::Texcoords => *width == 2,
            ChannelKind::Tangent => *width == 4,
            ChannelKind::Joints => *width > 0 && width.is_multiple_of(2),
        };
        if !fits {
            return Err(Error::Mesh(format!(
                "the channel '{name}' has {width} numbers a vertex, which its kind has not"
            )));
        }
        if self.values.len() != vertices * width {
            let count = self.values.len();
            return Err(Error::Mesh(format!(
                "{count} numbers in the channel '{name}' for {vertices} vertices of {width}"
            )));
        }
        Ok(())
    }
}

impl Mesh {
    /// The names of its channels in a row, for a message.
    pub(crate) fn channel_names(&self) -> String {
        let names: Vec<&str> = self.channels.iter().map(|channel| channel.name.as_str()).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    }
}

/// What every face is made of: borders between materials hold as seams do.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Materials {
    /// A number into `names`, one a face.
    pub of_face: Vec<u32>,
    /// The names, as the file tells them: faces without a material have the empty one.
    pub names: Vec<String>,
}

impl Materials {
    /// Whether every face has one of the names.
    pub(super) fn check(&self, faces: usize) -> Result<()> {
        if self.of_face.len() != faces {
            return Err(Error::Mesh(format!("{} materials for {faces} faces", self.of_face.len())));
        }
        match first_where(&self.of_face, |&material| material as usize >= self.names.len()) {
            Some(f) => {
                let (number, count) = (self.of_face[f], self.names.len());
                Err(Error::Mesh(format!("face {f} has the material {number}, there are {count}")))
            }
            None => Ok(()),
        }
    }

    /// The same for so many other faces, where all have one.
    pub(crate) fn on_all(&self, faces: usize) -> Option<Self> {
        let &first = self.of_face.first()?;
        let is_one = self.of_face.iter().all(|&material| material == first);
        is_one.then(|| Self { of_face: vec![first; faces], names: self.names.clone() })
    }

    /// Those of the faces `order`.
    pub(crate) fn take(&self, order: &[u32]) -> Self {
        Self { of_face: super::take(&self.of_face, order), names: self.names.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_taken_and_checked() {
        let channel =
            Channel { name: "uv".into(), kind: ChannelKind::Texcoords, width: 2, values: vec![0.0, 1.0, 2.0, 3.0] };
        assert!(channel.check(2).is_ok() && channel.check(3).is_err());
        assert_eq!(channel.take(&[1, 0, 1]).values, [2.0, 3.0, 0.0, 1.0, 2.0, 3.0]);
        assert!(Channel { width: 1, ..channel }.check(4).is_err());
    }

    #[test]
    fn materials_have_names() {
        let materials = Materials { of_face: vec![0, 1, 0], names: vec![String::new(), "wood".into()] };
        assert!(materials.check(3).is_ok() && materials.check(2).is_err());
        assert_eq!(materials.take(&[2, 1]).of_face, [0, 1]);
        assert_eq!(
            (materials.on_all(1), materials.take(&[1]).on_all(2).map(|all| all.of_face)),
            (None, Some(vec![1, 1]))
        );
        assert!(Materials { names: vec![String::new()], ..materials }.check(3).is_err());
    }
}
