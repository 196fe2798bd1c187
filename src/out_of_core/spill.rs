//! The faces of every part, side by side in one file, and the vertices that several parts share.

use std::io::{Read, Seek, SeekFrom};

use rustc_hash::FxHashSet;

use super::bridges::key;
use super::cut::Cut;
use super::marks::Marks;
use super::rows::each_chunk;
use crate::error::{Error, Result};
use crate::formats::{Scratch, ScratchFile, Stream};

/// Bytes of a face in the file.
const FACE_BYTES: usize = 12;
/// Bytes that wait for the disk, of all parts together.
const WAITING_BYTES: usize = 16 << 20;

/// Faces sorted by part.
#[derive(Debug)]
pub struct Spill {
    scratch: ScratchFile,
}

impl Spill {
    /// Sorts the faces; adds to `frozen` the vertices at positions that several parts share.
    ///
    /// `frozen` may get a few more: all vertices of a face whose position lies in the cells of another part.
    ///
    /// # Errors
    /// Those of reading and writing.
    pub fn new(stream: &Stream, cut: &Cut, scratch: Scratch<'_>, frozen: &mut Marks) -> Result<Self> {
        let spill = Self { scratch: scratch.file()? };
        let waiting = WAITING_BYTES / cut.part_count().max(1) / FACE_BYTES * FACE_BYTES;
        let mut outlets: Vec<(u64, Vec<u8>)> =
            (0..cut.part_count()).map(|part| (cut.faces_of_part(part).start, Vec::new())).collect();
        let (mut room, mut faces) = (Vec::new(), Vec::new());
        each_chunk(stream.face_count(), |rows| {
            stream.faces(rows, &mut room, &mut faces)?;
            for &face in &faces {
                let part = cut.part(face);
                face.iter().filter(|&&v| cut.part_of_vertex(v) != part).for_each(|&v| frozen.insert(v));
                let (at, bytes) = &mut outlets[usize::from(part)];
                face.iter().for_each(|corner| bytes.extend_from_slice(&corner.to_ne_bytes()));
                if bytes.len() >= waiting {
                    spill.write(at, bytes)?;
                }
            }
            Ok(())
        })?;
        outlets.iter_mut().try_for_each(|(at, bytes)| spill.write(at, bytes))?;
        Ok(spill)
    }

    /// Writes faces to where `at` says, which moves on.
    fn write(&self, at: &mut u64, bytes: &mut Vec<u8>) -> Result<()> {
        let faces = bytes.len() / FACE_BYTES;
        self.seek(*at)?;
        self.scratch.write(bytes)?;
        *at += faces as u64;
        Ok(())
    }

    /// Reads the faces of a part.
    ///
    /// # Errors
    /// Those of the system.
    pub fn faces(&self, cut: &Cut, part: usize) -> Result<Vec<[u32; 3]>> {
        let range = cut.faces_of_part(part);
        let mut faces = vec![[0; 3]; (range.end - range.start) as usize];
        self.seek(range.start)?;
        (&self.scratch.file).read_exact(bytemuck::cast_slice_mut(&mut faces)).map_err(|e| self.failed(e))?;
        Ok(faces)
    }

    fn seek(&self, face: u64) -> Result<()> {
        let at = SeekFrom::Start(face * FACE_BYTES as u64);
        (&self.scratch.file).seek(at).map(drop).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: std::io::Error) -> Error {
        Error::Read { path: self.scratch.folder.clone(), source }
    }
}

/// Adds to `marks` all vertices at the positions of those in it.
///
/// # Errors
/// Those of reading.
pub fn mark_repeats(stream: &Stream, marks: &mut Marks) -> Result<()> {
    let (mut room, mut positions) = (Vec::new(), Vec::new());
    let mut marked = FxHashSet::default();
    each_chunk(stream.vertex_count(), |rows| {
        if marks.members(rows.clone()).next().is_some() {
            let first = rows.start;
            stream.positions(rows.clone(), &mut room, &mut positions)?;
            marked.extend(marks.members(rows).map(|v| key(positions[v as usize - first])));
        }
        Ok(())
    })?;
    each_chunk(stream.vertex_count(), |rows| {
        let first = rows.start as u32;
        stream.positions(rows, &mut room, &mut positions)?;
        (first..).zip(&positions).filter(|&(_, &p)| marked.contains(&key(p))).for_each(|(v, _)| marks.insert(v));
        Ok(())
    })
}
