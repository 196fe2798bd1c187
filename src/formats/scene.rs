//! A mesh with what its file says beside it.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::faces::{Faces, check_polygons};
use super::{Compression, Format, WriteOptions, convert, gltf, input, not_finite, obj, off, output, ply, stl};
use crate::error::{Error, Place, Result};
use crate::mesh::{ChannelKind, Materials, Mesh, Polygons};

/// What a file holds that is no mesh. It goes into a file of the same format.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub enum Document {
    /// Nothing.
    #[default]
    None,
    /// The libraries of materials of an OBJ file.
    Obj(obj::Libraries),
    /// The comments of a PLY file, and what of it is not read.
    Ply(ply::Notes),
    /// Nodes, materials, textures, skins, animations of a glTF file.
    Gltf(Box<gltf::Gltf>),
}

/// A mesh and the rest of its file.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// All triangles. Texture coordinates are as the file has them: in a glTF v runs down the picture, in others up.
    pub mesh: Mesh,
    /// What is no triangle.
    pub document: Document,
    /// What was not read as it stands there, a sentence each.
    pub warnings: Vec<String>,
}

impl Scene {
    /// The mesh alone, with v up the picture.
    pub fn into_mesh(self) -> Mesh {
        let Self { mut mesh, document, .. } = self;
        if document.gltf().is_some() {
            turn_textures(&mut mesh);
        }
        mesh
    }
}

impl Scene {
    /// The scene with the faces that all nodes of a glTF show, where several have one mesh, which is simplified once; as it is
    /// where that cannot be told, and why. An invalid mesh stays as it is. For what is measured, or written without nodes: in a file
    /// with nodes each of them shows it all.
    #[must_use]
    pub fn with_instances(self) -> (Self, Option<String>) {
        match self.document.all_shown(&self.mesh) {
            (Cow::Owned(mesh), _) => {
                (Self { mesh, document: self.document.without_instances(), warnings: self.warnings }, None)
            }
            (Cow::Borrowed(_), untold) => (self, untold),
        }
    }

    /// What every face is made of, by the material alone: parts and groups of one material are one.
    pub fn materials(&self) -> Option<Materials> {
        convert::materials(&self.mesh, &self.document)
    }
}

/// Turns texture coordinates upside down.
fn turn_textures(mesh: &mut Mesh) {
    mesh.texcoords.iter_mut().flatten().flatten().for_each(|uv| uv.y = 1.0 - uv.y);
    for channel in mesh.channels.iter_mut().filter(|channel| channel.kind == ChannelKind::Texcoords) {
        channel.values.iter_mut().skip(1).step_by(2).for_each(|v| *v = 1.0 - *v);
    }
}

/// The mesh with texture coordinates as `format` has them, where the document's are the other way up.
fn turned_for<'a>(mesh: &'a Mesh, document: &Document, format: Format) -> Cow<'a, Mesh> {
    let is_down = matches!(format, Format::Gltf | Format::Glb);
    let has_any = mesh.texcoords.is_some() || mesh.channels.iter().any(|c| c.kind == ChannelKind::Texcoords);
    if is_down == document.gltf().is_some() || !has_any {
        return Cow::Borrowed(mesh);
    }
    let mut turned = mesh.clone();
    turn_textures(&mut turned);
    Cow::Owned(turned)
}

/// The mesh as a file of `format` has it, and a sentence for what is lost or has to be known: with its textures up or down, and
/// without nodes with all that they show.
fn as_in<'a>(
    (mesh, faces): (&'a Mesh, Faces<'_>),
    document: &Document,
    format: Format,
    path: Option<&Path>,
) -> (Cow<'a, Mesh>, Vec<String>) {
    let mut told = document.losses(format, path);
    let mesh = turned_for(mesh, document, format);
    let has_nodes = matches!(format, Format::Gltf | Format::Glb);
    let Some(document) = document.gltf().filter(|document| !has_nodes && document.has_instances()) else {
        return (mesh, told);
    };
    let shown = match faces {
        Faces::Triangles(_) => document.instanced(&mesh, format == Format::Obj),
        Faces::Polygons(_) => gltf::Shown::Untold(format!("{}: polygons are not repeated", gltf::ONCE)),
    };
    match shown {
        gltf::Shown::Once => (mesh, told),
        gltf::Shown::All(all) => {
            let more = all.faces.len() - mesh.faces.len();
            told.push(format!("what several nodes show is written for each of them: {more} faces more"));
            (Cow::Owned(all), told)
        }
        gltf::Shown::Untold(why) => {
            told.push(why);
            (mesh, told)
        }
    }
}

