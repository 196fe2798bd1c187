//! Plain OBJ, read by all threads.
//!
//! Takes files in which every vertex, texture coordinate, normal and face is a whole line of good numbers, with indices in
//! range: nearly all there are. Anything else is left to `tobj`, which reads it or says what is wrong where. What both
//! read, they read to the same bits.

use rayon::prelude::*;

use super::normalize::Counts;
use super::read::{average_normals, unit_colors};
use crate::formats::attributes;
use crate::formats::polygon::Triangulator;
use crate::formats::text::{integer, number};
use crate::math::{DVec3, Vec2};
use crate::mesh::Mesh;

/// Bytes a thread parses at a time.
const CHUNK_BYTES: usize = 1 << 20;

/// Reads OBJ text if it is plain and has a face.
pub(super) fn read(bytes: &[u8]) -> Option<Mesh> {
    read_in_chunks(bytes, CHUNK_BYTES)
}

fn read_in_chunks(bytes: &[u8], chunk_bytes: usize) -> Option<Mesh> {
    let mut chunks = split(bytes, chunk_bytes).into_par_iter().map(Chunk::parse).collect::<Option<Vec<_>>>()?;
    let mut totals = Counts::default();
    let befores: Vec<Counts> = chunks
        .iter()
        .map(|chunk| {
            let before = totals;
            totals.vertices += chunk.positions.len();
            totals.texcoords += chunk.texcoords.len();
            totals.normals += chunk.normals.len();
            totals.colored |= !chunk.colors.is_empty();
            before
        })
        .collect();
    // What a weight among colors means is not known.
    if totals.colored && chunks.iter().any(|chunk| chunk.weighted) {
        return None;
    }
    chunks.par_iter_mut().zip(&befores).try_for_each(|(chunk, before)| chunk.resolve(before, &totals))?;
    let mesh = assemble(&chunks, totals);
    (!mesh.faces.is_empty()).then_some(mesh)
}

/// Cuts a text at line ends into pieces of about `chunk_bytes`.
fn split(mut rest: &[u8], chunk_bytes: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(rest.len() / chunk_bytes + 1);
    while !rest.is_empty() {
        let line_end = rest.iter().skip(chunk_bytes).position(|&b| b == b'\n');
        let (piece, next) = rest.split_at(line_end.map_or(rest.len(), |at| chunk_bytes + at + 1));
        pieces.push(piece);
        rest = next;
    }
    pieces
}

fn assemble(chunks: &[Chunk], totals: Counts) -> Mesh {
    let positions = chunks.iter().map(|chunk| chunk.positions.as_slice()).collect::<Vec<_>>().concat();
    let texcoords = chunks.iter().any(|chunk| chunk.texture.has_any()).then(|| {
        chunks.iter().map(|chunk| chunk.texcoords.as_slice()).collect::<Vec<_>>().concat()
    });
    let faces: Vec<_> = chunks.par_iter().map(|chunk| chunk.triangles(&positions, texcoords.as_deref())).collect();
    let mut mesh = Mesh::new(positions, Vec::with_capacity(faces.iter().map(|(faces, _)| faces.len()).sum()));
    mesh.texcoords = texcoords.map(|_| Vec::with_capacity(mesh.faces.capacity()));
    for (faces, rows) in faces {
        mesh.faces.extend(faces);
        mesh.texcoords.iter_mut().for_each(|texcoords| texcoords.extend(&rows));
    }
    if totals.colored {
        mesh.colors = Some(unit_colors(&chunks.iter().flat_map(Chunk::padded_colors).collect::<Vec<_>>()));
    }
    if totals.normals > 0 {
        let normals: Vec<DVec3> = chunks.iter().flat_map(|chunk| &chunk.normals).copied().collect();
        let direction = |index: Option<u32>| index.map_or(DVec3::ZERO, |index| normals[index as usize]);
        let corners = chunks.iter().flat_map(|chunk| {
            let vertices = chunk.vertices.values.iter().enumerate();
            vertices.map(|(at, &vertex)| (vertex, direction(chunk.shading.at(at))))
        });
        mesh.normals = average_normals(corners, mesh.positions.len());
    }
    mesh
}

/// What the lines of a piece of the file hold.
#[derive(Default)]
struct Chunk {
    positions: Vec<DVec3>,
    /// One for each vertex up to the last that has one.
    colors: Vec<[f64; 3]>,
    /// Whether any vertex has a weight.
    weighted: bool,
    texcoords: Vec<Vec2>,
    /// Unit length or zero.
    normals: Vec<DVec3>,
    /// The corners of each face up to the last that is no triangle.
    arities: Vec<usize>,
    face_count: usize,
    vertices: Indices,
    texture: Indices,
    shading: Indices,
}

/// The color of a vertex without one among colored ones.
const WHITE: [f64; 3] = [1.0; 3];

impl Chunk {
    fn parse(bytes: &[u8]) -> Option<Self> {
        let mut chunk = Self::default();
        let mut words = Words { rest: bytes };
        while !words.rest.is_empty() {
            match words.next() {
                Some(b"v") => chunk.vertex(words.numbers()?)?,
                Some(b"vt") => chunk.texcoord(words.numbers()?)?,
                Some(b"vn") => chunk.normal(words.numbers()?)?,
                Some(b"f") => chunk.face(&mut words)?,
                _ => {}
            }
            words.skip_line();
        }
        Some(chunk)
    }

    /// `x y z [w]` or `x y z r g b [a]`.
    fn vertex(&mut self, (values, count): ([f64; 7], usize)) -> Option<()> {
        let [x, y, z, w, ..] = values;
        let mut position = DVec3::new(x, y, z);
        match count {
            3 => {}
            4 => {
                position /= w;
                self.weighted = true;
            }
            6 | 7 => {
                self.colors.resize(self.positions.len(), WHITE);
                self.colors.push([values[3], values[4], values[5]]);
            }
            _ => return None,
        }
        self.positions.push(position);
        (position.is_finite() && values[3..6].iter().all(|value| value.is_finite())).then_some(())
    }

