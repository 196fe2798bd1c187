//! A primitive of triangles: which of its attributes go where in a mesh.

use serde_json::{Map, Value};

use super::accessor::{Accessor, Store};
use super::json::Json;
use super::number::Number;
use super::scene::Placement;
use crate::error::Result;
use crate::mesh::ChannelKind;

/// The channel of the joints of all sets, then their weights.
pub(super) const JOINTS: &str = "JOINTS";

/// Where the numbers of an attribute go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Place {
    Positions,
    Normals,
    Colors,
    Texcoords,
    /// All of a channel.
    Channel(String, ChannelKind),
    /// Four numbers of the channel [`JOINTS`]: a set of joints, or of weights.
    Joints(usize),
    Weights(usize),
}

/// An attribute of a primitive, or of one of its targets.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    /// As the primitive calls it: `TEXCOORD_0`.
    pub(super) semantic: String,
    /// Of a morph target: its number.
    pub(super) target: Option<usize>,
    pub(super) place: Place,
    pub(super) width: usize,
    /// The accessor's type: `VEC3`.
    pub(super) shape: String,
    /// The type that its numbers were stored as.
    pub(super) number: Number,
    /// What the accessor says beside its numbers: a name, extras.
    pub(super) said: Map<String, Value>,
}

/// A primitive that became faces.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) mesh: usize,
    pub(super) primitive: usize,
    pub(super) placement: Placement,
    pub(super) attributes: Vec<Attribute>,
    /// What the accessor of its indices says beside them.
    pub(super) indices_said: Map<String, Value>,
}

impl Attribute {
    /// The attribute `semantic` of a primitive, or of one of its targets; checks that its accessor suits it.
    pub(super) fn of(semantic: &str, target: Option<usize>, accessor: &Accessor<'_>) -> Result<Self> {
        let (place, widths): (_, &[usize]) = match (target, semantic, semantic.rsplit_once('_')) {
            (None, "POSITION", _) => (Place::Positions, &[3]),
            (None, "NORMAL", _) => (Place::Normals, &[3]),
            (None, "TANGENT", _) => (Place::Channel(semantic.into(), ChannelKind::Tangent), &[4]),
            (None, "COLOR_0", _) => (Place::Colors, &[3, 4]),
            (None, "TEXCOORD_0", _) => (Place::Texcoords, &[2]),
            (None, _, Some(("TEXCOORD", _))) => (Place::Channel(semantic.into(), ChannelKind::Texcoords), &[2]),
            (None, _, Some(("JOINTS", set))) if set.parse::<u8>().is_ok() => {
                (Place::Joints(set.parse::<u8>().unwrap_or(0).into()), &[4])
            }
            (None, _, Some(("WEIGHTS", set))) if set.parse::<u8>().is_ok() => {
                (Place::Weights(set.parse::<u8>().unwrap_or(0).into()), &[4])
            }
            (None, ..) => (Place::Channel(semantic.into(), kind_of(semantic, accessor)), &[]),
            (Some(target), "POSITION", _) => {
                (Place::Channel(displacement(target, semantic), ChannelKind::Displacement), &[3])
            }
            (Some(target), ..) => (Place::Channel(displacement(target, semantic), ChannelKind::Linear), &[]),
        };
        if !widths.is_empty() {
            accessor.expect_width(widths, semantic)?;
        } else if target.is_some() && matches!(semantic, "NORMAL" | "TANGENT") {
            accessor.expect_width(&[3], semantic)?;
        }
        let (width, number) = (accessor.width(), accessor.number);
        let shape = accessor.json.text("type")?.unwrap_or_default().into();
        Ok(Self { semantic: semantic.into(), target, place, width, shape, number, said: said(accessor) })
    }
}

/// What the numbers of an attribute are that glTF does not define: of whole ones labels, and so are the numbers of features.
fn kind_of(semantic: &str, accessor: &Accessor<'_>) -> ChannelKind {
    let is_whole = accessor.number != Number::F32 && !accessor.is_normalized;
    if is_whole || semantic.starts_with("_FEATURE_ID_") { ChannelKind::Label } else { ChannelKind::Linear }
}

/// The channel of what a morph target adds to an attribute: to positions in the space of the scene, as they are; to others in
/// that of the mesh, for however they are turned, the sums between vertices are the same.
pub(super) fn displacement(target: usize, semantic: &str) -> String {
    format!("target_{target}.{semantic}")
}

/// What an accessor says beside its numbers.
fn said(accessor: &Accessor<'_>) -> Map<String, Value> {
    const NUMBERS: [&str; 9] =
        ["bufferView", "byteOffset", "componentType", "normalized", "count", "type", "max", "min", "sparse"];
    let members = accessor.json.value.as_object().into_iter().flatten();
    let kept = members.filter(|(key, _)| !NUMBERS.contains(&key.as_str()));
    kept.map(|(key, value)| (key.clone(), value.clone())).collect()
}

/// The accessors of a part, before they are read.
pub(super) struct Source<'a> {
    pub(super) part: Part,
    pub(super) accessors: Vec<Accessor<'a>>,
    indices: Option<Accessor<'a>>,
    mode: usize,
    pub(super) json: Json<'a>,
    pub(super) name: String,
}

