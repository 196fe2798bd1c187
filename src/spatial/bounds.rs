//! Boxes along the axes.

use crate::math::Vec3;

/// A box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub low: Vec3,
    /// Upper corner.
    pub high: Vec3,
}

impl Bounds {
    /// Around nothing.
    pub const NONE: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    /// Around some points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::NONE, |bounds, p| bounds.union(Self { low: p, high: p }))
    }

    /// Around both.
    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Wider by so much on each side.
    pub fn wider(self, by: f32) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    /// Whether both have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && self.high.cmpge(other.low).all()
    }

    /// Whether another lies within it, as the box around nothing does.
    #[inline]
    pub fn holds(&self, other: &Self) -> bool {
        self.low.cmple(other.low).all() && self.high.cmpge(other.high).all()
    }

    /// Half of the area of the sides; zero for none.
    pub(super) fn half_area(self) -> f32 {
        let d = (self.high - self.low).max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Twice the center.
    pub(super) fn doubled_center(self) -> Vec3 {
        self.low + self.high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_holds_what_adds_nothing_to_it() {
        let around = |low: f32, high: f32| Bounds::of([Vec3::splat(low), Vec3::new(high, 2.0, 3.0)]);
        let unit = around(0.0, 1.0);
        for other in [unit, around(0.5, 0.75), around(0.0, 1.5), around(-0.5, 1.0), Bounds::NONE] {
            assert_eq!(unit.holds(&other), unit.union(other) == unit, "{other:?}");
        }
        assert!(unit.holds(&around(0.5, 0.75)) && !unit.holds(&around(0.5, 1.5)));
        assert!(!Bounds::NONE.holds(&unit) && Bounds::NONE.holds(&Bounds::NONE));
    }
}
