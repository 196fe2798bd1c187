//! Meshes that several nodes show: simplified once, where the first of them puts it; a file without nodes gets all.

use super::document::Gltf;
use super::part::Part;
use super::read::finite;
use super::scene::Placement;
use crate::math::Vec3;
use crate::mesh::{Channel, ChannelKind, Mesh, take};

/// Numbers that may be added, whatever a small file asks for: 1 GiB.
const MOST_ADDED: usize = 1 << 28;

/// Numbers a vertex, beside those of channels, and a face.
const OF_VERTEX: usize = 12;
const OF_FACE: usize = 10;

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
        self.parts.iter().any(|part| !self.others_of(part).is_empty())
    }

    /// A valid mesh with what further nodes show of it.
    pub(in crate::formats) fn instanced(&self, mesh: &Mesh) -> Shown {
        if !self.has_instances() {
            return Shown::Once;
        }
        let mut faces_of = vec![Vec::new(); self.parts.len()];
        let part_of = mesh.materials.as_ref().filter(|materials| materials.names.len() == self.parts.len());
        if part_of.is_none() && self.parts.len() != 1 {
            return Shown::Untold(
                "what several nodes show is there once: without materials nobody knows which it is".into(),
            );
        }
        for face in 0..mesh.faces.len() {
            faces_of[part_of.map_or(0, |parts| parts.of_face[face] as usize)].push(face as u32);
        }
        let of_vertex = OF_VERTEX + mesh.channels.iter().map(|channel| channel.width).sum::<usize>();
        let added = |(part, faces): (&Part, &Vec<u32>)| {
            let vertices = mesh.positions.len().min(3 * faces.len());
            let numbers = vertices.saturating_mul(of_vertex).saturating_add(OF_FACE * faces.len());
            numbers.saturating_mul(self.others_of(part).len())
        };
        let added = self.parts.iter().zip(&faces_of).map(added).fold(0, usize::saturating_add);
        if added > MOST_ADDED {
            return Shown::Untold("what several nodes show is there once: it would be too much for the memory".into());
        }
        let mut all = mesh.clone();
        let mut number = vec![NONE; mesh.positions.len()];
        for (part, faces) in self.parts.iter().zip(&faces_of).filter(|(_, faces)| !faces.is_empty()) {
            self.others_of(part).iter().for_each(|place| append(&mut all, mesh, faces, place, &mut number));
        }
        if all.positions.iter().all(|position| position.is_finite()) {
            Shown::All(by_material(all))
        } else {
            Shown::Untold(
                "what several nodes show is there once: elsewhere it has coordinates that are not finite".into(),
            )
        }
    }

    fn others_of(&self, part: &Part) -> &[Placement] {
        self.others.get(part.mesh).map_or(&[], Vec::as_slice)
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

/// Appends `faces` of `mesh`, and their vertices, where `place` moves them; of `number`, one a vertex, nothing is left.
fn append(all: &mut Mesh, mesh: &Mesh, faces: &[u32], place: &Placement, number: &mut [u32]) {
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
        all.of_face.extend(faces.iter().map(|&face| rows.of_face[face as usize]));
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
