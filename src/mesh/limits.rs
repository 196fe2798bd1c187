//! Limits that every method which contracts or removes takes alike.

use std::f32::consts::FRAC_PI_3;
use std::f64::consts::TAU;

use super::circle::unit_circle;
use crate::error::{Error, Result};

/// Default greatest turn of a normal in radians: acos 0.2 or 78°. 90° folds thin parts, 60° leaves them dense.
pub const MAX_FLIP_RAD: f32 = 1.369_438_4;

/// What still lies flat.
pub const ONE_DEGREE: f64 = 0.017_453_292_519_943_295;
const COS_ONE_DEGREE: f64 = 0.999_847_695_156_391_3;
/// What is bent, yet hardly.
pub const TWENTY_DEGREES: f64 = 0.349_065_850_398_865_9;
const COS_TWENTY_DEGREES: f64 = 0.939_692_620_785_908_4;

/// The cosine of a greatest turn, the same bits on every platform; the default's is exact.
pub fn min_cos(max_flip_rad: f32) -> f64 {
    if max_flip_rad == MAX_FLIP_RAD { 0.2 } else { cos(max_flip_rad.into()) }
}

/// The least cosine of an angle up to `angle_rad`, the same bits on every platform; those of defaults are rounded correctly.
pub fn least_cos(angle_rad: f64) -> f64 {
    let exact = [(ONE_DEGREE, COS_ONE_DEGREE), (TWENTY_DEGREES, COS_TWENTY_DEGREES)];
    exact.into_iter().find(|&(angle, _)| angle == angle_rad).map_or_else(|| cos(angle_rad), |(_, cos)| cos)
}

/// The cosine below which two normals are farther apart than an angle, the same bits on every platform. That of 60° is exact, as the
/// angle in single precision is not.
pub fn crease_cos(angle_rad: f32) -> f32 {
    if angle_rad == FRAC_PI_3 { 0.5 } else { cos(angle_rad.into()) as f32 }
}

/// Without the standard library's, whose last bit differs between platforms.
fn cos(angle_rad: f64) -> f64 {
    unit_circle(angle_rad / TAU).0
}

/// [`Error::Parameter`] for a greatest turn of a normal that is no angle up to a right one.
pub fn check_max_flip(max_flip_rad: f32) -> Result<()> {
    if max_flip_rad > 0.0 && max_flip_rad <= std::f32::consts::FRAC_PI_2 {
        return Ok(());
    }
    let degrees = max_flip_rad.to_degrees();
    Err(Error::Parameter(format!("the greatest turn of a normal is {degrees}°, not in 0 … 90")))
}

/// [`Error::Parameter`] for a weld distance that is no length.
pub fn check_weld(weld: Option<f64>) -> Result<()> {
    match weld {
        Some(tolerance) if !(tolerance >= 0.0 && tolerance.is_finite()) => {
            Err(Error::Parameter(format!("the weld distance is {tolerance}: give 0 or more")))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_are_those_of_the_angles() {
        let degrees = |count: u32| f64::from(count).to_radians();
        for count in 0..=180 {
            let (angle, exact) = (degrees(count), degrees(count).cos());
            assert!((least_cos(angle) - exact).abs() < 2e-15, "{count}°");
            assert!((min_cos(angle as f32) - exact).abs() < 2e-7, "{count}°");
            assert!((f64::from(crease_cos(angle as f32)) - exact).abs() < 2e-7, "{count}°");
        }
        assert_eq!((min_cos(MAX_FLIP_RAD), crease_cos(FRAC_PI_3), crease_cos(0.0)), (0.2, 0.5, 1.0));
        assert_eq!(crease_cos(std::f32::consts::PI), -1.0);
        assert_eq!([ONE_DEGREE, TWENTY_DEGREES].map(least_cos), [COS_ONE_DEGREE, COS_TWENTY_DEGREES]);
    }
}
