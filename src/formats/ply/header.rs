//! The header: parsed by `ply-rs-bw`, checked here for what a mesh needs.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, PropertyType};

use super::FORMAT;
use super::face::FaceLayout;
use super::scalar::{Order, Scalar};
use super::vertex::VertexLayout;
use crate::error::{Error, Place, Result};
use crate::formats::text::{Lines, quote};

/// How the rows are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Body {
    Text,
    Binary(Order),
}

/// What a header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) body: Body,
    pub(super) elements: Vec<Element>,
    /// The lines that are no part of the structure, as they stand.
    pub(super) comments: Vec<String>,
    /// Where the rows start, in bytes.
    pub(super) body_start: usize,
    /// Lines of the header.
    pub(super) lines: u64,
}

/// A kind of row.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) role: Role,
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// What a kind of row means to a mesh.
#[derive(Debug)]
pub(super) enum Role {
    Vertex(VertexLayout),
    Face(FaceLayout),
    Skipped,
}

/// One property of a row.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// The type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { length: Scalar, item: Scalar },
}

impl Element {
    /// The bytes of a binary row, or `None` when they vary.
    pub(super) fn row_bytes(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |bytes, property| match property.kind {
            Kind::Scalar(scalar) => Some(bytes + scalar.size()),
            Kind::List { .. } => None,
        })
    }

    /// The fewest bytes a row can have in this body: an empty list, or a digit and a separator for each number.
    fn least_row_bytes(&self, body: Body) -> u64 {
        let least = |property: &Property| match (body, property.kind) {
            (Body::Text, _) => 2,
            (Body::Binary(_), Kind::Scalar(scalar)) => scalar.size() as u64,
            (Body::Binary(_), Kind::List { length, .. }) => length.size() as u64,
        };
        self.properties.iter().map(least).sum()
    }
}

impl Header {
    /// Parses the header and checks that the bytes after it can hold what it promises.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self> {
        Self::parse_start(bytes, bytes.len() as u64)
    }

    /// The same of the first `bytes` of a file of `file_bytes`, which hold the header.
    pub(super) fn parse_start(bytes: &[u8], file_bytes: u64) -> Result<Self> {
        let body_start = header_bytes(bytes);
        // Comments may hold file names in any encoding.
        let text = String::from_utf8_lossy(&bytes[..body_start]);
        let mut reader = Reader::new(text.as_bytes());
        let parsed = Parser::<DefaultElement>::new().read_header(&mut reader);
        let line = reader.line() as u64;
        let parsed = parsed.map_err(|error| line_error(bytes, error.line().map_or(line, |line| line as u64)))?;
        let mut lines = Lines::after(0, &bytes[..body_start]);
        let property_lines = lines.by_ref().filter(|line| line.starts_with(b"property")).count();
        let element_lines = Lines::after(0, &bytes[..body_start]).filter(|line| line.starts_with(b"element")).count();
        let properties: usize = parsed.elements.values().map(|element| element.properties.len()).sum();
        if (element_lines, property_lines) != (parsed.elements.len(), properties) {
            let message = "two elements or two properties of an element have the same name";
            return Err(Error::format(FORMAT, Place::Line(lines.number), message));
        }
        let header = Self {
            body: match parsed.encoding {
                Encoding::Ascii => Body::Text,
                Encoding::BinaryLittleEndian => Body::Binary(Order::Little),
                Encoding::BinaryBigEndian => Body::Binary(Order::Big),
            },
            elements: parsed.elements.values().map(element).collect::<Result<_>>()?,
            comments: text.lines().filter(|line| is_comment(line)).map(Into::into).collect(),
            body_start,
            lines: lines.number,
        };
        header.check_elements()?;
        header.check_room(file_bytes - body_start as u64)?;
        Ok(header)
    }

    fn error(&self, message: String) -> Error {
        Error::format(FORMAT, Place::Line(self.lines), message)
    }

    /// A vertex element must be there and stand before the faces.
    fn check_elements(&self) -> Result<()> {
        let place = |wanted: fn(&Role) -> bool| self.elements.iter().position(|element| wanted(&element.role));
        let vertex = place(|role| matches!(role, Role::Vertex(_)));
        let face = place(|role| matches!(role, Role::Face(_)));
        match (vertex, face) {
            (Some(vertex), Some(face)) if vertex < face => Ok(()),
            (Some(_), Some(_)) => {
                Err(self.error("the element 'face' stands before 'vertex', expected after it".into()))
            }
            (None, _) => Err(self.error("found no element 'vertex'".into())),
            (_, None) if self.elements.iter().any(|element| element.name == "tristrips") => {
                Err(Error::Unsupported("PLY with triangle strips ('tristrips'); save it with faces".into()))
            }
            (_, None) => Err(self.error("no faces: found no element 'face'".into())),
        }
    }

    /// A count that the file cannot hold is refused before anything is allocated for it.
    fn check_room(&self, body_bytes: u64) -> Result<()> {
        // The last line may lack its end.
        let room = if self.body == Body::Text { body_bytes + 1 } else { body_bytes };
        let mut least = 0_u64;
        for element in &self.elements {
            least = least.saturating_add(element.count.saturating_mul(element.least_row_bytes(self.body)));
            if least > room {
                return Err(self.error(format!(
                    "the header promises {} rows of '{}', more than the {body_bytes} bytes after it can hold",
                    element.count, element.name
                )));
            }
        }
        Ok(())
    }
}

