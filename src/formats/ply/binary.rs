//! Rows as bytes, in either order.

use rayon::prelude::*;

use super::FORMAT;
use super::header::{Element, Header, Kind, Role};
use super::scalar::{Order, Scalar};
use super::vertex::{VertexLayout, normal};
use crate::error::{Error, Place, Result};
use crate::formats::polygon::Triangulator;
use crate::mesh::Mesh;

/// Rows below which a thread of its own does not pay.
const LEAST_ROWS: usize = 1 << 14;

/// Reads the rows after the header.
pub(super) fn read(header: &Header, order: Order, bytes: &[u8]) -> Result<Mesh> {
    let mut cursor = Cursor { bytes, at: header.body_start, order };
    let mut mesh = Mesh::default();
    for element in &header.elements {
        match &element.role {
            Role::Vertex(layout) => mesh = read_vertices(&mut cursor, element, layout)?,
            Role::Face(list) => read_faces(&mut cursor, element, *list, &mut mesh)?,
            Role::Skipped => skip(&mut cursor, element)?,
        }
    }
    // Some writers end the file with a line end or padding.
    match bytes[cursor.at..].iter().position(|&b| b != 0 && !b.is_ascii_whitespace()) {
        None => Ok(mesh),
        Some(_) => Err(cursor.error(format!(
            "found {} bytes after the rows that the header promises, expected the end of the file",
            bytes.len() - cursor.at
        ))),
    }
}

/// A place in the file, moving forward.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    order: Order,
}

impl<'a> Cursor<'a> {
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

