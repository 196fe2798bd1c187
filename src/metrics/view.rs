//! What a deviation comes to on a screen.

use crate::error::{Error, Result};

/// A perspective view of a model.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct View {
    /// From the eye to the nearest part of the model, in model units.
    pub distance: f64,
    /// The angle from the lower to the upper edge of the picture.
    pub fov_rad: f64,
    /// Of the picture, in pixels.
    pub height: f64,
}

impl View {
    /// Checks that the distance and height are above 0 and the angle is between 0° and 180°.
    ///
    /// # Errors
    /// [`Error::Parameter`] names what is not.
    pub fn check(&self) -> Result<()> {
        for (what, value) in [("distance", self.distance), ("height", self.height)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Parameter(format!("the view's {what} is {value}: give more than 0")));
            }
        }
        if !(self.fov_rad > 0.0 && self.fov_rad < std::f64::consts::PI) {
            let degrees = self.fov_rad.to_degrees();
            return Err(Error::Parameter(format!("the view's angle is {degrees}°: give one between 0° and 180°")));
        }
        Ok(())
    }

    /// The pixels that `length`, in model units, covers at most: seen across, at the view's distance.
    pub fn pixels(&self, length: f64) -> f64 {
        length * self.height / (2.0 * self.distance * (self.fov_rad / 2.0).tan())
    }

    /// The length in model units that covers so many pixels at the view's distance.
    pub fn length(&self, pixels: f64) -> f64 {
        pixels * 2.0 * self.distance * (self.fov_rad / 2.0).tan() / self.height
    }

    /// The distance from which on `length` covers at most so many pixels, whatever the view's own is.
    pub fn distance_for(&self, length: f64, pixels: f64) -> f64 {
        self.distance * self.pixels(length) / pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // At 90° the picture's height shows twice the distance.
    const WIDE: View = View { distance: 5.0, fov_rad: std::f64::consts::FRAC_PI_2, height: 1000.0 };

    #[test]
    fn the_height_of_the_view_is_the_height_of_the_picture() {
        assert!((WIDE.pixels(10.0) - 1000.0).abs() < 1e-9);
        assert!((WIDE.pixels(0.01) - 1.0).abs() < 1e-12);
        let far = View { distance: 10.0, ..WIDE };
        assert!((far.pixels(0.01) - 0.5).abs() < 1e-12);
        assert_eq!(WIDE.pixels(0.0), 0.0);
    }

    #[test]
    fn lengths_and_distances_lead_back() {
        assert!((WIDE.length(2.0) - 0.02).abs() < 1e-12);
        assert!((WIDE.pixels(WIDE.length(3.5)) - 3.5).abs() < 1e-9);
        // Twice as far for half the pixels; nothing off is seen from nowhere.
        assert!((WIDE.distance_for(0.01, 0.5) - 10.0).abs() < 1e-9);
        assert_eq!(WIDE.distance_for(0.0, 1.0), 0.0);
    }

    #[test]
    fn views_that_show_nothing_are_refused() {
        assert!(WIDE.check().is_ok());
        for bad in [
            View { distance: 0.0, ..WIDE },
            View { distance: f64::INFINITY, ..WIDE },
            View { height: -1.0, ..WIDE },
            View { height: f64::NAN, ..WIDE },
            View { fov_rad: 0.0, ..WIDE },
            View { fov_rad: std::f64::consts::PI, ..WIDE },
            View { fov_rad: f64::NAN, ..WIDE },
        ] {
            assert!(matches!(bad.check(), Err(Error::Parameter(_))), "{bad:?}");
        }
    }
}
