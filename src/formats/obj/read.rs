//! Reads OBJ: plain files by all threads, the others by way of `tobj`.

use super::normalize::{Counts, Normalized, Statements, keyword};
use super::words::NONE;
use super::{FORMAT, Libraries, plain, shading};
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::formats::polygon::Triangulator;
use crate::formats::text;
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::Mesh;

/// Reads OBJ text; also returns its libraries of materials, which lie in no folder yet.
pub(in crate::formats) fn read(bytes: &[u8]) -> Result<(Mesh, Libraries)> {
    // Editors put a mark of three bytes before UTF-8.
    let bytes = bytes.strip_prefix(text::MARK).unwrap_or(bytes);
    plain::read(bytes).map_or_else(|| read_any(bytes), Ok)
}

/// Reads any OBJ text, or says why not.
pub(super) fn read_any(bytes: &[u8]) -> Result<(Mesh, Libraries)> {
    let counts = Counts::of(bytes);
    let mut text = Normalized::new(bytes, counts);
    // No material library is named in the normalized text, so none is looked for.
    let parsed = tobj::load_obj_buf(&mut text, &tobj::LoadOptions::default(), |_| Err(tobj::LoadError::GenericFailure));
    let (models, _) = match (parsed, text.failure) {
        (_, Some(failure)) => return Err(failure),
        (Err(error), None) => return Err(Error::format(FORMAT, Place::Line(text.line), explain(error))),
        (Ok(parsed), None) => parsed,
    };
    let (libraries, materials) = text.groups.finish();
    // Without groups there is one model.
    let Some(model) = models.into_iter().next() else { return Ok((Mesh::default(), libraries)) };
    let mesh = assemble(bytes, counts, model.mesh, text.texture.of_corners())?;
    Ok((Mesh { materials, ..mesh }, libraries))
}

fn explain(error: tobj::LoadError) -> String {
    match error {
        tobj::LoadError::PositionParseError => "found a vertex that is not x y z [w], expected numbers".into(),
        tobj::LoadError::ScalingByZeroError => "found a vertex whose weight 'w' is 0".into(),
        tobj::LoadError::NormalParseError => "found a normal that is not x y z, expected numbers".into(),
        tobj::LoadError::ReadError => "found bytes that are not UTF-8 text".into(),
        error => error.to_string(),
    }
}

/// Takes the prelude off again and triangulates the rest.
fn assemble(bytes: &[u8], counts: Counts, parsed: tobj::Mesh, texcoords: Option<Vec<Vec2>>) -> Result<Mesh> {
    let positions: Vec<DVec3> = parsed.positions.chunks_exact(3).map(DVec3::from_slice).collect();
    if let Some(vertex) = positions.iter().position(|position| !position.is_finite()) {
        return Err(not_finite(bytes, vertex, positions[vertex]));
    }
    let behind_prelude = |indices: &[u32]| indices[counts.vertices.min(indices.len())..].to_vec();
    let [corners, shading] = [&parsed.indices, &parsed.normal_indices].map(|indices| behind_prelude(indices));
    let mut mesh = Mesh::new(positions, Vec::with_capacity(corners.len() / 3));
    mesh.texcoords = texcoords.as_ref().map(|_| Vec::with_capacity(corners.len() / 3));
    let mut rows = Vec::new();
    let mut triangulator = Triangulator::new();
    let mut first = 0;
    // Without arities all faces are triangles.
    let arities = parsed.face_arities.iter().skip(counts.prelude_faces()).map(|&arity| arity as usize);
    let triangles = if parsed.face_arities.is_empty() { corners.len() / 3 } else { 0 };
    for arity in arities.chain(std::iter::repeat_n(3, triangles)) {
        let face = &corners[first..corners.len().min(first + arity)];
        let Mesh { positions, faces, texcoords: uvs, .. } = &mut mesh;
        triangulator.split(face, positions, |triangle| {
            faces.push(triangle.map(|i| face[i]));
            if let (Some(uvs), Some(texcoords)) = (uvs.as_mut(), &texcoords) {
                uvs.push(triangle.map(|i| texcoords.get(first + i).copied().unwrap_or_default()));
            }
            rows.push(triangle.map(|i| shading.get(first + i).copied().unwrap_or(NONE)));
        });
        first += face.len();
    }
    if !parsed.vertex_color.is_empty() {
        mesh.colors = Some(unit_colors(parsed.vertex_color.as_chunks().0));
    }
    if !shading.is_empty() {
        let normals: Vec<Vec3> =
            parsed.normals.chunks_exact(3).map(|normal| shading::unit(DVec3::from_slice(normal))).collect();
        shading::shade(&mut mesh, &rows, &normals);
    }
    Ok(mesh)
}

