//! Where JSON and bytes lie: in a GLB, beside each other, or the bytes in the JSON.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use serde_json::Value;

use super::FORMAT;
use super::json::Json;
use crate::error::{Error, Place, Result};
use crate::formats::Format;
use crate::formats::looks::{path_beside, read_whole};

/// Reads base64 with and without the padding, and with stray bits, as writers leave them.
pub(super) const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

const MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// How the bytes of a buffer came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Origin {
    /// The binary chunk of a GLB.
    Chunk,
    /// In the JSON itself.
    Data,
    /// A file of its own.
    File(PathBuf),
}

/// The bytes of a buffer; none where an extension is to make them.
#[derive(Debug)]
pub(super) struct Buffer<'a> {
    pub(super) bytes: Option<Cow<'a, [u8]>>,
    pub(super) origin: Origin,
}

/// The JSON of a file, and the binary chunk where it has one.
pub(super) fn parse(bytes: &[u8], format: Format) -> Result<(Value, Option<&[u8]>)> {
    let (text, start, chunk) = match format {
        Format::Glb => {
            let (text, chunk) = chunks(bytes)?;
            (text, 20, chunk)
        }
        _ => (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), 0, None),
    };
    let json: Value = serde_json::from_slice(text).map_err(|error| {
        // A GLB's JSON has no lines to speak of.
        let place = if start == 0 { Place::Line(error.line() as u64) } else { Place::Byte(start) };
        Error::format(FORMAT, place, format!("the JSON does not parse: {error}"))
    })?;
    let root = Json::root(&json);
    let version = root.need("asset")?.text("version")?.unwrap_or_default().to_string();
    if !version.starts_with("2.") {
        return Err(Error::Unsupported(format!("glTF of version '{version}': save it as glTF 2.0")));
    }
    let needed = root.need("asset")?.text("minVersion")?.unwrap_or(&version);
    if !matches!(needed, "2.0" | "2.1") && needed != version {
        let message =
            format!("glTF {version} that only a reader of version '{needed}' understands: save it as glTF 2.0");
        return Err(Error::Unsupported(message));
    }
    Ok((json, chunk))
}

/// The JSON chunk of a GLB, and its binary chunk.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let error = |at: usize, message: String| Error::format(FORMAT, Place::Byte(at as u64), message);
    let word = |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(error(bytes.len(), "the file ends in its header of 12 bytes".into()));
    };
    if version != 2 {
        return Err(Error::Unsupported(format!("GLB of version {version}: save it as version 2")));
    }
    if length as usize > bytes.len() {
        return Err(error(8, format!("the header promises {length} bytes, the file has {}", bytes.len())));
    }
    let bytes = &bytes[..(length as usize).max(12)];
    let (mut at, mut json, mut binary) = (12, None, None);
    while at < bytes.len() {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else { break };
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)) else {
            let left = bytes.len().saturating_sub(at + 8);
            return Err(error(at, format!("a chunk of {size} bytes, {left} are left")));
        };
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BINARY_CHUNK if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at += 8 + size as usize;
    }
    json.map(|json| (json, binary)).ok_or_else(|| error(12, "found no JSON chunk".into()))
}

/// The bytes of all buffers; those in files lie in `folder`.
pub(super) fn load<'a>(json: &Value, chunk: Option<&'a [u8]>, folder: Option<&Path>) -> Result<Vec<Buffer<'a>>> {
    let buffers = Json::root(json).elements("buffers")?;
    buffers.iter().enumerate().map(|(index, buffer)| load_one(index, buffer, chunk, folder)).collect()
}

fn load_one<'a>(index: usize, json: &Json<'_>, chunk: Option<&'a [u8]>, folder: Option<&Path>) -> Result<Buffer<'a>> {
    let length = json.need("byteLength")?.whole()?;
    let (bytes, origin): (Cow<'a, [u8]>, _) = match json.text("uri")? {
        None => match chunk.filter(|_| index == 0) {
            Some(chunk) => (chunk.into(), Origin::Chunk),
            None => return Ok(Buffer { bytes: None, origin: Origin::Chunk }),
        },
        Some(uri) => match data_of(uri) {
            Some(data) => (decode(json, data)?.into(), Origin::Data),
            None => {
                let path = locate(json, uri, folder)?;
                (read_whole(path.clone())?.into(), Origin::File(path))
            }
        },
    };
    if bytes.len() < length {
        return Err(json.error(format!("promises {length} bytes, there are {}", bytes.len())));
    }
    // What stands behind is padding.
    let bytes = match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
        Cow::Owned(mut bytes) => {
            bytes.truncate(length);
            Cow::Owned(bytes)
        }
    };
    Ok(Buffer { bytes: Some(bytes), origin })
}

