//! The texture that a PLY file names in a comment, as MeshLab and others write it.

use std::borrow::Cow;
use std::path::Path;

use crate::formats::looks::{Pictures, read_beside};
use crate::looks::{Look, Texture, Wrap};

/// The picture that a comment names.
pub(super) fn texture_file(comments: &[String]) -> Option<&str> {
    let words = comments.iter().filter_map(|comment| comment.strip_prefix("comment"));
    words.filter_map(|words| words.trim().strip_prefix("TextureFile")).map(str::trim).next()
}

/// The look of all faces, where a comment names a texture.
pub(in crate::formats) fn look(comments: &[String], folder: Option<&Path>, pictures: &mut Pictures) -> Option<Look> {
    let name = texture_file(comments)?;
    let image = pictures.get(name, || read_beside(folder, name).map(Cow::Owned))?;
    let texture = Texture { image, channel: None, transform: Texture::UP, wrap: [Wrap::Repeat; 2] };
    Some(Look { texture: Some(texture), ..Look::default() })
}
