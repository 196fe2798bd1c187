//! How materials of libraries (MTL) look.

use std::borrow::Cow;
use std::path::Path;

use super::library::{Libraries, described};
use crate::formats::looks::{Pictures, read_beside};
use crate::formats::material::{Map, Material, Picture};
use crate::looks::{Look, Opacity, Texture, Wrap};

/// A look for each of `names`, whose first line is the material's, from the libraries in `folder`.
pub(in crate::formats) fn looks(
    libraries: &Libraries,
    names: &[String],
    folder: Option<&Path>,
    pictures: &mut Pictures,
) -> Vec<Look> {
    let libraries = Libraries { folder: folder.map(Path::to_path_buf), ..libraries.clone() };
    let (known, warnings) = libraries.read();
    warnings.into_iter().for_each(|warning| pictures.warn(warning));
    if known.is_empty() {
        return Vec::new();
    }
    let look = |material: Option<&Material>| material.map_or_else(Look::default, |m| look_of(m, folder, pictures));
    described(&known, names).into_iter().map(look).collect()
}

fn look_of(material: &Material, folder: Option<&Path>, pictures: &mut Pictures) -> Look {
    let texture = material.map.as_ref().and_then(|map| texture_of(map, folder, pictures));
    let color = material.seen_color();
    let opacity = if color[3] < 1.0 { Opacity::Blend } else { Opacity::Opaque };
    Look { color, texture, opacity }
}

fn texture_of(map: &Map, folder: Option<&Path>, pictures: &mut Pictures) -> Option<Texture> {
    let Picture::Beside(name) = &map.picture else { return None };
    let image = pictures.get(name, || read_beside(folder, name).map(Cow::Owned))?;
    let [u, v, origin] = Texture::UP;
    let transform = [u * map.scale.x, v * map.scale.y, origin + u * map.offset.x + v * map.offset.y];
    let wrap = if map.is_clamped { Wrap::Clamp } else { Wrap::Repeat };
    Some(Texture { image, channel: None, transform, wrap: [wrap; 2] })
}
