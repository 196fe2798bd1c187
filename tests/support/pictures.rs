//! Pictures for tests.

/// A picture of one texel.
pub fn png(texel: [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&texel).expect("a texel");
    writer.finish().expect("an end");
    bytes
}
