//! How the materials of a document look: their base colors.

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::FxHashMap;
use serde_json::Value;

use super::color;
use super::container;
use super::document::Gltf;
use super::json::Json;
use super::part::Part;
use super::scene::Instance;
use crate::error::Result;
use crate::formats::looks::Pictures;
use crate::looks::{Image, Look, Opacity, Texture, Wrap};
use crate::math::DVec2;

/// The extension that older files have instead of a base color.
const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";
/// The extension that moves pictures about.
pub(super) const TRANSFORM: &str = "KHR_texture_transform";

/// A look for each part.
pub(in crate::formats) fn looks(document: &Gltf, pictures: &mut Pictures) -> Vec<Look> {
    let root = Json::root(&document.json);
    let mut known: Vec<(usize, Look)> = Vec::new();
    let mut look = |number: usize| {
        if let Some((_, look)) = known.iter().find(|(known, _)| *known == number) {
            return look.clone();
        }
        let made = root.element("materials", number).and_then(|material| look_of(document, &material, pictures));
        let look = made.unwrap_or_else(|error| {
            pictures.warn(format!("materials[{number}] is drawn white: {error}"));
            Look::default()
        });
        known.push((number, look.clone()));
        look
    };
    let numbers = document.parts.iter().map(|part| material_of(document, part));
    numbers.map(|number| number.map_or_else(Look::default, &mut look)).collect()
}

/// The number of a part's material.
fn material_of(document: &Gltf, part: &Part) -> Option<usize> {
    let root = Json::root(&document.json);
    let mesh = root.element("meshes", part.mesh).ok()?;
    mesh.element("primitives", part.primitive).ok()?.optional_whole("material").ok()?
}

/// The names of all materials, the last for parts without one; and which of them each part has. Those without a name of their
/// own go by their number.
pub(in crate::formats) fn materials(document: &Gltf) -> (Vec<String>, Vec<usize>) {
    let list = document.json.get("materials").and_then(Value::as_array).map_or(&[][..], |list| list);
    let given: Vec<&str> =
        list.iter().map(|material| material.get("name").and_then(Value::as_str).unwrap_or_default()).collect();
    let mut counts: FxHashMap<&str, u32> = FxHashMap::default();
    given.iter().for_each(|&name| *counts.entry(name).or_default() += 1);
    let is_own = |name: &str| !name.is_empty() && counts[name] == 1;
    let name = |(number, &name): (usize, &&str)| {
        if is_own(name) {
            return name.into();
        }
        let mut numbered = format!("{}[{number}]", if name.is_empty() { "materials" } else { name });
        while counts.contains_key(numbered.as_str()) {
            numbered.push('_');
        }
        numbered
    };
    let mut names: Vec<String> = given.iter().enumerate().map(name).collect();
    names.push(String::new());
    let of_part = |part: &Part| material_of(document, part).filter(|&number| number < list.len()).unwrap_or(list.len());
    (names, document.parts.iter().map(of_part).collect())
}

/// What people call the object of each part, then of those that further nodes show: the name of the node or, where it has none, of
/// the mesh, numbered from 2 on for the others; empty without either.
pub(in crate::formats) fn objects(document: &Gltf) -> Vec<String> {
    let meshes = document.json.get("meshes").and_then(Value::as_array).map_or(&[][..], |list| list);
    let of_mesh = |part: &Part| {
        meshes.get(part.mesh).and_then(|mesh| mesh.get("name")).and_then(Value::as_str).unwrap_or_default()
    };
    let first = |part: &Part| match document.instances.get(part.mesh) {
        Some(instances) if !instances.first.name.is_empty() => instances.first.name.clone(),
        _ => of_mesh(part).to_string(),
    };
    let mut seen = vec![1_u32; document.parts.len()];
    let other = |(part, instance): (usize, &Instance)| {
        seen[part] += 1;
        match (instance.name.as_str(), of_mesh(&document.parts[part])) {
            ("", "") => String::new(),
            ("", mesh) => format!("{mesh}.{}", seen[part]),
            (node, _) => node.into(),
        }
    };
    document.parts.iter().map(first).chain(document.shown_again().into_iter().map(other)).collect()
}

/// Where a material has its base color, and the keys of color and texture there.
pub(super) fn base_color<'a>(material: &Json<'a>) -> (Option<Json<'a>>, &'static str, &'static str) {
    let glossy = material.get("extensions").and_then(|extensions| extensions.get(GLOSSY));
    match (material.get("pbrMetallicRoughness"), glossy) {
        (_, Some(glossy)) => (Some(glossy), "diffuseFactor", "diffuseTexture"),
        (surface, None) => (surface, "baseColorFactor", "baseColorTexture"),
    }
}

