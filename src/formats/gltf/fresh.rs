//! A document for a mesh that came from another format.

use rustc_hash::FxHashMap;
use serde_json::{Map, Value, json};

use super::document::Gltf;
use super::materials;
use super::number::Number;
use super::part::{Attribute, Part, Place};
use super::scene::Placement;
use crate::formats::material::Material;
use crate::formats::{attributes, obj};
use crate::math::DVec3;
use crate::mesh::{ChannelKind, Mesh};

/// A node with a mesh for each object, of these a primitive for each name of its materials; these as `described` by the first lines
/// of names.
pub(super) fn document(mesh: &Mesh, described: &[Material]) -> Gltf {
    let names = mesh.materials.as_ref().map_or(&[][..], |materials| &materials.names);
    let (numbers, materials) = materials_of(names, described);
    // Map coordinates would lose what the eye can see.
    let shift = if attributes::needs_double(mesh) { center(mesh) } else { DVec3::ZERO };
    let attributes = attributes_of(mesh);
    let mut objects = Objects::default();
    let part = |number: usize| {
        let name = names.get(number).map_or("", |name| obj::object_of(name));
        let material = numbers.get(number).copied().flatten();
        let (mesh, primitive) = objects.add(name, material.map_or_else(|| json!({}), |of| json!({ "material": of })));
        Part {
            mesh,
            primitive,
            placement: Placement::shift(shift),
            attributes: attributes.clone(),
            indices_said: Map::new(),
        }
    };
    let parts: Vec<Part> = (0..names.len().max(1)).map(part).collect();
    let (nodes, meshes) = objects.finish(shift);
    let mut json = json!({
        "asset": { "version": "2.0", "generator": format!("coarsen {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<usize>>() }],
        "nodes": nodes,
        "meshes": meshes,
    });
    let mut binary = Vec::new();
    materials::put(&mut json, &mut binary, &materials, mesh.texcoords.is_some());
    Gltf { json, binary, parts, instances: Vec::new(), folder: None, has_data_uris: false, files: Vec::new() }
}

/// Objects by name, with the primitives of each.
#[derive(Default)]
struct Objects<'a> {
    known: FxHashMap<&'a str, usize>,
    all: Vec<(&'a str, Vec<Value>)>,
}

impl<'a> Objects<'a> {
    /// Adds a primitive to an object; tells the numbers of both.
    fn add(&mut self, name: &'a str, primitive: Value) -> (usize, usize) {
        let next = self.all.len();
        let number = *self.known.entry(name).or_insert(next);
        if number == next {
            self.all.push((name, Vec::new()));
        }
        let primitives = &mut self.all[number].1;
        primitives.push(primitive);
        (number, primitives.len() - 1)
    }

    /// A node that is shifted and a mesh for each.
    fn finish(self, shift: DVec3) -> (Vec<Value>, Vec<Value>) {
        let row = |(mesh, (name, primitives)): (usize, (&str, Vec<Value>))| {
            let (mut node, mut mesh) = (json!({ "mesh": mesh }), json!({ "primitives": primitives }));
            if !name.is_empty() {
                node["name"] = name.into();
                mesh["name"] = name.into();
            }
            if shift != DVec3::ZERO {
                node["translation"] = json!(shift.to_array());
            }
            (node, mesh)
        };
        self.all.into_iter().enumerate().map(row).unzip()
    }
}

/// Materials by name, those that are described.
pub(super) type Named<'a> = Vec<(String, Option<&'a Material>)>;

/// Which material each name has, groups of one material the same; and these. What has no name and no description has none.
fn materials_of<'a>(names: &[String], described: &'a [Material]) -> (Vec<Option<usize>>, Named<'a>) {
    let mut known: FxHashMap<&str, usize> = FxHashMap::default();
    let mut materials = Vec::new();
    let mut numbers = Vec::with_capacity(names.len());
    for (name, material) in names.iter().zip(obj::described(described, names)) {
        let name = name.lines().next().unwrap_or_default();
        let is_there = !name.is_empty() || material.is_some();
        numbers.push(is_there.then(|| {
            *known.entry(name).or_insert_with(|| {
                materials.push((name.to_string(), material));
                materials.len() - 1
            })
        }));
    }
    (numbers, materials)
}

/// The middle of the bounding box, in whole numbers: nothing is lost by taking it off.
fn center(mesh: &Mesh) -> DVec3 {
    let (low, high) = mesh.bounds();
    (low * 0.5 + high * 0.5).round()
}

fn attributes_of(mesh: &Mesh) -> Vec<Attribute> {
    let standard = [
        (true, "POSITION", Place::Positions, 3, Number::F32),
        (mesh.normals.is_some(), "NORMAL", Place::Normals, 3, Number::F32),
        (mesh.texcoords.is_some(), "TEXCOORD_0", Place::Texcoords, 2, Number::F32),
        // Bytes of light would lose dark shades.
        (mesh.colors.is_some(), "COLOR_0", Place::Colors, 4, Number::U16),
    ];
    let of = |(_, semantic, place, width, number): (bool, &str, Place, usize, Number)| Attribute {
        semantic: semantic.into(),
        target: None,
        place,
        width,
        shape: shape(width).into(),
        number,
        said: Map::new(),
    };
    let mut attributes: Vec<Attribute> = standard.into_iter().filter(|(is_there, ..)| *is_there).map(of).collect();
    for channel in &mesh.channels {
        let semantic = match channel.kind {
            // A tangent has a direction at every vertex, or none at any.
            ChannelKind::Tangent if channel.values.chunks(4).any(|row| row[..3] == [0.0; 3]) => continue,
            // Joints say nothing without a skin, nor targets without their mesh.
            ChannelKind::Joints | ChannelKind::Displacement => continue,
            ChannelKind::Linear | ChannelKind::Label if channel.name.contains('.') || channel.width > 4 => continue,
            ChannelKind::Linear | ChannelKind::Label if channel.name.starts_with('_') => channel.name.clone(),
            ChannelKind::Linear | ChannelKind::Label => format!("_{}", channel.name.to_ascii_uppercase()),
            ChannelKind::Texcoords | ChannelKind::Tangent => channel.name.clone(),
        };
        let place = Place::Channel(channel.name.clone(), channel.kind);
        let is_label = channel.kind == ChannelKind::Label;
        let number = if is_label { Number::of_whole(&channel.values) } else { Number::F32 };
        attributes.push(of((true, &semantic, place, channel.width, number)));
    }
    attributes
}

fn shape(width: usize) -> &'static str {
    ["SCALAR", "VEC2", "VEC3", "VEC4"][width.clamp(1, 4) - 1]
}
