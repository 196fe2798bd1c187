//! Drops small parts: dust of scans, screws of assemblies.

use super::layers::Layers;
use super::topology::Components;
use super::weld::{Welded, weld_layers};
use super::{Channel, Mesh};
use crate::math::DVec3;

/// Drops the parts of a welded mesh whose bounding box's diagonal is below `fraction` of the whole mesh's. Returns the
/// number of parts dropped.
///
/// Parts are connected over vertices. With a fraction of 0 nothing is dropped, with 1 all but a part as large as the mesh.
pub fn prune(welded: &mut Welded, fraction: f64) -> usize {
    let mesh = &welded.mesh;
    let (parts, small) = small_parts(mesh, fraction);
    let dropped = small.iter().filter(|&&small| small).count();
    if dropped == 0 {
        return 0;
    }
    let is_kept = |face: &[u32; 3]| !small[parts.of_vertex[face[0] as usize] as usize];
    let kept: Vec<usize> = (0..mesh.faces.len()).filter(|&f| is_kept(&mesh.faces[f])).collect();
    welded.face_source = kept.iter().map(|&f| welded.face_source[f]).collect();
    let stays: Vec<bool> =
        parts.of_vertex.iter().map(|&part| small.get(part as usize).is_some_and(|&small| !small)).collect();
    let mut new_vertex = vec![0; stays.len()];
    let mut count = 0;
    for (new, &stays) in new_vertex.iter_mut().zip(&stays) {
        *new = count;
        count += u32::from(stays);
    }
    let Mesh { positions, faces, normals, colors, texcoords, face_colors, channels, materials } = &mut welded.mesh;
    *faces = kept.iter().map(|&f| faces[f].map(|v| new_vertex[v as usize])).collect();
    if let Some(texcoords) = texcoords {
        *texcoords = kept.iter().map(|&f| texcoords[f]).collect();
    }
    if let Some(face_colors) = face_colors {
        *face_colors = kept.iter().map(|&f| face_colors[f]).collect();
    }
    if let Some(materials) = materials {
        materials.of_face = kept.iter().map(|&f| materials.of_face[f]).collect();
    }
    for Channel { values, width, .. } in channels {
        let mut rows = stays.iter().flat_map(|&stays| std::iter::repeat_n(stays, *width));
        values.retain(|_| rows.next() == Some(true));
    }
    retain(positions, &stays);
    retain(&mut welded.vertex_source, &stays);
    if let Some(normals) = normals {
        retain(normals, &stays);
    }
    if let Some(colors) = colors {
        retain(colors, &stays);
    }
    dropped
}

/// What [`prune`] drops of a mesh.
#[derive(Debug, Clone)]
pub(crate) struct Small {
    /// Which vertices, of those that others are joined into.
    pub vertices: Vec<bool>,
    /// How many parts.
    pub parts: usize,
}

/// What [`prune`] drops of a mesh that is welded so.
pub(crate) fn find_small(mesh: &Mesh, tolerance: f64, layers: Layers<'_>, fraction: f64) -> Small {
    let welded = weld_layers(mesh, tolerance, layers);
    let (parts, small) = small_parts(&welded.mesh, fraction);
    let mut vertices = vec![false; mesh.positions.len()];
    for (&source, &part) in welded.vertex_source.iter().zip(&parts.of_vertex) {
        vertices[source as usize] = small.get(part as usize).is_some_and(|&small| small);
    }
    Small { vertices, parts: small.into_iter().filter(|&small| small).count() }
}

/// The parts of a mesh, and which of them are small.
fn small_parts(mesh: &Mesh, fraction: f64) -> (Components, Vec<bool>) {
    let parts = Components::new(&mesh.faces, mesh.positions.len());
    let least = fraction * mesh.diagonal();
    let small = sizes(&parts, &mesh.positions).map(|size| size < least).collect();
    (parts, small)
}

