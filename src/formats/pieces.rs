//! Writing a mesh that comes in pieces and is never in memory as a whole: binary PLY.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use super::scratch::Scratch;
use super::{Compression, Format, attributes, output};
use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// Bytes of the header, filled up with a comment: the counts come last and go in front.
const HEADER_BYTES: usize = 512;
/// Bytes that are written at a time.
const WRITTEN_BYTES: usize = 1 << 20;

/// Writes the mesh whose pieces `make` hands to its argument to `path`, as atomically as [`super::write()`].
///
/// A piece has vertices of its own, and faces that name these and those of earlier pieces by their number in the whole.
/// Positions are written as `float`, colors as bytes where the first piece has them, and nothing else.
///
/// # Errors
/// [`Error::Unsupported`] for an extension other than `.ply`, the first of `make`, and [`Error::Write`].
pub fn write_pieces(path: &Path, make: impl FnOnce(&mut dyn FnMut(&Mesh) -> Result<()>) -> Result<()>) -> Result<()> {
    if Format::from_path(path)? != (Format::Ply, Compression::None) {
        return Err(Error::Unsupported(format!("'{}': only PLY is written in pieces", path.display())));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let scratch = Scratch(folder).file()?;
    let failed = |source| Error::Write { path: path.to_path_buf(), source };
    let mut own_error = None;
    let written = output::atomically(path, |file| {
        let work = || {
            let mut writer = Writer { counts: [0; 2], colored: None, bytes: vec![b' '; HEADER_BYTES] };
            make(&mut |piece| {
                writer.vertices(piece, file).map_err(failed)?;
                writer.faces(piece, &mut &scratch.file).map_err(failed)
            })?;
            writer.finish(file, &scratch.file).map_err(failed)
        };
        work().map_err(|error| {
            own_error = Some(error);
            io::ErrorKind::Other.into()
        })
    });
    match own_error {
        Some(error) => Err(error),
        None => written.map_err(failed),
    }
}

struct Writer {
    counts: [usize; 2],
    /// Whether the first piece has colors.
    colored: Option<bool>,
    /// What waits to be written.
    bytes: Vec<u8>,
}

impl Writer {
    fn vertices(&mut self, piece: &Mesh, out: &mut File) -> io::Result<()> {
        let colored = *self.colored.get_or_insert(piece.colors.is_some());
        for (vertex, position) in piece.positions.iter().enumerate() {
            position.as_vec3().to_array().iter().for_each(|x| self.bytes.extend_from_slice(&x.to_le_bytes()));
            if colored {
                let color = piece.colors.as_ref().map_or([1.0; 4], |colors| colors[vertex]);
                self.bytes.extend_from_slice(&attributes::to_bytes(color));
            }
            self.pour(out, WRITTEN_BYTES)?;
        }
        self.counts[0] += piece.positions.len();
        self.pour(out, 1)
    }

    fn faces(&mut self, piece: &Mesh, out: &mut &File) -> io::Result<()> {
        for face in &piece.faces {
            self.bytes.push(3);
            face.iter().for_each(|corner| self.bytes.extend_from_slice(&corner.to_le_bytes()));
            self.pour(out, WRITTEN_BYTES)?;
        }
        self.counts[1] += piece.faces.len();
        self.pour(out, 1)
    }

    /// Writes what waits, from `least` bytes on.
    fn pour(&mut self, out: &mut impl Write, least: usize) -> io::Result<()> {
        if self.bytes.len() >= least {
            out.write_all(&self.bytes)?;
            self.bytes.clear();
        }
        Ok(())
    }

    /// Puts the faces behind the vertices, and the header in front.
    fn finish(self, out: &mut File, mut faces: &File) -> io::Result<()> {
        faces.rewind()?;
        io::copy(&mut faces, out)?;
        let [vertices, faces] = self.counts;
        let colors = if self.colored == Some(true) {
            ["red", "green", "blue", "alpha"].map(|name| format!("property uchar {name}\n")).concat()
        } else {
            String::new()
        };
        let before = "ply\nformat binary_little_endian 1.0\ncomment ";
        let after = format!(
            "\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n{colors}\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        );
        let filling = "-".repeat(HEADER_BYTES.saturating_sub(before.len() + after.len()));
        out.seek(SeekFrom::Start(0))?;
        out.write_all(format!("{before}{filling}{after}").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read;
    use crate::mesh::shapes;

    #[test]
    fn pieces_become_one_mesh() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("ball.ply");
        let ball = Mesh { colors: Some(vec![[1.0, 0.0, 0.0, 1.0]; 42]), ..shapes::icosphere(1) };
        let piece = |vertices: std::ops::Range<usize>, faces: std::ops::Range<usize>| Mesh {
            colors: ball.colors.as_ref().map(|rows| rows[vertices.clone()].to_vec()),
            ..Mesh::new(ball.positions[vertices].to_vec(), ball.faces[faces].to_vec())
        };
        write_pieces(&path, |piece_is| {
            piece_is(&piece(0..30, 0..0))?;
            piece_is(&piece(30..42, 0..80))
        })
        .expect("a writable folder");
        let back = read(&path).expect("a mesh");
        assert_eq!((&back.faces, &back.colors), (&ball.faces, &ball.colors));
        assert!(back.positions.iter().zip(&ball.positions).all(|(a, b)| *a == b.as_vec3().as_dvec3()));
        assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 1);
    }

    #[test]
    fn an_error_on_the_way_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = write_pieces(&folder.path().join("a.ply"), |_| Err(Error::Mesh("torn".into())));
        assert!(matches!(error, Err(Error::Mesh(_))));
        assert!(write_pieces(&folder.path().join("a.obj"), |_| Ok(())).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 0);
    }
}
