//! Colors: light in glTF, as screens take them (sRGB) in a mesh.
//!
//! Colors stored as integers come back to the same ones; of those stored as `f32` the last bits may differ, for the curve is
//! flat where they are dense.

use super::number::Number;
use crate::formats::attributes;

/// A color of three or four numbers of light, the last of them opacity.
pub(super) fn of_light(light: &[f32]) -> [f32; 4] {
    let at = |channel: usize| light.get(channel).copied().unwrap_or(1.0);
    let curve = |light: f32| attributes::channel(encoded(f64::from(light)), 1.0);
    [curve(at(0)), curve(at(1)), curve(at(2)), attributes::channel(at(3).into(), 1.0)]
}

/// The light of a color.
pub(super) fn to_light([red, green, blue, alpha]: [f32; 4]) -> [f32; 4] {
    let light = |channel: f32| decoded(f64::from(channel)) as f32;
    [light(red), light(green), light(blue), alpha]
}

/// Fractions as numbers of a type.
pub(super) fn push(bytes: &mut Vec<u8>, fractions: &[f32], number: Number) {
    for &fraction in fractions {
        let scaled = (fraction * number.greatest()).round();
        match number {
            Number::U8 => bytes.push(scaled as u8),
            Number::U16 => bytes.extend_from_slice(&(scaled as u16).to_le_bytes()),
            _ => bytes.extend_from_slice(&fraction.to_le_bytes()),
        }
    }
}

/// The curve of IEC 61966-2-1.
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

fn decoded(stored: f64) -> f64 {
    if stored <= 12.92 * 0.003_130_8 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_come_back_the_same() {
        for (number, greatest) in [(Number::U8, 255_u32), (Number::U16, 65535)] {
            for whole in 0..=greatest {
                let light = whole as f32 / number.greatest();
                let color = of_light(&[light, light, light]);
                let mut bytes = Vec::new();
                push(&mut bytes, &to_light(color)[..1], number);
                bytes.resize(4, 0);
                assert_eq!(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), whole, "{number:?}");
            }
        }
    }

    #[test]
    fn the_curve_is_that_of_screens() {
        // Half of the light is shown by 188 of 255.
        assert_eq!((of_light(&[0.5, 0.0, 1.0])[0] * 255.0).round(), 188.0);
        assert_eq!(of_light(&[7.0, -1.0, 0.0, 0.25]), [1.0, 0.0, 0.0, 0.25]);
        assert!(of_light(&[f32::NAN; 3])[..3].iter().all(|channel| channel.is_nan()));
        for light in [0.001_f32, 0.02, 0.3, 0.7, 0.999] {
            assert!((to_light(of_light(&[light, 0.0, 0.0]))[0] - light).abs() < 4e-7 * light, "{light}");
        }
    }
}