/// The diagonals of the bounding boxes of a mesh's parts.
pub(crate) fn sizes(parts: &Components, positions: &[DVec3]) -> impl Iterator<Item = f64> {
    let mut bounds = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); parts.count];
    for (&part, &p) in parts.of_vertex.iter().zip(positions) {
        if let Some((low, high)) = bounds.get_mut(part as usize) {
            (*low, *high) = (low.min(p), high.max(p));
        }
    }
    bounds.into_iter().map(|(low, high)| (high - low).length())
}

fn retain<T>(rows: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    rows.retain(|_| stays.next() == Some(&true));
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::super::weld::weld;
    use super::*;
    use crate::math::Vec2;

    /// An icosahedron of diagonal about 3.4 and, after it, one of a tenth of that beside it.
    fn large_and_small() -> Mesh {
        let mut mesh = shapes::icosahedron();
        let count = mesh.positions.len() as u32;
        let small: Vec<DVec3> = mesh.positions.iter().map(|&p| p * 0.1 + DVec3::X * 2.0).collect();
        let faces: Vec<[u32; 3]> = mesh.faces.iter().map(|face| face.map(|v| v + count)).collect();
        mesh.positions.extend(small);
        mesh.faces.extend(faces);
        mesh
    }

    #[test]
    fn small_parts_go_with_their_vertices() {
        let mut welded = weld(&large_and_small(), 0.0);
        assert_eq!(prune(&mut welded, 0.2), 1);
        assert_eq!(welded.mesh, shapes::icosahedron());
        assert_eq!(welded.vertex_source, (0..12).collect::<Vec<_>>());
        assert_eq!(welded.face_source, (0..20).collect::<Vec<_>>());
    }

    #[test]
    fn what_faces_have_goes_with_them() {
        let mut mesh = large_and_small();
        // The small part first, so that rows move.
        mesh.faces.rotate_right(20);
        mesh.texcoords = Some((0..40).map(|f| [Vec2::splat(f as f32); 3]).collect());
        mesh.face_colors = Some((0..40).map(|f| [f as f32; 4]).collect());
        let mut welded = weld(&mesh, 0.0);
        assert_eq!(prune(&mut welded, 0.2), 1);
        assert_eq!(welded.mesh.face_colors, Some((20..40).map(|f| [f as f32; 4]).collect()));
        assert_eq!(welded.mesh.texcoords, Some((20..40).map(|f| [Vec2::splat(f as f32); 3]).collect()));
        assert!(welded.mesh.check().is_ok());
    }

    /// As they come, and with faces that share no vertex until they are welded, exactly or within a distance.
    #[test]
    fn what_is_found_to_be_small_is_what_goes() {
        let whole = large_and_small();
        let mut apart = Mesh::default();
        for (f, face) in whole.faces.iter().enumerate() {
            apart.faces.push([0, 1, 2].map(|k| 3 * f as u32 + k));
            apart.positions.extend(face.map(|v| whole.positions[v as usize]));
        }
        let mut beside = apart.clone();
        beside.positions.iter_mut().enumerate().for_each(|(v, p)| p.x += 1e-6 * (v % 7) as f64);
        for (mesh, tolerance) in [(whole, 0.0), (apart, 0.0), (beside, 1e-5)] {
            let small = find_small(&mesh, tolerance, Layers::ONE, 0.2);
            let mut welded = weld(&mesh, tolerance);
            let all = welded.vertex_source.clone();
            assert_eq!((prune(&mut welded, 0.2), small.parts), (1, 1));
            let stay: Vec<u32> = all.into_iter().filter(|&v| !small.vertices[v as usize]).collect();
            assert!(stay == welded.vertex_source && stay.len() == 12);
        }
    }

    #[test]
    fn nothing_goes_below_the_limit() {
        let mut welded = weld(&large_and_small(), 0.0);
        assert_eq!(prune(&mut welded, 0.01), 0);
        assert_eq!(welded.mesh.faces.len(), 40);
        assert_eq!(prune(&mut welded, 0.0), 0);
    }
}
