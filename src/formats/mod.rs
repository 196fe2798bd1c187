//! Reading and writing mesh files.
//!
//! The format follows from the extension and is checked against the content; `.gz` and `.zst` behind it compress.
//!
//! | format | extension | text | binary | positions | normals | colors | face colors | texture coordinates | faces read |
//! |--------|-----------|------|--------|-----------|---------|--------|-------------|---------------------|------------|
//! | OBJ | obj | yes | no | f64 | yes | rgb | no | yes | polygons |
//! | PLY | ply | yes | yes | f32 or f64 | yes | rgba | rgba | yes | polygons |
//! | STL | stl | yes | yes | f32 | no | no | no | no | triangles |
//! | OFF | off | yes | no | f64 | yes | rgba | rgba | no | polygons |
//! | glTF | gltf | yes | no | f32 | yes | rgba | no | yes | triangles |
//! | GLB | glb | no | yes | f32 | yes | rgba | no | yes | triangles |
//!
//! The same table as data is [`Format::traits`]. What every reader does:
//! - polygons become triangles, concave ones by ear clipping ([`earcut`]), and keep every corner; where a polygon has edges
//!   both ways, the bridges between its outline and its holes, these stay holes;
//! - coordinates must be finite, indices in range, and there must be a face, or it is [`Error::Format`] with the place;
//! - a count in a header is believed only as far as the bytes that follow can hold it;
//! - colors become `[0, 1]` with alpha 1 where none is stored; normals become unit length, zero where a vertex has none;
//! - texture coordinates belong to corners, zero where a corner has none or one that is not finite; those that a file has
//!   at its vertices (PLY, OFF with `ST`) are given to the corners, and what no corner has is none;
//! - numbers of normals, colors and what else vertices have that are not finite in single precision are zero, all of a normal
//!   where one is (a color in OBJ is refused), and [`Scene::warnings`] counts these and such texture coordinates;
//! - a polygon's color goes to each of its triangles;
//! - what OBJ and glTF tell of materials becomes [`Mesh::materials`], what PLY and glTF have at vertices beside the standard
//!   attributes becomes [`Mesh::channels`]; a vertex with several normals in an OBJ is repeated.
//!
//! What a file holds that is no mesh (nodes, textures, comments) is its [`Document`], which [`read_scene`] reads along and
//! [`write_scene`] puts into a file of the same format; materials and their pictures pass between OBJ and glTF.
//!
//! Text is written with the fewest digits that read back as the same number. Text STL therefore keeps f64 positions.
//! The bytes written do not depend on the number of threads.

mod attributes;
mod convert;
mod faces;
mod gltf;
mod input;
mod looks;
mod material;
mod not_finite;
mod obj;
mod off;
mod output;
mod pieces;
mod ply;
mod polygon;
mod property;
mod scene;
mod scratch;
mod size;
mod stl;
mod stream;
mod text;

use std::io::{self, Write};
use std::path::Path;

use crate::error::{Error, Result};
use crate::mesh::Mesh;

pub use convert::file_beside;
pub use gltf::Gltf;
pub use looks::{Looks, looks};
pub use obj::Libraries;
pub(crate) use output::{stem_of_temporary, temporary_stem};
pub use pieces::write_pieces;
pub use ply::Notes;
pub use property::{Weights, read_indices, read_numbers, read_property, write_with_property};
pub use scene::{
    Document, Scene, read_scene, read_scene_bytes, read_scene_from, write_polygons, write_polygons_to, write_scene,
    write_scene_to,
};
pub(crate) use scratch::{Scratch, ScratchFile};
pub use size::FileSize;
pub(crate) use stream::{Rows, Stream};

/// A mesh file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY.
    Ply,
    /// STL, triangles without shared vertices; equal positions are joined on reading.
    Stl,
    /// Geomview OFF with its `C` and `N` variants.
    Off,
    /// glTF 2.0 as JSON, with its bytes in a file beside it.
    Gltf,
    /// glTF 2.0 in one binary file.
    Glb,
}

/// How the bytes of a file are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compression {
    /// Not at all.
    #[default]
    None,
    /// gzip, `.gz`.
    Gzip,
    /// Zstandard, `.zst`.
    Zstd,
}

