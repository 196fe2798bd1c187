//! OFF, the text format of Geomview: an optional `ST` (texture coordinates), `C` (colors) and `N` (normals) before the
//! keyword, then counts and rows.
//!
//! ```text
//! COFF
//! 3 1 0               vertices faces edges (the edges are ignored)
//! 0 0 0 255 0 0 255   x y z, then nx ny nz for N, then r g b [a] for C, as bytes or fractions, then s t for ST
//! 1 0 0 0 255 0 255
//! 0 1 0 0 0 255 255
//! 3 0 1 2 255 0 0     corners, then the face's color, r g b [a], read where every face has one
//! ```
//! Faces of one or two corners (points and lines) are left out. Texture coordinates are read but not written: a vertex has
//! one pair here, which a seam would split.

use std::io::{self, Write};

use super::polygon::Triangulator;
use super::text::{Lines, Row, Rows, number, quote};
use super::{attributes, output};
use crate::error::{Error, Result};
use crate::math::{DVec3, Vec2};
use crate::mesh::Mesh;

const FORMAT: &str = "OFF";

/// What the keyword says stands in a vertex row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Keyword {
    texcoords: bool,
    normals: bool,
    colors: bool,
}

/// Reads OFF text.
pub(super) fn read(bytes: &[u8]) -> Result<Mesh> {
    let mut rows = Rows::new(FORMAT, Lines::after(0, bytes), Some(b'#'));
    let mut header = rows.expect("header lines", 0, 2)?;
    let keyword = keyword(&mut header)?;
    // Some writers put the counts on the keyword's line.
    let mut counts = if header.clone().next().is_some() { header } else { rows.expect("header lines", 1, 2)? };
    let vertex_count = counts.count("the number of vertices")?;
    let face_count = counts.count("the number of faces")?;

    // The shortest rows are "0 0 0" and "0", each with a line end that the last may lack.
    let room = rows.rest().len() as u64 + 1;
    if vertex_count.saturating_mul(6).saturating_add(face_count.saturating_mul(2)) > room {
        return Err(counts.error(format!(
            "the header promises {vertex_count} vertices and {face_count} faces, more than the {} bytes after it can hold",
            room - 1
        )));
    }
    let (mut mesh, texcoords) = read_vertices(&mut rows, vertex_count, keyword)?;
    let mut triangulator = Triangulator::new();
    let mut corners = Vec::new();
    let mut colors = Channels::default();
    for at in 0..face_count {
        let mut row = rows.expect("faces", at, face_count)?;
        let corner_count = row.count("the number of corners")?;
        corners.clear();
        for _ in 0..corner_count {
            corners.push(row.index(mesh.positions.len())?);
        }
        let before = mesh.faces.len();
        triangulator.append(&corners, &[], &mut mesh);
        colors.push_face(&row, mesh.faces.len() - before);
    }
    rows.expect_end()?;
    // A face without a color has that of the program that shows it.
    mesh.face_colors = Some(colors.to_unit()).filter(|colors| colors.len() == mesh.faces.len() && !colors.is_empty());
    mesh.texcoords = texcoords.map(|of_vertex| attributes::of_corners(&mesh.faces, &of_vertex));
    Ok(mesh)
}

fn keyword(header: &mut Row<'_>) -> Result<Keyword> {
    let word = header.expect("the keyword 'OFF'")?;
    let (texcoords, rest) = word.strip_prefix(b"ST").map_or((false, word), |rest| (true, rest));
    let keyword = match rest {
        b"OFF" => Keyword { texcoords, ..Keyword::default() },
        b"COFF" => Keyword { texcoords, colors: true, normals: false },
        b"NOFF" => Keyword { texcoords, normals: true, colors: false },
        b"CNOFF" | b"NCOFF" => Keyword { texcoords, normals: true, colors: true },
        _ if word.ends_with(b"OFF") => {
            return Err(Error::Unsupported(format!(
                "OFF in {} form; known are OFF, COFF, NOFF, CNOFF, also with ST before",
                quote(word)
            )));
        }
        _ => return Err(header.error(format!("found {}, expected the keyword 'OFF'", quote(word)))),
    };
    match header.clone().next() {
        Some(b"BINARY") => Err(Error::Unsupported("binary OFF; write it as text".into())),
        _ => Ok(keyword),
    }
}