/// Reads the mesh at `path` with what the file says beside it.
///
/// # Errors
/// As [`read`](super::read()).
pub fn read_scene(path: &Path) -> Result<Scene> {
    let (format, compression) = Format::from_path(path)?;
    let content = input::open(path, format, compression)?;
    read_scene_bytes(&content, format, path.parent())
}

/// Reads a scene of `format` from the uncompressed content of a file; `folder` is where it looks for files beside it.
///
/// # Errors
/// As [`read_scene`]; [`Error::Unsupported`] for a glTF with bytes in other files, and no folder.
pub fn read_scene_bytes(bytes: &[u8], format: Format, folder: Option<&Path>) -> Result<Scene> {
    input::check_content(bytes, format)?;
    let plain = |mesh| (mesh, Document::None);
    let (mut mesh, document) = match format {
        Format::Obj => obj::read(bytes).map(|(mesh, libraries)| {
            (mesh, Document::Obj(obj::Libraries { folder: folder.map(Path::to_path_buf), ..libraries }))
        }),
        Format::Ply => ply::read(bytes).map(|(mesh, notes)| (mesh, Document::Ply(notes))),
        Format::Stl => stl::read(bytes).map(plain),
        Format::Off => off::read(bytes).map(plain),
        Format::Gltf | Format::Glb => {
            gltf::read(bytes, format, folder).map(|(mesh, document)| (mesh, Document::Gltf(Box::new(document))))
        }
    }?;
    if mesh.faces.is_empty() {
        return Err(Error::format(format.name(), Place::File, "no faces: found none, expected at least one triangle"));
    }
    if mesh.positions.len() > u32::MAX as usize / 2 || mesh.faces.len() > u32::MAX as usize / 3 {
        mesh.check()?;
    }
    let mut warnings = Vec::from_iter(not_finite::to_zero(&mut mesh));
    let has_more = format == Format::Stl && stl::has_more(bytes);
    warnings.extend(has_more.then(|| "numbers beside facets, which some programs keep colors in, are not read".into()));
    warnings.extend(document.gltf().and_then(|document| document.tell_foreign_joints(&mesh)));
    Ok(Scene { mesh, document, warnings })
}

/// Reads a scene of `format` from a stream to its end, such as standard input; `folder` as for [`read_scene_bytes`].
///
/// # Errors
/// As [`read_scene_bytes`]; [`Error::Read`] names the stream `-`.
pub fn read_scene_from(
    stream: &mut dyn io::Read,
    format: Format,
    compression: Compression,
    folder: Option<&Path>,
) -> Result<Scene> {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).map_err(|source| Error::Read { path: PathBuf::from("-"), source })?;
    let content = input::decompress(&bytes, format, compression, u64::MAX)?;
    read_scene_bytes(content.as_deref().unwrap_or(&bytes), format, folder)
}

/// Writes `mesh` to `path` in the format and compression its extensions name, with what `document` says beside it where
/// that is of the same format; returns what is lost or has to be known, a sentence each.
///
/// A mesh that several nodes of a glTF show is written for each of them to a file of another format, which has more faces then.
///
/// Atomic as [`write`](super::write()); the bytes of a `.gltf` go to a `.bin` beside it, which is written first.
///
/// # Errors
/// As [`write`](super::write()) and [`Document::check_output`].
pub fn write_scene(mesh: &Mesh, document: &Document, path: &Path, options: &WriteOptions) -> Result<Vec<String>> {
    write_at((mesh, Faces::of(mesh)), document, path, options)
}

/// Writes `polygons` in the place of the faces of `mesh` to the OBJ or PLY file at `path`; for the rest as [`write_scene`].
///
/// A polygon has the color and the material of its first face. Texture coordinates, which belong to triangles, are left out.
///
/// # Errors
/// As [`write_scene`]; [`Error::Unsupported`] for another format, [`Error::Mesh`] where they are no polygons of the mesh.
pub fn write_polygons(
    mesh: &Mesh,
    polygons: &Polygons,
    document: &Document,
    path: &Path,
    options: &WriteOptions,
) -> Result<Vec<String>> {
    check_polygons(mesh, polygons, Format::from_path(path)?.0)?;
    write_at((mesh, Faces::Polygons(polygons)), document, path, options)
}

