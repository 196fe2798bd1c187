//! Rows as bytes, in either order.

use rayon::prelude::*;

use super::FORMAT;
use super::face::{FaceLayout, Faces};
use super::fixed::{TriangleRow, Triple, fields};
use super::header::{Element, Header, Kind, Role};
use super::scalar::{Order, Scalar};
use super::vertex::{VertexLayout, Vertices, normal, texcoord};
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::math::DVec3;
use crate::mesh::{Mesh, first_where};

/// Rows below which a thread of its own does not pay.
const LEAST_ROWS: usize = 1 << 14;

/// Reads the rows after the header.
pub(super) fn read(header: &Header, order: Order, bytes: &[u8]) -> Result<Mesh> {
    let mut cursor = Cursor::new(bytes, header.body_start, order);
    let mut vertices = Vertices::default();
    for element in &header.elements {
        match &element.role {
            Role::Vertex(layout) => vertices = read_vertices(&mut cursor, element, layout)?,
            Role::Face(layout) => read_faces(&mut cursor, element, layout, &mut vertices.mesh)?,
            Role::Skipped => skip(&mut cursor, element)?,
        }
    }
    // Some writers end the file with a line end or padding.
    match bytes[cursor.at..].iter().position(|&b| b != 0 && !b.is_ascii_whitespace()) {
        None => Ok(vertices.into_mesh()),
        Some(_) => Err(cursor.error(format!(
            "found {} bytes after the rows that the header promises, expected the end of the file",
            bytes.len() - cursor.at
        ))),
    }
}

/// A place in the file, moving forward.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    order: Order,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize, order: Order) -> Self {
        Self { bytes, at, order }
    }

    fn error(&self, message: String) -> Error {
        Error::format(FORMAT, Place::Byte(self.at as u64), message)
    }

    fn take(&mut self, count: u64, what: &str) -> Result<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        if count > rest.len() as u64 {
            return Err(self.error(format!("the file ends: {} bytes are left of {count} for {what}", rest.len())));
        }
        self.at += count as usize;
        Ok(&rest[..count as usize])
    }

    /// `count` rows of `row_bytes` bytes.
    fn take_rows(&mut self, element: &Element, row_bytes: usize) -> Result<&'a [u8]> {
        self.take(element.count.saturating_mul(row_bytes as u64), &element.name)
    }

    pub(super) fn scalar(&mut self, scalar: Scalar) -> Result<f64> {
        let order = self.order;
        Ok(scalar.decode(self.take(scalar.size() as u64, "a number")?, order))
    }

    /// The items of a list.
    fn list(&mut self, length: Scalar, item: Scalar) -> Result<&'a [u8]> {
        let start = self.at;
        let order = self.order;
        let count = length.decode(self.take(length.size() as u64, "the length of a list")?, order);
        if !(count >= 0.0 && count.fract() == 0.0) {
            self.at = start;
            return Err(self.error(format!("found a list of {count} items, expected a whole number")));
        }
        self.take(count as u64 * item.size() as u64, "the items of a list")
    }

    pub(super) fn skip(&mut self, kind: Kind) -> Result<()> {
        match kind {
            Kind::Scalar(scalar) => self.take(scalar.size() as u64, "a number").map(drop),
            Kind::List { length, item } => self.list(length, item).map(drop),
        }
    }
}

/// Passes over the rows of an element.
pub(super) fn skip(cursor: &mut Cursor<'_>, element: &Element) -> Result<()> {
    if let Some(row_bytes) = element.row_bytes() {
        return cursor.take_rows(element, row_bytes).map(drop);
    }
    for _ in 0..element.count {
        for property in &element.properties {
            cursor.skip(property.kind)?;
        }
    }
    Ok(())
}

fn read_vertices(cursor: &mut Cursor<'_>, element: &Element, layout: &VertexLayout) -> Result<Vertices> {
    let start = cursor.at;
    let Some(row_bytes) = element.row_bytes() else { return walk_vertices(cursor, element, layout) };
    let rows = cursor.take_rows(element, row_bytes)?;
    let fields = fields(element);
    let order = cursor.order;
    let value = |row: &[u8], place: usize| {
        let (offset, scalar) = fields[place];
        scalar.decode(&row[offset..], order)
    };
    let rows = || rows.par_chunks_exact(row_bytes).with_min_len(LEAST_ROWS);
    let triple = Triple::of(&fields, layout.position);
    let position = |row: &[u8]| match triple.and_then(|triple| triple.numbers(row, order)) {
        Some(position) => DVec3::from(position),
        None => layout.position(|place| value(row, place)),
    };
    let mesh = Mesh {
        positions: rows().map(position).collect(),
        faces: Vec::new(),
        normals: layout.normal.map(|places| rows().map(|row| normal(places, |place| value(row, place))).collect()),
        colors: layout.color.as_ref().map(|color| rows().map(|row| color.color(|place| value(row, place))).collect()),
        channels: layout.channels(|place| rows().map(|row| value(row, place) as f32).collect()),
        ..Mesh::default()
    };
    let texcoords = layout.texcoord.map(|places| rows().map(|row| texcoord(places, |at| value(row, at))).collect());
    match first_where(&mesh.positions, |position| !position.is_finite()) {
        None => Ok(Vertices { mesh, texcoords }),
        Some(vertex) => {
            cursor.at = start + vertex * row_bytes;
            Err(not_finite(cursor, &mesh, vertex))
        }
    }
}

fn not_finite(cursor: &Cursor<'_>, mesh: &Mesh, vertex: usize) -> Error {
    cursor.error(format!("found vertex {vertex} at {}, expected finite coordinates", mesh.positions[vertex]))
}

