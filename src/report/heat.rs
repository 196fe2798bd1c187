//! From a deviation to a color.

use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// The color scale, in sRGB, from none to most: dark blue, teal, green, yellow.
///
/// Twelve points of our own with the idea of \[SW15\]: the lightness rises in equal steps (from 0.36 to 0.92 in the space
/// of \[Ott20\]), so that a greater deviation looks brighter to every eye and in print, and no step looks larger than
/// another, as the bands of a rainbow do.
const SCALE: [[u8; 3]; 12] = [
    [26, 44, 148],
    [2, 75, 139],
    [4, 95, 137],
    [4, 114, 141],
    [4, 133, 146],
    [11, 152, 148],
    [0, 172, 145],
    [9, 193, 131],
    [97, 207, 109],
    [157, 217, 90],
    [208, 224, 74],
    [255, 230, 78],
];

/// The color of a share of the limit, in sRGB from 0 to 1: linear between the points, the ends beyond them.
pub fn color(share: f64) -> [f32; 3] {
    let last = SCALE.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let low = (at as usize).min(last - 1);
    let t = (at - low as f64) as f32;
    std::array::from_fn(|i| {
        let [a, b] = [SCALE[low][i], SCALE[low + 1][i]].map(f32::from);
        (a + t * (b - a)) / 255.0
    })
}

/// What a distance is of `limit`; 0 where nothing deviates.
pub(super) fn share(distance: f64, limit: f64) -> f64 {
    if limit > 0.0 { distance / limit } else { 0.0 }
}

/// Distances up to this share of the diagonal are rounding.
const ROUNDING: f64 = 1e-9;
/// The share of vertices that a scale without a limit tells apart. A single spike would leave all else dark blue.
const TOLD_APART: f64 = 0.99;

/// The distance that has the last color: `limit`, or what 99 in 100 distances do not pass, or else the greatest; more than
/// rounding where there is any.
///
/// # Errors
/// [`Error::Parameter`] unless there is one finite distance of 0 or more for each vertex, and the limit is such a one.
pub(super) fn checked_limit(mesh: &Mesh, distances: &[f64], limit: Option<f64>) -> Result<f64> {
    if distances.len() != mesh.positions.len() {
        let (rows, vertices) = (distances.len(), mesh.positions.len());
        return Err(Error::Parameter(format!("{rows} distances for {vertices} vertices")));
    }
    let is_length = |length: &f64| length.is_finite() && *length >= 0.0;
    match limit.iter().chain(distances).find(|length| !is_length(length)) {
        Some(length) => Err(Error::Parameter(format!("{length} is no distance to color"))),
        None => Ok(limit.unwrap_or_else(|| match usual(distances) {
            0.0 => 0.0,
            usual => usual.max((ROUNDING * mesh.diagonal()).min(f64::MAX)),
        })),
    }
}

/// What 99 in 100 distances do not pass; the greatest where that is 0.
fn usual(distances: &[f64]) -> f64 {
    let last = ((distances.len() as f64 * TOLD_APART).ceil() as usize).saturating_sub(1);
    if distances.is_empty() {
        return 0.0;
    }
    let mut sorted = distances.to_vec();
    match *sorted.select_nth_unstable_by(last, f64::total_cmp).1 {
        0.0 => distances.iter().copied().fold(0.0, f64::max),
        usual => usual,
    }
}

/// `mesh` with the color of each vertex by its distance, from 0 to `limit`, or else to what 99 in 100 vertices do
/// not pass. Colors of its faces go: viewers show those first.
///
/// # Errors
/// [`Error::Parameter`] unless there is one finite distance of 0 or more for each vertex, and the limit is such a one.
pub fn heatmap(mesh: &Mesh, distances: &[f64], limit: Option<f64>) -> Result<Mesh> {
    let limit = checked_limit(mesh, distances, limit)?;
    let colors = distances.iter().map(|&distance| {
        let [r, g, b] = color(share(distance, limit));
        [r, g, b, 1.0]
    });
    Ok(Mesh { colors: Some(colors.collect()), face_colors: None, ..mesh.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::tetrahedron;

    /// The lightness of a color \[Ott20\].
    fn lightness(rgb: [f32; 3]) -> f64 {
        let linear = |c: f32| {
            let c = f64::from(c);
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let [r, g, b] = rgb.map(linear);
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s
    }

    #[test]
    fn the_ends_are_the_ends_of_the_scale() {
        let bytes = |share: f64| color(share).map(|c| (c * 255.0).round() as u8);
        assert_eq!([bytes(0.0), bytes(1.0)], [[26, 44, 148], [255, 230, 78]]);
        assert_eq!([bytes(-1.0), bytes(7.0)], [bytes(0.0), bytes(1.0)]);
        assert_eq!(bytes(1.5 / 11.0), [3, 85, 138]);
    }

    #[test]
    fn lightness_rises_in_equal_steps() {
        for step in 0..11 {
            let [a, b] = [step, step + 1].map(|i| lightness(color(f64::from(i) / 11.0)));
            assert!((b - a - 0.56 / 11.0).abs() < 0.003, "from {a} to {b}");
        }
    }

    #[test]
    fn a_heat_map_goes_to_the_usual_or_to_the_limit() {
        let mesh = tetrahedron();
        let distances = [0.0, 1.0, 2.0, 4.0];
        let colors = |limit| heatmap(&mesh, &distances, limit).expect("a heat map").colors.expect("colors");
        let rgb = |row: [f32; 4]| [row[0], row[1], row[2]];
        assert_eq!(colors(None).iter().map(|&c| rgb(c)).collect::<Vec<_>>(), [0.0, 0.25, 0.5, 1.0].map(color));
        assert_eq!(colors(Some(2.0)).iter().map(|&c| rgb(c)).collect::<Vec<_>>(), [0.0, 0.5, 1.0, 1.0].map(color));
        assert_eq!(usual(&(0..=1000).map(f64::from).collect::<Vec<_>>()), 990.0);
        let mut spike = vec![0.0; 1000];
        spike[7] = 3.0;
        assert_eq!((usual(&spike), usual(&[])), (3.0, 0.0));
        // Rounding is no deviation: it looks like none.
        let rounded = heatmap(&mesh, &[0.0, 1e-15, 0.0, 2e-15], None).expect("a heat map").colors.expect("colors");
        let off = |row: &[f32; 4]| (0..3).map(|k| (row[k] - color(0.0)[k]).abs()).fold(0.0, f32::max);
        assert!(rounded.iter().all(|row| off(row) < 1e-3), "{rounded:?}");
        let same = heatmap(&mesh, &[0.0; 4], None).expect("a heat map");
        assert!(same.colors.expect("colors").iter().all(|&c| rgb(c) == color(0.0)));
    }

    #[test]
    fn what_is_no_distance_is_refused() {
        let mesh = tetrahedron();
        for (distances, limit) in [
            (vec![0.0; 3], None),
            (vec![0.0, 1.0, f64::NAN, 0.0], None),
            (vec![0.0, 1.0, f64::INFINITY, 0.0], None),
            (vec![0.0, -1.0, 0.0, 0.0], None),
            (vec![0.0; 4], Some(f64::NAN)),
        ] {
            assert!(matches!(heatmap(&mesh, &distances, limit), Err(Error::Parameter(_))), "{distances:?}");
        }
    }
}