/// What a format carries; one row of the table in the module's documentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traits {
    /// Upper-case name.
    pub name: &'static str,
    /// File extension without the dot.
    pub extension: &'static str,
    /// Whether a text form can be written.
    pub text: bool,
    /// Whether a binary form can be written; it is the default where there is one.
    pub binary: bool,
    /// The number type of written positions.
    pub positions: &'static str,
    /// Whether vertex normals are carried.
    pub normals: bool,
    /// The channels of vertex colors, empty for none.
    pub colors: &'static str,
    /// The channels of face colors, empty for none.
    pub face_colors: &'static str,
    /// Whether texture coordinates are carried.
    pub texcoords: bool,
    /// The faces a file may hold.
    pub faces: &'static str,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 6] = [Self::Obj, Self::Ply, Self::Stl, Self::Off, Self::Gltf, Self::Glb];

    /// What the format carries.
    pub const fn traits(self) -> Traits {
        let polygons = Traits {
            name: "",
            extension: "",
            text: true,
            binary: false,
            positions: "f64",
            normals: true,
            colors: "rgba",
            face_colors: "rgba",
            texcoords: true,
            faces: "polygons",
        };
        match self {
            Self::Obj => Traits { name: "OBJ", extension: "obj", colors: "rgb", face_colors: "", ..polygons },
            Self::Ply => Traits { name: "PLY", extension: "ply", binary: true, positions: "f32 or f64", ..polygons },
            Self::Stl => Traits {
                name: "STL",
                extension: "stl",
                binary: true,
                positions: "f32",
                normals: false,
                colors: "",
                face_colors: "",
                texcoords: false,
                faces: "triangles",
                ..polygons
            },
            Self::Off => Traits { name: "OFF", extension: "off", texcoords: false, ..polygons },
            Self::Gltf | Self::Glb => {
                let gltf = Traits { positions: "f32", face_colors: "", faces: "triangles", ..polygons };
                match self {
                    Self::Gltf => Traits { name: "glTF", extension: "gltf", ..gltf },
                    _ => Traits { name: "GLB", extension: "glb", text: false, binary: true, ..gltf },
                }
            }
        }
    }

    /// Whether polygons can be written: [`write_polygons`].
    pub const fn writes_polygons(self) -> bool {
        matches!(self, Self::Obj | Self::Ply)
    }

    /// The upper-case name that errors use.
    pub const fn name(self) -> &'static str {
        self.traits().name
    }

    /// The format called `name`: an extension in any case, with or without a leading dot.
    ///
    /// # Errors
    /// [`Error::Unsupported`] names the known formats.
    pub fn from_name(name: &str) -> Result<Self> {
        let wanted = name.strip_prefix('.').unwrap_or(name);
        Self::ALL
            .into_iter()
            .find(|format| format.traits().extension.eq_ignore_ascii_case(wanted))
            .ok_or_else(|| Error::Unsupported(format!("the format '{name}'; known are {KNOWN}")))
    }

    /// The format and compression that the extensions of `path` name, in any case.
    ///
    /// # Errors
    /// [`Error::Unsupported`] names the known extensions.
    pub fn from_path(path: &Path) -> Result<(Self, Compression)> {
        let (compression, stem) = match extension(path).as_str() {
            "gz" => (Compression::Gzip, path.with_extension("")),
            "zst" => (Compression::Zstd, path.with_extension("")),
            _ => (Compression::None, path.to_path_buf()),
        };
        let name = extension(&stem);
        if name.is_empty() {
            return Err(Error::Unsupported(format!(
                "'{}' has no extension that names a mesh format; known are {KNOWN}, each also with .gz or .zst",
                path.display()
            )));
        }
        match Self::from_name(&name) {
            Ok(format) => Ok((format, compression)),
            Err(_) => Err(Error::Unsupported(format!(
                "the extension '.{name}' of '{}'; known are {KNOWN}, each also with .gz or .zst",
                path.display()
            ))),
        }
    }
}

const KNOWN: &str = "obj, ply, stl, off, gltf, glb";

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Reads the mesh at `path`.
///
/// Plain files are mapped into memory, so the file must not be cut short by another program meanwhile.
///
/// # Errors
/// [`Error::Unsupported`] for an unknown extension, [`Error::Read`] when the system cannot open or read the file,
/// [`Error::Format`] with the place when its content is not what the format demands, [`Error::Limit`] when it holds
/// more than 32-bit indices can.
pub fn read(path: &Path) -> Result<Mesh> {
    read_scene(path).map(Scene::into_mesh)
}

/// Reads a mesh of `format` from the uncompressed content of a file; [`read_scene_bytes`] also tells of what was not read as it
/// stands there.
///
/// # Errors
/// As [`read`], without those of the system.
pub fn read_bytes(bytes: &[u8], format: Format) -> Result<Mesh> {
    read_scene_bytes(bytes, format, None).map(Scene::into_mesh)
}

/// Reads a mesh of `format` from a stream to its end, such as standard input.
///
/// # Errors
/// As [`read`]; [`Error::Read`] names the stream `-`.
pub fn read_from(stream: &mut dyn io::Read, format: Format, compression: Compression) -> Result<Mesh> {
    read_scene_from(stream, format, compression, None).map(Scene::into_mesh)
}

