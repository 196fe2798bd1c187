//! Primitives to one mesh.

use super::accessor::Store;
use super::color;
use super::instancing::instance_transforms;
use super::json::Json;
use super::part::{JOINTS, Part, Place, Source};
use super::scene::{Instances, Placement, instances};
use crate::error::Result;
use crate::formats::attributes;
use crate::math::{Vec2, Vec3};
use crate::mesh::{Channel, ChannelKind, Materials, Mesh};

/// Color where a primitive has none among others: it multiplies the material's.
const WHITE: [f32; 4] = [1.0; 4];

/// The triangles of all meshes as one mesh, and where they came from: the number of a face's material is that of its part; and the
/// instances of each mesh.
pub(super) fn mesh(store: &Store<'_>) -> Result<(Mesh, Vec<Part>, Vec<Instances>)> {
    let root = Json::root(store.json);
    let instances = instances(store.json, |node| instance_transforms(store, node))?;
    let mut sources = Vec::new();
    for (mesh, json) in root.elements("meshes")?.iter().enumerate() {
        let placement = instances.get(mesh).map_or(Placement::IDENTITY, |instances| instances.first.placement);
        for primitive in 0..json.elements("primitives")?.len() {
            sources.extend(Source::of(store, mesh, primitive, placement)?);
        }
    }
    let mut assembly = Assembly::of(&sources);
    for (number, source) in sources.iter().enumerate() {
        assembly.append(store, source, number as u32)?;
    }
    let names = sources.iter().map(|source| source.name.clone()).collect();
    let mesh = Mesh { materials: Some(Materials { of_face: assembly.parts, names }), ..assembly.mesh };
    Ok((mesh, sources.into_iter().map(|source| source.part).collect(), instances))
}

/// A mesh that grows by parts.
struct Assembly {
    mesh: Mesh,
    /// The part of each face.
    parts: Vec<u32>,
    /// Sets of four joints.
    sets: usize,
    /// Numbers a vertex.
    width: usize,
}

