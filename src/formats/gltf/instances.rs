//! Meshes that several nodes show: simplified once, where one of them puts it; a file without nodes gets all.

use super::document::Gltf;
use super::scene::{Instance, Placement};
use crate::math::Vec3;
use crate::mesh::{Channel, ChannelKind, Mesh, take};

/// Numbers that may be added, whatever a small file asks for: 1 GiB.
const MOST_ADDED: usize = 1 << 28;

/// Numbers a vertex, beside those of channels, and a face.
const OF_VERTEX: usize = 12;
const OF_FACE: usize = 10;

/// Names of parts that may be added.
const MOST_NAMES: usize = 1 << 22;

/// What is lost where instances cannot be told.
pub(in crate::formats) const ONCE: &str = "what several nodes show is there once";

/// No vertex yet.
const NONE: u32 = u32::MAX;

/// What nodes show of a mesh.
pub(in crate::formats) enum Shown {
    /// What there is.
    Once,
    /// More.
    All(Mesh),
    /// More that cannot be told, and why.
    Untold(String),
}

impl Gltf {
    /// Whether any of its meshes is shown by several nodes.
    pub(in crate::formats) fn has_instances(&self) -> bool {
        self.parts.iter().any(|part| self.instances.get(part.mesh).is_some_and(|of_mesh| !of_mesh.others.is_empty()))
    }

    /// The document of a mesh that has all that nodes show.
    pub(in crate::formats) fn without_instances(mut self) -> Self {
        self.instances.iter_mut().for_each(|of_mesh| of_mesh.others.clear());
        self
    }

    /// The parts as further nodes show them, node by node; none where these are too many.
    pub(super) fn shown_again(&self) -> Vec<(usize, &Instance)> {
        let mut parts_of = vec![Vec::new(); self.instances.len()];
        for (number, part) in self.parts.iter().enumerate() {
            parts_of.get_mut(part.mesh).into_iter().for_each(|parts: &mut Vec<usize>| parts.push(number));
        }
        let of_meshes = || self.instances.iter().zip(&parts_of);
        let counts = of_meshes().map(|(instances, parts)| instances.others.len().saturating_mul(parts.len()));
        if counts.fold(0, usize::saturating_add) > MOST_NAMES {
            return Vec::new();
        }
        let mut all = Vec::new();
        for (instances, parts) in of_meshes() {
            for instance in &instances.others {
                all.extend(parts.iter().map(|&part| (part, instance)));
            }
        }
        all
    }

    /// A valid mesh with what further nodes show of it, which no transform that can be undone takes out of double precision; with
    /// `has_names` under numbers of materials of their own, behind those of the parts, in the order of [`Gltf::shown_again`].
    pub(in crate::formats) fn instanced(&self, mesh: &Mesh, has_names: bool) -> Shown {
        if !self.has_instances() {
            return Shown::Once;
        }
        let untold = |why: &str| Shown::Untold(format!("{ONCE}: {why}"));
        let materials = mesh.materials.as_ref().filter(|materials| materials.names.len() == self.parts.len());
        if materials.is_none() && self.parts.len() != 1 {
            return untold("without materials nobody knows which it is");
        }
        let mut faces_of = vec![Vec::new(); self.parts.len()];
        for face in 0..mesh.faces.len() {
            faces_of[materials.map_or(0, |materials| materials.of_face[face] as usize)].push(face as u32);
        }
        let of_vertex = OF_VERTEX + mesh.channels.iter().map(|channel| channel.width).sum::<usize>();
        let of_part = |faces: &Vec<u32>| {
            let vertices = mesh.positions.len().min(3 * faces.len());
            vertices.saturating_mul(of_vertex).saturating_add(OF_FACE * faces.len())
        };
        let sizes: Vec<usize> = faces_of.iter().map(of_part).collect();
        let again = self.shown_again();
        let added = again.iter().fold(0_usize, |sum, (part, _)| sum.saturating_add(sizes[*part]));
        if again.is_empty() || added > MOST_ADDED {
            return untold("it would be too much for the memory");
        }
        let mut all = mesh.clone();
        let mut number = vec![NONE; mesh.positions.len()];
        for (part, instance) in again {
            if let Some(materials) = all.materials.as_mut().filter(|_| has_names) {
                materials.names.push(materials.names[part].clone());
            }
            let material = if has_names { all.materials.as_ref().map(|all| all.names.len() as u32 - 1) } else { None };
            append(&mut all, (mesh, &faces_of[part], material), &instance.placement, &mut number);
        }
        Shown::All(by_material(all))
    }
}

