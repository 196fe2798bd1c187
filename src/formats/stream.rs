//! The vertices and faces of a binary file, read in pieces with buffers of fixed size: for meshes that do not fit the memory.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::ply::Tables;
use super::stl::Facets;
use super::{Compression, Format, not_finite};
use crate::error::{Error, Place, Result};
use crate::math::DVec3;
use crate::mesh::{Mesh, first_where};

/// Rows that a thread decodes at a time.
pub(super) const LEAST_ROWS: usize = 1 << 12;

/// A mesh file whose rows have one size.
#[derive(Debug)]
pub(crate) enum Stream {
    /// A binary PLY of triangles.
    Ply(Box<Tables>),
    /// A binary STL: every corner of a facet is a vertex of its own.
    Stl(Facets),
}

/// What a mesh made of rows holds beside positions and faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rows {
    pub normals: bool,
    pub colors: bool,
}

impl Stream {
    /// Opens the file at `path` and reads its header.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for what cannot be read in pieces, and why; [`Error::Format`] and [`Error::Read`] as when it
    /// is read at once.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let (format, compression) = Format::from_path(path)?;
        if compression != Compression::None {
            return Err(refused("a compressed file"));
        }
        let failed = |source| Error::Read { path: path.to_path_buf(), source };
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if !metadata.is_file() {
            return Err(refused("what is no file"));
        }
        match format {
            Format::Ply => Tables::open(path, metadata.len()).map(|tables| Self::Ply(tables.into())),
            Format::Stl => Facets::open(path, metadata.len()).map(Self::Stl),
            Format::Obj | Format::Off | Format::Gltf | Format::Glb => {
                Err(refused(&format!("a file of the format {}", format.name())))
            }
        }
    }

    /// The tables in two files of rows, which [`Rows`] made; `path` names them in errors.
    pub(crate) fn of_rows(rows: Rows, path: &Path, files: [File; 2], counts: [usize; 2]) -> Result<Self> {
        Tables::of_rows(rows, path, files, counts).map(|tables| Self::Ply(tables.into()))
    }

    pub(crate) fn vertex_count(&self) -> usize {
        match self {
            Self::Ply(tables) => tables.vertex_count(),
            Self::Stl(facets) => 3 * facets.count(),
        }
    }

    pub(crate) fn face_count(&self) -> usize {
        match self {
            Self::Ply(tables) => tables.face_count(),
            Self::Stl(facets) => facets.count(),
        }
    }

    /// Whether vertices at one position are one whatever is asked for, as there are no others.
    pub(crate) fn repeats_positions(&self) -> bool {
        matches!(self, Self::Stl(_))
    }

    /// What a mesh made of these rows holds beside positions and faces.
    pub(crate) fn rows(&self) -> Rows {
        match self {
            Self::Ply(tables) => tables.rows(),
            Self::Stl(_) => Rows { normals: false, colors: false },
        }
    }

    /// Whether there are texture coordinates, colors of faces, and channels: none is read here.
    pub(crate) fn leaves_out(&self) -> [bool; 3] {
        match self {
            Self::Ply(tables) => tables.leaves_out(),
            Self::Stl(_) => [false; 3],
        }
    }

    /// The positions of these vertices, in the place of what `positions` holds; `room` is for bytes.
    ///
    /// # Errors
    /// [`Error::Format`] where the file ends or a coordinate is not finite.
    pub(crate) fn positions(&self, rows: Range<usize>, room: &mut Vec<u8>, positions: &mut Vec<DVec3>) -> Result<()> {
        match self {
            Self::Ply(tables) => tables.positions(rows, room, positions),
            Self::Stl(facets) => facets.positions(rows, room, positions),
        }
    }

    /// Appends the vertices of these ascending numbers to `mesh`, which holds what [`Stream::rows`] says; when all are there it is to
    /// be [put right](Stream::put_right).
    ///
    /// # Errors
    /// [`Error::Format`] where the file ends.
    pub(crate) fn append_vertices(&self, wanted: &[u32], room: &mut Vec<u8>, mesh: &mut Mesh) -> Result<()> {
        match self {
            Self::Ply(tables) => tables.append_vertices(wanted, room, mesh),
            Self::Stl(facets) => facets.append_vertices(wanted, room, mesh),
        }
    }

    /// These faces, in the place of what `faces` holds; `room` is for bytes.
    ///
    /// # Errors
    /// [`Error::Format`] where the file ends or a corner is no vertex, [`Error::Unsupported`] where a face is no triangle.
    pub(crate) fn faces(&self, rows: Range<usize>, room: &mut Vec<u8>, faces: &mut Vec<[u32; 3]>) -> Result<()> {
        match self {
            Self::Ply(tables) => tables.faces(rows, room, faces),
            Self::Stl(_) => {
                faces.clear();
                faces.extend(rows.map(|row| [0, 1, 2].map(|corner| (3 * row + corner) as u32)));
                Ok(())
            }
        }
    }

    /// Takes what of a mesh of such vertices is not finite to zero, as readers do; returns a sentence where there was any, without
    /// a count, for several parts have the same vertices.
    pub(crate) fn put_right(mesh: &mut Mesh) -> Option<&'static str> {
        not_finite::to_zero(mesh).map(|_| "normals or colors that are not finite are read as zero")
    }

    /// A mesh without rows, ready for [`Stream::append_vertices`].
    pub(crate) fn no_mesh(&self) -> Mesh {
        let Rows { normals, colors } = self.rows();
        Mesh { normals: normals.then(Vec::new), colors: colors.then(Vec::new), ..Mesh::default() }
    }
}

/// The error for what cannot be read in pieces.
pub(super) fn refused(what: &str) -> Error {
    Error::Unsupported(format!("{what}: only binary PLY and STL are read in pieces"))
}

/// Rows of one size in a file.
#[derive(Debug)]
pub(super) struct Table {
    pub path: PathBuf,
    pub file: File,
    pub start: u64,
    pub count: usize,
    pub row_bytes: usize,
}

impl Table {
    /// Reads these rows into `room`, which becomes as long.
    ///
    /// # Errors
    /// [`Error::Format`] of `format` where the file ends.
    pub fn read<'a>(&self, rows: Range<usize>, room: &'a mut Vec<u8>, format: &'static str) -> Result<&'a [u8]> {
        let at = self.place(rows.start);
        room.resize(rows.len() * self.row_bytes, 0);
        let mut file = &self.file;
        match file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(room)) {
            Ok(()) => Ok(room),
            Err(source) if source.kind() == io::ErrorKind::UnexpectedEof => {
                let message = format!("the file ends before the {} rows that the header promises", self.count);
                Err(Error::format(format, Place::Byte(at), message))
            }
            Err(source) => Err(Error::Read { path: self.path.clone(), source }),
        }
    }

    /// Where a row starts, in bytes.
    pub fn place(&self, row: usize) -> u64 {
        self.start + row as u64 * self.row_bytes as u64
    }
}

/// Refuses a position that is not finite; `place` tells where the vertices from `first` on stand.
///
/// # Errors
/// [`Error::Format`] of `format`.
pub(super) fn check_finite(
    positions: &[DVec3],
    first: usize,
    format: &'static str,
    place: impl Fn(usize) -> u64,
) -> Result<()> {
    match first_where(positions, |position| !position.is_finite()) {
        None => Ok(()),
        Some(at) => {
            let (vertex, found) = (first + at, positions[at]);
            let message = format!("found vertex {vertex} at {found}, expected finite coordinates");
            Err(Error::format(format, Place::Byte(place(vertex)), message))
        }
    }
}
