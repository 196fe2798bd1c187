//! Writes PLY: binary little endian, or text.

use std::io::{self, Write};

use crate::formats::faces::Faces;
use crate::formats::{WriteOptions, attributes, output};
use crate::mesh::{ChannelKind, Mesh};

/// A name and a number for each vertex.
type Property<'a> = (&'a str, &'a [f32]);

/// A property of the file: its name, the numbers of a channel or of one column of it.
struct Column<'a> {
    name: String,
    values: &'a [f32],
    width: usize,
    at: usize,
    /// Whether all of them are whole, and stand for that.
    is_whole: bool,
}

impl Column<'_> {
    fn value(&self, vertex: usize) -> f32 {
        self.values[vertex * self.width + self.at]
    }

    /// Its type in the file.
    fn type_name(&self) -> &'static str {
        if self.is_whole { "int" } else { "float" }
    }

    fn bytes(&self, vertex: usize) -> [u8; 4] {
        let value = self.value(vertex);
        if self.is_whole { (value as i32).to_le_bytes() } else { value.to_le_bytes() }
    }
}

/// The channels of a mesh, a property for each of their numbers; one of its own takes the place of one that is called the same.
fn columns<'a>(mesh: &'a Mesh, own: Option<Property<'a>>) -> Vec<Column<'a>> {
    let mut columns: Vec<Column<'_>> = Vec::new();
    for channel in &mesh.channels {
        let plain: String =
            channel.name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
        // The greatest single-precision number that an `int` holds.
        let is_whole = |x: &f32| x.fract() == 0.0 && (-2_147_483_648.0..=2_147_483_520.0).contains(x);
        let is_whole = channel.kind == ChannelKind::Label && channel.values.iter().all(is_whole);
        for at in 0..channel.width {
            let name = if channel.width == 1 { plain.clone() } else { format!("{plain}_{at}") };
            columns.push(Column { name, values: &channel.values, width: channel.width, at, is_whole });
        }
    }
    if let Some((name, values)) = own {
        columns.push(Column { name: name.into(), values, width: 1, at: 0, is_whole: false });
    }
    // The last of a name counts, and none of those that mean something else.
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    let has = |name: &str, may_be_whole: bool| {
        columns.iter().any(|column| column.name == name && (may_be_whole || !column.is_whole))
    };
    // Places in a texture are no whole numbers.
    let are_there = |names: &[&str]| names.iter().all(|name| has(name, names.len() == 3));
    let standard = STANDARD.iter().filter(|(names, _)| is_own(names, mesh) || are_there(names));
    let taken: Vec<&str> = standard.flat_map(|(names, more)| names.iter().chain(*more)).copied().collect();
    let mut place = 0;
    columns.retain(|column| {
        place += 1;
        let is_last = !names[place..].contains(&column.name);
        !column.name.is_empty() && is_last && !taken.contains(&column.name.as_str())
    });
    columns
}

/// Names of properties that readers take for something else where all of them are there, and what goes with them then.
const STANDARD: [(&[&str], &[&str]); 7] = [
    (&["x", "y", "z"], &[]),
    (&["nx", "ny", "nz"], &[]),
    (&["red", "green", "blue"], &["alpha"]),
    (&["diffuse_red", "diffuse_green", "diffuse_blue"], &["diffuse_alpha"]),
    (&["s", "t"], &[]),
    (&["u", "v"], &[]),
    (&["texture_u", "texture_v"], &[]),
];

/// Whether a mesh has the properties of such names itself.
fn is_own(names: &[&str], mesh: &Mesh) -> bool {
    match names[0] {
        "x" => true,
        "nx" => mesh.normals.is_some(),
        "red" => mesh.colors.is_some(),
        _ => false,
    }
}

/// Writes binary PLY, or text with [`WriteOptions::ascii`]; with a property beside the mesh's own, and lines of the header.
pub(in crate::formats) fn write(
    mesh: &Mesh,
    faces: Faces<'_>,
    options: &WriteOptions,
    (property, comments): (Option<Property<'_>>, &[String]),
    out: &mut dyn Write,
) -> io::Result<()> {
    let form = Form::of(mesh, faces);
    let columns = columns(mesh, property);
    out.write_all(header(mesh, faces, options, form, (&columns, comments)).as_bytes())?;
    let write = if options.ascii { write_text } else { write_binary };
    write(mesh, faces, form, &columns, out)
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

fn header(
    mesh: &Mesh,
    faces: Faces<'_>,
    options: &WriteOptions,
    form: Form,
    (columns, comments): (&[Column<'_>], &[String]),
) -> String {
    let encoding = if options.ascii { "ascii" } else { "binary_little_endian" };
    let comments: String = comments.iter().map(|line| format!("{line}\n")).collect();
    let mut header = format!("ply\nformat {encoding} 1.0\n{comments}element vertex {}\n", mesh.positions.len());
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
    columns.iter().for_each(|column| property(column.type_name(), &[&column.name]));
    let count = if form.counts_int { "int" } else { "uchar" };
    header.push_str(&format!("element face {}\nproperty list {count} int vertex_indices\n", faces.len()));
    if faces.texcoords(mesh).is_some() {
        header.push_str("property list uchar float texcoord\n");
    }
    header.push_str(&lines("uchar", &CHANNELS[..form.face_channels]));
    header.push_str("end_header\n");
    header
}

fn write_binary(
    mesh: &Mesh,
    faces: Faces<'_>,
    form: Form,
    columns: &[Column<'_>],
    out: &mut dyn Write,
) -> io::Result<()> {
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
        columns.iter().for_each(|column| buffer.extend_from_slice(&column.bytes(vertex)));
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

fn write_text(
    mesh: &Mesh,
    faces: Faces<'_>,
    form: Form,
    columns: &[Column<'_>],
    out: &mut dyn Write,
) -> io::Result<()> {
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
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        columns.iter().for_each(|column| match column.is_whole {
            true => buffer.extend_from_slice(format!(" {}", column.value(vertex) as i32).as_bytes()),
            false => output::push_floats(buffer, &[finite(column.value(vertex))]),
        });
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