impl Assembly {
    /// No vertices yet, of all attributes that any part has.
    fn of(sources: &[Source<'_>]) -> Self {
        let attributes = || sources.iter().flat_map(|source| &source.part.attributes);
        let has = |place: &Place| attributes().any(|attribute| attribute.place == *place);
        let mut mesh = Mesh {
            normals: has(&Place::Normals).then(Vec::new),
            colors: has(&Place::Colors).then(Vec::new),
            texcoords: has(&Place::Texcoords).then(Vec::new),
            ..Mesh::default()
        };
        let mut sets = 0;
        for attribute in attributes() {
            match &attribute.place {
                Place::Channel(name, kind) => match mesh.channels.iter_mut().find(|channel| channel.name == *name) {
                    Some(channel) => {
                        channel.width = channel.width.max(attribute.width);
                        // What is an amount anywhere is one everywhere, and what is two things is numbers.
                        if channel.kind != *kind {
                            let is_amount = matches!((channel.kind, kind), (ChannelKind::Label, ChannelKind::Linear));
                            channel.kind = if is_amount { *kind } else { ChannelKind::Linear };
                        }
                    }
                    None => mesh.channels.push(empty(name, *kind, attribute.width)),
                },
                Place::Joints(set) | Place::Weights(set) => sets = sets.max(set + 1),
                _ => {}
            }
        }
        if sets > 0 {
            mesh.channels.push(empty(JOINTS, ChannelKind::Joints, 8 * sets));
        }
        let width = 12 + mesh.channels.iter().map(|channel| channel.width).sum::<usize>();
        Self { mesh, parts: Vec::new(), sets, width }
    }

    /// Appends the faces of a part, and the vertices that they use.
    fn append(&mut self, store: &Store<'_>, source: &Source<'_>, number: u32) -> Result<()> {
        let triangles = source.triangles(store)?;
        store.spend(&source.json, source.vertex_count())?;
        let mut numbers = vec![None; source.vertex_count()];
        triangles.as_flattened().iter().for_each(|&corner| numbers[corner as usize] = Some(0));
        let used: Vec<u32> = (0..numbers.len() as u32).filter(|&vertex| numbers[vertex as usize].is_some()).collect();
        store.spend(&source.json, used.len().saturating_mul(self.width).saturating_add(10 * triangles.len()))?;
        // Other rows come from iterators that tell their number.
        self.mesh.channels.iter_mut().for_each(|channel| channel.values.reserve(used.len() * channel.width));
        let first = self.mesh.positions.len() as u32;
        used.iter().zip(first..).for_each(|(&vertex, number)| numbers[vertex as usize] = Some(number));
        let placement = &source.part.placement;
        let of_face = |[a, b, c]: [u32; 3]| if placement.is_mirrored { [a, c, b] } else { [a, b, c] };
        let corner = |corner: u32| numbers[corner as usize].unwrap_or(first);
        self.mesh.faces.extend(triangles.iter().map(|&face| of_face(face).map(corner)));
        self.parts.resize(self.mesh.faces.len(), number);
        for (attribute, accessor) in source.part.attributes.iter().zip(&source.accessors) {
            let values = store.numbers(accessor)?;
            let width = attribute.width;
            let rows = used.iter().map(|&vertex| &values[vertex as usize * width..][..width]);
            match &attribute.place {
                Place::Positions => {
                    let point = |row: &[f32]| placement.point_to_scene(Vec3::from_slice(row));
                    self.mesh.positions.extend(rows.map(point));
                    let placed = &self.mesh.positions[first as usize..];
                    if let Some(at) = placed.iter().position(|position| !position.is_finite()) {
                        let vertex = used[at];
                        return Err(accessor.json.error(format!("position {vertex} is not finite")));
                    }
                }
                Place::Normals => {
                    let normal = |row| attributes::unit_normal(placement.normal_to_scene(Vec3::from_slice(row)));
                    self.mesh.normals.iter_mut().for_each(|normals| normals.extend(rows.clone().map(normal)));
                }
                Place::Colors => {
                    self.mesh.colors.iter_mut().for_each(|colors| colors.extend(rows.clone().map(color::of_light)));
                }
                Place::Texcoords => {
                    let pair = |vertex: u32| {
                        let at = 2 * vertex as usize;
                        attributes::texcoord(values[at].into(), values[at + 1].into())
                    };
                    let row = |&face: &[u32; 3]| of_face(face).map(pair);
                    self.mesh.texcoords.iter_mut().for_each(|texcoords| texcoords.extend(triangles.iter().map(row)));
                }
                Place::Channel(name, kind) => {
                    let channel = self.mesh.channels.iter_mut().find(|channel| channel.name == *name);
                    channel.into_iter().for_each(|channel| {
                        for row in rows.clone() {
                            let start = channel.values.len();
                            match (kind, <[f32; 4]>::try_from(row)) {
                                (ChannelKind::Tangent, Ok(row)) => {
                                    channel.values.extend(placement.tangent_to_scene(row));
                                }
                                (ChannelKind::Displacement, _) => {
                                    let displaced = placement.vector_to_scene(Vec3::from_slice(row));
                                    channel.values.extend(displaced.to_array());
                                }
                                _ => channel.values.extend(row),
                            }
                            channel.values.resize(start + channel.width, 0.0);
                        }
                    });
                }
                Place::Joints(set) => self.set_joints(first, 4 * set, rows),
                Place::Weights(set) => self.set_joints(first, 4 * (self.sets + set), rows),
            }
        }
        self.fill();
        Ok(())
    }

    /// Puts four numbers a vertex to column `at` of the joints, for the vertices from `first`.
    fn set_joints<'a>(&mut self, first: u32, at: usize, rows: impl Iterator<Item = &'a [f32]>) {
        let channel = self.mesh.channels.iter_mut().find(|channel| channel.kind == ChannelKind::Joints);
        let Some(channel) = channel else { return };
        let width = channel.width;
        for (vertex, row) in rows.enumerate() {
            let start = (first as usize + vertex) * width;
            if channel.values.len() < start + width {
                channel.values.resize(start + width, 0.0);
            }
            channel.values[start + at..][..4].copy_from_slice(row);
        }
    }

    /// Gives the vertices and faces what their part has not.
    fn fill(&mut self) {
        let (vertices, faces) = (self.mesh.positions.len(), self.mesh.faces.len());
        self.mesh.normals.iter_mut().for_each(|normals| normals.resize(vertices, Vec3::ZERO));
        self.mesh.colors.iter_mut().for_each(|colors| colors.resize(vertices, WHITE));
        self.mesh.texcoords.iter_mut().for_each(|rows| rows.resize(faces, [Vec2::ZERO; 3]));
        self.mesh.channels.iter_mut().for_each(|channel| channel.values.resize(vertices * channel.width, 0.0));
    }
}

fn empty(name: &str, kind: ChannelKind, width: usize) -> Channel {
    Channel { name: name.into(), kind, width, values: Vec::new() }
}
