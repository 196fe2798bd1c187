//! Writes binary and text STL.

use std::io::{self, Write};

use super::HEADER_BYTES;
use crate::formats::{WriteOptions, output};
use crate::math::DVec3;
use crate::mesh::Mesh;

/// Writes binary STL (positions rounded to f32), or text with [`WriteOptions::ascii`].
pub(in crate::formats) fn write(mesh: &Mesh, options: &WriteOptions, out: &mut dyn Write) -> io::Result<()> {
    if options.ascii { write_text(mesh, out) } else { write_binary(mesh, out) }
}

/// The corners and the unit normal of a face; the normal is zero when the face has no area, as the format asks.
fn facet(mesh: &Mesh, face: usize) -> ([DVec3; 3], DVec3) {
    let corners = mesh.faces[face].map(|vertex| mesh.positions[vertex as usize]);
    let [a, b, c] = corners;
    (corners, (b - a).cross(c - a).normalize_or_zero())
}

fn write_binary(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let (low, high) = mesh.bounds();
    if low.abs().max(high.abs()).max_element() > f64::from(f32::MAX) {
        let message = "a coordinate is too large for the f32 of binary STL; write text STL or another format";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    // Not "solid": readers that look at the first word would take the file for text.
    let mut header = [0; HEADER_BYTES];
    let title = b"binary STL written by coarsen";
    header[..title.len()].copy_from_slice(title);
    header[HEADER_BYTES - 4..].copy_from_slice(&(mesh.faces.len() as u32).to_le_bytes());
    out.write_all(&header)?;
    output::rows(out, mesh.faces.len(), |face, buffer| {
        let (corners, normal) = facet(mesh, face);
        for value in [normal, corners[0], corners[1], corners[2]].into_iter().flat_map(|v| v.as_vec3().to_array()) {
            buffer.extend_from_slice(&value.to_le_bytes());
        }
        buffer.extend_from_slice(&[0; 2]);
    })
}

fn write_text(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "solid coarsen")?;
    output::rows(out, mesh.faces.len(), |face, buffer| {
        let (corners, normal) = facet(mesh, face);
        buffer.extend_from_slice(b"facet normal");
        output::push_floats(buffer, &normal.as_vec3().to_array());
        buffer.extend_from_slice(b"\n  outer loop\n");
        for corner in corners {
            buffer.extend_from_slice(b"    vertex");
            output::push_floats(buffer, &corner.to_array());
            buffer.push(b'\n');
        }
        buffer.extend_from_slice(b"  endloop\nendfacet\n");
    })?;
    writeln!(out, "endsolid coarsen")
}
