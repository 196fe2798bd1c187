//! Materials of a document by what other formats know of them, and of other formats as a document has them.

use serde_json::{Value, json};

use super::color;
use super::container;
use super::document::Gltf;
use super::fresh::Named;
use super::json::{Json, list_mut};
use super::looks::{TRANSFORM, base_color, materials, number, view_bytes};
use crate::error::Result;
use crate::formats::material::{Map, Material, Picture, kind_of};
use crate::math::DVec2;

/// How a picture goes on beside its sides: by its edge, or by its mirror image.
const CLAMP: usize = 33071;
const MIRROR: usize = 33648;

/// The materials of a document under the names of [`materials`], but for those without a number; and what is not told of them.
pub(in crate::formats) fn described(document: &Gltf) -> (Vec<Material>, Vec<String>) {
    let (mut names, _) = materials(document);
    names.pop();
    let root = Json::root(&document.json);
    let mut warnings = Vec::new();
    let mut found = Vec::with_capacity(names.len());
    for (at, name) in names.into_iter().enumerate() {
        let material = root.element("materials", at).and_then(|json| describe(document, &json, &mut warnings));
        let material = material.unwrap_or_else(|error| {
            warnings.push(format!("materials[{at}] is written white: {error}"));
            Material::default()
        });
        found.push(Material { name, ..material });
    }
    (found, warnings)
}

fn describe(document: &Gltf, json: &Json<'_>, warnings: &mut Vec<String>) -> Result<Material> {
    let (surface, factor, texture) = base_color(json);
    let mut material = Material::default();
    let Some(surface) = surface else { return Ok(material) };
    if let Some(light) = surface.numbers::<4>(factor)? {
        material.color = color::of_light(&light.map(|channel| channel as f32));
    }
    // Opacity counts only where something says so.
    if json.text("alphaMode")? != Some("BLEND") {
        material.color[3] = 1.0;
    }
    let share = |key: &str| number(&surface, key, 1.0).clamp(0.0, 1.0);
    // Where a picture tells them, a number alone would be wrong.
    if factor == "baseColorFactor" && surface.get("metallicRoughnessTexture").is_none() {
        (material.roughness, material.metallic) = (Some(share("roughnessFactor")), Some(share("metallicFactor")));
    }
    if let Some(texture) = surface.get(texture) {
        match map(document, &texture) {
            Ok((map, is_mirrored)) => {
                let why = "goes on in mirror images, which a library cannot say";
                warnings.extend(is_mirrored.then(|| format!("the texture of {} {why}", json.path)));
                material.map = Some(map);
            }
            Err(error) => warnings.push(format!("the texture of {} is not written: {error}", json.path)),
        }
    }
    Ok(material)
}

/// The picture of a texture and where it lies, and whether beside its sides it should be its mirror image.
fn map(document: &Gltf, named: &Json<'_>) -> Result<(Map, bool)> {
    let root = Json::root(&document.json);
    let texture = root.element("textures", named.need("index")?.whole()?)?;
    let image = root.element("images", texture.need("source")?.whole()?)?;
    let picture = match image.text("uri")? {
        Some(uri) => match container::data_of(uri) {
            Some(data) => Picture::Inside(container::decode(&image, data)?),
            None => Picture::Beside(container::name_beside(&image, uri)?),
        },
        None => Picture::Inside(view_bytes(document, &image)?.to_vec()),
    };
    let mut set = named.optional_whole("texCoord")?.unwrap_or(0);
    let (mut scale, mut offset) = (DVec2::ONE, DVec2::ZERO);
    if let Some(moved) = named.get("extensions").and_then(|extensions| extensions.get(TRANSFORM)) {
        set = moved.optional_whole("texCoord")?.unwrap_or(set);
        scale = moved.numbers::<2>("scale")?.map_or(DVec2::ONE, DVec2::from);
        offset = moved.numbers::<2>("offset")?.map_or(DVec2::ZERO, DVec2::from);
        if number(&moved, "rotation", 0.0) != 0.0 {
            return Err(moved.error("is turned, which a library cannot say"));
        }
    }
    if set > 0 {
        return Err(named.error(format!("goes by TEXCOORD_{set}, which a library cannot say")));
    }
    let sampler = texture.optional_whole("sampler")?.map(|sampler| root.element("samplers", sampler)).transpose()?;
    let wrap = |side: &str| sampler.as_ref()?.optional_whole(side).ok().flatten();
    let [across, down] = ["wrapS", "wrapT"].map(wrap);
    let upside_down = Map { picture, scale, offset, is_clamped: across == Some(CLAMP) };
    let is_mirrored = [across, down].contains(&Some(MIRROR));
    Ok((Map { offset: upside_down.turned_offset(), ..upside_down }, is_mirrored))
}

