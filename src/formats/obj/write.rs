//! Writes OBJ: `mtllib name`, `v x y z [r g b]`, `vt u v`, `vn x y z`, `o name`, `g name`, `usemtl name`, `f v/vt/vn …` or less.

use std::hash::Hash;
use std::io::{self, Write};

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::{Libraries, groups};
use crate::formats::faces::Faces;
use crate::formats::{attributes, output, text};
use crate::math::Vec2;
use crate::mesh::{Materials, Mesh};

/// Writes OBJ text, with materials, those of the mesh by other names or not, of these libraries, in whose encoding names are. Alpha
/// is dropped.
pub(in crate::formats) fn write(
    mesh: &Mesh,
    faces: Faces<'_>,
    (libraries, materials): (&Libraries, Option<&Materials>),
    out: &mut dyn Write,
) -> io::Result<()> {
    let rows = Rows::of(mesh, faces.texcoords(mesh));
    write_head(&rows, faces.len(), libraries, out)?;
    write_vertices(mesh, &rows, out)?;
    write_faces(&rows, faces, (materials, libraries.in_latin1), out)
}

/// Writes OBJ text with an object for each name, of faces that share the vertices of `mesh`. Texture coordinates are left
/// out, and faces of the mesh itself.
pub(in crate::formats) fn write_objects(
    mesh: &Mesh,
    objects: &[(String, &[[u32; 3]])],
    out: &mut dyn Write,
) -> io::Result<()> {
    let rows = Rows::of(mesh, None);
    write_head(&rows, objects.iter().map(|(_, faces)| faces.len()).sum(), &Libraries::default(), out)?;
    write_vertices(mesh, &rows, out)?;
    for (name, faces) in objects {
        writeln!(out, "o {name}")?;
        write_faces(&rows, Faces::Triangles(faces), (None, false), out)?;
    }
    Ok(())
}

/// Which lines the corners of faces name.
struct Rows {
    vertices: Numbered,
    normals: Option<Numbered>,
    texture: Option<Texture>,
}

impl Rows {
    fn of(mesh: &Mesh, texcoords: Option<&[[Vec2; 3]]>) -> Self {
        let count = mesh.positions.len();
        let position = |vertex: usize| {
            let color = mesh.colors.as_ref().map_or([0; 4], |colors| colors[vertex].map(f32::to_bits));
            (mesh.positions[vertex].to_array().map(f64::to_bits), color)
        };
        // Vertices that repeat a position for the sake of another normal, or of another place in a texture.
        let is_split = mesh.normals.is_some() || mesh.texcoords.is_some();
        let normal = |normals: &Vec<_>| {
            Numbered::of(count, |vertex| attributes::written_normal(normals[vertex]).to_array().map(f32::to_bits))
        };
        let (vertices, (normals, texture)) = rayon::join(
            || if is_split { Numbered::of(count, position) } else { Numbered::each(count) },
            || rayon::join(|| mesh.normals.as_ref().map(normal), || texcoords.map(Texture::of)),
        );
        Self { vertices, normals, texture }
    }
}

/// Rows without repetitions, numbered by their first use.
struct Numbered {
    /// The first row of each kind.
    firsts: Vec<u32>,
    /// The number of each row.
    numbers: Vec<u32>,
}

impl Numbered {
    fn of<K: Hash + Eq>(count: usize, key: impl Fn(usize) -> K) -> Self {
        let mut firsts = Vec::new();
        let mut known: FxHashMap<K, u32> = FxHashMap::with_capacity_and_hasher(count, FxBuildHasher);
        let numbers = (0..count).map(|row| {
            *known.entry(key(row)).or_insert_with(|| {
                firsts.push(row as u32);
                firsts.len() as u32 - 1
            })
        });
        let numbers = numbers.collect();
        Self { firsts, numbers }
    }

    /// Every row for itself.
    fn each(count: usize) -> Self {
        let rows: Vec<u32> = (0..count as u32).collect();
        Self { firsts: rows.clone(), numbers: rows }
    }
}

fn write_head(rows: &Rows, faces: usize, libraries: &Libraries, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# {} vertices, {faces} faces, written by coarsen", rows.vertices.firsts.len())?;
    libraries
        .names
        .iter()
        .try_for_each(|library| out.write_all(&text::encoded(&format!("mtllib {library}\n"), libraries.in_latin1)))
}

