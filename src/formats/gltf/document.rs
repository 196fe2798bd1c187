//! What a file says beside its triangles: all of its JSON, and the bytes that this needs.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::accessor::Store;
use super::container::{Buffer, Origin};
use super::json::{Json, array_mut, list_mut, object_mut};
use super::number::Number;
use super::orphans::{follow_in_extensions, stop_animations};
use super::part::Part;
use super::references;
use super::scene::Instances;
use crate::error::Result;

/// Extensions that say how the numbers of meshes are stored. They are undone on reading.
const STORAGE: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Positions, normals, tangents, texture coordinates as integers.
pub(super) const QUANTIZED: &str = "KHR_mesh_quantization";

/// A glTF file without its triangles: nodes, materials, textures, skins, animations, and whatever nobody here understands.
///
/// Made by [`read_scene`](crate::formats::read_scene), to be written with the mesh that came with it.
#[derive(Debug, Clone)]
pub struct Gltf {
    /// Primitives of triangles have nulls where the numbers of their accessors were.
    pub(super) json: Value,
    /// The only buffer: what is left of all of them.
    pub(super) binary: Vec<u8>,
    pub(super) parts: Vec<Part>,
    /// Of each mesh; none for a document of another format's.
    pub(super) instances: Vec<Instances>,
    /// Where relative URIs start; none for a stream.
    pub(super) folder: Option<PathBuf>,
    /// Whether all bytes stood in the JSON.
    pub(super) has_data_uris: bool,
    /// The files that they came from.
    pub(super) files: Vec<PathBuf>,
}

impl Gltf {
    /// Keeps of a file what its parts are not.
    pub(super) fn of(
        store: &Store<'_>,
        parts: Vec<Part>,
        instances: Vec<Instances>,
        folder: Option<&Path>,
    ) -> Result<Self> {
        let mut json = store.json.clone();
        parts.iter().for_each(|part| strip(&mut json, part));
        let binary = compact(&mut json, store)?;
        for extension in STORAGE {
            forget(&mut json, extension);
        }
        let has_data_uris =
            !store.buffers.is_empty() && store.buffers.iter().all(|buffer| buffer.origin == Origin::Data);
        let file = |buffer: &Buffer<'_>| match &buffer.origin {
            Origin::File(path) => Some(path.clone()),
            _ => None,
        };
        let files = store.buffers.iter().filter_map(file).collect();
        Ok(Self { json, binary, parts, instances, folder: folder.map(Path::to_path_buf), has_data_uris, files })
    }
}

/// Takes the numbers out of a primitive, and leaves their places.
fn strip(json: &mut Value, part: &Part) {
    let Some(primitive) = primitive_mut(json, part) else { return };
    let clear = |attributes: &mut Value| object_mut(attributes).values_mut().for_each(|number| *number = Value::Null);
    clear(&mut primitive["attributes"]);
    array_mut(primitive, "targets").iter_mut().for_each(clear);
    let primitive = object_mut(primitive);
    primitive.insert("indices".into(), Value::Null);
    // Triangles, whatever it was, need no word.
    if primitive.get("mode").is_some_and(|mode| mode != 4) {
        primitive.remove("mode");
    }
    if let Some(extensions) = primitive.get_mut("extensions") {
        let extensions = object_mut(extensions);
        STORAGE.iter().for_each(|name| drop(extensions.remove(*name)));
        if extensions.is_empty() {
            primitive.remove("extensions");
        }
    }
}

/// The primitive of a part, to be changed.
pub(super) fn primitive_mut<'a>(json: &'a mut Value, part: &Part) -> Option<&'a mut Value> {
    let mesh = array_mut(json, "meshes").get_mut(part.mesh)?;
    array_mut(mesh, "primitives").get_mut(part.primitive)
}

/// Removes accessors, views and bytes that nothing names, and numbers the others anew; returns the bytes.
fn compact(json: &mut Value, store: &Store<'_>) -> Result<Vec<u8>> {
    // What an extension may name by numbers that nobody here finds has to stay where it is.
    let keeps_all = references::may_be_hidden(json);
    let count = |json: &Value, list: &str| json.get(list).and_then(Value::as_array).map_or(0, Vec::len);
    for (list, visit) in
        [("accessors", references::to_accessors as references::Visit), ("bufferViews", references::to_views)]
    {
        let mut numbers: Vec<Option<usize>> = vec![keeps_all.then_some(0); count(json, list)];
        let mut missing = None;
        visit(json, &mut |reference| match reference.as_u64().map(|number| numbers.get_mut(number as usize)) {
            Some(Some(used)) => *used = Some(0),
            _ => missing = Some(reference.to_string()),
        });
        if let Some(missing) = missing {
            return Err(Json::root(json).error(format!("something names {list}[{missing}], which is not there")));
        }
        numbers.iter_mut().flatten().enumerate().for_each(|(next, number)| *number = next);
        visit(json, &mut |reference| {
            let number = reference.as_u64().and_then(|number| numbers.get(number as usize).copied().flatten());
            number.iter().for_each(|&number| *reference = number.into());
        });
        if list == "bufferViews" {
            return gather(json, store, &numbers);
        }
        let mut kept = numbers.iter();
        list_mut(json, list).retain(|_| kept.next().is_some_and(Option::is_some));
    }
    Ok(Vec::new())
}

