//! A mesh back into the primitives it came from.

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use super::accessor::Number;
use super::color;
use super::document::{Gltf, QUANTIZED, forget, primitive_mut};
use super::json::{array_mut, list_mut, object_mut};
use super::part::{Attribute, JOINTS, Part, Place};
use crate::formats::attributes;
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{Channel, ChannelKind, Mesh};

/// What bytes of vertices and of indices are for.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A vertex of a primitive: that of the mesh, and the bits of its texture coordinates, which belong to corners there.
type Key = (u32, [u32; 2]);

/// A file as it grows.
pub(super) struct File {
    pub(super) json: Value,
    pub(super) binary: Vec<u8>,
    pub(super) warnings: Vec<String>,
}

/// The JSON and the bytes of `mesh` in `document`, whose parts its materials are.
pub(super) fn fill(mesh: &Mesh, document: &Gltf) -> File {
    let mut file = File { json: document.json.clone(), binary: document.binary.clone(), warnings: Vec::new() };
    let mut of_part = vec![Vec::new(); document.parts.len()];
    match &mesh.materials {
        Some(materials) if document.parts.len() > 1 => {
            materials.of_face.iter().zip(0..).for_each(|(&part, face)| of_part[part as usize].push(face));
        }
        _ => of_part.iter_mut().for_each(|faces| *faces = (0..mesh.faces.len() as u32).collect()),
    }
    let mut lost = Vec::new();
    for (part, faces) in document.parts.iter().zip(&of_part) {
        if faces.is_empty() {
            lost.push([part.mesh, part.primitive]);
        } else {
            file.put(mesh, part, faces);
        }
    }
    if !lost.is_empty() {
        let (count, all) = (lost.len(), document.parts.len());
        file.warnings.push(format!("{count} of {all} primitives have no faces left and are not written"));
        drop_primitives(&mut file.json, &lost);
    }
    if !is_quantized(&file.json) {
        forget(&mut file.json, QUANTIZED);
    }
    file.finish();
    file
}

