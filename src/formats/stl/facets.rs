//! The facets of a binary STL, read in pieces. The three corners of facet `f` are the vertices `3 f`, `3 f + 1`, `3 f + 2`.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::read::expected_bytes;
use super::{FACET_BYTES, FORMAT, HEADER_BYTES};
use crate::error::{Error, Result};
use crate::formats::stream::{LEAST_ROWS, Table, check_finite, refused};
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// Where the corners of a facet stand, behind its normal.
const CORNERS: usize = 12;
const CORNER_BYTES: usize = 12;

/// The facets.
#[derive(Debug)]
pub(crate) struct Facets(Table);

impl Facets {
    /// Opens the file at `path`, of so many bytes.
    pub(in crate::formats) fn open(path: &Path, file_bytes: u64) -> Result<Self> {
        let failed = |source| Error::Read { path: path.to_path_buf(), source };
        let file = File::open(path).map_err(failed)?;
        let mut head = Vec::new();
        (&file).take(HEADER_BYTES as u64).read_to_end(&mut head).map_err(failed)?;
        let count = head.last_chunk().map(|&count| u32::from_le_bytes(count));
        match count.filter(|&count| head.len() == HEADER_BYTES && expected_bytes(count) == file_bytes) {
            Some(count) => Ok(Self(Table {
                path: path.to_path_buf(),
                file,
                start: HEADER_BYTES as u64,
                count: count as usize,
                row_bytes: FACET_BYTES,
            })),
            None => Err(refused("an STL of text, or one that is cut short")),
        }
    }

    pub(in crate::formats) fn count(&self) -> usize {
        self.0.count
    }

    pub(in crate::formats) fn positions(
        &self,
        rows: Range<usize>,
        room: &mut Vec<u8>,
        positions: &mut Vec<DVec3>,
    ) -> Result<()> {
        let facets = rows.start / 3..rows.end.div_ceil(3);
        let first = 3 * facets.start;
        let bytes = self.0.read(facets, room, FORMAT)?;
        let vertices = rows.clone().into_par_iter().with_min_len(LEAST_ROWS);
        vertices.map(|vertex| corner(bytes, vertex - first)).collect_into_vec(positions);
        check_finite(positions, rows.start, FORMAT, |vertex| self.0.place(vertex / 3))
    }

    pub(in crate::formats) fn append_vertices(
        &self,
        wanted: &[u32],
        room: &mut Vec<u8>,
        mesh: &mut Mesh,
    ) -> Result<()> {
        let (Some(&first), Some(&last)) = (wanted.first(), wanted.last()) else { return Ok(()) };
        let bytes = self.0.read(first as usize / 3..last as usize / 3 + 1, room, FORMAT)?;
        mesh.positions.extend(wanted.iter().map(|&vertex| corner(bytes, (vertex - first / 3 * 3) as usize)));
        Ok(())
    }
}

/// The position of a vertex of the facets in `bytes`.
fn corner(bytes: &[u8], vertex: usize) -> DVec3 {
    let at = vertex / 3 * FACET_BYTES + CORNERS + vertex % 3 * CORNER_BYTES;
    Vec3::from_array(
        bytemuck::pod_read_unaligned::<[[u8; 4]; 3]>(&bytes[at..at + CORNER_BYTES]).map(f32::from_le_bytes),
    )
    .as_dvec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Stream, WriteOptions, write};
    use crate::mesh::shapes;

    #[test]
    fn every_corner_is_a_vertex_and_text_is_refused() {
        let dir = tempfile::tempdir().expect("a folder");
        let ball = shapes::icosphere(1);
        let path = dir.path().join("ball.stl");
        write(&ball, &path, &WriteOptions::default()).expect("a file");
        let stream = Stream::open(&path).expect("a stream");
        let count = ball.faces.len();
        assert_eq!((stream.face_count(), stream.vertex_count()), (count, 3 * count));
        let (mut room, mut positions, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        stream.positions(4..11, &mut room, &mut positions).expect("positions");
        let expected = |vertex: usize| ball.positions[ball.faces[vertex / 3][vertex % 3] as usize].as_vec3().as_dvec3();
        assert_eq!(positions, (4..11).map(expected).collect::<Vec<_>>());
        stream.faces(2..4, &mut room, &mut faces).expect("faces");
        assert_eq!(faces, [[6, 7, 8], [9, 10, 11]]);
        let mut mesh = stream.no_mesh();
        stream.append_vertices(&[5, 6, 60], &mut room, &mut mesh).expect("vertices");
        assert_eq!(mesh.positions, [5, 6, 60].map(expected));

        let text = dir.path().join("text.stl");
        write(&ball, &text, &WriteOptions { ascii: true }).expect("a file");
        assert!(matches!(Stream::open(&text), Err(Error::Unsupported(_))));
        let mut bytes = std::fs::read(&path).expect("a file");
        bytes[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        std::fs::write(&path, bytes).expect("a file");
        let error = Stream::open(&path).and_then(|s| s.positions(0..9, &mut room, &mut positions)).expect_err("NaN");
        assert!(error.to_string().starts_with("STL byte 134: found vertex 3 "), "{error}");
    }
}
