//! glTF 2.0: JSON that describes a scene, and the bytes of its buffers, in one file (GLB) or beside each other.
//!
//! All primitives of triangles, strips and fans of a file become one mesh, so that borders between them are kept together:
//! - a face's material is the number of its primitive among them;
//! - positions, normals and tangents are those of the scene, where the first node that shows the mesh puts it; a mesh with a
//!   skin, whose joints place it, stays as it is, and so does one whose transform cannot be undone;
//! - `NORMAL`, `COLOR_0` and `TEXCOORD_0` are the mesh's own, colors as screens take them (`color`);
//! - `TANGENT` and further `TEXCOORD_n` are channels by these names, `JOINTS` is one of the joints of all sets, then their
//!   weights, and `target_0.POSITION` what the first morph target adds to positions, in the scene's space, neither moved nor normalized;
//! - whatever else a primitive has at its vertices is a channel by its name;
//! - a primitive without an attribute that others have gets zeros, white for its color, and is written without it.
//!
//! Points, lines and all that is no mesh stay in the JSON ([`Gltf`]), with the bytes that they need. What is written is that
//! JSON with new accessors for the primitives: `f32`, colors and joints as they were stored, indices. Sparse accessors and
//! integers of `KHR_mesh_quantization` are read; compressed buffers are refused by the name of their extension.
//!
//! Everything is looked up in the JSON itself, because what no type here knows is to survive, and each look-up can fail: no
//! number of the file is believed, and accessors may describe only so many numbers for each byte of it.

mod accessor;
mod color;
mod container;
mod document;
mod file;
mod fresh;
mod instances;
mod instancing;
mod json;
mod looks;
mod materials;
mod number;
mod orphans;
mod part;
mod read;
mod references;
mod scene;
mod skins;
mod untextured;
mod write;

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use base64::Engine as _;
use serde_json::Value;

use super::material::Material;
use super::{Compression, Format, obj, output};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use accessor::Store;
pub use document::Gltf;
pub(super) use instances::{ONCE, Shown};
pub(super) use looks::{looks, materials, objects};
pub(super) use materials::described;

const FORMAT: &str = "glTF";

/// Extensions without which vertices cannot be read.
const COMPRESSED: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

fn unsupported(extension: &str) -> Error {
    Error::Unsupported(format!("glTF with the extension {extension}: save it without compression of its meshes"))
}

/// The parts that further nodes show, node by node.
pub(super) fn shown_again(document: &Gltf) -> Vec<usize> {
    document.shown_again().into_iter().map(|(part, _)| part).collect()
}

/// Reads a file; `folder` is where its relative URIs start.
pub(super) fn read(bytes: &[u8], format: Format, folder: Option<&Path>) -> Result<(Mesh, Gltf)> {
    let (json, chunk) = container::parse(bytes, format)?;
    let required = json.get("extensionsRequired").and_then(Value::as_array).into_iter().flatten();
    if let Some(name) = required.filter_map(Value::as_str).find(|name| COMPRESSED.contains(name)) {
        return Err(unsupported(name));
    }
    let buffers = container::load(&json, chunk, folder)?;
    let store = Store::new(&json, buffers, bytes.len());
    let (mesh, parts, instances) = read::mesh(&store)?;
    let document = Gltf::of(&store, parts, instances, folder)?;
    Ok((mesh, document))
}

/// A file ready to be written.
pub(super) struct Prepared {
    file: file::File,
    has_data_uris: bool,
    pub(super) warnings: Vec<String>,
}

/// Puts `mesh` into `document`, or into a new one where it did not come from there, whose materials are `described` by name.
pub(super) fn prepare(mesh: &Mesh, document: Option<&Gltf>, described: &[Material]) -> Prepared {
    let fits = |document: &&Gltf| {
        let materials = mesh.materials.as_ref().map(|materials| materials.names.len());
        document.parts.len() == 1 || materials == Some(document.parts.len())
    };
    let mut warnings = Vec::new();
    let file = match (document.filter(fits), document) {
        (Some(document), _) => write::fill(mesh, document),
        (None, given) => {
            if given.is_some() {
                let message =
                    "the result does not tell its materials apart: nodes, materials and textures are not written";
                warnings.push(message.into());
                warnings.extend(document.filter(|document| document.has_instances()).map(|_| ONCE.into()));
            }
            let names = mesh.materials.as_ref().map_or(&[][..], |materials| &materials.names);
            if mesh.texcoords.is_none()
                && obj::described(described, names).iter().flatten().any(|one| one.has_picture())
            {
                warnings.push(untextured::UNTEXTURED.into());
            }
            write::fill(mesh, &fresh::document(mesh, described))
        }
    };
    warnings.extend(file.warnings.iter().cloned());
    let has_data_uris = document.is_some_and(|document| document.has_data_uris);
    Prepared { file, has_data_uris, warnings }
}