/// The bytes of the views that have a number, one behind the other.
fn gather(json: &mut Value, store: &Store<'_>, numbers: &[Option<usize>]) -> Result<Vec<u8>> {
    let mut binary = Vec::new();
    let mut views = Vec::new();
    for (old, _) in numbers.iter().enumerate().filter(|(_, number)| number.is_some()) {
        let at = Json::root(store.json).element("bufferViews", old)?;
        let (bytes, _) = store.view(&at, old)?;
        store.spend(&at, bytes.len())?;
        // Accessors count their alignment from the buffer's start.
        let residue = at.optional_whole("byteOffset")?.unwrap_or(0) % 8;
        while binary.len() % 8 != residue {
            binary.push(0);
        }
        let mut view = at.value.clone();
        let members = object_mut(&mut view);
        members.insert("buffer".into(), 0.into());
        members.insert("byteOffset".into(), binary.len().into());
        if let Some(extensions) = members.get_mut("extensions") {
            STORAGE.iter().for_each(|name| drop(object_mut(extensions).remove(*name)));
            if object_mut(extensions).is_empty() {
                members.remove("extensions");
            }
        }
        views.push(view);
        binary.extend_from_slice(bytes);
    }
    *list_mut(json, "bufferViews") = views;
    // The one that is left says what the first said.
    let mut buffer = json.get("buffers").and_then(|buffers| buffers.get(0)).cloned().unwrap_or_else(|| json!({}));
    let members = object_mut(&mut buffer);
    members.remove("uri");
    members.remove("extensions");
    *list_mut(json, "buffers") = vec![buffer];
    Ok(binary)
}

/// Takes an extension off the lists of those that are used and required.
pub(super) fn forget(json: &mut Value, extension: &str) {
    let root: &mut Map<String, Value> = object_mut(json);
    for key in ["extensionsUsed", "extensionsRequired"] {
        if let Some(Value::Array(names)) = root.get_mut(key) {
            names.retain(|name| name != extension);
            if names.is_empty() {
                root.remove(key);
            }
        }
    }
}

/// Removes primitives, and the meshes that have none left from their nodes; returns how often an extension named such a mesh.
pub(super) fn drop_primitives(json: &mut Value, lost: &[[usize; 2]]) -> usize {
    let mut numbers = Vec::new();
    let mut next = 0;
    for (number, mesh) in array_mut(json, "meshes").iter_mut().enumerate() {
        let mut place = 0;
        list_mut(mesh, "primitives").retain(|_| {
            place += 1;
            !lost.contains(&[number, place - 1])
        });
        let has_any = !array_mut(mesh, "primitives").is_empty();
        numbers.push(has_any.then_some(next));
        next += usize::from(has_any);
    }
    let mut kept = numbers.iter();
    list_mut(json, "meshes").retain(|_| kept.next().is_some_and(Option::is_some));
    let mut bereft = Vec::new();
    for (at, node) in array_mut(json, "nodes").iter_mut().enumerate() {
        let Some(number) = node.get("mesh").and_then(Value::as_u64) else { continue };
        let node = object_mut(node);
        match numbers.get(number as usize).copied().flatten() {
            Some(number) => drop(node.insert("mesh".into(), number.into())),
            None => {
                ["mesh", "skin", "weights"].iter().for_each(|key| drop(node.remove(*key)));
                bereft.push(at as u64);
            }
        }
    }
    stop_animations(json, &bereft, &numbers);
    follow_in_extensions(json, &numbers)
}

/// Whether a primitive is left whose numbers are what only `KHR_mesh_quantization` allows.
pub(super) fn is_quantized(json: &Value) -> bool {
    let list = |object: &Value, key: &str| object.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    let needs = |attributes: &Value| {
        attributes.as_object().into_iter().flatten().any(|(semantic, number)| {
            let is_plain = ["COLOR", "JOINTS", "WEIGHTS", "_"].iter().any(|start| semantic.starts_with(start));
            let accessor = number.as_u64().and_then(|number| json["accessors"].get(number as usize));
            !is_plain && accessor.is_some_and(|accessor| accessor["componentType"] != Number::F32.code())
        })
    };
    let primitives = list(json, "meshes").into_iter().flat_map(|mesh| list(&mesh, "primitives"));
    primitives
        .into_iter()
        .any(|primitive| needs(&primitive["attributes"]) || list(&primitive, "targets").iter().any(needs))
}