    /// `u [v [w]]`.
    fn texcoord(&mut self, ([u, v, _], count): ([f64; 3], usize)) -> Option<()> {
        self.texcoords.push(attributes::texcoord(u, v));
        (count > 0).then_some(())
    }

    fn normal(&mut self, (values, count): ([f64; 3], usize)) -> Option<()> {
        self.normals.push(DVec3::from(values).normalize_or_zero());
        (count == 3).then_some(())
    }

    fn face(&mut self, words: &mut Words<'_>) -> Option<()> {
        let first = self.vertices.values.len();
        while let Some(corner) = words.next() {
            let at = self.vertices.values.len();
            let mut parts = corner.split(|&b| b == b'/');
            let vertex = parts.next().filter(|vertex| !vertex.is_empty())?;
            self.vertices.push(at, vertex, self.positions.len())?;
            self.texture.push(at, parts.next().unwrap_or_default(), self.texcoords.len())?;
            self.shading.push(at, parts.next().unwrap_or_default(), self.normals.len())?;
            if parts.next().is_some() {
                return None;
            }
        }
        let arity = self.vertices.values.len() - first;
        if arity != 3 {
            self.arities.resize(self.face_count, 3);
            self.arities.push(arity);
        }
        self.face_count += 1;
        (arity >= 3).then_some(())
    }

    /// Makes all indices those of the whole file.
    fn resolve(&mut self, before: &Counts, totals: &Counts) -> Option<()> {
        self.vertices.resolve(before.vertices, totals.vertices)?;
        // Some exporters number texture coordinates and normals that they do not write.
        for (indices, before, total) in [
            (&mut self.texture, before.texcoords, totals.texcoords),
            (&mut self.shading, before.normals, totals.normals),
        ] {
            if total == 0 {
                *indices = Indices::default();
            }
            indices.resolve(before, total)?;
        }
        Some(())
    }

    /// The triangles of all faces and, of `texcoords`, the rows of their corners.
    fn triangles(&self, positions: &[DVec3], texcoords: Option<&[Vec2]>) -> (Vec<[u32; 3]>, Vec<[Vec2; 3]>) {
        let mut triangulator = Triangulator::new();
        let (mut faces, mut rows) = (Vec::with_capacity(self.face_count), Vec::new());
        let mut first = 0;
        for face in 0..self.face_count {
            let corners = &self.vertices.values[first..first + self.arities.get(face).unwrap_or(&3)];
            triangulator.split(corners, positions, |triangle| {
                faces.push(triangle.map(|i| corners[i]));
                if let Some(texcoords) = texcoords {
                    let texcoord = |index: u32| texcoords[index as usize];
                    rows.push(triangle.map(|i| self.texture.at(first + i).map(texcoord).unwrap_or_default()));
                }
            });
            first += corners.len();
        }
        (faces, rows)
    }

    /// A color for each vertex.
    fn padded_colors(&self) -> impl Iterator<Item = [f64; 3]> {
        let missing = self.positions.len() - self.colors.len();
        self.colors.iter().copied().chain(std::iter::repeat_n(WHITE, missing))
    }
}

/// The mark of a corner without an index.
const NONE: u32 = u32::MAX;

/// Indices of one kind, from 0, for each corner up to the last that has one.
#[derive(Default)]
struct Indices {
    values: Vec<u32>,
    /// Corners with an index that counts back from where it stands, and that index from the start of the chunk.
    relative: Vec<(usize, i64)>,
}

impl Indices {
    /// Adds the index that is written at corner `at`, if there is one, after `seen` rows of this chunk.
    fn push(&mut self, at: usize, written: &[u8], seen: usize) -> Option<()> {
        if written.is_empty() {
            return Some(());
        }
        self.values.resize(at, NONE);
        match integer(written)? {
            0 => return None,
            index if index < 0 => {
                self.relative.push((at, seen as i64 + index));
                self.values.push(NONE);
            }
            index => self.values.push(u32::try_from(index - 1).ok().filter(|&index| index != NONE)?),
        }
        Some(())
    }

    /// Replaces relative indices, of a chunk that comes after `before` rows of `total`; `None` when one is out of range.
    fn resolve(&mut self, before: usize, total: usize) -> Option<()> {
        for &(at, index) in &self.relative {
            self.values[at] = u32::try_from(before as i64 + index).ok()?;
        }
        self.values.iter().all(|&index| index == NONE || (index as usize) < total).then_some(())
    }

    fn at(&self, corner: usize) -> Option<u32> {
        self.values.get(corner).copied().filter(|&index| index != NONE)
    }

    fn has_any(&self) -> bool {
        !self.values.is_empty()
    }
}

/// The words of several lines.
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// The next word on this line before a comment.
    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|&b| b == b'\n' || !b.is_ascii_whitespace())?;
        self.rest = &self.rest[start..];
        let end = self.rest.iter().position(|&b| b == b'#' || b.is_ascii_whitespace()).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// The numbers up to the end of the line, zeros after them, and how many there are; at most `N`.
    fn numbers<const N: usize>(&mut self) -> Option<([f64; N], usize)> {
        let mut values = [0.0; N];
        let mut count = 0;
        while let Some(word) = self.next() {
            *values.get_mut(count)? = number(word)?;
            count += 1;
        }
        Some((values, count))
    }

    fn skip_line(&mut self) {
        let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |at| at + 1);
        self.rest = &self.rest[end..];
    }
}