const TRIANGLES: usize = 4;
const STRIP: usize = 5;
const FAN: usize = 6;

impl<'a> Source<'a> {
    /// Primitive `primitive` of mesh `mesh`; `None` for points, lines, and what has no positions.
    pub(super) fn of(
        store: &'a Store<'a>,
        mesh: usize,
        primitive: usize,
        placement: Placement,
    ) -> Result<Option<Self>> {
        let root = Json::root(store.json);
        let owner = root.element("meshes", mesh)?;
        let json = owner.element("primitives", primitive)?;
        let mode = json.optional_whole("mode")?.unwrap_or(TRIANGLES);
        if mode > FAN {
            return Err(json.error(format!("has the mode {mode}, expected 0 to 6")));
        }
        let attributes = json.need("attributes")?;
        if mode < TRIANGLES || attributes.get("POSITION").is_none() {
            return Ok(None);
        }
        let compressed = |error| {
            let draco = "KHR_draco_mesh_compression";
            let is_draco = json.get("extensions").is_some_and(|extensions| extensions.get(draco).is_some());
            if is_draco { super::unsupported(draco) } else { error }
        };
        let (mut found, mut accessors) = (Vec::new(), Vec::new());
        let mut take = |target, attributes: &Json<'a>| -> Result<()> {
            for (semantic, number) in attributes.members()? {
                let accessor = store.accessor(&number).map_err(compressed)?;
                found.push(Attribute::of(semantic, target, &accessor)?);
                accessors.push(accessor);
            }
            Ok(())
        };
        take(None, &attributes)?;
        for (number, target) in json.elements("targets")?.iter().enumerate() {
            take(Some(number), target)?;
        }
        let indices = json.get("indices").map(|number| store.accessor(&number).map_err(compressed)).transpose()?;
        let source = Self {
            part: Part {
                mesh,
                primitive,
                placement,
                attributes: found,
                indices_said: indices.as_ref().map(said).unwrap_or_default(),
            },
            accessors,
            indices,
            mode,
            name: name(&root, &owner, mesh, &json, primitive)?,
            json,
        };
        source.check_counts()?;
        // Draco leaves accessors without bytes.
        let is_draco = source.json.get("extensions").is_some_and(|e| e.get("KHR_draco_mesh_compression").is_some());
        let is_empty = source.accessors.iter().any(|accessor| accessor.json.get("bufferView").is_none());
        if is_draco && is_empty { Err(super::unsupported("KHR_draco_mesh_compression")) } else { Ok(Some(source)) }
    }

    fn check_counts(&self) -> Result<()> {
        let count = self.vertex_count();
        let mut pairs = self.part.attributes.iter().zip(&self.accessors);
        match pairs.find(|(_, accessor)| accessor.count != count) {
            Some((Attribute { semantic, .. }, Accessor { count: found, .. })) => {
                Err(self.json.error(format!("{found} elements of {semantic} for {count} positions")))
            }
            None => Ok(()),
        }
    }

    pub(super) fn vertex_count(&self) -> usize {
        let positions = self.part.attributes.iter().position(|attribute| attribute.place == Place::Positions);
        positions.map_or(0, |at| self.accessors[at].count)
    }

    /// The corners of its triangles, all of them vertices.
    pub(super) fn triangles(&self, store: &Store<'_>) -> Result<Vec<[u32; 3]>> {
        let count = self.vertex_count();
        let corners = match &self.indices {
            Some(indices) => store.indices(indices)?,
            None => {
                store.spend(&self.json, count)?;
                (0..count as u32).collect()
            }
        };
        if let Some((at, corner)) = corners.iter().enumerate().find(|(_, corner)| **corner as usize >= count) {
            let indices = self.indices.as_ref().map_or(&self.json, |indices| &indices.json);
            return Err(indices.error(format!("index {at} is {corner}, expected less than {count}")));
        }
        Ok(match self.mode {
            TRIANGLES => corners.as_chunks().0.to_vec(),
            STRIP => {
                let turned = |(at, window): (usize, &[u32])| match (at % 2, window) {
                    (0, &[a, b, c]) => [a, b, c],
                    (_, window) => [window[0], window[2], window[1]],
                };
                corners.windows(3).enumerate().map(turned).filter(has_corners).collect()
            }
            _ => corners.windows(2).skip(1).map(|pair| [pair[0], pair[1], corners[0]]).filter(has_corners).collect(),
        })
    }
}

/// Strips are joined by triangles of two corners.
fn has_corners(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// What people call a primitive; no two have the same.
fn name(root: &Json<'_>, owner: &Json<'_>, mesh: usize, json: &Json<'_>, primitive: usize) -> Result<String> {
    let named = |object: &Json<'_>| object.value.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
    let mut name = format!("{mesh}.{primitive} {}", named(owner));
    if let Some(material) = json.optional_whole("material")? {
        let material =
            root.element("materials", material).map_err(|_| json.error(format!("has no materials[{material}]")))?;
        name = format!("{name}: {}", named(&material));
    }
    Ok(name.trim_end().into())
}