/// The content of a compressed file of these bytes; none where it is not compressed.
///
/// # Errors
/// [`Error::Format`] where the compressed data breaks or its beginning is no mesh; [`Error::Limit`] when there are more bytes
/// than `most`, of which no more are unpacked.
pub fn unpack(stored: &[u8], format: Format, compression: Compression, most: u64) -> Result<Option<Vec<u8>>> {
    input::decompress(stored, format, compression, most)
}

/// How to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WriteOptions {
    /// Write text where the format also has a binary form (PLY, STL).
    pub ascii: bool,
}

/// Writes `mesh` to `path` in the format and compression its extensions name.
///
/// Atomic: the bytes go to a temporary name in the same folder, which is renamed when all of them are on the disk. A
/// symbolic link is followed; a path that exists and is no regular file, such as a device, is written in place.
///
/// # Errors
/// [`Error::Unsupported`] for an unknown extension, [`Error::Mesh`] for an invalid mesh, [`Error::Write`] with the
/// path when the system refuses; then nothing is left behind and a file already there is untouched.
pub fn write(mesh: &Mesh, path: &Path, options: &WriteOptions) -> Result<()> {
    write_scene(mesh, &Document::None, path, options).map(drop)
}

/// Writes faces that share the vertices of `mesh` to the OBJ file at `path`, an object for each name, as atomically as
/// [`write()`]. The faces and texture coordinates of `mesh` itself are left out.
///
/// # Errors
/// As [`write()`]; [`Error::Unsupported`] for another format, [`Error::Mesh`] for a corner that is no vertex.
pub fn write_objects(mesh: &Mesh, objects: &[(String, &[[u32; 3]])], path: &Path) -> Result<()> {
    let (format, compression) = Format::from_path(path)?;
    if format != Format::Obj {
        return Err(Error::Unsupported(format!("several objects in {}: write them as OBJ", format.name())));
    }
    mesh.check()?;
    let count = mesh.positions.len();
    if objects.iter().any(|(_, faces)| faces.as_flattened().iter().any(|&corner| corner as usize >= count)) {
        return Err(Error::Mesh(format!("a face of an object has a corner that is none of the {count} vertices")));
    }
    output::atomically(path, |file| output::compressed(file, compression, |out| obj::write_objects(mesh, objects, out)))
        .map_err(|source| Error::Write { path: path.to_path_buf(), source })
}

/// Writes a finished file that is no mesh, such as a picture, as atomically as [`write()`].
///
/// # Errors
/// [`Error::Write`] with the path when the system refuses; then a file already there is untouched.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    output::atomically(path, |file| file.write_all(bytes))
        .map_err(|source| Error::Write { path: path.to_path_buf(), source })
}

/// Writes `mesh` in `format`, uncompressed, to a stream such as standard output, and flushes it.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh; [`Error::Write`] names the stream `-`.
pub fn write_to(mesh: &Mesh, format: Format, options: &WriteOptions, out: &mut dyn Write) -> Result<()> {
    write_scene_to(mesh, &Document::None, format, options, out).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_name_format_and_compression() {
        for (path, expected) in [
            ("a.obj", (Format::Obj, Compression::None)),
            ("a.b/C.PLY", (Format::Ply, Compression::None)),
            ("a.stl.GZ", (Format::Stl, Compression::Gzip)),
            ("x.y.Off.zst", (Format::Off, Compression::Zstd)),
        ] {
            assert_eq!(Format::from_path(Path::new(path)).ok(), Some(expected), "{path}");
        }
        for path in ["a", "a.gz", "a.fbx", "obj", ".ply", "a.ply.bz2", ""] {
            let error = Format::from_path(Path::new(path)).unwrap_err();
            assert!(matches!(&error, Error::Unsupported(m) if m.contains(KNOWN)), "{path}: {error}");
        }
        assert_eq!(Format::from_name(".StL").ok(), Some(Format::Stl));
        assert!(Format::from_name("fbx").is_err());
    }

    #[test]
    fn the_documented_table_is_the_data() {
        let yes = |b| if b { "yes" } else { "no" };
        for format in Format::ALL {
            let t = format.traits();
            let [colors, face_colors] = [t.colors, t.face_colors].map(|c| if c.is_empty() { "no" } else { c });
            let texcoords = yes(t.texcoords);
            let head = [t.name, t.extension, yes(t.text), yes(t.binary), t.positions];
            let cells = [&head[..], &[yes(t.normals), colors, face_colors, texcoords, t.faces]].concat();
            let row = format!("//! | {} |", cells.join(" | "));
            assert!(include_str!("mod.rs").lines().any(|line| line == row), "missing in the table: {row}");
        }
    }
}