impl File {
    /// Writes some faces of a mesh as a primitive.
    fn put(&mut self, mesh: &Mesh, part: &Part, faces: &[u32]) {
        let corners = corners(mesh, faces);
        let mut keys = corners.clone();
        keys.par_sort_unstable();
        keys.dedup();
        let number = |key: &Key| keys.binary_search(key).unwrap_or_default() as u32;
        let mut indices: Vec<u32> = corners.par_iter().map(number).collect();
        if part.placement.is_mirrored {
            indices.as_chunks_mut().0.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
        let vertices = Vertices { mesh, part, keys: &keys, faces };
        let mut attributes = Map::new();
        let mut targets: Vec<Value> = Vec::new();
        for attribute in &part.attributes {
            let to = match attribute.target {
                None => &mut attributes,
                Some(target) => {
                    targets.resize(targets.len().max(target + 1), json!({}));
                    object_mut(&mut targets[target])
                }
            };
            match self.attribute(&vertices, attribute) {
                Some(accessor) => drop(to.insert(attribute.semantic.clone(), accessor.into())),
                None => self.note_loss(attribute),
            }
        }
        if !attributes.contains_key("NORMAL") && vertices.have_normals() {
            let accessor = self.floats(&vertices.normals(), 3, "VEC3", false, &Map::new());
            attributes.insert("NORMAL".into(), accessor.into());
        }
        let indices = self.indices(&indices, keys.len(), &part.indices_said);
        let Some(primitive) = primitive_mut(&mut self.json, part) else { return };
        let primitive = object_mut(primitive);
        primitive.insert("attributes".into(), Value::Object(attributes));
        primitive.insert("indices".into(), indices.into());
        if !targets.is_empty() {
            primitive.insert("targets".into(), Value::Array(targets));
        }
    }

    /// An accessor for an attribute; `None` where the mesh has not got it any more.
    fn attribute(&mut self, vertices: &Vertices<'_>, attribute: &Attribute) -> Option<usize> {
        let Vertices { mesh, part, keys, .. } = vertices;
        let is_position = attribute.semantic == "POSITION";
        let Attribute { width, shape, said, .. } = attribute;
        let rows = || keys.iter().map(|&(vertex, _)| vertex as usize);
        let numbers: Vec<f32> = match &attribute.place {
            Place::Positions => {
                rows().flat_map(|v| part.placement.point_from_scene(mesh.positions[v]).to_array()).collect()
            }
            Place::Normals => {
                mesh.normals.as_ref()?;
                vertices.normals()
            }
            Place::Texcoords => {
                mesh.texcoords.as_ref()?;
                keys.iter().flat_map(|(_, bits)| bits.map(f32::from_bits)).collect()
            }
            Place::Colors => {
                let colors = mesh.colors.as_ref()?;
                let light = rows().map(|v| color::to_light(colors[v]));
                let number = match attribute.number {
                    Number::U8 | Number::U16 => attribute.number,
                    _ => Number::F32,
                };
                let bytes = light.map(|light| {
                    let mut bytes = Vec::new();
                    color::push(&mut bytes, &light[..*width], number);
                    bytes
                });
                return Some(self.elements(bytes, number, number != Number::F32, shape, said));
            }
            Place::Channel(name, kind) => {
                let Some(channel) = channel(mesh, name).filter(|channel| channel.width >= *width) else {
                    // A target needs something; nothing is what it does.
                    return attribute.target.map(|_| self.zeros(keys.len(), attribute));
                };
                let row = |v| &channel.row(v)[..*width];
                match (kind, width) {
                    (ChannelKind::Tangent, 4) => rows()
                        .flat_map(|v| part.placement.tangent_from_scene([0, 1, 2, 3].map(|i| channel.row(v)[i])))
                        .collect(),
                    _ => rows().flat_map(row).copied().collect(),
                }
            }
            Place::Joints(set) => {
                let channel = channel(mesh, JOINTS)?;
                let joints = |v| channel.row(v)[4 * set..][..4].iter().map(|&joint| joint as u16);
                let is_small = attribute.number == Number::U8 && rows().flat_map(joints).all(|joint| joint < 256);
                let number = if is_small { Number::U8 } else { Number::U16 };
                let bytes = rows()
                    .map(|v| joints(v).flat_map(|joint| joint.to_le_bytes().into_iter().take(number.size())).collect());
                return Some(self.elements(bytes, number, false, shape, said));
            }
            Place::Weights(set) => {
                let channel = channel(mesh, JOINTS)?;
                rows().flat_map(|v| &channel.row(v)[channel.width / 2 + 4 * set..][..4]).copied().collect()
            }
        };
        Some(self.floats(&numbers, *width, shape, is_position, said))
    }

    fn note_loss(&mut self, attribute: &Attribute) {
        if matches!(attribute.place, Place::Joints(_) | Place::Weights(_)) {
            let warning = format!("the result has no {}: its skin does not move it", attribute.semantic);
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }

    /// An accessor of `f32`.
    fn floats(
        &mut self,
        numbers: &[f32],
        width: usize,
        shape: &str,
        is_position: bool,
        said: &Map<String, Value>,
    ) -> usize {
        let accessor = self.elements(
            numbers.chunks_exact(width).map(|row| bytemuck::cast_slice(row).to_vec()),
            Number::F32,
            false,
            shape,
            said,
        );
        if is_position {
            self.bound(accessor, numbers, width);
        }
        accessor
    }

    /// Says the least and the greatest of each column.
    fn bound(&mut self, accessor: usize, numbers: &[f32], width: usize) {
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f64> {
            let column = |at| numbers.iter().skip(at).step_by(width).copied().reduce(pick).unwrap_or_default();
            (0..width).map(|at| f64::from(column(at))).collect()
        };
        let (least, greatest) = (bound(f32::min), bound(f32::max));
        let accessor = &mut list_mut(&mut self.json, "accessors")[accessor];
        accessor["min"] = json!(least);
        accessor["max"] = json!(greatest);
    }

    /// An accessor without bytes: zeros.
    fn zeros(&mut self, count: usize, attribute: &Attribute) -> usize {
        let Attribute { shape, said, width, .. } = attribute;
        let number = self.accessor(said.clone(), None, Number::F32, count, shape);
        if attribute.semantic == "POSITION" {
            self.bound(number, &[], *width);
        }
        number
    }

    /// An accessor of elements of the same size, each at a multiple of 4 bytes.
    fn elements(
        &mut self,
        elements: impl Iterator<Item = Vec<u8>>,
        number: Number,
        is_normalized: bool,
        shape: &str,
        said: &Map<String, Value>,
    ) -> usize {
        let start = self.align();
        let (mut count, mut size) = (0, 0);
        for element in elements {
            self.binary.extend_from_slice(&element);
            size = element.len();
            count += 1;
            self.align();
        }
        let stride = (size % 4 != 0).then(|| size.next_multiple_of(4));
        let view = self.view(start, ARRAY_BUFFER, stride);
        let accessor = self.accessor(said.clone(), Some(view), number, count, shape);
        if is_normalized {
            list_mut(&mut self.json, "accessors")[accessor]["normalized"] = true.into();
        }
        accessor
    }

    /// An accessor of indices below `count`, as small as they fit.
    fn indices(&mut self, indices: &[u32], count: usize, said: &Map<String, Value>) -> usize {
        let start = self.align();
        // The greatest number of a type restarts strips.
        let number = if count < usize::from(u16::MAX) { Number::U16 } else { Number::U32 };
        match number {
            Number::U16 => indices.iter().for_each(|&i| self.binary.extend_from_slice(&(i as u16).to_le_bytes())),
            _ => self.binary.extend_from_slice(&indices.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>()),
        }
        let view = self.view(start, ELEMENT_ARRAY_BUFFER, None);
        self.accessor(said.clone(), Some(view), number, indices.len(), "SCALAR")
    }

    /// Fills up to a multiple of 4 bytes; where that is.
    fn align(&mut self) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.binary.len()
    }

    /// A view of the bytes from `start` on.
    fn view(&mut self, start: usize, target: u32, stride: Option<usize>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": self.binary.len() - start });
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        view["target"] = target.into();
        let views = list_mut(&mut self.json, "bufferViews");
        views.push(view);
        views.len() - 1
    }

    fn accessor(
        &mut self,
        mut said: Map<String, Value>,
        view: Option<usize>,
        number: Number,
        count: usize,
        shape: &str,
    ) -> usize {
        if let Some(view) = view {
            said.insert("bufferView".into(), view.into());
        }
        said.insert("componentType".into(), number.code().into());
        said.insert("count".into(), count.into());
        said.insert("type".into(), shape.into());
        let accessors = list_mut(&mut self.json, "accessors");
        accessors.push(Value::Object(said));
        accessors.len() - 1
    }

    /// The length of the buffer; no empty lists, which glTF does not allow.
    fn finish(&mut self) {
        self.align();
        let length = self.binary.len();
        let buffers = list_mut(&mut self.json, "buffers");
        match (length, buffers.first_mut()) {
            (0, _) => buffers.clear(),
            (_, Some(buffer)) => buffer["byteLength"] = length.into(),
            (_, None) => buffers.push(json!({ "byteLength": length })),
        }
        for key in ["buffers", "bufferViews", "accessors", "meshes"] {
            if list_mut(&mut self.json, key).is_empty() {
                object_mut(&mut self.json).remove(key);
            }
        }
    }
}

/// The vertices of a primitive.
struct Vertices<'a> {
    mesh: &'a Mesh,
    part: &'a Part,
    keys: &'a [Key],
    faces: &'a [u32],
}

