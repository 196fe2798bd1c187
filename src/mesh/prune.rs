//! Drops small parts: dust of scans, screws of assemblies.

use super::parts::Parts;
use super::weld::Welded;
use super::{Channel, Mesh};

/// Drops the parts of a welded mesh whose bounding box's diagonal is below `fraction` of the whole mesh's. Returns the
/// number of parts dropped.
///
/// Parts are connected over vertices. With a fraction of 0 nothing is dropped, with 1 all but a part as large as the mesh.
pub fn prune(welded: &mut Welded, fraction: f64) -> usize {
    let mesh = &welded.mesh;
    let parts = Parts::of_joined(&mesh.faces, &mesh.positions);
    let (small, of_vertex) = (parts.are_small(fraction), parts.of_vertex());
    let dropped = small.iter().filter(|&&small| small).count();
    if dropped == 0 {
        return 0;
    }
    let is_kept = |face: &[u32; 3]| !small[of_vertex[face[0] as usize] as usize];
    let kept: Vec<usize> = (0..mesh.faces.len()).filter(|&f| is_kept(&mesh.faces[f])).collect();
    welded.face_source = kept.iter().map(|&f| welded.face_source[f]).collect();
    let stays: Vec<bool> =
        of_vertex.iter().map(|&part| small.get(part as usize).is_some_and(|&small| !small)).collect();
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

    #[test]
    fn small_parts_go_with_their_vertices() {
        let mut welded = weld(&shapes::large_and_small(), 0.0);
        assert_eq!(prune(&mut welded, 0.2), 1);
        assert_eq!(welded.mesh, shapes::icosahedron());
        assert_eq!(welded.vertex_source, (0..12).collect::<Vec<_>>());
        assert_eq!(welded.face_source, (0..20).collect::<Vec<_>>());
    }

    #[test]
    fn what_faces_have_goes_with_them() {
        let mut mesh = shapes::large_and_small();
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

    #[test]
    fn nothing_goes_below_the_limit() {
        let mut welded = weld(&shapes::large_and_small(), 0.0);
        assert_eq!(prune(&mut welded, 0.01), 0);
        assert_eq!(welded.mesh.faces.len(), 40);
        assert_eq!(prune(&mut welded, 0.0), 0);
    }
}
