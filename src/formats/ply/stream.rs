//! The tables of a binary PLY, read in pieces.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::FORMAT;
use super::fixed::{TriangleRow, fields};
use super::header::{Body, Element, Header, MOST_HEADER_BYTES, Role};
use super::scalar::{Order, Scalar};
use super::vertex::{VertexLayout, normal};
use crate::error::{Error, Place, Result};
use crate::formats::stream::{LEAST_ROWS, Rows, Table, check_finite, refused};
use crate::formats::{Format, input};
use crate::math::DVec3;
use crate::mesh::{Mesh, first_where};

/// A binary PLY of triangles whose rows have one size: one side of [`Stream`](crate::formats::Stream), which says what each does.
#[derive(Debug)]
pub(crate) struct Tables {
    order: Order,
    vertices: Table,
    layout: VertexLayout,
    /// Where the numbers of a vertex stand, and their types.
    fields: Vec<(usize, Scalar)>,
    faces: Table,
    triangle: TriangleRow,
    has_face_colors: bool,
}

/// Rows as [`Tables::of_rows`] reads them: doubles, then floats for normals and colors.
impl Rows {
    fn header(self, vertices: usize, faces: usize) -> String {
        let names = |kind: &str, names: &str| -> String {
            names.split(' ').map(|name| format!("property {kind} {name}\n")).collect()
        };
        let normals = if self.normals { names("float", "nx ny nz") } else { String::new() };
        let colors = if self.colors { names("float", "red green blue alpha") } else { String::new() };
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{}{normals}{colors}element face {faces}\n\
             property list uchar int vertex_indices\nend_header\n",
            names("double", "x y z"),
        )
    }

    /// Appends the row of a vertex.
    pub(crate) fn push_vertex(self, mesh: &Mesh, vertex: usize, out: &mut Vec<u8>) {
        mesh.positions[vertex].to_array().iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
        let normal = mesh.normals.iter().flat_map(|rows| rows[vertex].to_array());
        let color = mesh.colors.iter().flat_map(|rows| rows[vertex]);
        normal.chain(color).for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    }

    /// Appends the row of a face.
    pub(crate) fn push_face(self, face: [u32; 3], out: &mut Vec<u8>) {
        out.push(3);
        face.iter().for_each(|corner| out.extend_from_slice(&corner.to_le_bytes()));
    }
}

impl Tables {
    /// Opens the file at `path`, of so many bytes, and reads its header.
    pub(in crate::formats) fn open(path: &Path, file_bytes: u64) -> Result<Self> {
        let failed = |source| Error::Read { path: path.to_path_buf(), source };
        let open = || File::open(path).map_err(failed);
        let file = open()?;
        let mut head = Vec::new();
        (&file).take(MOST_HEADER_BYTES as u64).read_to_end(&mut head).map_err(failed)?;
        input::check_content(&head, Format::Ply)?;
        let header = Header::parse_start(&head, file_bytes)?;
        Self::new(&header, |start, count, row_bytes| {
            Ok(Table { path: path.to_path_buf(), file: open()?, start, count, row_bytes })
        })
    }

    pub(in crate::formats) fn of_rows(rows: Rows, path: &Path, files: [File; 2], counts: [usize; 2]) -> Result<Self> {
        let header = Header::parse_start(rows.header(counts[0], counts[1]).as_bytes(), u64::MAX)?;
        let mut files = files.into_iter();
        Self::new(&header, |_, count, row_bytes| match files.next() {
            Some(file) => Ok(Table { path: path.to_path_buf(), file, start: 0, count, row_bytes }),
            None => Err(Error::Unsupported("more than two tables".into())),
        })
    }

    fn new(header: &Header, mut table: impl FnMut(u64, usize, usize) -> Result<Table>) -> Result<Self> {
        let refused = |what| Err(refused(what));
        let Body::Binary(order) = header.body else { return refused("a PLY of text") };
        let mut start = header.body_start as u64;
        let (mut vertices, mut faces) = (None, None);
        for element in &header.elements {
            let Element { role, count, .. } = element;
            let rows = usize::try_from(*count).map_err(|_| Error::Limit(format!("{count} rows")))?;
            if let Role::Face(layout) = role {
                let Some(triangle) = TriangleRow::of(element, layout) else {
                    return refused("a PLY whose faces have lists beside their corners");
                };
                faces = Some((table(start, rows, triangle.bytes)?, triangle, layout.color.is_some()));
                break;
            }
            let Some(row_bytes) = element.row_bytes() else { return refused("a PLY whose vertices have lists") };
            if let Role::Vertex(_) = role {
                let layout = VertexLayout::of(&element.properties)?;
                vertices = Some((table(start, rows, row_bytes)?, layout, fields(element)));
            }
            start += count * row_bytes as u64;
        }
        let (Some((vertices, layout, fields)), Some((faces, triangle, has_face_colors))) = (vertices, faces) else {
            return refused("a PLY without vertices before its faces");
        };
        Ok(Self { order, vertices, layout, fields, faces, triangle, has_face_colors })
    }

