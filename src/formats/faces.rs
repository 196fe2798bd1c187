//! What writers take for faces: the triangles of a mesh, or polygons in their place.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{Format, WriteOptions, obj, output, ply};
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

/// Writes `polygons` in the place of the faces of `mesh` to the OBJ or PLY file at `path`, as atomically as
/// [`write`](super::write()).
///
/// A polygon has the color of its first face. Texture coordinates, which belong to triangles, are left out.
///
/// # Errors
/// As [`write`](super::write()); [`Error::Unsupported`] for another format, [`Error::Mesh`] where they are no polygons of the mesh.
pub fn write_polygons(mesh: &Mesh, polygons: &Polygons, path: &Path, options: &WriteOptions) -> Result<()> {
    let (format, compression) = Format::from_path(path)?;
    check(mesh, polygons, format)?;
    output::atomically(path, |file| {
        output::compressed(file, compression, |out| encode(mesh, polygons, format, options, out))
    })
    .map_err(|source| Error::Write { path: path.to_path_buf(), source })
}

/// Writes `polygons` in the place of the faces of `mesh`, uncompressed, to a stream, and flushes it.
///
/// # Errors
/// As [`write_polygons`]; [`Error::Write`] names the stream `-`.
pub fn write_polygons_to(
    mesh: &Mesh,
    polygons: &Polygons,
    format: Format,
    options: &WriteOptions,
    out: &mut dyn Write,
) -> Result<()> {
    check(mesh, polygons, format)?;
    encode(mesh, polygons, format, options, out)
        .and_then(|()| out.flush())
        .map_err(|source| Error::Write { path: PathBuf::from("-"), source })
}

fn check(mesh: &Mesh, polygons: &Polygons, format: Format) -> Result<()> {
    if !format.writes_polygons() {
        let name = format.name();
        return Err(Error::Unsupported(format!("polygons in {name}: write them as OBJ or PLY, or write triangles")));
    }
    mesh.check()?;
    polygons.check(mesh)
}

fn encode(
    mesh: &Mesh,
    polygons: &Polygons,
    format: Format,
    options: &WriteOptions,
    out: &mut dyn Write,
) -> io::Result<()> {
    match format {
        Format::Obj => obj::write(mesh, Faces::Polygons(polygons), (&[], mesh.materials.as_ref()), out),
        Format::Ply => ply::write(mesh, Faces::Polygons(polygons), options, (None, &[]), out),
        Format::Stl | Format::Off | Format::Gltf | Format::Glb => Err(io::ErrorKind::Unsupported.into()),
    }
}
