//! Who names accessors and views by their numbers.

use serde_json::Value;

use super::json::array_mut;

/// Calls its second argument with every number of a kind.
pub(super) type Visit = fn(&mut Value, &mut dyn FnMut(&mut Value));

/// Extensions known to name no accessor and no view, by how their names begin.
const HARMLESS: [&str; 14] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "KHR_node_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_ies",
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "MSFT_lod",
    "MSFT_packing_",
    "MSFT_texture_",
];

/// The members of objects in extensions that may be such numbers.
const NUMBERS: [&str; 8] =
    ["attributes", "indices", "values", "input", "output", "arrayOffsets", "stringOffsets", "targets"];

/// Those of accessors. Null stands for none.
pub(super) fn to_accessors(json: &mut Value, visit: &mut dyn FnMut(&mut Value)) {
    let mut see = |value: Option<&mut Value>| value.filter(|value| !value.is_null()).into_iter().for_each(&mut *visit);
    for mesh in array_mut(json, "meshes") {
        for primitive in array_mut(mesh, "primitives") {
            members(primitive.get_mut("attributes"), &mut see);
            see(primitive.get_mut("indices"));
            array_mut(primitive, "targets").iter_mut().for_each(|target| members(Some(target), &mut see));
        }
    }
    for animation in array_mut(json, "animations") {
        for sampler in array_mut(animation, "samplers") {
            see(sampler.get_mut("input"));
            see(sampler.get_mut("output"));
        }
    }
    array_mut(json, "skins").iter_mut().for_each(|skin| see(skin.get_mut("inverseBindMatrices")));
    for node in array_mut(json, "nodes") {
        members(node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes"), &mut see);
    }
}

/// Those of views.
pub(super) fn to_views(json: &mut Value, visit: &mut dyn FnMut(&mut Value)) {
    let mut see = |value: Option<&mut Value>| value.filter(|value| !value.is_null()).into_iter().for_each(&mut *visit);
    for accessor in array_mut(json, "accessors") {
        for path in ["/bufferView", "/sparse/indices/bufferView", "/sparse/values/bufferView"] {
            see(accessor.pointer_mut(path));
        }
    }
    array_mut(json, "images").iter_mut().for_each(|image| see(image.get_mut("bufferView")));
}

fn members(object: Option<&mut Value>, see: &mut impl FnMut(Option<&mut Value>)) {
    let Some(Value::Object(map)) = object else { return };
    map.values_mut().for_each(|value| see(Some(value)));
}

/// Whether an extension that is not known may name an accessor or a view.
pub(super) fn may_be_hidden(json: &Value) -> bool {
    match json {
        Value::Array(values) => values.iter().any(may_be_hidden),
        Value::Object(map) => map.iter().any(|(key, value)| match (key.as_str(), value) {
            // What applications keep for themselves is theirs.
            ("extras", _) => false,
            ("extensions", Value::Object(extensions)) => extensions.iter().any(|(name, extension)| {
                let is_known = HARMLESS.iter().any(|known| name.starts_with(known));
                if is_known { may_be_hidden(extension) } else { names_numbers(extension) }
            }),
            _ => may_be_hidden(value),
        }),
        _ => false,
    }
}

fn names_numbers(extension: &Value) -> bool {
    let by_key = |(key, value): (&String, &Value)| {
        let lower = key.to_ascii_lowercase();
        let is_named = lower.contains("accessor") || lower.contains("bufferview") || NUMBERS.contains(&key.as_str());
        is_named && has_number(value) || names_numbers(value)
    };
    match extension {
        Value::Array(values) => values.iter().any(names_numbers),
        Value::Object(map) => map.iter().any(by_key),
        _ => false,
    }
}

fn has_number(value: &Value) -> bool {
    match value {
        Value::Number(_) => true,
        Value::Array(values) => values.iter().any(has_number),
        Value::Object(map) => map.values().any(has_number),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn unknown_numbers_are_suspected_where_they_may_be() {
        for (json, is_suspect) in [
            (json!({ "materials": [{ "extensions": { "KHR_materials_ior": { "ior": 1.4 } } }] }), false),
            (json!({ "nodes": [{ "extensions": { "ACME_sound": { "clips": [{ "bufferView": 3 }] } } }] }), true),
            (json!({ "extensions": { "EXT_structural_metadata": { "tables": [{ "p": { "values": 2 } }] } } }), true),
            (json!({ "nodes": [{ "extensions": { "ACME_tag": { "color": [1, 2] } } }] }), false),
            (json!({ "nodes": [{ "extras": { "extensions": { "X": { "accessor": 1 } } } }] }), false),
        ] {
            assert_eq!(may_be_hidden(&json), is_suspect, "{json}");
        }
    }
}