impl Gltf {
    /// The files that bytes came from, in the input's folder.
    pub(super) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The file of the input's bytes that those of a glTF at `output` would replace.
    pub(super) fn replaces(&self, output: &Path) -> Option<PathBuf> {
        let beside = fs::canonicalize(output.with_extension("bin")).ok()?;
        let is_replaced = |file: &Path| fs::canonicalize(file).is_ok_and(|file| file == beside);
        self.files.iter().find(|file| is_replaced(file)).cloned()
    }

    /// What there is of the file that other formats have not, as a list for people, of materials all but their base colors with
    /// `keeps_colors`; nothing where it is meshes alone.
    pub(super) fn told_parts(&self, keeps_colors: bool) -> Option<String> {
        let count = |key: &str| self.json.get(key).and_then(Value::as_array).map_or(0, Vec::len);
        let materials = if keeps_colors { "all of materials but base colors" } else { "materials" };
        let kinds = [
            // One alone puts the mesh where it is written.
            ("nodes", count("nodes") > 1),
            ("cameras", count("cameras") > 0),
            ("animations", count("animations") > 0),
            (materials, count("materials") > 0),
            ("textures", count("textures") + count("images") > 0 && !keeps_colors),
        ];
        let told: Vec<&str> = kinds.into_iter().filter(|(_, is_there)| *is_there).map(|(kind, _)| kind).collect();
        let (last, others) = told.split_last()?;
        Some(if others.is_empty() { (*last).into() } else { format!("{} and {last}", others.join(", ")) })
    }

    /// Whether any primitive is one of points or lines, which go into no other format.
    pub(super) fn has_points_or_lines(&self) -> bool {
        let is_flat = |primitive: &Value| primitive.get("mode").and_then(Value::as_u64).is_some_and(|mode| mode < 4);
        let meshes = self.json.get("meshes").and_then(Value::as_array).into_iter().flatten();
        meshes.filter_map(|mesh| mesh.get("primitives")?.as_array()).flatten().any(is_flat)
    }

    /// Whether pictures lie in files of their own, which a file in another folder will not find.
    pub(super) fn leaves_behind(&self, output: &Path) -> bool {
        let is_outside = |image: &Value| {
            image
                .get("uri")
                .and_then(Value::as_str)
                .is_some_and(|uri| container::data_of(uri).is_none() && !uri.contains("://"))
        };
        let images = self.json.get("images").and_then(Value::as_array);
        let place =
            |folder: &Path| fs::canonicalize(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
        let [from, to] = [self.folder.as_deref(), output.parent()].map(|folder| folder.and_then(|f| place(f).ok()));
        images.into_iter().flatten().any(is_outside) && from != to
    }
}

impl Prepared {
    /// Refuses positions that no reader would take.
    fn check(&self) -> io::Result<()> {
        match self.file.overflows {
            true => Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                "a coordinate is too large for the f32 of glTF; write another format",
            )),
            false => Ok(()),
        }
    }

    /// Writes all into one stream.
    pub(super) fn write_to(mut self, format: Format, out: &mut dyn Write) -> io::Result<()> {
        self.check()?;
        if format == Format::Glb {
            let too_large = || io::Error::new(io::ErrorKind::FileTooLarge, "a GLB holds at most 4 GiB");
            return out.write_all(&container::glb(&self.file.json, &self.file.binary).ok_or_else(too_large)?);
        }
        if let Some(buffer) = self.file.json.pointer_mut("/buffers/0") {
            let encoded = container::BASE64.encode(&self.file.binary);
            buffer["uri"] = format!("data:application/octet-stream;base64,{encoded}").into();
        }
        out.write_all(self.file.json.to_string().as_bytes())
    }

    /// Writes a file at `path`; the bytes of a glTF go to a `.bin` beside it, first, unless they stood in the JSON.
    pub(super) fn write(mut self, path: &Path, format: Format, compression: Compression) -> io::Result<()> {
        self.check()?;
        let is_apart = format == Format::Gltf && compression == Compression::None && !self.has_data_uris;
        if is_apart && let Some(buffer) = self.file.json.pointer_mut("/buffers/0") {
            let beside = path.with_extension("bin");
            let name = beside.file_name().unwrap_or_default().to_string_lossy();
            buffer["uri"] = container::percent_encoded(&name).into();
            output::atomically(&beside, |file| file.write_all(&self.file.binary))?;
            let text = self.file.json.to_string();
            return output::atomically(path, |file| file.write_all(text.as_bytes()));
        }
        let write = |file: &mut fs::File| output::compressed(file, compression, |out| self.write_to(format, out));
        output::atomically(path, write)
    }
}