fn write_vertices(mesh: &Mesh, rows: &Rows, out: &mut dyn Write) -> io::Result<()> {
    let Rows { vertices, normals, texture } = rows;
    output::rows(out, vertices.firsts.len(), |row, buffer| {
        let vertex = vertices.firsts[row] as usize;
        buffer.push(b'v');
        output::push_floats(buffer, &mesh.positions[vertex].to_array());
        if let Some(colors) = &mesh.colors {
            // Fractions outside the unit range would read back as bytes.
            output::push_floats(buffer, &[0, 1, 2].map(|i| attributes::written_channel(colors[vertex][i])));
        }
        buffer.push(b'\n');
    })?;
    if let Some(texture) = texture {
        output::rows(out, texture.coordinates.len(), |at, buffer| {
            buffer.extend_from_slice(b"vt");
            output::push_floats(buffer, &texture.coordinates[at].to_array());
            buffer.push(b'\n');
        })?;
    }
    if let (Some(rows), Some(normals)) = (normals, &mesh.normals) {
        output::rows(out, rows.firsts.len(), |row, buffer| {
            buffer.extend_from_slice(b"vn");
            let normal = normals[rows.firsts[row] as usize];
            output::push_floats(buffer, &attributes::written_normal(normal).to_array());
            buffer.push(b'\n');
        })?;
    }
    Ok(())
}

fn write_faces(
    rows: &Rows,
    faces: Faces<'_>,
    (materials, in_latin1): (Option<&Materials>, bool),
    out: &mut dyn Write,
) -> io::Result<()> {
    let Rows { vertices, normals, texture } = rows;
    let material = |face: usize| materials.map(|materials| materials.of_face[faces.triangle(face)]);
    let order = materials.and_then(|materials| sorted(faces.len(), materials.names.len(), &material));
    let at = |place: usize| order.as_ref().map_or(place, |order| order[place] as usize);
    output::rows(out, faces.len(), |place, buffer| {
        let face = at(place);
        if let (Some(materials), Some(number)) = (materials, material(face)) {
            let before = place.checked_sub(1).and_then(|place| material(at(place)));
            if before != Some(number) {
                let before = before.map(|before| materials.names[before as usize].as_str());
                let statements = groups::statements(before, &materials.names[number as usize]);
                buffer.extend_from_slice(&text::encoded(&statements, in_latin1));
            }
        }
        buffer.push(b'f');
        for (i, &corner) in faces.corners(face).iter().enumerate() {
            buffer.push(b' ');
            output::push_integer(buffer, vertices.numbers[corner as usize] + 1);
            if let Some(texture) = texture {
                buffer.push(b'/');
                output::push_integer(buffer, texture.corners[face][i] + 1);
            }
            if let Some(normals) = normals {
                buffer.extend_from_slice(if texture.is_some() { b"/" } else { b"//" });
                output::push_integer(buffer, normals.numbers[corner as usize] + 1);
            }
        }
        buffer.push(b'\n');
    })
}

/// Runs of faces of one material that are few enough to be written as they come, for each name.
const RUNS_A_NAME: usize = 8;

/// The faces by material, where in their own order they change it all the time.
fn sorted(count: usize, names: usize, material: &dyn Fn(usize) -> Option<u32>) -> Option<Vec<u32>> {
    let runs = (1..count).filter(|&face| material(face) != material(face - 1)).count();
    (runs > RUNS_A_NAME * names).then(|| {
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by_key(|&face| material(face as usize));
        order
    })
}

/// Texture coordinates numbered by their first use.
struct Texture {
    coordinates: Vec<Vec2>,
    corners: Vec<[u32; 3]>,
}

impl Texture {
    fn of(rows: &[[Vec2; 3]]) -> Self {
        let corners = rows.as_flattened();
        // Equal bits, so that a negative zero is read back as one.
        let Numbered { firsts, numbers } = Numbered::of(corners.len(), |at| corners[at].to_array().map(f32::to_bits));
        let coordinates = firsts.iter().map(|&first| corners[first as usize]).collect();
        Self { coordinates, corners: numbers.as_chunks().0.to_vec() }
    }
}