/// The vertices, and their texture coordinates.
fn read_vertices(rows: &mut Rows<'_>, vertex_count: u64, keyword: Keyword) -> Result<(Mesh, Option<Vec<Vec2>>)> {
    let mut mesh = Mesh { positions: Vec::with_capacity(vertex_count as usize), ..Mesh::default() };
    let mut normals = Vec::new();
    let mut colors = Channels::default();
    let mut texcoords = keyword.texcoords.then(Vec::new);
    for at in 0..vertex_count {
        let mut row = rows.expect("vertices", at, vertex_count)?;
        mesh.positions.push(row.point()?);
        if keyword.normals {
            let normal = DVec3::new(row.number("nx")?, row.number("ny")?, row.number("nz")?);
            normals.push(attributes::unit_normal(normal.as_vec3()));
        }
        if keyword.colors {
            let first = row.clone().next();
            let rgb = [row.number("red")?, row.number("green")?, row.number("blue")?];
            // The pair of a texture coordinate is no alpha.
            let more = row.words() > if keyword.texcoords { 2 } else { 0 };
            let alpha = if more { row.next().and_then(number) } else { None };
            colors.push(first, rgb, alpha);
        }
        if let Some(texcoords) = &mut texcoords {
            texcoords.push(attributes::texcoord(row.number("s")?, row.number("t")?));
        }
    }
    if keyword.normals {
        mesh.normals = Some(normals);
    }
    if keyword.colors {
        mesh.colors = Some(colors.to_unit());
    }
    Ok((mesh, texcoords))
}

/// Colors as they are stored: fractions or bytes, which only all of them tell.
#[derive(Default)]
struct Channels {
    rows: Vec<([f64; 3], Option<f64>)>,
    greatest: f64,
    fractions: bool,
}

impl Channels {
    /// Appends a color; `first` is how its red is written.
    fn push(&mut self, first: Option<&[u8]>, rgb: [f64; 3], alpha: Option<f64>) {
        self.fractions |= first.is_some_and(|token| token.contains(&b'.'));
        self.greatest = rgb.into_iter().chain(alpha).fold(self.greatest, f64::max);
        self.rows.push((rgb, alpha));
    }

    /// Appends the color at the end of a face's row for each of its triangles, if there is one: no number is none, and one
    /// is the index of a color that stands elsewhere.
    fn push_face(&mut self, row: &Row<'_>, triangles: usize) {
        let mut rest = row.clone();
        let first = row.clone().next();
        let mut channel = || rest.next().and_then(number);
        if let [Some(red), Some(green), Some(blue), alpha] = [channel(), channel(), channel(), channel()] {
            (0..triangles).for_each(|_| self.push(first, [red, green, blue], alpha));
        }
    }

    fn to_unit(&self) -> Vec<[f32; 4]> {
        let factor = if self.fractions { 1.0 } else { attributes::unit_factor(self.greatest) };
        let unit = |&(rgb, alpha): &([f64; 3], Option<f64>)| {
            let [r, g, b] = rgb.map(|channel| attributes::channel(channel, factor));
            [r, g, b, alpha.map_or(1.0, |alpha| attributes::channel(alpha, factor))]
        };
        self.rows.iter().map(unit).collect()
    }
}

