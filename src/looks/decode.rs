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

#[cfg(test)]
mod tests {
    use base64::Engine as _;
    use base64::engine::general_purpose::STANDARD;

    use super::*;
    use crate::error::Error;

    /// 8 × 8 texels of one color: red, and gray.
    const RED: &str = "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAA0JCgsKCA0LCgsODg0PEyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxOUl\
        NSMj5aYVpQYEpRUk//2wBDAQ4ODhMREyYVFSZPNS01T09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT0//wAARC\
        AAIAAgDASIAAhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAAAAX/xAAUEAEAAAAAAAAAAAAAAAAAAAAA/8QAFQEBAQAAAAAAAAAAAAAAAAAABQb/\
        xAAUEQEAAAAAAAAAAAAAAAAAAAAA/9oADAMBAAIRAxEAPwCaAJVL/9k=";
    const GRAY: &str = "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAA0JCgsKCA0LCgsODg0PEyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxOU\
        lNSMj5aYVpQYEpRUk//wAALCAAIAAgBAREA/8QAFAABAAAAAAAAAAAAAAAAAAAABf/EABQQAQAAAAAAAAAAAAAAAAAAAAD/2gAIAQEAAD8AIf/Z";

    fn encoded(size: (u32, u32), kind: ColorType, depth: png::BitDepth, rows: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
        encoder.set_color(kind);
        encoder.set_depth(depth);
        if kind == ColorType::Indexed {
            encoder.set_palette(vec![1, 2, 3, 4, 5, 6]);
            encoder.set_trns(vec![255, 7]);
        }
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(rows).expect("rows");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn every_kind_of_png_becomes_texels() {
        use png::BitDepth::{Eight, One, Sixteen};
        type Case<'a> = (ColorType, png::BitDepth, &'a [u8], [[u8; 4]; 2]);
        let cases: [Case; 6] = [
            (ColorType::Grayscale, Eight, &[9, 200], [[9, 9, 9, 255], [200, 200, 200, 255]]),
            (ColorType::Grayscale, One, &[0b0100_0000], [[0, 0, 0, 255], [255; 4]]),
            (ColorType::GrayscaleAlpha, Eight, &[9, 1, 200, 2], [[9, 9, 9, 1], [200, 200, 200, 2]]),
            (ColorType::Rgb, Sixteen, &[1, 9, 2, 9, 3, 9, 4, 9, 5, 9, 6, 9], [[1, 2, 3, 255], [4, 5, 6, 255]]),
            (ColorType::Rgba, Eight, &[1, 2, 3, 4, 5, 6, 7, 8], [[1, 2, 3, 4], [5, 6, 7, 8]]),
            (ColorType::Indexed, One, &[0b0100_0000], [[1, 2, 3, 255], [4, 5, 6, 7]]),
        ];
        for (kind, depth, rows, texels) in cases {
            let decoded = decode(&encoded((2, 1), kind, depth, rows), 2).expect("texels");
            assert_eq!(decoded, (2, 1, texels.to_vec()), "{kind:?}, {depth:?}");
        }
    }

    #[test]
    fn jpeg_becomes_texels() {
        for (text, expected) in [(RED, [200, 61, 32]), (GRAY, [91; 3])] {
            let bytes = STANDARD.decode(text).expect("base64");
            let (width, height, texels) = decode(&bytes, 64).expect("texels");
            assert_eq!((width, height, texels.len()), (8, 8, 64));
            let is_near = |texel: &[u8; 4]| (0..3).all(|i| texel[i].abs_diff(expected[i]) <= 2) && texel[3] == 255;
            assert!(texels.iter().all(is_near), "{:?}", texels[0]);
            assert!(matches!(decode(&bytes, 63), Err(Error::Limit(_))));
        }
    }

    #[test]
    fn what_is_broken_or_too_large_is_refused() {
        let png = encoded((2, 1), ColorType::Grayscale, png::BitDepth::Eight, &[0, 0]);
        assert!(matches!(decode(&png[..40], 2), Err(Error::Format { format: "PNG", .. })));
        assert!(matches!(decode(b"\xff\xd8\xff", 2), Err(Error::Format { format: "JPEG", .. })));
        assert!(matches!(decode(b"GIF89a", 2), Err(Error::Unsupported(_))));
        assert!(matches!(decode(&[], 2), Err(Error::Unsupported(_))));
        let wide = encoded((9000, 1), ColorType::Grayscale, png::BitDepth::Eight, &[0; 9000]);
        assert!(matches!(decode(&wide, u64::MAX), Err(Error::Limit(_))));
    }

    /// Whatever becomes of it, it is no panic.
    #[test]
    fn mutated_files_do_no_harm() {
        let png = encoded((2, 2), ColorType::Indexed, png::BitDepth::One, &[0b0100_0000, 0b1000_0000]);
        let jpeg = STANDARD.decode(RED).expect("base64");
        for bytes in [png, jpeg] {
            for at in 2..bytes.len() {
                for value in [0, 1, 0x7f, 0xff] {
                    let mut bytes = bytes.clone();
                    bytes[at] = value;
                    drop(decode(&bytes, 1 << 16));
                    drop(decode(&bytes[..at], 1 << 16));
                }
            }
        }
    }
}