    fn scalar(&mut self, scalar: Scalar) -> Result<f64> {
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

    fn skip(&mut self, kind: Kind) -> Result<()> {
        match kind {
            Kind::Scalar(scalar) => self.take(scalar.size() as u64, "a number").map(drop),
            Kind::List { length, item } => self.list(length, item).map(drop),
        }
    }
}

fn skip(cursor: &mut Cursor<'_>, element: &Element) -> Result<()> {
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

fn read_vertices(cursor: &mut Cursor<'_>, element: &Element, layout: &VertexLayout) -> Result<Mesh> {
    let start = cursor.at;
    let Some(row_bytes) = element.row_bytes() else { return walk_vertices(cursor, element, layout) };
    let rows = cursor.take_rows(element, row_bytes)?;
    let fields: Vec<(usize, Scalar)> = element
        .properties
        .iter()
        .scan(0, |offset, property| {
            let Kind::Scalar(scalar) = property.kind else { return None };
            *offset += scalar.size();
            Some((*offset - scalar.size(), scalar))
        })
        .collect();
    let order = cursor.order;
    let value = |row: &[u8], place: usize| {
        let (offset, scalar) = fields[place];
        scalar.decode(&row[offset..], order)
    };
    let rows = || rows.par_chunks_exact(row_bytes).with_min_len(LEAST_ROWS);
    let mesh = Mesh {
        positions: rows().map(|row| layout.position(|place| value(row, place))).collect(),
        faces: Vec::new(),
        normals: layout.normal.map(|places| rows().map(|row| normal(places, |place| value(row, place))).collect()),
        colors: layout.color.as_ref().map(|color| rows().map(|row| color.color(|place| value(row, place))).collect()),
    };
    match mesh.positions.par_iter().with_min_len(LEAST_ROWS).position_first(|position| !position.is_finite()) {
        None => Ok(mesh),
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
fn walk_vertices(cursor: &mut Cursor<'_>, element: &Element, layout: &VertexLayout) -> Result<Mesh> {
    let mut mesh = layout.empty_mesh();
    let mut values = vec![0.0; element.properties.len()];
    for vertex in 0..element.count as usize {
        let start = cursor.at;
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(scalar) => values[place] = cursor.scalar(scalar)?,
                list => cursor.skip(list)?,
            }
        }
        layout.push(&mut mesh, |place| values[place]);
        if !mesh.positions[vertex].is_finite() {
            cursor.at = start;
            return Err(not_finite(cursor, &mesh, vertex));
        }
    }
    Ok(mesh)
}

fn read_faces(cursor: &mut Cursor<'_>, element: &Element, list: usize, mesh: &mut Mesh) -> Result<()> {
    let Kind::List { length, item } = element.properties[list].kind else { return Ok(()) };
    match triangle_rows(cursor, element, list) {
        Some((rows, row_bytes, list_at)) => {
            let order = cursor.order;
            let corners_at = list_at + length.size();
            let corner = |row: &[u8], i: usize| item.decode_index(&row[corners_at + i * item.size()..], order);
            mesh.faces = rows
                .par_chunks_exact(row_bytes)
                .with_min_len(LEAST_ROWS)
                .map(|row| std::array::from_fn(|i| corner(row, i)))
                .collect();
            let vertex_count = mesh.positions.len();
            let out_of_range = |face: &[u32; 3]| face.iter().any(|&vertex| vertex as usize >= vertex_count);
            let faces = mesh.faces.par_iter().with_min_len(LEAST_ROWS);
            if let Some(face) = faces.position_first(out_of_range) {
                cursor.at += face * row_bytes;
                let row = &rows[face * row_bytes..];
                let found: [f64; 3] = std::array::from_fn(|i| item.decode(&row[corners_at + i * item.size()..], order));
                return Err(bad_corners(cursor, &found, vertex_count));
            }
            cursor.at += rows.len();
            Ok(())
        }
        None => walk_faces(cursor, element, list, mesh),
    }
}

/// The rows, their size and the offset of the corner list, when every row is a triangle and holds no other list.
///
/// Whether all are triangles is only known by looking: a row's size follows from the rows before it.
fn triangle_rows<'a>(cursor: &Cursor<'a>, element: &Element, list: usize) -> Option<(&'a [u8], usize, usize)> {
    let mut row_bytes = 0;
    let mut list_at = 0;
    for (place, property) in element.properties.iter().enumerate() {
        match property.kind {
            Kind::Scalar(scalar) => row_bytes += scalar.size(),
            Kind::List { length, item } if place == list => {
                list_at = row_bytes;
                row_bytes += length.size() + 3 * item.size();
            }
            Kind::List { .. } => return None,
        }
    }
    let Kind::List { length, .. } = element.properties[list].kind else { return None };
    let bytes = usize::try_from(element.count).ok()?.checked_mul(row_bytes)?;
    let rows = cursor.bytes[cursor.at..].get(..bytes)?;
    let triangle = |row: &[u8]| length.decode_index(&row[list_at..], cursor.order) == 3;
    let triangles = rows.par_chunks_exact(row_bytes).with_min_len(LEAST_ROWS).all(triangle);
    triangles.then_some((rows, row_bytes, list_at))
}

/// Faces of varying size.
fn walk_faces(cursor: &mut Cursor<'_>, element: &Element, list: usize, mesh: &mut Mesh) -> Result<()> {
    let mut triangulator = Triangulator::new();
    let mut corners = Vec::new();
    for _ in 0..element.count {
        let start = cursor.at;
        corners.clear();
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { length, item } if place == list => {
                    let items = cursor.list(length, item)?.chunks_exact(item.size());
                    if items.len() < 3 {
                        let message = format!("found a face of {} corners, expected at least 3", items.len());
                        cursor.at = start;
                        return Err(cursor.error(message));
                    }
                    corners.extend(items.clone().map(|bytes| item.decode_index(bytes, cursor.order)));
                    if corners.iter().any(|&corner| corner as usize >= mesh.positions.len()) {
                        let found: Vec<f64> = items.map(|bytes| item.decode(bytes, cursor.order)).collect();
                        cursor.at = start;
                        return Err(bad_corners(cursor, &found, mesh.positions.len()));
                    }
                }
                kind => cursor.skip(kind)?,
            }
        }
        triangulator.append(&corners, &mesh.positions, &mut mesh.faces);
    }
    Ok(())
}

/// An error at the cursor that names the first corner that is no vertex.
fn bad_corners(cursor: &Cursor<'_>, corners: &[f64], vertex_count: usize) -> Error {
    let is_vertex = |corner: f64| corner >= 0.0 && corner < vertex_count as f64 && corner.fract() == 0.0;
    let found = corners.iter().copied().find(|&corner| !is_vertex(corner)).unwrap_or_default();
    let last = vertex_count as i64 - 1;
    cursor.error(format!("found a face with the corner {found}, expected a vertex index from 0 to {last}"))
}
