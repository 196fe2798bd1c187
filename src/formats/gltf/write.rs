//! A mesh back into the primitives it came from.

use std::collections::BTreeSet;

use rayon::prelude::*;
use serde_json::{Map, Value};

use super::color;
use super::document::{Gltf, QUANTIZED, drop_primitives, forget, is_quantized, primitive_mut};
use super::file::File;
use super::json::object_mut;
use super::number::Number;
use super::orphans::take_skins_off;
use super::part::{Attribute, JOINTS, Part, Place};
use super::untextured::{Bare, UNTEXTURED, take_textures_out};
use crate::formats::attributes;
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{Channel, ChannelKind, Mesh};

/// A vertex of a primitive: that of the mesh, and the bits of its texture coordinates, which belong to corners there.
type Key = (u32, [u32; 2]);

/// The JSON and the bytes of `mesh` in `document`, whose parts its materials are.
pub(super) fn fill(mesh: &Mesh, document: &Gltf) -> File {
    let mut file =
        File { json: document.json.clone(), binary: document.binary.clone(), warnings: Vec::new(), overflows: false };
    let mut of_part = vec![Vec::new(); document.parts.len()];
    match &mesh.materials {
        Some(materials) if document.parts.len() > 1 => {
            materials.of_face.iter().zip(0..).for_each(|(&part, face)| of_part[part as usize].push(face));
        }
        _ => of_part.iter_mut().for_each(|faces| *faces = (0..mesh.faces.len() as u32).collect()),
    }
    let (mut lost, mut bare, mut unmoved) = (Vec::new(), Vec::new(), Vec::new());
    for (part, faces) in document.parts.iter().zip(&of_part) {
        if faces.is_empty() {
            lost.push([part.mesh, part.primitive]);
            unmoved.push(part.mesh);
            continue;
        }
        let gone = file.put(mesh, part, faces);
        let mut sets: Vec<u64> = gone.iter().filter_map(|name| name.strip_prefix("TEXCOORD_")?.parse().ok()).collect();
        if !sets.is_empty() {
            sets.sort_unstable();
            bare.push(Bare { mesh: part.mesh, primitive: part.primitive, sets });
        }
        if gone.contains("JOINTS_0") {
            unmoved.push(part.mesh);
        }
    }
    if take_textures_out(&mut file.json, bare) {
        file.warnings.push(UNTEXTURED.into());
    }
    take_skins_off(&mut file.json, &unmoved, &lost);
    if !lost.is_empty() {
        let (count, all) = (lost.len(), document.parts.len());
        file.warnings.push(format!("primitives without faces left, which are not written: {count} of {all}"));
        let hanging = drop_primitives(&mut file.json, &lost);
        let told = format!("references of extensions to meshes without faces left, which are taken out: {hanging}");
        file.warnings.extend((hanging > 0).then_some(told));
    }
    if !is_quantized(&file.json) {
        forget(&mut file.json, QUANTIZED);
    }
    file.finish();
    file
}

impl File {
    /// Writes some faces of a mesh as a primitive; returns the attributes that it has no more.
    fn put<'a>(&mut self, mesh: &Mesh, part: &'a Part, faces: &[u32]) -> BTreeSet<&'a str> {
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
        let mut targets: Vec<Map<String, Value>> = Vec::new();
        let mut gone = BTreeSet::new();
        for attribute in &part.attributes {
            let to = match attribute.target {
                None => &mut attributes,
                Some(target) => {
                    targets.resize(targets.len().max(target + 1), Map::new());
                    &mut targets[target]
                }
            };
            match self.attribute(&vertices, attribute) {
                Some(accessor) => drop(to.insert(attribute.semantic.clone(), accessor.into())),
                None => {
                    gone.insert(attribute.semantic.as_str());
                    self.note_loss(attribute);
                }
            }
        }
        if gone.contains("NORMAL") {
            // A tangent is one of a normal's.
            gone.extend(attributes.remove("TANGENT").map(|_| "TANGENT"));
        }
        if !attributes.contains_key("NORMAL") && vertices.have_normals() {
            let accessor = self.floats(&vertices.normals(), 3, "VEC3", false, &Map::new());
            attributes.insert("NORMAL".into(), accessor.into());
        }
        for target in &mut targets {
            // What a target adds to has to be there, and a target needs something: nothing is what it does.
            target.retain(|semantic, _| !gone.contains(semantic.as_str()));
            if target.is_empty() {
                let accessor = self.floats(&vec![0.0; 3 * keys.len()], 3, "VEC3", true, &Map::new());
                target.insert("POSITION".into(), accessor.into());
            }
        }
        let indices = self.indices(&indices, keys.len(), &part.indices_said);
        let Some(primitive) = primitive_mut(&mut self.json, part) else { return gone };
        let primitive = object_mut(primitive);
        primitive.insert("attributes".into(), Value::Object(attributes));
        primitive.insert("indices".into(), indices.into());
        if !targets.is_empty() {
            primitive.insert("targets".into(), targets.into_iter().map(Value::Object).collect());
        }
        gone
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
                let mut packed = Vec::new();
                light.for_each(|light| color::push(&mut packed, &light[..*width], number));
                let kind = (number, number != Number::F32);
                return Some(self.elements(&packed, width * number.size(), kind, shape, said));
            }
            Place::Channel(name, kind) => {
                let Some(channel) = channel(mesh, name).filter(|channel| channel.width >= *width) else {
                    // A target needs something; nothing is what it does.
                    return attribute.target.map(|_| self.zeros(keys.len(), attribute));
                };
                let row = |v| &channel.row(v)[..*width];
                let packed = (channel.kind == ChannelKind::Label)
                    .then(|| attribute.number.pack_whole(rows().flat_map(row).copied()))
                    .flatten();
                if let Some(packed) = packed {
                    let size = width * attribute.number.size();
                    return Some(self.elements(&packed, size, (attribute.number, false), shape, said));
                }
                match (kind, width) {
                    (ChannelKind::Tangent, 4) => rows()
                        .flat_map(|v| part.placement.tangent_from_scene([0, 1, 2, 3].map(|i| channel.row(v)[i])))
                        .collect(),
                    (ChannelKind::Displacement, 3) => rows()
                        .flat_map(|v| part.placement.vector_from_scene(Vec3::from_slice(channel.row(v))).to_array())
                        .collect(),
                    _ => rows().flat_map(row).copied().collect(),
                }
            }
            Place::Joints(set) => {
                let channel = joints(mesh, *set)?;
                let joints = |v| channel.row(v)[4 * set..][..4].iter().map(|&joint| joint as u16);
                let is_small = attribute.number == Number::U8 && rows().flat_map(joints).all(|joint| joint < 256);
                let number = if is_small { Number::U8 } else { Number::U16 };
                let bytes = |joint: u16| joint.to_le_bytes().into_iter().take(number.size());
                let packed: Vec<u8> = rows().flat_map(joints).flat_map(bytes).collect();
                return Some(self.elements(&packed, 4 * number.size(), (number, false), shape, said));
            }
            Place::Weights(set) => {
                let channel = joints(mesh, *set)?;
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

/// The channel of joints, where it has this set of four.
fn joints(mesh: &Mesh, set: usize) -> Option<&Channel> {
    channel(mesh, JOINTS).filter(|channel| channel.kind == ChannelKind::Joints && channel.width / 8 > set)
}

fn channel<'a>(mesh: &'a Mesh, name: &str) -> Option<&'a Channel> {
    mesh.channels.iter().find(|channel| channel.name == name)
}
