//! Materials of primitives that are written without texture coordinates: a texture that asks for them would be an error.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::json::{array_mut, list_mut, object_mut};

/// What the user is told.
pub(super) const UNTEXTURED: &str = "the result has no texture coordinates: materials are written without textures";

/// A primitive that lacks some of its sets of texture coordinates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Bare {
    pub mesh: usize,
    pub primitive: usize,
    /// The sets, ascending.
    pub sets: Vec<u64>,
}

/// Takes the textures that need coordinates which are gone out of materials: of those that nothing else uses themselves,
/// otherwise of copies of them. Returns whether there were any.
pub(super) fn take_textures_out(json: &mut Value, mut bare: Vec<Bare>) -> bool {
    bare.sort_unstable_by_key(|bare| (bare.mesh, bare.primitive));
    let used_by = users(json, &bare);
    let mut found = false;
    let mut copies: BTreeMap<(u64, &[u64]), u64> = BTreeMap::new();
    for Bare { mesh, primitive, sets } in &bare {
        let mut named = Vec::new();
        for_each_material(primitive_at(json, *mesh, *primitive), &mut |number| named.push(number));
        named.sort_unstable();
        named.dedup();
        for number in named {
            let materials = list_mut(json, "materials");
            let Some(material) = materials.get_mut(number as usize) else { continue };
            if used_by.get(&number) == Some(&Some(sets)) {
                found |= without_textures(object_mut(material), sets);
                continue;
            }
            let mut copy = material.clone();
            let known = copies.get(&(number, sets.as_slice())).copied();
            if known.is_none() && !without_textures(object_mut(&mut copy), sets) {
                continue;
            }
            let number_of_copy = known.unwrap_or_else(|| {
                materials.push(copy);
                materials.len() as u64 - 1
            });
            copies.insert((number, sets), number_of_copy);
            found = true;
            rename(json, (*mesh, *primitive), number, number_of_copy);
        }
    }
    found
}

/// The sets that all users of a material lack; `None` where they do not agree.
fn users<'a>(json: &mut Value, bare: &'a [Bare]) -> BTreeMap<u64, Option<&'a Vec<u64>>> {
    let mut users = BTreeMap::new();
    for (mesh, value) in array_mut(json, "meshes").iter_mut().enumerate() {
        for (primitive, value) in array_mut(value, "primitives").iter_mut().enumerate() {
            let own = bare.binary_search_by_key(&(mesh, primitive), |bare| (bare.mesh, bare.primitive));
            let missing = own.ok().map(|own| &bare[own].sets);
            for_each_material(Some(value), &mut |number| {
                let all = users.entry(number).or_insert(missing);
                *all = all.filter(|all| Some(*all) == missing);
            });
        }
    }
    users
}

fn primitive_at(json: &mut Value, mesh: usize, primitive: usize) -> Option<&mut Value> {
    array_mut(array_mut(json, "meshes").get_mut(mesh)?, "primitives").get_mut(primitive)
}

/// The places where a primitive names a material: its own, and those of its variants.
fn material_places(primitive: &mut Value) -> Vec<&mut Value> {
    const VARIANTS: &str = "KHR_materials_variants";
    let Some(primitive) = primitive.as_object_mut() else { return Vec::new() };
    let mut places = Vec::new();
    for (key, value) in primitive {
        match key.as_str() {
            "material" => places.push(value),
            "extensions" => {
                let mappings = value.get_mut(VARIANTS).and_then(|variants| variants.get_mut("mappings"));
                let mappings = mappings.and_then(Value::as_array_mut).into_iter().flatten();
                places.extend(mappings.filter_map(|mapping| mapping.get_mut("material")));
            }
            _ => {}
        }
    }
    places
}

fn for_each_material(primitive: Option<&mut Value>, tell: &mut impl FnMut(u64)) {
    primitive.into_iter().flat_map(material_places).filter_map(|place| place.as_u64()).for_each(tell);
}

fn rename(json: &mut Value, (mesh, primitive): (usize, usize), from: u64, to: u64) {
    let places = primitive_at(json, mesh, primitive).into_iter().flat_map(material_places);
    places.filter(|place| place.as_u64() == Some(from)).for_each(|place| *place = to.into());
}

/// Takes the textures by these sets out of a material or a part of one; returns whether there were any.
fn without_textures(part: &mut Map<String, Value>, sets: &[u64]) -> bool {
    let before = part.len();
    part.retain(|key, value| !(key.ends_with("Texture") && set_of(value).is_some_and(|set| sets.contains(&set))));
    let mut found = part.len() < before;
    for value in part.values_mut() {
        if let Value::Object(inner) = value {
            found |= without_textures(inner, sets);
        }
    }
    found
}

/// The set of coordinates that a texture is looked up by; `None` for what is no texture.
fn set_of(texture: &Value) -> Option<u64> {
    texture.get("index")?.as_u64()?;
    let moved = texture.get("extensions").and_then(|extensions| extensions.get("KHR_texture_transform"));
    let set = moved.and_then(|moved| moved.get("texCoord")).or_else(|| texture.get("texCoord"));
    Some(set.and_then(Value::as_u64).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn cloth() -> Value {
        json!({
            "name": "cloth",
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "baseColorFactor": [1, 0, 0, 1] },
            "occlusionTexture": { "index": 1, "texCoord": 1 },
            "extensions": { "KHR_materials_clearcoat": { "clearcoatTexture": {
                "index": 2, "texCoord": 1, "extensions": { "KHR_texture_transform": { "texCoord": 0 } },
            } } },
        })
    }

    /// Two primitives with a material each of two, and a variant.
    fn file(second: u64) -> Value {
        let variants = json!({ "KHR_materials_variants": { "mappings": [{ "material": 1, "variants": [0] }] } });
        json!({
            "meshes": [{ "primitives": [{ "material": 0, "extensions": variants }, { "material": second }] }],
            "materials": [cloth(), { "name": "plain" }],
        })
    }

    #[test]
    fn a_material_of_bare_primitives_alone_loses_its_textures() {
        let mut json = file(1);
        let bare = Bare { mesh: 0, primitive: 0, sets: vec![0] };
        assert!(take_textures_out(&mut json, vec![bare]));
        let expected = json!({
            "name": "cloth",
            "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1] },
            "occlusionTexture": { "index": 1, "texCoord": 1 },
            "extensions": { "KHR_materials_clearcoat": {} },
        });
        assert_eq!(json["materials"], json!([expected, { "name": "plain" }]));
        assert_eq!(json["meshes"], file(1)["meshes"]);
    }

    #[test]
    fn a_material_of_others_too_is_copied() {
        let mut json = file(0);
        let bare = Bare { mesh: 0, primitive: 1, sets: vec![0, 1] };
        assert!(take_textures_out(&mut json, vec![bare]));
        assert_eq!((&json["materials"][0], &json["meshes"][0]["primitives"][1]["material"]), (&cloth(), &json!(2)));
        assert_eq!(json["materials"][2]["pbrMetallicRoughness"], json!({ "baseColorFactor": [1, 0, 0, 1] }));
        assert!(json["materials"][2].get("occlusionTexture").is_none());
    }

    #[test]
    fn what_has_no_such_textures_stays() {
        let mut json = file(1);
        assert!(!take_textures_out(&mut json, vec![Bare { mesh: 0, primitive: 1, sets: vec![0] }]));
        assert!(!take_textures_out(&mut json, vec![Bare { mesh: 7, primitive: 1, sets: vec![0] }]));
        assert_eq!(json, file(1));
    }
}