impl Vertices<'_> {
    /// Whether every vertex has one; zeros stand for those of a primitive without.
    fn have_normals(&self) -> bool {
        let normals = self.mesh.normals.as_ref();
        normals.is_some_and(|normals| self.keys.iter().all(|&(vertex, _)| normals[vertex as usize].is_normalized()))
    }

    /// A direction for each: where there is none that of a face, since a glTF must have one.
    fn normals(&self) -> Vec<f32> {
        let normals = self.mesh.normals.as_deref().unwrap_or_default();
        let rows = self.keys.iter().map(|&(vertex, _)| attributes::written_normal(normals[vertex as usize]));
        let mut rows: Vec<Vec3> = rows.collect();
        if rows.contains(&Vec3::ZERO) {
            for &face in self.faces {
                let corners = self.mesh.faces[face as usize];
                let direction = self.mesh.cross(corners).normalize_or(DVec3::Z).as_vec3();
                for vertex in corners {
                    let first = self.keys.partition_point(|&(key, _)| key < vertex);
                    let same = self.keys[first..].iter().take_while(|(key, _)| *key == vertex).count();
                    rows[first..first + same]
                        .iter_mut()
                        .filter(|row| **row == Vec3::ZERO)
                        .for_each(|row| *row = direction);
                }
            }
        }
        rows.iter().flat_map(|&normal| self.part.placement.normal_from_scene(normal).to_array()).collect()
    }
}

fn corners(mesh: &Mesh, faces: &[u32]) -> Vec<Key> {
    let of_face = |&face: &u32| {
        let face = face as usize;
        let pairs = mesh.texcoords.as_ref().map_or([Vec2::ZERO; 3], |rows| rows[face]);
        [0, 1, 2].map(|i| (mesh.faces[face][i], pairs[i].to_array().map(f32::to_bits)))
    };
    faces.iter().flat_map(of_face).collect()
}

fn channel<'a>(mesh: &'a Mesh, name: &str) -> Option<&'a Channel> {
    mesh.channels.iter().find(|channel| channel.name == name)
}

/// Removes primitives, and the meshes that have none left from their nodes.
fn drop_primitives(json: &mut Value, lost: &[[usize; 2]]) {
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
    for node in array_mut(json, "nodes") {
        let Some(number) = node.get("mesh").and_then(Value::as_u64) else { continue };
        let node = object_mut(node);
        match numbers.get(number as usize).copied().flatten() {
            Some(number) => drop(node.insert("mesh".into(), number.into())),
            None => ["mesh", "skin", "weights"].iter().for_each(|key| drop(node.remove(*key))),
        }
    }
}

/// Whether a primitive is left whose numbers are what only `KHR_mesh_quantization` allows.
fn is_quantized(json: &Value) -> bool {
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