/// Vertices whose rows hold lists.
fn walk_vertices(cursor: &mut Cursor<'_>, element: &Element, layout: &VertexLayout) -> Result<Vertices> {
    let mut vertices = layout.no_vertices();
    let mut values = vec![0.0; element.properties.len()];
    for vertex in 0..element.count as usize {
        let start = cursor.at;
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(scalar) => values[place] = cursor.scalar(scalar)?,
                list => cursor.skip(list)?,
            }
        }
        layout.push(&mut vertices, |place| values[place]);
        if !vertices.mesh.positions[vertex].is_finite() {
            cursor.at = start;
            return Err(not_finite(cursor, &vertices.mesh, vertex));
        }
    }
    Ok(vertices)
}

fn read_faces(cursor: &mut Cursor<'_>, element: &Element, layout: &FaceLayout, mesh: &mut Mesh) -> Result<()> {
    let Some(triangles) = Triangles::of(cursor, element, layout) else {
        return walk_faces(cursor, element, layout, mesh);
    };
    let (order, vertex_count) = (cursor.order, mesh.positions.len());
    let Triangles { rows: bytes, row: triangle } = &triangles;
    let row_bytes = triangle.bytes;
    let rows = || bytes.par_chunks_exact(row_bytes).with_min_len(LEAST_ROWS);
    mesh.faces = rows().map(|row| triangle.corners(row, order)).collect();
    let is_out_of_range = |&[a, b, c]: &[u32; 3]| a.max(b).max(c) as usize >= vertex_count;
    if let Some(face) = first_where(&mesh.faces, is_out_of_range) {
        cursor.at += face * row_bytes;
        let row = &bytes[face * row_bytes..];
        let (corners_at, item) = triangle.corners;
        let found: [f64; 3] = std::array::from_fn(|i| item.decode(&row[corners_at + i * item.size()..], order));
        return Err(bad_corners(cursor, &found, vertex_count));
    }
    if let Some((at, item)) = triangle.texcoords {
        let number = |row: &[u8], i: usize| item.decode(&row[at + i * item.size()..], order);
        let pair = |row: &[u8], i: usize| attributes::texcoord(number(row, 2 * i), number(row, 2 * i + 1));
        mesh.texcoords = Some(rows().map(|row| std::array::from_fn(|i| pair(row, i))).collect());
    }
    mesh.face_colors = layout.color.as_ref().map(|color| {
        let value = |row: &[u8], place: usize| {
            let (at, scalar) = triangle.scalars[place];
            scalar.decode(&row[at..], order)
        };
        rows().map(|row| color.color(|place| value(row, place))).collect()
    });
    cursor.at += bytes.len();
    Ok(())
}

/// Rows of one size, each a triangle.
struct Triangles<'a> {
    rows: &'a [u8],
    row: TriangleRow,
}

impl<'a> Triangles<'a> {
    /// The rows, when every one is a triangle: that is only known by looking.
    fn of(cursor: &Cursor<'a>, element: &Element, layout: &FaceLayout) -> Option<Self> {
        let row = TriangleRow::of(element, layout)?;
        let bytes = usize::try_from(element.count).ok()?.checked_mul(row.bytes)?;
        let rows = cursor.bytes[cursor.at..].get(..bytes)?;
        let is_triangle = |bytes: &[u8]| row.is_triangle(bytes, cursor.order);
        let are_triangles = |piece: &[u8]| piece.chunks_exact(row.bytes).all(is_triangle);
        rows.par_chunks(row.bytes * LEAST_ROWS).all(are_triangles).then_some(Self { rows, row })
    }
}

/// Faces of varying size.
fn walk_faces(cursor: &mut Cursor<'_>, element: &Element, layout: &FaceLayout, mesh: &mut Mesh) -> Result<()> {
    let order = cursor.order;
    let vertex_count = mesh.positions.len();
    let mut faces = Faces::new(mesh, layout);
    let mut values = vec![0.0; element.properties.len()];
    for _ in 0..element.count {
        let start = cursor.at;
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { length, item } if place == layout.corners => {
                    let items = cursor.list(length, item)?.chunks_exact(item.size());
                    if items.len() < 3 {
                        let message = format!("found a face of {} corners, expected at least 3", items.len());
                        cursor.at = start;
                        return Err(cursor.error(message));
                    }
                    faces.corners.extend(items.clone().map(|bytes| item.decode_index(bytes, order)));
                    if faces.corners.iter().any(|&corner| corner as usize >= vertex_count) {
                        let found: Vec<f64> = items.map(|bytes| item.decode(bytes, order)).collect();
                        cursor.at = start;
                        return Err(bad_corners(cursor, &found, vertex_count));
                    }
                }
                Kind::List { length, item } if layout.texcoords == Some(place) => {
                    let items = cursor.list(length, item)?.chunks_exact(item.size());
                    faces.texcoords.extend(items.map(|bytes| item.decode(bytes, order)));
                }
                Kind::Scalar(scalar) if layout.color.is_some() => values[place] = cursor.scalar(scalar)?,
                kind => cursor.skip(kind)?,
            }
        }
        if let Some(color) = &layout.color {
            faces.color = color.color(|place| values[place]);
        }
        if let Err(message) = faces.end_row() {
            cursor.at = start;
            return Err(cursor.error(message));
        }
    }
    faces.end();
    Ok(())
}

/// An error at the cursor that names the first corner that is no vertex.
fn bad_corners(cursor: &Cursor<'_>, corners: &[f64], vertex_count: usize) -> Error {
    let is_vertex = |corner: f64| corner >= 0.0 && corner < vertex_count as f64 && corner.fract() == 0.0;
    let found = corners.iter().copied().find(|&corner| !is_vertex(corner)).unwrap_or_default();
    let last = vertex_count as i64 - 1;
    cursor.error(format!("found a face with the corner {found}, expected a vertex index from 0 to {last}"))
}
