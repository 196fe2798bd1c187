//! Writes PLY: binary little endian, or text.

use std::io::{self, Write};

use crate::formats::faces::Faces;
use crate::formats::{WriteOptions, attributes, output};
use crate::mesh::Mesh;

/// A name and a number for each vertex.
type Property<'a> = (&'a str, &'a [f32]);

/// Writes binary PLY, or text with [`WriteOptions::ascii`].
pub(in crate::formats) fn write(
    mesh: &Mesh,
    faces: Faces<'_>,
    options: &WriteOptions,
    property: Option<Property<'_>>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let form = Form::of(mesh, faces);
    out.write_all(header(mesh, faces, options, form, property).as_bytes())?;
    let values = property.map_or(&[][..], |(_, values)| values);
    let write = if options.ascii { write_text } else { write_binary };
    write(mesh, faces, form, values, out)
}

/// What the rows hold.
#[derive(Clone, Copy)]
struct Form {
    /// Whether positions are `double`.
    double: bool,
    /// Channels of vertices and of faces: none, or with alpha where one is not opaque.
    channels: usize,
    face_channels: usize,
    /// Whether a face may have more corners than a byte can count.
    counts_int: bool,
}

impl Form {
    fn of(mesh: &Mesh, faces: Faces<'_>) -> Self {
        let channels = |colors: &Option<Vec<[f32; 4]>>| match colors {
            None => 0,
            Some(colors) if colors.iter().any(|color| attributes::to_byte(color[3]) != 255) => 4,
            Some(_) => 3,
        };
        Self {
            double: attributes::needs_double(mesh),
            channels: channels(&mesh.colors),
            face_channels: channels(&mesh.face_colors),
            counts_int: faces.most_corners() > u8::MAX.into(),
        }
    }
}

fn header(mesh: &Mesh, faces: Faces<'_>, options: &WriteOptions, form: Form, own: Option<Property<'_>>) -> String {
    let encoding = if options.ascii { "ascii" } else { "binary_little_endian" };
    let mut header = format!("ply\nformat {encoding} 1.0\nelement vertex {}\n", mesh.positions.len());
    const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];
    let lines = |kind: &str, names: &[&str]| -> String {
        names.iter().map(|name| format!("property {kind} {name}\n")).collect()
    };
    let mut property = |kind: &str, names: &[&str]| header.push_str(&lines(kind, names));
    property(if form.double { "double" } else { "float" }, &["x", "y", "z"]);
    if mesh.normals.is_some() {
        property("float", &["nx", "ny", "nz"]);
    }
    property("uchar", &CHANNELS[..form.channels]);
    if let Some((name, _)) = own {
        property("float", &[name]);
    }
    let count = if form.counts_int { "int" } else { "uchar" };
    header.push_str(&format!("element face {}\nproperty list {count} int vertex_indices\n", faces.len()));
    if faces.texcoords(mesh).is_some() {
        header.push_str("property list uchar float texcoord\n");
    }
    header.push_str(&lines("uchar", &CHANNELS[..form.face_channels]));
    header.push_str("end_header\n");
    header
}

fn write_binary(mesh: &Mesh, faces: Faces<'_>, form: Form, values: &[f32], out: &mut dyn Write) -> io::Result<()> {
    output::rows(out, mesh.positions.len(), |vertex, buffer| {
        for coordinate in mesh.positions[vertex].to_array() {
            if form.double {
                buffer.extend_from_slice(&coordinate.to_le_bytes());
            } else {
                buffer.extend_from_slice(&(coordinate as f32).to_le_bytes());
            }
        }
        for coordinate in mesh.normals.iter().flat_map(|normals| attributes::written_normal(normals[vertex]).to_array())
        {
            buffer.extend_from_slice(&coordinate.to_le_bytes());
        }
        if let Some(colors) = &mesh.colors {
            buffer.extend_from_slice(&attributes::to_bytes(colors[vertex])[..form.channels]);
        }
        if let Some(value) = values.get(vertex) {
            buffer.extend_from_slice(&value.to_le_bytes());
        }
    })?;
    let texcoords = faces.texcoords(mesh);
    output::rows(out, faces.len(), |face, buffer| {
        let corners = faces.corners(face);
        let count = (corners.len() as u32).to_le_bytes();
        buffer.extend_from_slice(if form.counts_int { &count } else { &count[..1] });
        for corner in corners {
            buffer.extend_from_slice(&corner.to_le_bytes());
        }
        if let Some(texcoords) = texcoords {
            buffer.push(6);
            for number in texcoords[face].into_iter().flat_map(|uv| uv.to_array()) {
                buffer.extend_from_slice(&number.to_le_bytes());
            }
        }
        if let Some(colors) = &mesh.face_colors {
            buffer.extend_from_slice(&attributes::to_bytes(colors[faces.triangle(face)])[..form.face_channels]);
        }
    })
}

fn write_text(mesh: &Mesh, faces: Faces<'_>, form: Form, values: &[f32], out: &mut dyn Write) -> io::Result<()> {
    output::rows(out, mesh.positions.len(), |vertex, buffer| {
        let position = mesh.positions[vertex];
        output::push_float(buffer, position.x);
        output::push_floats(buffer, &[position.y, position.z]);
        if let Some(normals) = &mesh.normals {
            output::push_floats(buffer, &attributes::written_normal(normals[vertex]).to_array());
        }
        if let Some(colors) = &mesh.colors {
            output::push_channels(buffer, &attributes::to_bytes(colors[vertex])[..form.channels]);
        }
        if let Some(&value) = values.get(vertex) {
            output::push_floats(buffer, &[value]);
        }
        buffer.push(b'\n');
    })?;
    let texcoords = faces.texcoords(mesh);
    output::rows(out, faces.len(), |face, buffer| {
        output::push_face(buffer, faces.corners(face));
        if let Some(texcoords) = texcoords {
            buffer.extend_from_slice(b" 6");
            texcoords[face].iter().for_each(|uv| output::push_floats(buffer, &uv.to_array()));
        }
        if let Some(colors) = &mesh.face_colors {
            output::push_channels(buffer, &attributes::to_bytes(colors[faces.triangle(face)])[..form.face_channels]);
        }
        buffer.push(b'\n');
    })
}
