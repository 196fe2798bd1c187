//! How the materials of a file look.

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::scene::{Document, Scene};
use super::{gltf, obj, ply, text};
use crate::error::{Error, Result};
use crate::looks::{Image, LONGEST_SIDE, Look};

/// The texels that the pictures of a file have together at most: four of the largest.
const MOST_TEXELS: u64 = 4 * (LONGEST_SIDE as u64) * (LONGEST_SIDE as u64);

/// How the materials of a mesh look.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Looks {
    /// A look for each name in [`Mesh::materials`](crate::Mesh::materials), or one for a mesh without materials; none where
    /// the file describes no looks.
    pub of_material: Vec<Look>,
    /// What is missing or broken, a sentence each: the looks concerned are without it.
    pub warnings: Vec<String>,
}

/// How the materials of `scene` look: base colors of glTF, those of the libraries (MTL) that an OBJ names in `folder`, the
/// texture that a comment `TextureFile` of a PLY names there.
///
/// Pictures are PNG or JPEG, in the file or beside it, at most [`LONGEST_SIDE`] texels long. One that is missing or broken
/// leaves the material's color, and a warning.
pub fn looks(scene: &Scene, folder: Option<&Path>) -> Looks {
    let mut pictures = Pictures { known: FxHashMap::default(), texels_left: MOST_TEXELS, warnings: Vec::new() };
    let names = scene.mesh.materials.as_ref().map_or(&[][..], |materials| &materials.names);
    let of_material = match &scene.document {
        Document::Gltf(document) => gltf::looks(document, &mut pictures),
        Document::Obj(libraries) => obj::looks(libraries, names, folder, &mut pictures),
        Document::Ply(notes) => ply::look(notes.comments(), folder, &mut pictures).into_iter().collect(),
        Document::None => Vec::new(),
    };
    Looks { of_material, warnings: pictures.warnings }
}

/// Pictures, each decoded once.
pub(super) struct Pictures {
    known: FxHashMap<String, Option<Arc<Image>>>,
    texels_left: u64,
    warnings: Vec<String>,
}

impl Pictures {
    /// The picture `name`, whose file has the `bytes`; none where it has a warning.
    pub(super) fn get<'a>(&mut self, name: &str, bytes: impl FnOnce() -> Result<Cow<'a, [u8]>>) -> Option<Arc<Image>> {
        if let Some(known) = self.known.get(name) {
            return known.clone();
        }
        let picture = bytes().and_then(|bytes| Image::decode(&bytes, self.texels_left));
        let picture = match picture {
            Ok(picture) => {
                self.texels_left -= picture.texel_count();
                Some(Arc::new(picture))
            }
            Err(error) => {
                self.warn(format!("the texture {} is not drawn: {error}", text::quote(name.as_bytes())));
                None
            }
        };
        self.known.insert(name.into(), picture.clone());
        picture
    }

    pub(super) fn warn(&mut self, warning: String) {
        self.warnings.push(warning);
    }
}

/// The path of a file that another in `folder` names; `None` where the name does not start there.
pub(super) fn path_beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let is_plain = |part| matches!(part, Component::Normal(_) | Component::ParentDir | Component::CurDir);
    let is_relative = !name.is_empty() && !name.contains('\0') && Path::new(name).components().all(is_plain);
    is_relative.then(|| folder.join(name))
}

/// The bytes of a file that another in `folder` names, perhaps on a system with other slashes, or as it lay elsewhere.
pub(super) fn read_beside(folder: Option<&Path>, name: &str) -> Result<Vec<u8>> {
    let Some(folder) = folder else {
        return Err(Error::Unsupported("a file beside a stream, which has no folder: give a path".into()));
    };
    let paths = paths_beside(folder, name);
    match paths.iter().find(|path| path.is_file()).or_else(|| paths.first()) {
        Some(path) => read_whole(path.clone()),
        None => Err(Error::Unsupported(format!("the file name {}", text::quote(name.as_bytes())))),
    }
}

/// Where [`read_beside`] looks for a file, in this order.
pub(super) fn paths_beside(folder: &Path, name: &str) -> Vec<PathBuf> {
    let name = name.replace('\\', "/");
    let last = name.rsplit('/').next().unwrap_or_default();
    [path_beside(folder, &name), path_beside(folder, last)].into_iter().flatten().collect()
}

/// All bytes of a file, which must be a regular one.
pub(super) fn read_whole(path: PathBuf) -> Result<Vec<u8>> {
    let read = match fs::metadata(&path) {
        Ok(metadata) if !metadata.is_file() => Err(io::ErrorKind::InvalidInput.into()),
        Ok(_) => fs::read(&path),
        Err(error) => Err(error),
    };
    read.map_err(|source| Error::Read { path, source })
}
