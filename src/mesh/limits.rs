//! Limits that every method which contracts or removes takes alike.

use crate::error::{Error, Result};

/// Default greatest turn of a normal in radians: acos 0.2 or 78°. 90° folds thin parts, 60° leaves them dense.
pub const MAX_FLIP_RAD: f32 = 1.369_438_4;

/// What still lies flat.
pub const ONE_DEGREE: f64 = 0.017_453_292_519_943_295;
const COS_ONE_DEGREE: f64 = 0.999_847_695_156_391_3;
/// What is bent, yet hardly.
pub const TWENTY_DEGREES: f64 = 0.349_065_850_398_865_9;
const COS_TWENTY_DEGREES: f64 = 0.939_692_620_785_908_4;

/// The cosine of a greatest turn; the default's is exact, for cosines differ between platforms.
pub fn min_cos(max_flip_rad: f32) -> f64 {
    if max_flip_rad == MAX_FLIP_RAD { 0.2 } else { f64::from(max_flip_rad).cos() }
}

/// The least cosine of an angle up to `angle_rad`; those that are defaults are exact, for cosines differ between platforms.
pub fn least_cos(angle_rad: f64) -> f64 {
    let exact = [(ONE_DEGREE, COS_ONE_DEGREE), (TWENTY_DEGREES, COS_TWENTY_DEGREES)];
    exact.into_iter().find(|&(angle, _)| angle == angle_rad).map_or_else(|| angle_rad.cos(), |(_, cos)| cos)
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