/// Colors of `[0, 1]` from the red, green and blue of all vertices of a file.
pub(super) fn unit_colors(stored: &[[f64; 3]]) -> Vec<[f32; 4]> {
    let factor = attributes::unit_factor(stored.iter().copied().flatten().fold(0.0, f64::max));
    let unit = |rgb: &[f64; 3]| {
        let [r, g, b] = rgb.map(|channel| attributes::channel(channel, factor));
        [r, g, b, 1.0]
    };
    stored.iter().map(unit).collect()
}

fn not_finite(bytes: &[u8], vertex: usize, position: DVec3) -> Error {
    let line = Statements::of(bytes).filter(|(_, text)| keyword(text) == b"v").nth(vertex).map(|(line, _)| line);
    let message = format!("found a vertex at {position}, expected finite coordinates");
    Error::format(FORMAT, line.map_or(Place::File, Place::Line), message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Mesh> {
        super::read(bytes).map(|(mesh, _)| mesh)
    }

    /// The first line counts, whatever an editor put before it.
    #[test]
    fn a_mark_before_the_text_hides_no_line() {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 3 4\n";
        let marked = [b"\xef\xbb\xbf".as_slice(), text].concat();
        let [plain, marked] = [text.as_slice(), &marked].map(|bytes| super::read(bytes).expect("a mesh"));
        assert_eq!(plain, marked);
        let named = b"\xef\xbb\xbfmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(super::read(named).expect("a mesh").1.names, ["a.mtl"]);
    }

    #[test]
    fn vertices_keep_their_number_and_the_unused_stay() {
        let mesh = read(b"v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 4 2 3\n").unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces), (4, vec![[3, 1, 2]]));
    }

    #[test]
    fn groups_and_materials_share_vertices() {
        let text =
            b"mtllib gone.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl x\nf 1 2 3\ng b\nusemtl y\nf 3 2 4\n";
        let mesh = read(text).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces), (4, vec![[0, 1, 2], [2, 1, 3]]));
        let materials = mesh.materials.unwrap();
        assert_eq!(materials.of_face, [0, 1]);
        assert_eq!(materials.names, ["x\no a", "y\no a\ng b"]);
        assert_eq!(super::read(text).unwrap().1.names, ["gone.mtl"]);
    }

    #[test]
    fn many_vertices_pass_the_prelude() {
        let mut text = String::new();
        for i in 0..5000 {
            text.push_str(&format!("v {i} {} 0\n", i % 2));
        }
        text.push_str("f 1 2 3\nf 4998 4999 5000\nf 1 2 4 3\n");
        let mesh = read(text.as_bytes()).unwrap();
        assert_eq!(mesh.faces[..2], [[0, 1, 2], [4997, 4998, 4999]]);
        assert!((0..5000).all(|i| mesh.positions[i].x == i as f64));
        assert_eq!(mesh.faces.len(), 4);
    }

    #[test]
    fn several_normals_of_a_vertex_repeat_it() {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 2\nvn 1 0 0\nvn 0 -0 4\n\
            f 1//1 2//1 3//1\nf 1//2 3//3 4\nf 3//2 1//2 2\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.faces, [[0, 1, 2], [4, 2, 3], [5, 4, 1]]);
        assert_eq!(mesh.normals, Some(vec![Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO, Vec3::X, Vec3::X]));
        assert_eq!((mesh.positions[4], mesh.positions[5]), (DVec3::ZERO, DVec3::Y));
    }

    /// Whichever of its corners comes first.
    #[test]
    fn normals_that_are_not_finite_give_way_and_repeat_nothing() {
        let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn nan 0 1\nf 1//2 2//1 3//1\nf 1//1 3//2 4//2\n";
        let mesh = read(text).unwrap();
        let normals = mesh.normals.unwrap();
        assert_eq!((normals[..3].to_vec(), normals.len()), (vec![Vec3::Z; 3], 4));
        assert!(normals[3].is_nan() && mesh.faces == [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn corners_keep_their_texture_coordinates() {
        // A seam at vertex 1, a dart split by ears, a face and a corner without any, an index from the end.
        let text = b"v 0 0 0\nv 1 1 0\nv 0 2 0\nv 0.5 1 0\nvt 0.5\nvt 0 1 7\nvt 1e39 nan\nvt 0.1 0.25\n\
            f 1/1 2/2 3/4\nf 2/4 1/-2 4/1\nf 1 2 3\nf 1/1 2// 3/2\nf 1/1 2/2 3/3 4/4\n";
        let mesh = crate::formats::read_bytes(text, crate::formats::Format::Obj).unwrap();
        let [a, b, c, d] = [(0.5, 0.0), (0.0, 1.0), (0.0, 0.0), (0.1, 0.25)].map(Vec2::from);
        let rows = mesh.texcoords.unwrap();
        assert_eq!(rows[..4], [[a, b, d], [d, c, a], [Vec2::ZERO; 3], [a, Vec2::ZERO, b]]);
        for (face, row) in mesh.faces[4..].iter().zip(&rows[4..]) {
            assert_eq!(*row, face.map(|vertex| [a, b, c, d][vertex as usize]));
        }
        assert_eq!((mesh.faces.len(), rows.len()), (6, 6));
    }

    #[test]
    fn texture_coordinates_that_no_corner_has_are_none() {
        for text in ["vt 0 1\nf 1 2 3\n", "f 1/1 2/2 3/3\n", "vt 0 0\nf 1// 2// 3//\n"] {
            let mesh = read(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{text}").as_bytes()).unwrap();
            assert_eq!((mesh.texcoords, mesh.faces.len()), (None, 1), "{text}");
        }
    }

    #[test]
    fn errors_have_a_line() {
        for (text, expected) in [
            ("v 0 0 0\nv 1 0 \nv 0 1 0\nf 1 2 3\n", "OBJ line 2: found a vertex of 2 values"),
            ("v 0 0 0\nv 1 a 0\nv 0 1 0\nf 1 2 3\n", "OBJ line 2: found a vertex that is not x y z [w]"),
            ("v 0 0 0\nv 1 0 0\n\nv 0 1e999 0\nf 1 2 3\n", "OBJ line 4: found a vertex at"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "OBJ line 4: found the corner '4'"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "OBJ line 4: found the corner '0'"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "OBJ line 4: found the corner '-4'"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//-9\n", "OBJ line 5: found the corner '3//-9'"),
            (
                "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0\nf 1/1 2/1 3/2\n",
                "OBJ line 5: found the corner '3/2', expected a texture",
            ),
            ("vt 0 a\n", "OBJ line 1: found a texture coordinate that is not u [v [w]]"),
            ("vt\n", "OBJ line 1: found a texture coordinate that is not u [v [w]]"),
            ("v 0 0 0\nv 1 0 0\nf 1 2\n", "OBJ line 3: found a face of 2 corners"),
        ] {
            let message = read(text.as_bytes()).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