fn write_at(
    (mesh, faces): (&Mesh, Faces<'_>),
    document: &Document,
    path: &Path,
    options: &WriteOptions,
) -> Result<Vec<String>> {
    let (format, compression) = Format::from_path(path)?;
    mesh.check()?;
    document.check_output(path)?;
    let (mesh, mut warnings) = as_in((mesh, faces), document, format, Some(path));
    let (mesh, faces) = (&*mesh, faces.of_same_kind(&mesh));
    warnings.extend(convert::losses(mesh, faces, document, format));
    let written = match format {
        Format::Gltf | Format::Glb => {
            let mut prepared = document.prepare(mesh);
            warnings.append(&mut prepared.warnings);
            prepared.write(path, format, compression)
        }
        _ => document.write_libraries(format, path, &mut warnings).and_then(|libraries| {
            output::atomically(path, |file| {
                output::compressed(file, compression, |out| {
                    encode((mesh, faces), document, format, options, (&libraries, out))
                })
            })
        }),
    };
    written.map(|()| warnings).map_err(|source| Error::Write { path: path.to_path_buf(), source })
}

/// Writes `mesh` in `format`, uncompressed, to a stream such as standard output, and flushes it; for the rest as
/// [`write_scene`]. A glTF has its bytes in the JSON.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh; [`Error::Write`] names the stream `-`.
pub fn write_scene_to(
    mesh: &Mesh,
    document: &Document,
    format: Format,
    options: &WriteOptions,
    out: &mut dyn Write,
) -> Result<Vec<String>> {
    write_into((mesh, Faces::of(mesh)), document, format, options, out)
}

/// Writes `polygons` in the place of the faces of `mesh`, uncompressed, to a stream, and flushes it; for the rest as
/// [`write_polygons`].
///
/// # Errors
/// As [`write_polygons`]; [`Error::Write`] names the stream `-`.
pub fn write_polygons_to(
    mesh: &Mesh,
    polygons: &Polygons,
    document: &Document,
    format: Format,
    options: &WriteOptions,
    out: &mut dyn Write,
) -> Result<Vec<String>> {
    check_polygons(mesh, polygons, format)?;
    write_into((mesh, Faces::Polygons(polygons)), document, format, options, out)
}

fn write_into(
    (mesh, faces): (&Mesh, Faces<'_>),
    document: &Document,
    format: Format,
    options: &WriteOptions,
    out: &mut dyn Write,
) -> Result<Vec<String>> {
    mesh.check()?;
    let (mesh, mut warnings) = as_in((mesh, faces), document, format, None);
    let (mesh, faces) = (&*mesh, faces.of_same_kind(&mesh));
    warnings.extend(convert::losses(mesh, faces, document, format));
    let written = match format {
        Format::Gltf | Format::Glb => {
            let mut prepared = document.prepare(mesh);
            warnings.append(&mut prepared.warnings);
            prepared.write_to(format, out)
        }
        _ => encode((mesh, faces), document, format, options, (&document.libraries(), out)),
    };
    let written = written.and_then(|()| out.flush()).map(|()| warnings);
    written.map_err(|source| Error::Write { path: PathBuf::from("-"), source })
}

/// Writes one of the formats that are a row after the other, an OBJ with these libraries.
fn encode(
    (mesh, faces): (&Mesh, Faces<'_>),
    document: &Document,
    format: Format,
    options: &WriteOptions,
    (libraries, out): (&obj::Libraries, &mut dyn Write),
) -> io::Result<()> {
    match (format, document) {
        (Format::Obj, Document::Gltf(_)) => {
            let materials = convert::objects(mesh, document);
            obj::write(mesh, faces, (libraries, materials.as_ref()), out)
        }
        (Format::Obj, _) => obj::write(mesh, faces, (libraries, mesh.materials.as_ref()), out),
        (Format::Ply, Document::Ply(notes)) => ply::write(mesh, faces, options, (None, notes.comments()), out),
        (Format::Ply, _) => ply::write(mesh, faces, options, (None, &[]), out),
        (Format::Stl, _) => stl::write(mesh, options, out),
        (Format::Off, _) => off::write(mesh, out),
        (Format::Gltf | Format::Glb, _) => document.prepare(mesh).write_to(format, out),
    }
}

impl Document {
    /// Checks that a scene with this document can be written at `path` and the input stays whole: the bytes of a `.gltf` may not
    /// replace those that another reads.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names the file.
    pub fn check_output(&self, path: &Path) -> Result<()> {
        let is_apart = matches!(Format::from_path(path), Ok((Format::Gltf, Compression::None)));
        match self.gltf().filter(|_| is_apart).and_then(|document| document.replaces(path)) {
            Some(file) => Err(Error::Parameter(format!(
                "'{}', where the bytes of '{}' would go, holds those of the input: give the output another name",
                file.display(),
                path.display()
            ))),
            None => Ok(()),
        }
    }

    /// A mesh of this document with the faces that all nodes of a glTF show of it, as [`Scene::with_instances`]; and why not, where
    /// that cannot be told.
    pub fn all_shown<'a>(&self, mesh: &'a Mesh) -> (Cow<'a, Mesh>, Option<String>) {
        let shown = match self.gltf().filter(|document| document.has_instances() && mesh.check().is_ok()) {
            Some(document) => document.instanced(mesh, false),
            None => gltf::Shown::Once,
        };
        match shown {
            gltf::Shown::Once => (Cow::Borrowed(mesh), None),
            gltf::Shown::All(all) => (Cow::Owned(all), None),
            gltf::Shown::Untold(why) => (Cow::Borrowed(mesh), Some(why)),
        }
    }

    /// The files beside the input that one of `format` is made of, also those that were looked for and are missing: the buffers of
    /// a glTF, the libraries and pictures of an OBJ that becomes one. They are read when it is written; buffers when it was read.
    pub fn files_beside(&self, format: Format) -> Vec<PathBuf> {
        match self {
            Self::Gltf(document) => document.files().to_vec(),
            Self::Obj(libraries) if matches!(format, Format::Gltf | Format::Glb) => libraries.files(),
            _ => Vec::new(),
        }
    }

    fn without_instances(self) -> Self {
        match self {
            Self::Gltf(document) => Self::Gltf(Box::new(document.without_instances())),
            other => other,
        }
    }

    fn gltf(&self) -> Option<&gltf::Gltf> {
        match self {
            Self::Gltf(document) => Some(document),
            _ => None,
        }
    }

    /// The libraries that an OBJ named.
    fn libraries(&self) -> Cow<'_, obj::Libraries> {
        match self {
            Self::Obj(libraries) => Cow::Borrowed(libraries),
            _ => Cow::default(),
        }
    }

    /// The libraries for a file at `path`; that of a glTF's materials is written.
    fn write_libraries(
        &self,
        format: Format,
        path: &Path,
        warnings: &mut Vec<String>,
    ) -> io::Result<Cow<'_, obj::Libraries>> {
        match self {
            Self::Gltf(document) if format == Format::Obj => {
                let (names, mut losses) = convert::write_library(document, path)?;
                warnings.append(&mut losses);
                Ok(Cow::Owned(obj::Libraries { names, ..obj::Libraries::default() }))
            }
            _ => Ok(self.libraries()),
        }
    }

    /// A glTF of `mesh`.
    fn prepare(&self, mesh: &Mesh) -> gltf::Prepared {
        let (described, warnings) = match self {
            Self::Obj(libraries) => convert::for_gltf(libraries),
            _ => Default::default(),
        };
        let mut prepared = gltf::prepare(mesh, self.gltf(), &described);
        prepared.warnings.extend(warnings);
        prepared
    }

    /// What a file of `format` at `path` will not have or not find.
    fn losses(&self, format: Format, path: Option<&Path>) -> Vec<String> {
        let name = format.name();
        let loss = match self {
            Self::Gltf(document) if matches!(format, Format::Gltf | Format::Glb) => path
                .filter(|path| document.leaves_behind(path))
                .map(|_| "the pictures beside the input are not copied: put them beside the output".to_string()),
            Self::Gltf(document) => {
                let beside = path.filter(|_| format == Format::Obj);
                let is_left = beside.is_some_and(|path| document.leaves_behind(path));
                let pictures = if is_left { "; pictures beside the input are not copied" } else { "" };
                let parts = document.told_parts(beside.is_some());
                parts.map(|parts| format!("{parts} are not written: {name} has none{pictures}"))
            }
            Self::Obj(libraries) if format == Format::Obj => {
                let are_left = path.is_some_and(|path| libraries.leaves_behind(path));
                let advice = "put them, and their pictures, beside the output";
                are_left.then(|| format!("the libraries of materials beside the input are not copied: {advice}"))
            }
            Self::Obj(libraries) if !matches!(format, Format::Obj | Format::Gltf | Format::Glb) => {
                let has_any = !libraries.names.is_empty();
                has_any.then(|| format!("the materials of the OBJ's libraries are not written: {name} names none"))
            }
            Self::Ply(notes) if format != Format::Ply => notes.loss_elsewhere(),
            _ => None,
        };
        let skipped = match self {
            Self::Obj(libraries) => libraries.loss(),
            Self::Ply(notes) => notes.loss(),
            Self::Gltf(document) if !matches!(format, Format::Gltf | Format::Glb) => {
                document.has_points_or_lines().then(|| "points and lines of the glTF are not written".into())
            }
            _ => None,
        };
        loss.into_iter().chain(skipped).collect()
    }
}
