//! The plainer OBJ text that `tobj` is given.

use std::borrow::Cow;
use std::io::{self, BufRead, Read, Write};

use super::FORMAT;
use super::groups::{Groups, KEYWORDS};
use crate::error::{Error, Place, Result};
use crate::formats::attributes;
use crate::formats::text::{Lines, integer, number, quote, tokens};
use crate::math::Vec2;

/// Corners of a polygon of the prelude.
const PRELUDE_CORNERS: usize = 1024;

/// The mark of a corner without a texture coordinate.
const NO_TEXCOORD: u32 = u32::MAX;

/// The texture coordinates of a file, and which of them the corners of its faces use, in order.
#[derive(Debug, Default)]
pub(super) struct Texture {
    coordinates: Vec<Vec2>,
    corners: Vec<u32>,
}

impl Texture {
    /// The coordinates of all corners, zero where they have none; `None` when no corner has any.
    pub(super) fn of_corners(&self) -> Option<Vec<Vec2>> {
        let of = |&index: &u32| self.coordinates.get(index as usize).copied();
        self.corners.iter().any(|corner| of(corner).is_some()).then(|| {
            let corners = self.corners.iter();
            corners.map(|corner| of(corner).unwrap_or_default()).collect()
        })
    }
}

/// What a file holds, counted before it is parsed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) vertices: usize,
    pub(super) normals: usize,
    pub(super) texcoords: usize,
    /// Whether any vertex has a color.
    pub(super) colored: bool,
}

impl Counts {
    pub(super) fn of(bytes: &[u8]) -> Self {
        let mut counts = Self::default();
        for (_, line) in Statements::of(bytes) {
            match keyword(&line) {
                b"v" => {
                    counts.vertices += 1;
                    counts.colored |= tokens(&line).nth(6).is_some();
                }
                b"vn" => counts.normals += 1,
                b"vt" => counts.texcoords += 1,
                _ => {}
            }
        }
        counts
    }

    /// Polygons that [`Normalized`] puts before the file's own faces; their corners are all vertices in order.
    pub(super) fn prelude_faces(&self) -> usize {
        self.vertices.div_ceil(PRELUDE_CORNERS)
    }
}

/// A text with the same vertices, normals and faces, as `tobj` wants it.
///
/// It begins with faces whose corners are all vertices in order: `tobj` numbers vertices by their first use, so they
/// keep their number in the file, the unused ones too. It ends with a zero normal, which the corners without a normal
/// use: `tobj` would give them the one of the corner before. Texture coordinates are left out and collected here.
pub(super) struct Normalized<'a> {
    statements: Statements<'a>,
    totals: Counts,
    /// Vertices, normals and texture coordinates so far, to which negative indices are relative.
    seen: Counts,
    prelude_vertex: usize,
    has_epilogue: bool,
    buffer: Vec<u8>,
    read: usize,
    /// The line that stands in the buffer.
    pub(super) line: u64,
    pub(super) texture: Texture,
    pub(super) groups: Groups,
    /// Why the text ended early.
    pub(super) failure: Option<Error>,
}

impl<'a> Normalized<'a> {
    pub(super) fn new(bytes: &'a [u8], totals: Counts) -> Self {
        Self {
            statements: Statements::of(bytes),
            totals,
            seen: Counts::default(),
            prelude_vertex: 0,
            has_epilogue: totals.normals > 0,
            buffer: Vec::new(),
            read: 0,
            line: 0,
            texture: Texture::default(),
            groups: Groups::default(),
            failure: None,
        }
    }

    /// Puts the next line into the empty buffer; leaves it empty at the end.
    fn refill(&mut self) -> Result<()> {
        if self.prelude_vertex < self.totals.vertices {
            let end = self.totals.vertices.min(self.prelude_vertex + PRELUDE_CORNERS);
            self.buffer.push(b'f');
            for vertex in self.prelude_vertex..end {
                // Writing to a Vec does not fail.
                let _ = write!(self.buffer, " {}", vertex + 1);
            }
            self.prelude_vertex = end;
        } else {
            while let Some((line, text)) = self.statements.next() {
                self.line = line;
                match keyword(&text) {
                    b"v" => self.vertex(&text)?,
                    b"vn" => {
                        self.seen.normals += 1;
                        self.buffer.extend_from_slice(&text);
                    }
                    b"vt" => {
                        self.texcoord(&text)?;
                        continue;
                    }
                    b"f" => self.face(&text)?,
                    word => {
                        let name = &text.trim_ascii_start()[word.len()..];
                        self.groups.statement(word, name);
                        continue;
                    }
                }
                break;
            }
        }
        if self.buffer.is_empty() && std::mem::take(&mut self.has_epilogue) {
            self.buffer.extend_from_slice(b"vn 0 0 0");
        }
        if !self.buffer.is_empty() {
            self.buffer.push(b'\n');
        }
        Ok(())
    }

    fn error(&self, message: String) -> Error {
        Error::format(FORMAT, Place::Line(self.line), message)
    }

    /// Copies a vertex with exactly one color, white if it has none, when the file is colored.
    fn vertex(&mut self, text: &[u8]) -> Result<()> {
        self.seen.vertices += 1;
        let values = tokens(text).skip(1).count();
        match values {
            3 | 4 => {
                self.buffer.extend_from_slice(text);
                if self.totals.colored && values == 3 {
                    self.buffer.extend_from_slice(b" 1 1 1");
                } else if self.totals.colored {
                    return Err(self.error("found a vertex with a weight 'w' in a file with vertex colors".into()));
                }
            }
            6.. => {
                for (at, token) in tokens(text).take(7).enumerate() {
                    if at > 3 && !number(token).is_some_and(f64::is_finite) {
                        return Err(self.error(format!("found {}, expected a color channel", quote(token))));
                    }
                    self.buffer.extend_from_slice(token);
                    self.buffer.push(b' ');
                }
            }
            _ => {
                return Err(self.error(format!("found a vertex of {values} values, expected x y z [w] or x y z r g b")));
            }
        }
        Ok(())
    }

