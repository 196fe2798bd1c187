//! Meshes that several nodes have: one of them is simplified, where the first node puts it, and what a file without nodes shows
//! is all of them.

use std::sync::Arc;

use serde_json::Value;

use super::document::Gltf;
use super::scene::Placement;
use crate::math::Vec3;
use crate::mesh::{Channel, ChannelKind, Mesh, take};

/// Faces that may be added, whatever a small file asks for.
const MOST_ADDED: usize = 1 << 24;

/// No vertex yet.
const NONE: u32 = u32::MAX;

impl Gltf {
    /// The faces of `mesh` with those that further nodes show; none where no node has a mesh that another has.
    ///
    /// # Errors
    /// Why they cannot be told.
    pub(in crate::formats) fn instanced(&self, mesh: &Mesh) -> Result<Option<Mesh>, String> {
        if self.parts.iter().all(|part| part.others.is_empty()) {
            return Ok(None);
        }
        let part_of = match &mesh.materials {
            _ if self.parts.len() == 1 => None,
            Some(materials) if materials.names.len() == self.parts.len() => Some(&materials.of_face),
            _ => return Err("what several nodes have is there once: its materials are not told apart".into()),
        };
        let mut faces_of = vec![Vec::new(); self.parts.len()];
        for face in 0..mesh.faces.len() as u32 {
            faces_of[part_of.map_or(0, |parts| parts[face as usize] as usize)].push(face);
        }
        let added: usize =
            self.parts.iter().zip(&faces_of).map(|(part, faces)| part.others.len().saturating_mul(faces.len())).sum();
        if added > MOST_ADDED {
            return Err(format!("what several nodes have is there once: they show {added} faces more"));
        }
        let mut all = mesh.clone();
        let mut number = vec![NONE; mesh.positions.len()];
        for (part, faces) in self.parts.iter().zip(&faces_of) {
            part.others.iter().for_each(|place| append(&mut all, mesh, faces, place, &mut number));
        }
        Ok(Some(by_material(all)))
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
        (ChannelKind::Displacement, row) => values.extend(place.vector_to_scene(Vec3::from_slice(row)).to_array()),
        (ChannelKind::Tangent, &[x, y, z, side]) => values.extend(place.tangent_to_scene([x, y, z, side])),
        (_, row) => values.extend(row),
    }
}

/// What people call the object of each part: the name of the first node that has its mesh, or the mesh's own; empty without either.
pub(in crate::formats) fn objects(document: &Gltf) -> Vec<String> {
    let list = |key: &str| document.json.get(key).and_then(Value::as_array).map_or(&[][..], |list| list);
    let named = |value: &Value| value.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
    let mut names: Vec<String> = list("meshes").iter().map(named).collect();
    for node in list("nodes").iter().rev().filter(|node| !named(node).is_empty()) {
        let mesh = node.get("mesh").and_then(Value::as_u64).and_then(|mesh| names.get_mut(mesh as usize));
        mesh.into_iter().for_each(|name| *name = named(node));
    }
    document.parts.iter().map(|part| names.get(part.mesh).cloned().unwrap_or_default()).collect()
}

/// From where the first node that has a mesh puts it to where the others do.
pub(super) fn others(placements: &[Placement]) -> Arc<[Placement]> {
    let Some((first, others)) = placements.split_first() else { return [].into() };
    others.iter().map(|other| other.after(first)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3};

    #[test]
    fn others_are_seen_from_the_first() {
        let shift = |x: f64| Placement::shift(DVec3::X * x);
        let turn = Placement::new(DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0)));
        let found = others(&[shift(1.0), shift(4.0), turn]);
        assert_eq!(found[0].position_to_scene(DVec3::X), DVec3::X * 4.0);
        assert_eq!(found[1].position_to_scene(DVec3::new(3.0, 1.0, 0.0)), DVec3::new(-4.0, 2.0, 0.0));
        assert!(found[1].is_mirrored && !found[0].is_mirrored && others(&[]).is_empty());
    }
}
