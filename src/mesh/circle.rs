//! Points on the unit circle, the same bits on every machine.

use std::f64::consts::TAU;

/// Cosine and sine of `turns` full turns.
///
/// The standard library's may differ in the last bit from one platform to the next; sums and products may not.
/// Within 1e-15 of the true values. `turns` is best below a million.
pub(super) fn unit_circle(turns: f64) -> (f64, f64) {
    // Quarter turns off the nearest axis, in [-1/2, 1/2].
    let quarters = turns * 4.0;
    let axis = quarters.round();
    let angle = (quarters - axis) * (TAU / 4.0);
    let square = angle * angle;
    // Taylor series: the angle is below 0.79, so that the first terms left out are below 1e-17.
    let series = |from: i32| {
        (0..9).rev().fold(0.0, |sum, k| {
            let denominator = f64::from((2 * k + from) * (2 * k + from + 1));
            1.0 - square * sum / denominator
        })
    };
    let (cos, sin) = (series(1), angle * series(2));
    match axis.rem_euclid(4.0) as u8 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        for i in -1000..1000 {
            let turns = f64::from(i) / 77.0;
            let (cos, sin) = unit_circle(turns);
            assert!((cos - (turns * TAU).cos()).abs() < 1e-13 && (sin - (turns * TAU).sin()).abs() < 1e-13, "{turns}");
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        let axes = [0.0, 0.25, 0.5, 0.75, 1.0].map(unit_circle);
        assert_eq!(axes, [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)]);
    }
}
