//! What passes from the file of one format to that of another beside the mesh: materials, and what is lost.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustc_hash::FxHashMap;

use super::faces::Faces;
use super::looks::read_beside;
use super::material::{Map, Material, Picture, kind_of};
use super::obj::Libraries;
use super::scene::Document;
use super::{Compression, Format, gltf, obj, output, text};
use crate::mesh::{ChannelKind, Materials, Mesh};

/// What every face is made of, by the material alone: parts and groups of one material are one.
pub(super) fn materials(mesh: &Mesh, document: &Document) -> Option<Materials> {
    let materials = mesh.materials.as_ref()?;
    let (names, numbers) = match document {
        Document::Gltf(document) => {
            let (names, of_part) = gltf::materials(document);
            let has_instances = materials.names.len() > of_part.len();
            let again = if has_instances { gltf::shown_again(document) } else { Vec::new() };
            (names, of_part.iter().copied().chain(again.into_iter().map(|part| of_part[part])).collect())
        }
        _ => by_first_line(&materials.names),
    };
    // Those of another mesh say nothing of this.
    if numbers.len() != materials.names.len() {
        return Some(materials.clone());
    }
    let of_face = materials.of_face.iter().map(|&part| numbers[part as usize] as u32).collect();
    Some(Materials { of_face, names })
}

/// What every face of an OBJ is made of and belongs to: of a glTF the material and, where there is one, the object's name.
pub(super) fn objects(mesh: &Mesh, document: &Document) -> Option<Materials> {
    let mut materials = materials(mesh, document)?;
    materials.names.iter_mut().for_each(|name| *name = obj::plain_name(name));
    let (Document::Gltf(document), Some(parts)) = (document, &mesh.materials) else { return Some(materials) };
    let objects = gltf::objects(document);
    if objects.len() < parts.names.len() || objects.iter().all(String::is_empty) {
        return Some(materials);
    }
    let (mut names, mut known) = (Vec::new(), FxHashMap::default());
    let of_part = |(part, number): (u32, u32)| {
        *known.entry((part, number)).or_insert_with(|| {
            let object = obj::plain_name(&objects[part as usize]);
            names.push(obj::in_object(&materials.names[number as usize], &object));
            names.len() as u32 - 1
        })
    };
    let of_face = parts.of_face.iter().copied().zip(materials.of_face.iter().copied()).map(of_part).collect();
    Some(Materials { of_face, names })
}

fn by_first_line(all: &[String]) -> (Vec<String>, Vec<usize>) {
    let mut names: Vec<String> = Vec::new();
    let mut known = FxHashMap::default();
    let number = |name: &String| {
        *known.entry(name.lines().next().unwrap_or_default().to_string()).or_insert_with_key(|name| {
            names.push(name.clone());
            names.len() - 1
        })
    };
    let numbers = all.iter().map(number).collect();
    (names, numbers)
}

/// The materials of an OBJ's libraries with their pictures, as far as a glTF can have them, and what it cannot.
pub(super) fn for_gltf(libraries: &Libraries) -> (Vec<Material>, Vec<String>) {
    let (mut described, mut warnings) = libraries.read();
    let mut known: FxHashMap<String, Option<Vec<u8>>> = FxHashMap::default();
    let mut bytes_of = |name: &str| {
        let read = |name: &String| {
            let shown = text::quote(name.as_bytes());
            let why = match read_beside(libraries.folder.as_deref(), name) {
                Ok(bytes) if kind_of(&bytes).is_some() => return Some(bytes),
                Ok(_) => "it is neither PNG nor JPEG".to_string(),
                Err(error) => error.to_string(),
            };
            warnings.push(format!("the texture {shown} is not written: {why}"));
            None
        };
        known.entry(name.to_string()).or_insert_with_key(read).clone()
    };
    for material in &mut described {
        let Some(Map { picture: Picture::Beside(name), .. }) = &material.map else { continue };
        let bytes = bytes_of(name);
        // What only the picture colors stays as bright as it was.
        material.color = material.seen_color();
        material.map =
            material.map.take().zip(bytes).map(|(map, bytes)| Map { picture: Picture::Inside(bytes), ..map });
    }
    (described, warnings)
}

