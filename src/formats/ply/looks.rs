//! The texture that a PLY file names in a comment, as MeshLab and others write it.

use std::borrow::Cow;
use std::path::Path;

use crate::formats::looks::{Pictures, read_beside};
use crate::looks::{Look, Texture, Wrap};

/// The look of all faces, where a comment names a texture.
pub(in crate::formats) fn look(comments: &[String], folder: Option<&Path>, pictures: &mut Pictures) -> Option<Look> {
    let named = |comment: &String| {
        Some(comment.strip_prefix("comment")?.trim().strip_prefix("TextureFile")?.trim().to_string())
    };
    let name = comments.iter().find_map(named)?;
    let image = pictures.get(&name, || read_beside(folder, &name).map(Cow::Owned))?;
    let texture = Texture { image, channel: None, transform: Texture::UP, wrap: [Wrap::Repeat; 2] };
    Some(Look { texture: Some(texture), ..Look::default() })
}