/// Puts materials into a document, of those names that are described and of the others the name; pictures go into its bytes, where
/// there are coordinates to look them up by.
pub(super) fn put(json: &mut Value, binary: &mut Vec<u8>, materials: &Named<'_>, has_texcoords: bool) {
    let mut list = Vec::with_capacity(materials.len());
    for (name, described) in materials {
        let mut material = json!({ "name": name });
        if let Some(described) = described {
            let light = color::to_light(described.seen_color()).map(f64::from);
            let mut surface = json!({ "baseColorFactor": light });
            surface["metallicFactor"] = described.metallic.unwrap_or(0.0).into();
            surface["roughnessFactor"] = described.roughness.unwrap_or(1.0).into();
            if light[3] < 1.0 {
                material["alphaMode"] = "BLEND".into();
            }
            if let Some(Map { picture: Picture::Inside(bytes), scale, is_clamped, .. }) = &described.map
                && has_texcoords
                && let Some((_, kind)) = kind_of(bytes)
            {
                let index = put_texture(json, binary, bytes, kind, *is_clamped);
                let mut named = json!({ "index": index });
                let offset = described.map.as_ref().map_or(DVec2::ZERO, Map::turned_offset);
                if (*scale, offset) != (DVec2::ONE, DVec2::ZERO) {
                    let moved = json!({ "offset": offset.to_array(), "scale": scale.to_array() });
                    named["extensions"] = json!({ TRANSFORM: moved });
                    json["extensionsUsed"] = json!([TRANSFORM]);
                }
                surface["baseColorTexture"] = named;
            }
            material["pbrMetallicRoughness"] = surface;
        }
        list.push(material);
    }
    if !list.is_empty() {
        json["materials"] = list.into();
    }
}

/// A texture with a picture of its own, unless the same bytes are there already.
fn put_texture(json: &mut Value, binary: &mut Vec<u8>, bytes: &[u8], kind: &str, is_clamped: bool) -> usize {
    let is_same = |view: &Value| {
        let whole = |key: &str| view.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
        binary.get(whole("byteOffset")..).and_then(|behind| behind.get(..whole("byteLength"))) == Some(bytes)
    };
    // Every view is that of a picture so far.
    let known = list_mut(json, "bufferViews").iter().position(is_same);
    let image = known.unwrap_or_else(|| {
        let start = binary.len();
        binary.extend_from_slice(bytes);
        binary.resize(binary.len().next_multiple_of(4), 0);
        let views = list_mut(json, "bufferViews");
        views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
        let view = views.len() - 1;
        let images = list_mut(json, "images");
        images.push(json!({ "bufferView": view, "mimeType": kind }));
        images.len() - 1
    });
    let mut texture = json!({ "source": image });
    if is_clamped {
        let samplers = list_mut(json, "samplers");
        if samplers.is_empty() {
            samplers.push(json!({ "wrapS": CLAMP, "wrapT": CLAMP }));
        }
        texture["sampler"] = 0.into();
    }
    let textures = list_mut(json, "textures");
    let known = textures.iter().position(|known| *known == texture);
    known.unwrap_or_else(|| {
        textures.push(texture);
        textures.len() - 1
    })
}
