//! The bytes of a file: mapped, or decompressed; and whether they look like the format at all.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Deref;
use std::path::Path;

use super::{Compression, Format, text};
use crate::error::{Error, Place, Result};

/// Uncompressed content.
pub(super) enum Content {
    Mapped(memmap2::Mmap),
    Owned(Vec<u8>),
}

impl Deref for Content {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Owned(bytes) => bytes,
        }
    }
}

/// Opens and decompresses `path`.
pub(super) fn open(path: &Path, format: Format, compression: Compression) -> Result<Content> {
    let stored = map_or_read(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
    Ok(match decompress(&stored, format, compression, u64::MAX)? {
        Some(bytes) => Content::Owned(bytes),
        None => stored,
    })
}

/// The bytes of a file.
pub(super) fn map_or_read(path: &Path) -> io::Result<Content> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if metadata.is_file() && metadata.len() > 0 {
        #[expect(unsafe_code, reason = "a map is the fastest way in; read() documents that the file must not shrink")]
        let map = unsafe { memmap2::Mmap::map(&file) };
        if let Ok(map) = map {
            return Ok(Content::Mapped(map));
        }
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(Content::Owned(bytes))
}

/// The first bytes of a stream are checked before the rest is decompressed.
const SNIFF_BYTES: u64 = 1 << 12;

/// The decompressed bytes, or `None` when nothing is to be done.
///
/// # Errors
/// [`Error::Format`] with the offset, counted after decompression, where the compressed data breaks; [`Error::Limit`] for
/// more than `most` bytes.
pub(super) fn decompress(
    stored: &[u8],
    format: Format,
    compression: Compression,
    most: u64,
) -> Result<Option<Vec<u8>>> {
    let (name, mut stream): (_, Box<dyn Read + '_>) = match compression {
        Compression::None => return Ok(None),
        Compression::Gzip => ("gzip", Box::new(flate2::read::MultiGzDecoder::new(stored))),
        Compression::Zstd => match zstd::stream::read::Decoder::with_buffer(stored) {
            Ok(decoder) => ("zstd", Box::new(decoder)),
            Err(source) => return Err(Error::Limit(format!("zstd decoder: {source}"))),
        },
    };
    let mut bytes = Vec::new();
    let broken = |bytes: &[u8], source: io::Error| {
        let found = if bytes.is_empty() { format!("found {}, ", describe(stored)) } else { String::new() };
        Error::format(name, Place::Byte(bytes.len() as u64), format!("{found}expected {name} data: {source}"))
    };
    if let Err(source) = (&mut stream).take(SNIFF_BYTES).read_to_end(&mut bytes) {
        return Err(broken(&bytes, source));
    }
    check_content(&bytes, format)?;
    // One more than allowed tells that there are more.
    let room = most.saturating_sub(bytes.len() as u64).saturating_add(1);
    if let Err(source) = stream.take(room).read_to_end(&mut bytes) {
        return Err(match source.kind() {
            io::ErrorKind::OutOfMemory => Error::Limit(format!("no memory for the decompressed file: {source}")),
            _ => broken(&bytes, source),
        });
    }
    if bytes.len() as u64 > most {
        return Err(Error::Limit(format!("it holds more than the {most} bytes that fit the memory")));
    }
    Ok(Some(bytes))
}

/// Checks the first bytes: empty files, other formats and other kinds of data are refused by what they are.
///
/// # Errors
/// [`Error::Format`] says what was found and what was expected.
pub(super) fn check_content(bytes: &[u8], format: Format) -> Result<()> {
    let expected = match format {
        Format::Obj => "lines of OBJ text",
        Format::Ply => "the line 'ply'",
        Format::Stl => "binary STL or a line that starts with 'solid'",
        Format::Off => "the keyword 'OFF'",
        Format::Gltf => "a JSON object",
        Format::Glb => "the letters 'glTF'",
    };
    let mismatch = || {
        let message = format!("found {}, expected {expected}", describe(bytes));
        Err(Error::format(format.name(), Place::Byte(0), message))
    };
    if bytes.is_empty() {
        return mismatch();
    }
    let found = recognize(bytes);
    let plausible = match format {
        Format::Ply => found == Kind::Mesh(Format::Ply),
        Format::Off => matches!(found, Kind::Mesh(Format::Off) | Kind::Text),
        Format::Obj => found == Kind::Text,
        Format::Glb => found == Kind::Mesh(Format::Glb),
        Format::Gltf => bytes.trim_ascii_start().starts_with(b"{") || bytes.starts_with(b"\xef\xbb\xbf"),
        // The 80 bytes before the facet count of a binary STL are free: anything may stand there.
        Format::Stl => matches!(found, Kind::Mesh(Format::Stl) | Kind::Binary) || super::stl::is_binary(bytes),
    };
    if plausible { Ok(()) } else { mismatch() }
}

#[derive(Debug, PartialEq, Eq)]
enum Kind {
    Mesh(Format),
    Known(&'static str),
    Text,
    Binary,
}

const GZIP: &[u8] = b"\x1f\x8b";
const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

impl Compression {
    /// How a file that starts with these bytes, four or more, is compressed. No format starts as a compressed one does.
    #[must_use]
    pub fn of_content(start: &[u8]) -> Self {
        if start.starts_with(GZIP) {
            Self::Gzip
        } else if start.starts_with(ZSTD) {
            Self::Zstd
        } else {
            Self::None
        }
    }
}

/// File signatures worth naming in an error.
const SIGNATURES: [(&[u8], &str); 7] = [
    (GZIP, "gzip data (name it .gz)"),
    (ZSTD, "zstd data (name it .zst)"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\x89PNG", "a PNG picture"),
    (b"{", "JSON or glTF text"),
    (b"<", "XML or HTML text"),
    (b"version https://git-lfs", "a Git LFS pointer, not the file itself"),
];

fn recognize(bytes: &[u8]) -> Kind {
    if let Some((_, name)) = SIGNATURES.iter().find(|(signature, _)| bytes.starts_with(signature)) {
        return Kind::Known(name);
    }
    let head = &bytes[..bytes.len().min(SNIFF_BYTES as usize)];
    let word = text::tokens(head).next().unwrap_or_default();
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") || (bytes.starts_with(b"ply ") && word == b"ply") {
        Kind::Mesh(Format::Ply)
    } else if bytes.starts_with(b"glTF") {
        Kind::Mesh(Format::Glb)
    } else if word.eq_ignore_ascii_case(b"solid") {
        Kind::Mesh(Format::Stl)
    } else if word.len() <= 6 && word.ends_with(b"OFF") {
        Kind::Mesh(Format::Off)
    } else if head.contains(&0) {
        Kind::Binary
    } else {
        Kind::Text
    }
}

fn describe(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "an empty file".into();
    }
    match recognize(bytes) {
        Kind::Mesh(format) => format!("{} data", format.name()),
        Kind::Known(name) => name.into(),
        Kind::Text => format!("text starting with {}", text::quote(text::first_line(bytes))),
        Kind::Binary => {
            let head: Vec<String> = bytes.iter().take(4).map(|b| format!("{b:02x}")).collect();
            format!("{} bytes of binary data starting with {}", bytes.len(), head.join(" "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_content_is_named() {
        for (bytes, format, found) in [
            (b"hello world\n" as &[u8], Format::Ply, "text starting with 'hello world'"),
            (b"", Format::Obj, "an empty file"),
            (b"ply\nformat", Format::Obj, "PLY data"),
            (b"OFF\n1 1 1", Format::Obj, "OFF data"),
            (b"\x1f\x8b\x08\0", Format::Off, "gzip data"),
            (b"v 0 0 0", Format::Stl, "text starting with 'v 0 0 0'"),
            (b"\0\x01\x02\x03\x04", Format::Obj, "5 bytes of binary data starting with 00 01 02 03"),
        ] {
            let message = check_content(bytes, format).unwrap_err().to_string();
            assert!(message.contains(&format!("found {found}")), "{message}");
        }
    }
}
