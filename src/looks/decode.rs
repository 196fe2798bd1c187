//! PNG and JPEG to texels.

use std::io::Cursor;

use png::{ColorType, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::image::checked_size;
use crate::error::{Error, Place, Result};

/// Width, height and texels of a picture, in rows from above.
pub(super) type Texels = (usize, usize, Vec<[u8; 4]>);

/// Decodes a picture of at most so many texels; which kind it is, its first bytes tell.
pub(super) fn decode(bytes: &[u8], most: u64) -> Result<Texels> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes, most),
        [0xff, 0xd8, ..] => jpeg(bytes, most),
        _ => Err(Error::Unsupported("a picture that is neither PNG nor JPEG".into())),
    }
}

fn png(bytes: &[u8], most: u64) -> Result<Texels> {
    let broken = |error: png::DecodingError| Error::format("PNG", Place::File, error.to_string());
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(broken)?;
    let (width, height) = checked_size(reader.info().size(), most)?;
    let too_large = || Error::Limit("a picture of more bytes than memory can hold".into());
    let mut rows = vec![0; reader.output_buffer_size().ok_or_else(too_large)?];
    let info = reader.next_frame(&mut rows).map_err(broken)?;
    let texels = match info.color_type {
        ColorType::Grayscale => rows.iter().map(|&gray| [gray, gray, gray, 255]).collect(),
        ColorType::GrayscaleAlpha => rows.chunks_exact(2).map(|t| [t[0], t[0], t[0], t[1]]).collect(),
        ColorType::Rgb => opaque(&rows),
        ColorType::Rgba => rows.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).collect(),
        ColorType::Indexed => return Err(Error::format("PNG", Place::File, "the palette was not expanded")),
    };
    Ok((width, height, texels))
}

fn jpeg(bytes: &[u8], most: u64) -> Result<Texels> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let broken = |error: &dyn std::fmt::Debug| Error::format("JPEG", Place::File, format!("{error:?}"));
    decoder.decode_headers().map_err(|error| broken(&error))?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    let (width, height) = checked_size((width as u32, height as u32), most)?;
    let rows = decoder.decode().map_err(|error| broken(&error))?;
    Ok((width, height, opaque(&rows)))
}

fn opaque(rows: &[u8]) -> Vec<[u8; 4]> {
    rows.chunks_exact(3).map(|t| [t[0], t[1], t[2], 255]).collect()
}