/// What follows the `data:` of a data URI; the names of schemes have no case (RFC 3986, 3.1).
pub(super) fn data_of(uri: &str) -> Option<&str> {
    uri.split_at_checked(5).filter(|(scheme, _)| scheme.eq_ignore_ascii_case("data:")).map(|(_, data)| data)
}

/// The bytes of a data URI behind its `data:`.
pub(super) fn decode(json: &Json<'_>, data: &str) -> Result<Vec<u8>> {
    let is_base64 = |kind: &str| kind.to_ascii_lowercase().ends_with(";base64");
    let encoded = data.split_once(',').filter(|(kind, _)| is_base64(kind)).map(|(_, encoded)| encoded);
    let Some(encoded) = encoded else { return Err(json.error("found a data URI that is not base64")) };
    BASE64.decode(encoded).map_err(|error| json.error(format!("the data URI does not decode: {error}")))
}

/// The file that a relative URI names.
pub(super) fn read_beside(json: &Json<'_>, uri: &str, folder: Option<&Path>) -> Result<Vec<u8>> {
    read_whole(locate(json, uri, folder)?)
}

/// The path of that file.
fn locate(json: &Json<'_>, uri: &str, folder: Option<&Path>) -> Result<PathBuf> {
    let shown = crate::formats::text::quote(uri.as_bytes());
    let Some(folder) = folder else {
        let message = format!("{shown} lies in a file of its own, which a stream has not: give a path");
        return Err(Error::Unsupported(format!("glTF {}: {message}", json.path)));
    };
    Ok(folder.join(name_beside(json, uri)?))
}

/// The name of the file that a relative URI names.
pub(super) fn name_beside(json: &Json<'_>, uri: &str) -> Result<String> {
    let name = percent_decoded(uri).filter(|name| !uri.contains("://") && path_beside(Path::new(""), name).is_some());
    let shown = crate::formats::text::quote(uri.as_bytes());
    name.ok_or_else(|| json.error(format!("found the URI {shown}, expected a relative one")))
}

/// A text with its `%20` and the like decoded; `None` where they are not UTF-8.
fn percent_decoded(text: &str) -> Option<String> {
    let digit = |byte: Option<&u8>| byte.and_then(|&byte| char::from(byte).to_digit(16));
    let bytes = text.as_bytes();
    let (mut decoded, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while at < bytes.len() {
        match (bytes[at], digit(bytes.get(at + 1)), digit(bytes.get(at + 2))) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(decoded).ok()
}

/// A name as a URI.
pub(super) fn percent_encoded(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    name.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// A GLB of this JSON and these bytes; `None` when it is larger than a GLB can be.
pub(super) fn glb(json: &Value, binary: &[u8]) -> Option<Vec<u8>> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let padded = binary.len().next_multiple_of(4);
    let with_binary = if binary.is_empty() { 0 } else { 8 + padded };
    let total = u32::try_from(20 + text.len() + with_binary).ok()?;
    let mut bytes = Vec::with_capacity(total as usize);
    let mut push = |part: &[u8]| bytes.extend_from_slice(part);
    push(MAGIC);
    [2, total, text.len() as u32, JSON_CHUNK].iter().for_each(|word| push(&word.to_le_bytes()));
    push(&text);
    if !binary.is_empty() {
        [padded as u32, BINARY_CHUNK].iter().for_each(|word| push(&word.to_le_bytes()));
        push(binary);
    }
    bytes.resize(total as usize, 0);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scheme_has_no_case() {
        assert_eq!(data_of("data:,x"), Some(",x"));
        assert_eq!(data_of("DaTa:;BASE64,AA"), Some(";BASE64,AA"));
        assert_eq!([data_of("data"), data_of("dätas:"), data_of("datum:,x"), data_of("")], [None; 4]);
        let json = Value::Null;
        assert_eq!(decode(&Json::root(&json), ";BASE64,AA").unwrap(), [0]);
        assert!(decode(&Json::root(&json), ";base32,AA").is_err());
    }

    #[test]
    fn names_survive_as_uris() {
        for name in ["plain.bin", "with space & more%.bin", "größe.bin"] {
            let uri = percent_encoded(name);
            assert!(uri.is_ascii() && !uri.contains(' '), "{uri}");
            assert_eq!(percent_decoded(&uri).as_deref(), Some(name));
        }
        assert_eq!(percent_decoded("%ff"), None);
        assert_eq!(percent_decoded("%2").as_deref(), Some("%2"));
    }
}
