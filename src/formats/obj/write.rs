//! Writes OBJ: `v x y z [r g b]`, `vn x y z`, `f v//vn …` or `f v …`.

use std::io::{self, Write};

use crate::formats::{attributes, output};
use crate::mesh::Mesh;

/// Writes OBJ text. Alpha is dropped.
pub(in crate::formats) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# {} vertices, {} faces, written by coarsen", mesh.positions.len(), mesh.faces.len())?;
    output::rows(out, mesh.positions.len(), |vertex, buffer| {
        buffer.push(b'v');
        output::push_floats(buffer, &mesh.positions[vertex].to_array());
        if let Some(colors) = &mesh.colors {
            // Fractions outside the unit range would read back as bytes.
            output::push_floats(buffer, &[0, 1, 2].map(|i| attributes::channel(f64::from(colors[vertex][i]), 1.0)));
        }
        buffer.push(b'\n');
    })?;
    if let Some(normals) = &mesh.normals {
        output::rows(out, normals.len(), |vertex, buffer| {
            buffer.extend_from_slice(b"vn");
            output::push_floats(buffer, &attributes::written_normal(normals[vertex]).to_array());
            buffer.push(b'\n');
        })?;
    }
    output::rows(out, mesh.faces.len(), |face, buffer| {
        buffer.push(b'f');
        for corner in mesh.faces[face] {
            buffer.push(b' ');
            output::push_integer(buffer, corner + 1);
            if mesh.normals.is_some() {
                buffer.extend_from_slice(b"//");
                output::push_integer(buffer, corner + 1);
            }
        }
        buffer.push(b'\n');
    })
}
