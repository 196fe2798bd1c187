//! What writers take for faces: the triangles of a mesh, or polygons in their place.

use super::Format;
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::mesh::{Mesh, Polygons};

/// Faces with their corners.
#[derive(Clone, Copy)]
pub(super) enum Faces<'a> {
    Triangles(&'a [[u32; 3]]),
    Polygons(&'a Polygons),
}

impl<'a> Faces<'a> {
    /// The triangles of a mesh.
    pub fn of(mesh: &'a Mesh) -> Self {
        Self::Triangles(&mesh.faces)
    }

    /// The triangles of `mesh` where these are triangles; polygons stay what they are.
    pub fn of_same_kind(self, mesh: &'a Mesh) -> Self {
        match self {
            Self::Triangles(_) => Self::of(mesh),
            Self::Polygons(_) => self,
        }
    }

    pub fn len(self) -> usize {
        match self {
            Self::Triangles(faces) => faces.len(),
            Self::Polygons(polygons) => polygons.len(),
        }
    }

    #[inline]
    pub fn corners(self, face: usize) -> &'a [u32] {
        match self {
            Self::Triangles(faces) => &faces[face],
            Self::Polygons(polygons) => polygons.corners_of(face),
        }
    }

    pub fn most_corners(self) -> usize {
        match self {
            Self::Triangles(_) => 3,
            Self::Polygons(polygons) => polygons.iter().map(<[u32]>::len).max().unwrap_or(0),
        }
    }

    /// The first triangle of a face, whose color it has.
    pub fn triangle(self, face: usize) -> usize {
        match self {
            Self::Triangles(_) => face,
            Self::Polygons(polygons) => polygons.first_face(face),
        }
    }

    /// Texture coordinates belong to the corners of triangles.
    pub fn texcoords(self, mesh: &'a Mesh) -> Option<&'a [[Vec2; 3]]> {
        match self {
            Self::Triangles(_) => mesh.texcoords.as_deref(),
            Self::Polygons(_) => None,
        }
    }
}

/// Checks that `polygons` can stand in the place of the faces of `mesh` in a file of `format`.
///
/// # Errors
/// [`Error::Unsupported`] for a format without polygons, [`Error::Mesh`] where they are none of the mesh.
pub(super) fn check_polygons(mesh: &Mesh, polygons: &Polygons, format: Format) -> Result<()> {
    if !format.writes_polygons() {
        let name = format.name();
        return Err(Error::Unsupported(format!("polygons in {name}: write them as OBJ or PLY, or write triangles")));
    }
    polygons.check(mesh)
}
