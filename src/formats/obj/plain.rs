//! Plain OBJ, read by all threads.
//!
//! Takes files in which every vertex, texture coordinate, normal and face is a whole line of good numbers, with indices in
//! range: nearly all there are. Anything else is left to `tobj`, which reads it or says what is wrong where. What both
//! read, they read to the same bits.

use rayon::prelude::*;

use super::groups::{Groups, KEYWORDS, skipped};
use super::normalize::Counts;
use super::read::unit_colors;
use super::words::{Indices, NONE, Words};
use super::{Libraries, shading};
use crate::formats::attributes;
use crate::formats::polygon::Triangulator;
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{Materials, Mesh};

/// Bytes a thread parses at a time.
const CHUNK_BYTES: usize = 1 << 20;

/// Reads OBJ text if it is plain and has a face.
pub(super) fn read(bytes: &[u8]) -> Option<(Mesh, Libraries)> {
    read_in_chunks(bytes, CHUNK_BYTES)
}

fn read_in_chunks(bytes: &[u8], chunk_bytes: usize) -> Option<(Mesh, Libraries)> {
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
    let (libraries, materials) = grouped(&chunks);
    let mesh = Mesh { materials, ..assemble(&chunks, totals) };
    (!mesh.faces.is_empty()).then_some((mesh, libraries))
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

/// The libraries and materials that the statements between the faces tell.
fn grouped(chunks: &[Chunk<'_>]) -> (Libraries, Option<Materials>) {
    let mut groups = Groups::default();
    for chunk in chunks {
        chunk.skipped.iter().for_each(|what| groups.skip(what));
        let arity = |face: usize| chunk.arities.get(face).copied().unwrap_or(3);
        let mut next = 0;
        for &(face, keyword, name) in &chunk.statements {
            groups.faces((next..face).map(|face| arity(face) - 2).sum());
            groups.statement(keyword, name);
            next = face;
        }
        groups.faces((next..chunk.face_count).map(|face| arity(face) - 2).sum());
    }
    groups.finish()
}

fn assemble(chunks: &[Chunk<'_>], totals: Counts) -> Mesh {
    let positions = chunks.iter().map(|chunk| chunk.positions.as_slice()).collect::<Vec<_>>().concat();
    let texcoords = chunks
        .iter()
        .any(|chunk| chunk.texture.has_any())
        .then(|| chunks.iter().map(|chunk| chunk.texcoords.as_slice()).collect::<Vec<_>>().concat());
    let is_shaded = chunks.iter().any(|chunk| chunk.shading.has_any());
    let parts: Vec<_> =
        chunks.par_iter().map(|chunk| chunk.triangles(&positions, texcoords.as_deref(), is_shaded)).collect();
    let mut mesh = Mesh::new(positions, Vec::with_capacity(parts.iter().map(|part| part.faces.len()).sum()));
    mesh.texcoords = texcoords.map(|_| Vec::with_capacity(mesh.faces.capacity()));
    let mut shading = Vec::with_capacity(if is_shaded { mesh.faces.capacity() } else { 0 });
    for part in parts {
        mesh.faces.extend(part.faces);
        mesh.texcoords.iter_mut().for_each(|texcoords| texcoords.extend(&part.texcoords));
        shading.extend(part.shading);
    }
    if totals.colored {
        mesh.colors = Some(unit_colors(&chunks.iter().flat_map(Chunk::padded_colors).collect::<Vec<_>>()));
    }
    if is_shaded {
        let normals: Vec<Vec3> = chunks.iter().flat_map(|chunk| &chunk.normals).copied().collect();
        shading::shade(&mut mesh, &shading, &normals);
    }
    mesh
}

/// The triangles of a chunk; texture coordinates and numbers of normals where the file has any.
struct Triangles {
    faces: Vec<[u32; 3]>,
    texcoords: Vec<[Vec2; 3]>,
    shading: Vec<[u32; 3]>,
}

/// What the lines of a piece of the file hold.
#[derive(Default)]
struct Chunk<'a> {
    positions: Vec<DVec3>,
    /// One for each vertex up to the last that has one.
    colors: Vec<[f64; 3]>,
    /// Whether any vertex has a weight.
    weighted: bool,
    texcoords: Vec<Vec2>,
    /// Unit length or zero.
    normals: Vec<Vec3>,
    /// The corners of each face up to the last that is no triangle.
    arities: Vec<usize>,
    face_count: usize,
    /// Those of [`KEYWORDS`], with the faces before them.
    statements: Vec<(usize, &'a [u8], &'a [u8])>,
    /// Elements that are passed over.
    skipped: Vec<&'static str>,
    vertices: Indices,
    texture: Indices,
    shading: Indices,
}

/// The color of a vertex without one among colored ones.
const WHITE: [f64; 3] = [1.0; 3];

impl<'a> Chunk<'a> {
    fn parse(bytes: &'a [u8]) -> Option<Self> {
        let mut chunk = Self::default();
        let mut words = Words { rest: bytes };
        while !words.rest.is_empty() {
            match words.next() {
                Some(b"v") => chunk.vertex(words.numbers()?)?,
                Some(b"vt") => chunk.texcoord(words.numbers()?)?,
                Some(b"vn") => chunk.normal(words.numbers()?)?,
                Some(b"f") => chunk.face(&mut words)?,
                Some(word) if KEYWORDS.contains(&word) => chunk.statements.push((chunk.face_count, word, words.name())),
                Some(word) => chunk.skip(word),
                None => {}
            }
            words.skip_line();
        }
        Some(chunk)
    }

    /// Notes an element that is passed over, once a piece.
    fn skip(&mut self, word: &[u8]) {
        if let Some(what) = skipped(word)
            && !self.skipped.contains(&what)
        {
            self.skipped.push(what);
        }
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
        self.normals.push(shading::unit(DVec3::from(values)));
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

    /// The triangles of all faces.
    fn triangles(&self, positions: &[DVec3], texcoords: Option<&[Vec2]>, is_shaded: bool) -> Triangles {
        let mut triangulator = Triangulator::new();
        let mut made =
            Triangles { faces: Vec::with_capacity(self.face_count), texcoords: Vec::new(), shading: Vec::new() };
        let mut first = 0;
        for face in 0..self.face_count {
            let corners = &self.vertices.values[first..first + self.arities.get(face).unwrap_or(&3)];
            triangulator.split(corners, positions, |triangle| {
                made.faces.push(triangle.map(|i| corners[i]));
                if let Some(texcoords) = texcoords {
                    let texcoord = |index: u32| texcoords[index as usize];
                    let row = triangle.map(|i| self.texture.at(first + i).map(texcoord).unwrap_or_default());
                    made.texcoords.push(row);
                }
                if is_shaded {
                    made.shading.push(triangle.map(|i| self.shading.at(first + i).unwrap_or(NONE)));
                }
            });
            first += corners.len();
        }
        made
    }

    /// A color for each vertex.
    fn padded_colors(&self) -> impl Iterator<Item = [f64; 3]> {
        let missing = self.positions.len() - self.colors.len();
        self.colors.iter().copied().chain(std::iter::repeat_n(WHITE, missing))
    }
}

#[cfg(test)]
mod tests {
    use std::env;
    use std::fmt::Write;
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::*;
    use crate::formats::obj::read::read_any;

    /// All bits of a mesh: zeros of either sign differ.
    fn bits(mesh: &Mesh) -> [Option<Vec<u64>>; 6] {
        fn single<'a>(values: impl Iterator<Item = &'a f32>) -> Vec<u64> {
            values.map(|value| u64::from(value.to_bits())).collect()
        }
        [
            Some(mesh.positions.iter().flat_map(|p| p.to_array().map(f64::to_bits)).collect()),
            Some(mesh.faces.iter().flatten().map(|&vertex| u64::from(vertex)).collect()),
            mesh.normals.as_ref().map(|rows| single(rows.iter().flat_map(|row| row.as_ref()))),
            mesh.colors.as_ref().map(|rows| single(rows.iter().flatten())),
            mesh.texcoords.as_ref().map(|rows| single(rows.iter().flatten().flat_map(|row| row.as_ref()))),
            mesh.materials.as_ref().map(|materials| materials.of_face.iter().map(|&number| number.into()).collect()),
        ]
    }

    /// Whether the text is plain, whatever the chunks; then `tobj` must agree on every bit.
    fn is_plain(text: &[u8], name: &str) -> bool {
        let meshes = [1, 33, CHUNK_BYTES].map(|chunk_bytes| read_in_chunks(text, chunk_bytes));
        assert!(meshes.iter().all(|mesh| mesh.is_some() == meshes[0].is_some()), "{name}: depends on the chunks");
        for (mesh, libraries) in meshes.iter().flatten() {
            let (expected, of_any) =
                read_any(text).unwrap_or_else(|error| panic!("{name} was read, expected: {error}"));
            assert!(bits(mesh) == bits(&expected), "{name}:\n{}", String::from_utf8_lossy(text));
            assert!(mesh.materials == expected.materials && *libraries == of_any, "{name}: names");
        }
        meshes[0].is_some()
    }

    /// A grid of quads and triangles, each row after its vertices. The bits of `kind` add colors, texture coordinates,
    /// normals, indices from the end, and line ends, comments and groups of other programs.
    fn grid(kind: u32) -> String {
        const SIDE: i64 = 12;
        let has = |bit: u32| kind >> bit & 1 == 1;
        let mut text = String::from("# grid\n");
        for row in 0..SIDE {
            for column in 0..SIDE {
                let (x, y) = (column as f64 / 7.0, row as f64 * 0.3);
                let color = if has(0) && column % 3 > 0 { format!(" 0.5 {} 1e-1", x / 2.0) } else { String::new() };
                let weight = if !has(0) && column == 5 { " 3" } else { "" };
                let _ = writeln!(text, "v {x} {y} -{}{color}{weight}", x * y);
                let _ = if has(1) { writeln!(text, "vt {y} -{x}") } else { Ok(()) };
                let _ = if has(2) { writeln!(text, "vn {x} 0 {}", 5 * (column % 2)) } else { Ok(()) };
            }
            let seen = SIDE * (row + 1);
            for at in (SIDE * (row - 1)..SIDE * row - 1).filter(|&at| at >= 0) {
                let corner = |vertex: i64| {
                    let index = if has(3) && vertex % 2 == 0 { vertex - seen } else { vertex + 1 };
                    match (at % 5 > 0, has(1), has(2)) {
                        (true, true, true) => format!("{index}/{index}/{index}"),
                        (true, true, false) => format!("{index}/{index}"),
                        (true, false, true) => format!("{index}//{index}"),
                        _ => format!("{index}"),
                    }
                };
                let [a, b, c, d] = [at, at + 1, at + SIDE + 1, at + SIDE].map(corner);
                let _ = match at % 3 {
                    0 => writeln!(text, "f {a} {b} {c} {d}"),
                    _ => writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}"),
                };
            }
        }
        if has(4) {
            text.replace('\n', " \t# end\r\ng\ts\r\n\r\n").replace("\nv 0", "\nusemtl a # b\nv 0")
        } else {
            text
        }
    }

    #[test]
    fn both_routes_read_the_same_bits() {
        for kind in 0..32 {
            assert!(is_plain(grid(kind).as_bytes(), &format!("grid {kind}")));
        }
        let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/models");
        let models = env::var_os("COARSEN_MODELS").map_or_else(|| PathBuf::from(beside), PathBuf::from);
        for (folder, least) in [(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus"), 7), (models, 0)] {
            let files = obj_files(&folder);
            let plain = files.iter().filter(|path| is_plain(&fs::read(path).unwrap(), &path.display().to_string()));
            assert!(plain.count() >= least, "{} holds {} files", folder.display(), files.len());
        }
    }

    fn obj_files(folder: &Path) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
        let paths = entries.map(|entry| entry.unwrap().path());
        let nested = paths.flat_map(|path| if path.is_dir() { obj_files(&path) } else { vec![path] });
        // What takes seconds with chunks of a line is left out.
        let small = |path: &PathBuf| fs::metadata(path).is_ok_and(|metadata| metadata.len() < 1 << 20);
        nested.filter(|path| path.extension().is_some_and(|extension| extension == "obj") && small(path)).collect()
    }

    /// Words in place of others: where the general route refuses or reads something else, this one must not differ.
    #[test]
    fn both_routes_agree_on_mutated_files() {
        const WORDS: [&str; 28] = [
            "nan",
            "-inf",
            "1e999",
            "-0",
            "0",
            "+1",
            "4294967296",
            "9223372036854775808",
            "/",
            "//",
            "1/1",
            "1//1/",
            "\\",
            "\\\n",
            "\n",
            "\r",
            "\x0b",
            "#",
            "f",
            "v 1 2 3 4",
            "vt 1 2 3 4",
            "vn 0 0 1 1",
            "v 0 0 0 1 1 1 0.5",
            "\u{a0}",
            "\nusemtl a#b\n",
            "\nusemtl#b\n",
            "\ng\n",
            "\nmtllib x y\n",
        ];
        let mut state = 1_u64;
        let mut below = |bound: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) % bound as u64) as usize
        };
        let mut plain = 0;
        for round in 0..3000 {
            let text = grid(below(32) as u32);
            let mut text = text.into_bytes();
            for _ in 0..1 + below(2) {
                let at = below(text.len());
                let space = text[at..].iter().position(|b| *b == b' ').map_or(text.len(), |space| at + space);
                let end = text.len().min(space + below(4));
                text.splice(space..end, format!(" {}", WORDS[below(WORDS.len())]).into_bytes());
            }
            plain += usize::from(is_plain(&text, &format!("round {round}")));
        }
        assert!((300..2700).contains(&plain), "{plain} of 3000 are plain");
    }

    #[test]
    fn what_is_not_plain_is_left() {
        let rest = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!(is_plain(rest.as_bytes(), "good"));
        for line in [
            "f 1 2 \\\n3",
            "f 1 2 4",
            "f 1 2 0",
            "f -4 2 3",
            "f /1 2 3",
            "f 1 2",
            "f 1/1/1/1 2 3",
            "f 4294967296 2 3",
            "v 0 0",
            "v 0 0 inf",
            "v 0 0 0 0",
            "v 0 0 0 1 1",
            "v 0 0 0 1 1 nan",
            "vn 0 0",
            "vn 0 0 1 0",
            "vt",
            "vt 0 0 0 0",
            "v#",
            "v 0 0 0 1 0 0\nv 1 1 1 2",
        ] {
            assert!(!is_plain(format!("{rest}{line}\n").as_bytes(), line), "{line}");
        }
        assert!(!is_plain(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no face"));
    }
}
