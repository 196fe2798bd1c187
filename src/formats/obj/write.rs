//! Writes OBJ: `v x y z [r g b]`, `vt u v`, `vn x y z`, `o name`, `f v/vt/vn …` or less.

use std::io::{self, Write};

use rustc_hash::FxHashMap;

use crate::formats::faces::Faces;
use crate::formats::{attributes, output};
use crate::math::Vec2;
use crate::mesh::Mesh;

/// Writes OBJ text. Alpha is dropped.
pub(in crate::formats) fn write(
    mesh: &Mesh,
    faces: Faces<'_>,
    libraries: &[String],
    out: &mut dyn Write,
) -> io::Result<()> {
    let _ = libraries;
    let texture = faces.texcoords(mesh).map(Texture::of);
    write_vertices(mesh, faces.len(), texture.as_ref(), out)?;
    write_faces(mesh, faces, texture.as_ref(), out)
}

/// Writes OBJ text with an object for each name, of faces that share the vertices of `mesh`. Texture coordinates are left
/// out, and faces of the mesh itself.
pub(in crate::formats) fn write_objects(
    mesh: &Mesh,
    objects: &[(String, &[[u32; 3]])],
    out: &mut dyn Write,
) -> io::Result<()> {
    write_vertices(mesh, objects.iter().map(|(_, faces)| faces.len()).sum(), None, out)?;
    for (name, faces) in objects {
        writeln!(out, "o {name}")?;
        write_faces(mesh, Faces::Triangles(faces), None, out)?;
    }
    Ok(())
}

fn write_vertices(mesh: &Mesh, faces: usize, texture: Option<&Texture>, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# {} vertices, {faces} faces, written by coarsen", mesh.positions.len())?;
    output::rows(out, mesh.positions.len(), |vertex, buffer| {
        buffer.push(b'v');
        output::push_floats(buffer, &mesh.positions[vertex].to_array());
        if let Some(colors) = &mesh.colors {
            // Fractions outside the unit range would read back as bytes.
            output::push_floats(buffer, &[0, 1, 2].map(|i| attributes::channel(f64::from(colors[vertex][i]), 1.0)));
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
    if let Some(normals) = &mesh.normals {
        output::rows(out, normals.len(), |vertex, buffer| {
            buffer.extend_from_slice(b"vn");
            output::push_floats(buffer, &attributes::written_normal(normals[vertex]).to_array());
            buffer.push(b'\n');
        })?;
    }
    Ok(())
}

fn write_faces(mesh: &Mesh, faces: Faces<'_>, texture: Option<&Texture>, out: &mut dyn Write) -> io::Result<()> {
    output::rows(out, faces.len(), |face, buffer| {
        buffer.push(b'f');
        for (i, corner) in faces.corners(face).iter().enumerate() {
            buffer.push(b' ');
            output::push_integer(buffer, corner + 1);
            if let Some(texture) = texture {
                buffer.push(b'/');
                output::push_integer(buffer, texture.corners[face][i] + 1);
            }
            if mesh.normals.is_some() {
                buffer.extend_from_slice(if texture.is_some() { b"/" } else { b"//" });
                output::push_integer(buffer, corner + 1);
            }
        }
        buffer.push(b'\n');
    })
}

/// Texture coordinates numbered by their first use.
struct Texture {
    coordinates: Vec<Vec2>,
    corners: Vec<[u32; 3]>,
}

impl Texture {
    fn of(rows: &[[Vec2; 3]]) -> Self {
        let mut coordinates = Vec::new();
        // Equal bits, so that a negative zero is read back as one.
        let mut numbers: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        let mut number = |uv: Vec2| {
            *numbers.entry(uv.to_array().map(f32::to_bits)).or_insert_with(|| {
                coordinates.push(uv);
                coordinates.len() as u32 - 1
            })
        };
        let corners = rows.iter().map(|row| row.map(&mut number)).collect();
        Self { coordinates, corners }
    }
}