fn look_of(document: &Gltf, material: &Json<'_>, pictures: &mut Pictures) -> Result<Look> {
    let (surface, factor, texture) = base_color(material);
    let opacity = match material.text("alphaMode")? {
        Some("MASK") => Opacity::Mask(number(material, "alphaCutoff", 0.5) as f32),
        Some("BLEND") => Opacity::Blend,
        _ => Opacity::Opaque,
    };
    let mut look = Look { opacity, ..Look::default() };
    let Some(surface) = surface else { return Ok(look) };
    if let Some(light) = surface.numbers::<4>(factor)? {
        look.color = color::of_light(&light.map(|channel| channel as f32));
    }
    if let Some(texture) = surface.get(texture) {
        look.texture = of_texture(document, &texture, pictures)?;
    }
    Ok(look)
}

/// The texture that a material names, unless its picture is missing or broken.
fn of_texture(document: &Gltf, named: &Json<'_>, pictures: &mut Pictures) -> Result<Option<Texture>> {
    let root = Json::root(&document.json);
    let texture = root.element("textures", named.need("index")?.whole()?)?;
    let Some(source) = texture.optional_whole("source")? else {
        pictures.warn(format!("{} is not drawn: its picture is neither PNG nor JPEG", texture.path));
        return Ok(None);
    };
    let Some(image) = picture(document, source, pictures) else { return Ok(None) };
    let mut set = named.optional_whole("texCoord")?.unwrap_or(0);
    let mut transform = Texture::DOWN;
    if let Some(moved) = named.get("extensions").and_then(|extensions| extensions.get(TRANSFORM)) {
        set = moved.optional_whole("texCoord")?.unwrap_or(set);
        let scale = moved.numbers::<2>("scale")?.map_or(DVec2::ONE, DVec2::from);
        let offset = moved.numbers::<2>("offset")?.map_or(DVec2::ZERO, DVec2::from);
        // The last bits of sines differ between systems.
        let turn = DVec2::from_angle(number(&moved, "rotation", 0.0)).as_vec2().as_dvec2();
        // Counter-clockwise on a picture whose second axis points down.
        transform = [DVec2::new(turn.x, -turn.y) * scale.x, DVec2::new(turn.y, turn.x) * scale.y, offset];
    }
    let sampler = match texture.optional_whole("sampler")? {
        Some(sampler) => Some(root.element("samplers", sampler)?),
        None => None,
    };
    let wrap = |key: &str| -> Result<Wrap> {
        Ok(match sampler.as_ref().map(|sampler| sampler.optional_whole(key)).transpose()?.flatten() {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        })
    };
    let wrap = [wrap("wrapS")?, wrap("wrapT")?];
    let channel = (set > 0).then(|| format!("TEXCOORD_{set}"));
    Ok(Some(Texture { image, channel, transform, wrap }))
}

fn picture(document: &Gltf, number: usize, pictures: &mut Pictures) -> Option<Arc<Image>> {
    pictures.get(&format!("images[{number}]"), || {
        let root = Json::root(&document.json);
        let image = root.element("images", number)?;
        if let Some(uri) = image.text("uri")? {
            return Ok(Cow::Owned(match container::data_of(uri) {
                Some(data) => container::decode(&image, data)?,
                None => container::read_beside(&image, uri, document.folder.as_deref())?,
            }));
        }
        view_bytes(document, &image).map(Cow::Borrowed)
    })
}

/// The bytes of a picture within the file.
pub(super) fn view_bytes<'a>(document: &'a Gltf, image: &Json<'_>) -> Result<&'a [u8]> {
    let view = Json::root(&document.json).element("bufferViews", image.need("bufferView")?.whole()?)?;
    let start = view.optional_whole("byteOffset")?.unwrap_or(0);
    let length = view.need("byteLength")?.whole()?;
    let bytes = document.binary.get(start..).and_then(|bytes| bytes.get(..length));
    bytes.ok_or_else(|| view.error("lies outside of its buffer"))
}

/// A number that may be there.
pub(super) fn number(json: &Json<'_>, key: &str, otherwise: f64) -> f64 {
    json.get(key).and_then(|member| member.value.as_f64()).unwrap_or(otherwise)
}