    /// Collects `vt u [v [w]]`.
    fn texcoord(&mut self, text: &[u8]) -> Result<()> {
        self.seen.texcoords += 1;
        let mut values = tokens(text).skip(1).map(number);
        match (values.next(), values.next().unwrap_or(Some(0.0))) {
            (Some(Some(u)), Some(v)) => self.texture.coordinates.push(attributes::texcoord(u, v)),
            _ => return Err(self.error("found a texture coordinate that is not u [v [w]], expected numbers".into())),
        }
        Ok(())
    }

    /// Copies a face whose indices are all in range.
    fn face(&mut self, text: &[u8]) -> Result<()> {
        let corner_count = tokens(text).skip(1).count();
        if corner_count < 3 {
            return Err(self.error(format!("found a face of {corner_count} corners, expected at least 3")));
        }
        self.groups.faces(corner_count - 2);
        self.buffer.push(b'f');
        for corner in tokens(text).skip(1) {
            let mut parts = corner.split(|&b| b == b'/');
            let (vertex, texcoord, normal) = (parts.next().unwrap_or_default(), parts.next(), parts.next());
            let vertex = self.resolve(corner, vertex, "vertex", self.seen.vertices, self.totals.vertices)?;
            let _ = write!(self.buffer, " {vertex}");
            if parts.next().is_some() {
                return Err(
                    self.error(format!("found the corner {}, expected v, v/vt, v//vn or v/vt/vn", quote(corner)))
                );
            }
            // Some exporters number texture coordinates that they do not write.
            if self.totals.texcoords > 0 {
                let what = "texture coordinate";
                let texcoord = match texcoord {
                    None | Some([]) => NO_TEXCOORD,
                    Some(index) => {
                        let number = self.resolve(corner, index, what, self.seen.texcoords, self.totals.texcoords)?;
                        u32::try_from(number - 1).unwrap_or(NO_TEXCOORD)
                    }
                };
                self.texture.corners.push(texcoord);
            }
            if self.totals.normals > 0 {
                let normal = match normal {
                    None | Some([]) => self.totals.normals + 1,
                    Some(index) => self.resolve(corner, index, "normal", self.seen.normals, self.totals.normals)?,
                };
                let _ = write!(self.buffer, "//{normal}");
            }
        }
        Ok(())
    }

    /// An index counted from 1, from one that may be relative to the end of what was `seen`.
    fn resolve(&self, corner: &[u8], index: &[u8], what: &str, seen: usize, total: usize) -> Result<usize> {
        let resolved = integer(index).map(|index| if index < 0 { index + seen as i64 + 1 } else { index });
        match resolved {
            Some(resolved @ 1..) if resolved as u64 <= total as u64 => Ok(resolved as usize),
            _ => Err(self.error(format!(
                "found the corner {}, expected a {what} index from 1 to {total} or from -{seen} to -1",
                quote(corner)
            ))),
        }
    }
}

impl Read for Normalized<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Normalized<'_> {
    /// One line at a time, so that the line in the buffer is the line `tobj` complains about.
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.buffer.len() {
            self.buffer.clear();
            self.read = 0;
            if let Err(error) = self.refill() {
                self.failure = Some(error);
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
        Ok(&self.buffer[self.read..])
    }

    fn consume(&mut self, count: usize) {
        self.read += count;
    }
}

/// The statements of a file with the number of their first line: lines, joined where one ends in `\`, without comments.
pub(super) struct Statements<'a> {
    lines: Lines<'a>,
}

impl<'a> Statements<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        Self { lines: Lines::after(0, bytes) }
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (u64, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let line = self.lines.next()?;
        // A name may have any letter.
        let is_name = KEYWORDS.contains(&keyword(line));
        let mut statement = Cow::Borrowed(if is_name { line } else { without_comment(line) });
        let first = self.lines.number;
        // A path or a name may end in a backslash, too.
        if matches!(keyword(&statement), b"v" | b"vn" | b"vt" | b"f") {
            while let Some(continued) = statement.trim_ascii_end().strip_suffix(b"\\") {
                let next = without_comment(self.lines.next().unwrap_or_default());
                statement = Cow::Owned([continued, b" ", next].concat());
            }
        }
        Some((first, statement))
    }
}

fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// The first word.
pub(super) fn keyword(statement: &[u8]) -> &[u8] {
    tokens(statement).next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normalized(text: &str) -> String {
        let mut out = String::new();
        Normalized::new(text.as_bytes(), Counts::of(text.as_bytes())).read_to_string(&mut out).unwrap();
        out
    }

    #[test]
    fn lines_are_joined_and_everything_else_dropped() {
        assert_eq!(
            normalized(
                "# a\nmtllib x\ng b\nv 0 0 \\\r\n 1\nv 1 0 0 # c\nvt 1\nv 0 1 0\nusemtl d\nf -3/1 2/-1 \\\n3/1\n"
            ),
            "f 1 2 3\nv 0 0   1\nv 1 0 0 \nv 0 1 0\nf 1 2 3\n"
        );
    }

    #[test]
    fn missing_colors_are_white_and_missing_normals_zero() {
        assert_eq!(
            normalized("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1 0.5\nvn 0 0 1\nf 1//1 2 3//-1\n"),
            "f 1 2 3\nv 0 0 0 1 0 0 \nv 1 0 0 1 1 1\nv 0 1 0 0 0 1 \nvn 0 0 1\nf 1//1 2//2 3//1\nvn 0 0 0\n"
        );
    }
}