    pub(in crate::formats) fn vertex_count(&self) -> usize {
        self.vertices.count
    }

    pub(in crate::formats) fn face_count(&self) -> usize {
        self.faces.count
    }

    pub(in crate::formats) fn rows(&self) -> Rows {
        Rows { normals: self.layout.normal.is_some(), colors: self.layout.color.is_some() }
    }

    /// Whether there are texture coordinates, colors of faces, and channels: none is read here.
    pub(in crate::formats) fn leaves_out(&self) -> [bool; 3] {
        let texcoords = self.triangle.texcoords.is_some() || self.layout.texcoord.is_some();
        [texcoords, self.has_face_colors, !self.layout.channels.is_empty()]
    }

    pub(in crate::formats) fn positions(
        &self,
        rows: Range<usize>,
        room: &mut Vec<u8>,
        positions: &mut Vec<DVec3>,
    ) -> Result<()> {
        let first = rows.start;
        let bytes = self.vertices.read(rows, room, FORMAT)?.par_chunks_exact(self.vertices.row_bytes);
        let position = |row: &[u8]| self.layout.position(|place| self.value(row, place));
        bytes.with_min_len(LEAST_ROWS).map(position).collect_into_vec(positions);
        check_finite(positions, first, FORMAT, |vertex| self.vertices.place(vertex))
    }

    pub(in crate::formats) fn append_vertices(
        &self,
        wanted: &[u32],
        room: &mut Vec<u8>,
        mesh: &mut Mesh,
    ) -> Result<()> {
        let (Some(&first), Some(&last)) = (wanted.first(), wanted.last()) else { return Ok(()) };
        let bytes = self.vertices.read(first as usize..last as usize + 1, room, FORMAT)?;
        let row_bytes = self.vertices.row_bytes;
        let rows = || wanted.iter().map(|&vertex| &bytes[(vertex - first) as usize * row_bytes..][..row_bytes]);
        mesh.positions.extend(rows().map(|row| self.layout.position(|place| self.value(row, place))));
        if let (Some(places), Some(normals)) = (self.layout.normal, &mut mesh.normals) {
            normals.extend(rows().map(|row| normal(places, |place| self.value(row, place))));
        }
        if let (Some(color), Some(colors)) = (&self.layout.color, &mut mesh.colors) {
            colors.extend(rows().map(|row| color.color(|place| self.value(row, place))));
        }
        Ok(())
    }

    pub(in crate::formats) fn faces(
        &self,
        rows: Range<usize>,
        room: &mut Vec<u8>,
        faces: &mut Vec<[u32; 3]>,
    ) -> Result<()> {
        let (first, row_bytes) = (rows.start, self.faces.row_bytes);
        let bytes = self.faces.read(rows, room, FORMAT)?;
        let rows = || bytes.par_chunks_exact(row_bytes).with_min_len(LEAST_ROWS);
        if let Some(at) = rows().position_first(|row| !self.triangle.is_triangle(row, self.order)) {
            let what = format!("face {} is no triangle", first + at);
            return Err(Error::Unsupported(format!(
                "{what}: only triangles are read in pieces; save it with triangles"
            )));
        }
        rows().map(|row| self.triangle.corners(row, self.order)).collect_into_vec(faces);
        let is_out_of_range = |&[a, b, c]: &[u32; 3]| a.max(b).max(c) as usize >= self.vertices.count;
        match first_where(faces, is_out_of_range) {
            None => Ok(()),
            Some(at) => {
                let place = Place::Byte(self.faces.place(first + at));
                let last = self.vertices.count as i64 - 1;
                let found = faces[at].map(|corner| corner as i32);
                let message =
                    format!("found a face with the corners {found:?}, expected vertex indices from 0 to {last}");
                Err(Error::format(FORMAT, place, message))
            }
        }
    }

    fn value(&self, row: &[u8], place: usize) -> f64 {
        let (offset, scalar) = self.fields[place];
        scalar.decode(&row[offset..], self.order)
    }
}