/// The mesh with the faces of each material together.
fn by_material(mut mesh: Mesh) -> Mesh {
    let Some(materials) = &mesh.materials else { return mesh };
    let mut order: Vec<u32> = (0..mesh.faces.len() as u32).collect();
    order.sort_by_key(|&face| materials.of_face[face as usize]);
    mesh.materials = Some(materials.take(&order));
    mesh.faces = take(&mesh.faces, &order);
    mesh.texcoords = mesh.texcoords.map(|rows| take(&rows, &order));
    mesh.face_colors = mesh.face_colors.map(|rows| take(&rows, &order));
    mesh
}

/// Appends faces of a mesh, of a material of their own or those that they have, and their vertices, where `place` moves them; of
/// `number`, one a vertex, nothing is left.
fn append(
    all: &mut Mesh,
    (mesh, faces, material): (&Mesh, &[u32], Option<u32>),
    place: &Placement,
    number: &mut [u32],
) {
    let first = all.positions.len() as u32;
    let mut used = Vec::new();
    for &face in faces {
        let corners = mesh.faces[face as usize].map(|v| {
            let known = &mut number[v as usize];
            if *known == NONE {
                *known = first + used.len() as u32;
                used.push(v);
            }
            *known
        });
        all.faces.push(turned(corners, place));
    }
    used.iter().for_each(|&v| number[v as usize] = NONE);
    let vertices = || used.iter().map(|&v| v as usize);
    all.positions.extend(vertices().map(|v| place.position_to_scene(mesh.positions[v])));
    if let (Some(all), Some(rows)) = (&mut all.normals, &mesh.normals) {
        all.extend(vertices().map(|v| place.normal_to_scene(rows[v])));
    }
    if let (Some(all), Some(rows)) = (&mut all.colors, &mesh.colors) {
        all.extend(vertices().map(|v| rows[v]));
    }
    if let (Some(all), Some(rows)) = (&mut all.texcoords, &mesh.texcoords) {
        all.extend(faces.iter().map(|&face| turned(rows[face as usize], place)));
    }
    if let (Some(all), Some(rows)) = (&mut all.face_colors, &mesh.face_colors) {
        all.extend(faces.iter().map(|&face| rows[face as usize]));
    }
    if let (Some(all), Some(rows)) = (&mut all.materials, &mesh.materials) {
        all.of_face.extend(faces.iter().map(|&face| material.unwrap_or(rows.of_face[face as usize])));
    }
    for (all, channel) in all.channels.iter_mut().zip(&mesh.channels) {
        vertices().for_each(|v| append_row(&mut all.values, channel, v, place));
    }
}

/// What the corners of a face have, in the order that leaves its outside where it was.
fn turned<T: Copy>([a, b, c]: [T; 3], place: &Placement) -> [T; 3] {
    if place.is_mirrored { [a, c, b] } else { [a, b, c] }
}

fn append_row(values: &mut Vec<f32>, channel: &Channel, vertex: usize, place: &Placement) {
    match (channel.kind, channel.row(vertex)) {
        (ChannelKind::Displacement, &[x, y, z]) => {
            values.extend(place.vector_to_scene(Vec3::new(x, y, z)).to_array().map(finite));
        }
        (ChannelKind::Tangent, &[x, y, z, side]) => values.extend(place.tangent_to_scene([x, y, z, side]).map(finite)),
        (_, row) => values.extend(row),
    }
}

/// A number that others can be added to.
fn finite(number: f32) -> f32 {
    if number.is_finite() { number } else { 0.0 }
}