fn is_comment(line: &str) -> bool {
    matches!(line.split_whitespace().next(), Some("comment" | "obj_info"))
}

/// Far more than any header has.
pub(super) const MOST_HEADER_BYTES: usize = 1 << 20;

/// The bytes up to the end of the line 'end_header', or those of a text that may be a header without its end.
fn header_bytes(bytes: &[u8]) -> usize {
    let head = &bytes[..bytes.len().min(MOST_HEADER_BYTES)];
    let mut lines = Lines::after(0, head);
    for line in lines.by_ref() {
        if line.trim_ascii_end() == b"end_header" {
            break;
        }
    }
    head.len() - lines.rest().len()
}

fn line_error(bytes: &[u8], line: u64) -> Error {
    let expected = match line {
        0 | 1 => "the line 'ply'",
        _ => "a line of a PLY header (format, comment, obj_info, element, property) or 'end_header'",
    };
    let found = match Lines::after(0, bytes).nth(line.saturating_sub(1) as usize) {
        Some(text) => quote(text),
        None => "the end of the file".into(),
    };
    Error::format(FORMAT, Place::Line(line.max(1)), format!("found {found}, expected {expected}"))
}

fn element(parsed: &ElementDef) -> Result<Element> {
    let properties: Vec<Property> = parsed
        .properties
        .values()
        .map(|property| Property {
            name: property.name.clone(),
            kind: match &property.data_type {
                PropertyType::Scalar(scalar) => Kind::Scalar(scalar.into()),
                PropertyType::List(length, item) => Kind::List { length: length.into(), item: item.into() },
            },
        })
        .collect();
    let role = match parsed.name.as_str() {
        "vertex" => Role::Vertex(VertexLayout::of(&properties)?),
        "face" => Role::Face(FaceLayout::of(&properties)?),
        _ => Role::Skipped,
    };
    Ok(Element { role, name: parsed.name.clone(), count: parsed.count as u64, properties })
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: &str = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                        element face 1\nproperty list uchar int vertex_indices\nend_header\n";

    fn message(header: &str) -> String {
        Header::parse(header.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn lines_that_are_not_ply_are_quoted() {
        assert_eq!(
            message("ply\nformat ascii 1.0\nproprty float x\n"),
            "PLY line 3: found 'proprty float x', expected a line of a PLY header \
             (format, comment, obj_info, element, property) or 'end_header'"
        );
        assert!(message("ply\nformat ascii 1.0\n").starts_with("PLY line 3: found the end of the file"));
        assert!(message("ply\nformat ascii 1.0\ncomment \u{7f}\nelement vertex -1\n").starts_with("PLY line 4: found"));
    }

    #[test]
    fn promises_are_checked_against_the_length() {
        let header = format!("ply\nformat binary_little_endian 1.0\n{REST}");
        let lying = header.replace("vertex 1\n", "vertex 4000000000\n");
        assert_eq!(
            message(&lying),
            "PLY line 9: the header promises 4000000000 rows of 'vertex', more than the 0 bytes after it can hold"
        );
        let wrapping = header.replace("vertex 1\n", "vertex 18446744073709551615\n");
        assert!(message(&wrapping).contains("18446744073709551615 rows"), "{}", message(&wrapping));
    }

    #[test]
    fn repeated_properties_do_not_shift_the_rows() {
        let twice = format!("ply\nformat ascii 1.0\n{REST}").replace("float y", "float x");
        assert!(message(&twice).contains("the same name"), "{}", message(&twice));
    }
}
