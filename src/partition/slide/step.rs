//! Where a vertex should go, and what color it should have, by what the light around it is off.

use super::super::interior::{Color, length};
use crate::math::DVec2;

/// A vertex may go as far past what the sums tell as they tell: they take what is around it for fixed, and it follows.
const RELAXATION: f64 = 2.0;
/// What is added to the diagonal, as a share of the trace: where light has no bend there is nowhere to go.
const DAMPING: f64 = 1e-3;

/// Sums of Gauss and Newton's method over the light around a vertex, for its color and for two ways to go.
///
/// With the share λ that the vertex has at a spot, and the slope g of the light in the triangle there, the difference at the spot
/// changes by λ for each step of color, and by −λ g for each step of place.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// By how much the light is off, over areas.
    pub off: f64,
    weight: f64,
    pull: Color,
    mixed: [DVec2; 3],
    /// The upper half of the matrix of places: xx, xy, yy.
    matrix: [f64; 3],
    push: DVec2,
}

impl Sums {
    /// Adds a spot: its area, the difference there and its weight, the share of the vertex, and slopes along the ways to go.
    pub fn add(&mut self, [area, floor]: [f64; 2], difference: Color, share: f64, slopes: [DVec2; 3]) {
        let off = length(difference);
        self.off += area * off;
        let weight = area * share / (off + floor);
        let square = weight * share;
        self.weight += square;
        for k in 0..3 {
            let slope = slopes[k];
            self.pull[k] += weight * difference[k];
            self.mixed[k] -= square * slope;
            self.push -= weight * difference[k] * slope;
            let [xx, xy, yy] = &mut self.matrix;
            *xx += square * slope.x * slope.x;
            *xy += square * slope.x * slope.y;
            *yy += square * slope.y * slope.y;
        }
    }

    /// How far to go along either way.
    pub fn step(&self) -> DVec2 {
        let [mut xx, mut xy, mut yy] = self.matrix;
        let damping = DAMPING * (xx + yy);
        let mut push = self.push;
        if self.weight > 0.0 {
            for k in 0..3 {
                let mixed = self.mixed[k] / self.weight;
                push -= mixed * self.pull[k];
                xx -= mixed.x * self.mixed[k].x;
                xy -= mixed.x * self.mixed[k].y;
                yy -= mixed.y * self.mixed[k].y;
            }
        }
        (xx, yy) = (xx + damping, yy + damping);
        let determinant = xx * yy - xy * xy;
        if determinant <= 0.0 {
            return DVec2::ZERO;
        }
        let step = DVec2::new(xy * push.y - yy * push.x, xy * push.x - xx * push.y) / determinant;
        if step.is_finite() { step * RELAXATION } else { DVec2::ZERO }
    }

    /// By how much the color should change once the vertex has gone so far.
    pub fn recolor(&self, gone: DVec2) -> Color {
        if self.weight <= 0.0 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|k| -(self.pull[k] + self.mixed[k].dot(gone)) / self.weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light of a tent, 1 at its top and 0 at a distance of 1 in either direction of either axis.
    fn tent(at: DVec2) -> Color {
        [1.0 - at.x.abs().max(at.y.abs()); 3]
    }

    /// Sums for the vertex of such a tent that stands with its light beside where the top is.
    fn sums(top: DVec2) -> Sums {
        let mut sums = Sums::default();
        for (i, j) in
            (-9..=9).flat_map(|i| (-9..=9).map(move |j| (i, j))).filter(|(i, j): &(i32, i32)| i.abs() != j.abs())
        {
            let at = DVec2::new(f64::from(i), f64::from(j)) / 10.0;
            let share = tent(at)[0];
            let slope =
                if i.abs() > j.abs() { DVec2::X * -f64::from(i.signum()) } else { DVec2::Y * -f64::from(j.signum()) };
            // A vertex that is short of its place by that much lacks so much light.
            sums.add([0.01, 1.0], [share * slope.dot(top); 3], share, [slope; 3]);
        }
        sums
    }

    #[test]
    fn steps_lead_to_where_light_bends() {
        assert_eq!(sums(DVec2::ZERO).step(), DVec2::ZERO);
        for top in [DVec2::new(0.05, 0.0), DVec2::new(-0.03, 0.04)] {
            let step = sums(top).step() / RELAXATION;
            assert!((step - top).length() < 0.3 * top.length(), "{step} to {top}");
            assert!(sums(top).recolor(top)[0].abs() < 0.01, "the color is right already");
        }
    }

    #[test]
    fn what_has_no_slope_stays_and_takes_the_light() {
        let mut sums = Sums::default();
        sums.add([1.0, 0.1], [0.2, 0.0, -0.1], 0.5, [DVec2::ZERO; 3]);
        assert_eq!(sums.step(), DVec2::ZERO);
        let change = sums.recolor(DVec2::ZERO);
        assert!((change[0] + 0.4).abs() < 1e-12 && change[1] == 0.0 && (change[2] - 0.2).abs() < 1e-12, "{change:?}");
        assert_eq!((Sums::default().step(), Sums::default().recolor(DVec2::X)), (DVec2::ZERO, [0.0; 3]));
    }
}