/// Writes the materials of a glTF beside the OBJ at `path`: first pictures that lay in it, then a library; the library's name, and
/// what it does not say.
pub(super) fn write_library(document: &gltf::Gltf, path: &Path) -> io::Result<(Vec<String>, Vec<String>)> {
    let (mut described, mut warnings) = gltf::described(document);
    if described.is_empty() {
        return Ok((Vec::new(), warnings));
    }
    let mut known: FxHashMap<Vec<u8>, Option<String>> = FxHashMap::default();
    for material in &mut described {
        material.name = obj::plain_name(&material.name);
        let Some(Map { picture: Picture::Inside(bytes), .. }) = &material.map else { continue };
        let name = match known.get(bytes) {
            Some(name) => name.clone(),
            None => {
                let name = picture_name(&material.name, bytes);
                match &name {
                    Some(name) => write_picture(&path.with_file_name(name), bytes)?,
                    None => {
                        let shown = text::quote(material.name.as_bytes());
                        warnings.push(format!("the texture of {shown} is not written: it is neither PNG nor JPEG"));
                    }
                }
                known.insert(bytes.clone(), name.clone());
                name
            }
        };
        material.map = material.map.take().zip(name).map(|(map, name)| Map { picture: Picture::Beside(name), ..map });
    }
    let library = library_beside(path);
    output::atomically(&library, |file| {
        output::compressed(file, Compression::None, |out| obj::write_library(&described, out))
    })?;
    let name = library.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok((vec![name], warnings))
}

/// A name for the file of a picture, which no other content has.
fn picture_name(material: &str, bytes: &[u8]) -> Option<String> {
    let (extension, _) = kind_of(bytes)?;
    let plain: String =
        material.chars().take(40).map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    let mut sum = flate2::Crc::new();
    sum.update(bytes);
    Some(format!("{plain}-{:08x}.{extension}", sum.sum()))
}

fn write_picture(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Every level of a chain has the same ones.
    let is_there = fs::metadata(path).is_ok_and(|known| known.len() == bytes.len() as u64);
    if is_there && fs::read(path).is_ok_and(|known| known == bytes) {
        return Ok(());
    }
    output::atomically(path, |file| file.write_all(bytes))
}

/// The library of the OBJ file at `path`.
fn library_beside(path: &Path) -> PathBuf {
    let plain =
        if matches!(Format::from_path(path), Ok((_, Compression::None))) { path } else { &path.with_extension("") };
    plain.with_extension("mtl")
}

/// The file that [`write_scene`](super::write_scene) writes beside one at `output` of what was read from a file of the format
/// `input`: the bytes of a glTF, the materials of one that becomes an OBJ. Pictures of these have names that no other content has.
pub fn file_beside(output: &Path, input: Option<Format>) -> Option<PathBuf> {
    match (Format::from_path(output).ok()?, input) {
        ((Format::Gltf, Compression::None), _) => Some(output.with_extension("bin")),
        ((Format::Obj, _), Some(Format::Gltf | Format::Glb)) => Some(library_beside(output)),
        _ => None,
    }
}

/// What of the mesh a file of `format` will not have, which its document does not tell.
pub(super) fn losses(mesh: &Mesh, faces: Faces<'_>, document: &Document, format: Format) -> Vec<String> {
    let is_gltf = matches!(format, Format::Gltf | Format::Glb);
    let traits = format.traits();
    let mut lost: Vec<&str> = Vec::new();
    // Documents with libraries, and those of glTF, tell of their materials.
    let is_untold = matches!(document, Document::Obj(libraries) if libraries.names.is_empty());
    let has_names = is_gltf || format == Format::Obj;
    lost.extend((mesh.materials.is_some() && is_untold && !has_names).then_some("materials and groups"));
    lost.extend((mesh.colors.is_some() && traits.colors.is_empty()).then_some("colors"));
    lost.extend((mesh.texcoords.is_some() && !traits.texcoords).then_some("texture coordinates"));
    // A document of glTF has a place for what came with it; PLY has a property for every number.
    let has_channels = format == Format::Ply || (is_gltf && matches!(document, Document::Gltf(_)));
    for channel in mesh.channels.iter().filter(|_| !has_channels) {
        let is_target = channel.kind == ChannelKind::Linear && channel.name.contains('.');
        let word = match channel.kind {
            ChannelKind::Joints => "joints of skins",
            ChannelKind::Displacement => "displacements of morph targets",
            ChannelKind::Linear if is_target => "displacements of morph targets",
            _ if is_gltf => continue,
            ChannelKind::Texcoords => "further texture coordinates",
            ChannelKind::Tangent => "tangents",
            ChannelKind::Linear | ChannelKind::Label => "further properties of vertices",
        };
        lost.extend((!lost.contains(&word)).then_some(word));
    }
    let why = if is_gltf { "the input has no nodes for them".into() } else { format!("{} has none", format.name()) };
    let mut losses: Vec<String> =
        if lost.is_empty() { Vec::new() } else { vec![format!("{} are not written: {why}", lost.join(", "))] };
    if mesh.texcoords.is_some() && traits.texcoords && faces.texcoords(mesh).is_none() {
        losses.push("texture coordinates are not written: they belong to triangles, not to polygons".into());
    }
    losses
}