/// Writes OFF text; colors as bytes, the form that most readers expect.
pub(super) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let colors = if mesh.colors.is_some() { "C" } else { "" };
    let normals = if mesh.normals.is_some() { "N" } else { "" };
    writeln!(out, "{colors}{normals}OFF\n{} {} 0", mesh.positions.len(), mesh.faces.len())?;
    output::rows(out, mesh.positions.len(), |vertex, buffer| {
        let position = mesh.positions[vertex];
        output::push_float(buffer, position.x);
        output::push_floats(buffer, &[position.y, position.z]);
        if let Some(normals) = &mesh.normals {
            output::push_floats(buffer, &attributes::written_normal(normals[vertex]).to_array());
        }
        if let Some(colors) = &mesh.colors {
            output::push_channels(buffer, &attributes::to_bytes(colors[vertex]));
        }
        buffer.push(b'\n');
    })?;
    output::rows(out, mesh.faces.len(), |face, buffer| {
        output::push_face(buffer, &mesh.faces[face]);
        if let Some(colors) = &mesh.face_colors {
            output::push_channels(buffer, &attributes::to_bytes(colors[face]));
        }
        buffer.push(b'\n');
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn counts_may_stand_beside_the_keyword() {
        let mesh = read(b"OFF 3 1 0 # one\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5").unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces), (3, vec![[0, 1, 2]]));
    }

    #[test]
    fn normals_come_before_colors() {
        let text = b"CNOFF\n3 1 0\n0 0 0 0 0 2 51 0 0\n1 0 0 0 0 1 0 255 0\n0 1 0 0 0 1 0 0 255\n3 0 1 2\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.normals, Some(vec![Vec3::Z; 3]));
        assert_eq!(mesh.colors.map(|colors| colors[0]), Some([0.2, 0.0, 0.0, 1.0]));
    }

    #[test]
    fn faces_have_colors_where_every_one_has() {
        let colors = |first: &str, second: &str| {
            let text = format!("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 {first}\n3 0 1 2 {second}\n");
            read(text.as_bytes()).unwrap().face_colors
        };
        let (red, gray) = ([1.0, 0.0, 0.0, 1.0], [0.2, 0.2, 0.2, 0.4]);
        assert_eq!(colors("255 0 0", "51 51 51 102 # gray"), Some(vec![red, red, gray]));
        assert_eq!(colors("1.0 0 0", "0.2 0.2 0.2 0.4"), Some(vec![red, red, gray]));
        for (first, second) in [("", ""), ("255 0 0", ""), ("3", "4"), ("255 0 0", "7"), ("a b c", "1 0 0")] {
            assert_eq!(colors(first, second), None, "{first}, {second}");
        }
    }

    #[test]
    fn texture_coordinates_come_last() {
        for (colors, alpha) in [("0 0 255", 1.0), ("0 0 255 51", 0.2)] {
            let vertex = |x: u32, y: u32| format!("{x} {y} 0 {colors} 0.{x}5 -{y}\n");
            let text = format!("STCOFF\n3 1 0\n{}{}{}3 2 0 1\n", vertex(0, 0), vertex(1, 0), vertex(0, 1));
            let mesh = read(text.as_bytes()).unwrap();
            assert_eq!(mesh.texcoords, Some(vec![[(0.05, -1.0), (0.05, 0.0), (0.15, 0.0)].map(Vec2::from)]));
            assert_eq!(mesh.colors, Some(vec![[0.0, 0.0, 1.0, alpha]; 3]));
        }
        let message = read(b"STOFF\n1 0 0\n0 0 0 0.5\n").unwrap_err().to_string();
        assert!(message.starts_with("OFF line 3: the line ends, expected t"), "{message}");
    }

    #[test]
    fn colors_may_be_fractions() {
        let mesh = read(b"COFF\n3 1 0\n0 0 0 1.0 0.5 0 1\n1 0 0 0 0 0 1\n0 1 0 0 0 0 0.5\n3 0 1 2\n").unwrap();
        let colors = mesh.colors.unwrap();
        assert_eq!((colors[0], colors[2]), ([1.0, 0.5, 0.0, 1.0], [0.0, 0.0, 0.0, 0.5]));
    }

    #[test]
    fn a_lying_header_is_refused_by_its_line() {
        let error = read(b"OFF\n353535235358 6 0\n0 0 0\n").unwrap_err().to_string();
        assert!(error.starts_with("OFF line 2: the header promises 353535235358 vertices and 6 faces"), "{error}");
        // 2⁶³ and more do not wrap.
        assert!(read(b"OFF\n999999999999999999 999999999999999999 0\n").is_err());
    }
}
