//! A polygon with holes.

use std::ops::Range;

use crate::math::DVec2;

/// 2⁻⁴⁰⁰. What is larger is a multiple of 2⁻⁴⁵³, whose square is a number still.
const TINY: f64 = f64::from_bits((1023 - 400) << 52);

/// A polygon with holes in a plane: rings one after another, the outer one first and counter-clockwise, the others holes and
/// clockwise.
///
/// A mesh vertex may occur several times, at one place: the region is pinched there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    pub points: Vec<DVec2>,
    /// The mesh vertex of every point.
    pub vertices: Vec<u32>,
    /// The first point of every ring, and the number of points.
    pub ring_starts: Vec<u32>,
}

/// Why rings are no outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misfit {
    /// There is no ring.
    Empty,
    /// A ring has fewer than three points or no area.
    Flat {
        /// Which of the rings.
        ring: usize,
    },
    /// The ring of the greatest area is clockwise.
    Outer {
        /// Which of the rings.
        ring: usize,
    },
    /// Another ring is counter-clockwise.
    Hole {
        /// Which of the rings.
        ring: usize,
    },
}

impl Outline {
    /// The outline of these rings of mesh vertices in any order, the region to their left: the one of the greatest area is the
    /// outer one, the others follow in their order.
    ///
    /// # Errors
    /// What keeps them from being one.
    pub fn from_rings(rings: &[Vec<u32>], at: impl Fn(u32) -> DVec2) -> Result<Self, Misfit> {
        let points: Vec<Vec<DVec2>> = rings.iter().map(|ring| ring.iter().map(|&v| at(v)).collect()).collect();
        let areas: Vec<f64> = points.iter().map(|ring| signed_area(ring)).collect();
        if let Some(ring) = (0..rings.len()).find(|&ring| !(rings[ring].len() >= 3 && areas[ring].abs() > 0.0)) {
            return Err(Misfit::Flat { ring });
        }
        // Of equal ones the first.
        let larger = |&a: &usize, &b: &usize| areas[a].abs().total_cmp(&areas[b].abs()).then(b.cmp(&a));
        let outer = (0..rings.len()).max_by(larger).ok_or(Misfit::Empty)?;
        if areas[outer] < 0.0 {
            return Err(Misfit::Outer { ring: outer });
        }
        let holes = (0..rings.len()).filter(|&ring| ring != outer);
        if let Some(ring) = holes.clone().find(|&ring| areas[ring] > 0.0) {
            return Err(Misfit::Hole { ring });
        }
        let mut outline = Self { ring_starts: vec![0], ..Self::default() };
        for ring in [outer].into_iter().chain(holes) {
            outline.points.extend(&points[ring]);
            outline.vertices.extend(&rings[ring]);
            outline.ring_starts.push(outline.points.len() as u32);
        }
        Ok(outline)
    }

    /// The points of every ring.
    pub fn rings(&self) -> impl ExactSizeIterator<Item = Range<usize>> + '_ {
        self.ring_starts.windows(2).map(|ends| ends[0] as usize..ends[1] as usize)
    }

    /// Whether its parts fit together and its coordinates are finite: what every function of this module asks for first.
    pub(super) fn is_sound(&self) -> bool {
        self.points.len() == self.vertices.len()
            && self.points.len() < u32::MAX as usize / 4
            && self.ring_starts.len() > 1
            && self.ring_starts.first() == Some(&0)
            && self.ring_starts.last() == Some(&(self.points.len() as u32))
            && self.ring_starts.windows(2).all(|ends| ends[0] + 3 <= ends[1])
            && self.points.iter().all(|p| p.is_finite())
    }

    /// The point after every point in its ring.
    pub fn successors(&self) -> Vec<u32> {
        let mut next: Vec<u32> = (1..=self.points.len() as u32).collect();
        self.rings().for_each(|ring| next[ring.end - 1] = ring.start as u32);
        next
    }

    /// The point after a point in its ring.
    pub(super) fn successor(&self, point: u32) -> u32 {
        let ring = self.ring_starts.partition_point(|&first| first <= point);
        if point + 1 == self.ring_starts[ring] { self.ring_starts[ring - 1] } else { point + 1 }
    }

    /// The points times a power of two that brings the largest coordinate near one: exact, but that what is below [`TINY`]
    /// becomes zero. No product of their differences overflows or loses digits at the small end.
    pub(super) fn scaled(&self) -> Vec<DVec2> {
        let largest = self.points.iter().fold(0.0_f64, |largest, p| largest.max(p.abs().max_element()));
        if largest == 0.0 {
            return self.points.clone();
        }
        // The exponent as stored; a subnormal number's is 0, and 1 does as well.
        let exponent = (largest.to_bits() >> 52).clamp(1, 2045);
        let scale = f64::from_bits((2046 - exponent) << 52);
        let flush = |x: f64| if x.abs() < TINY { 0.0 } else { x };
        self.points.iter().map(|&p| DVec2::new(flush(p.x * scale), flush(p.y * scale))).collect()
    }
}

/// The area to the left of a ring.
pub(super) fn signed_area(ring: &[DVec2]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| (a - origin).perp_dot(b - origin)).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 2]; 8] = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 1.], [1., 2.], [2., 2.], [2., 1.]];

    fn outline(rings: &[&[u32]]) -> Result<Outline, Misfit> {
        let rings: Vec<Vec<u32>> = rings.iter().map(|ring| ring.to_vec()).collect();
        Outline::from_rings(&rings, |v| POINTS[v as usize].into())
    }

    #[test]
    fn the_largest_ring_comes_first() {
        let outline = outline(&[&[4, 5, 6, 7], &[1, 2, 3, 0]]).expect("a plate with a hole");
        assert_eq!(outline.vertices, [1, 2, 3, 0, 4, 5, 6, 7]);
        assert_eq!(outline.ring_starts, [0, 4, 8]);
        assert_eq!(outline.rings().map(|ring| signed_area(&outline.points[ring])).collect::<Vec<_>>(), [16.0, -1.0]);
        assert_eq!(outline.successors(), [1, 2, 3, 0, 5, 6, 7, 4]);
        assert!(outline.is_sound());
    }

    #[test]
    fn rings_of_the_wrong_sense_are_refused() {
        assert_eq!(outline(&[]), Err(Misfit::Empty));
        assert_eq!(outline(&[&[0, 1, 2, 3], &[4, 5]]), Err(Misfit::Flat { ring: 1 }));
        assert_eq!(outline(&[&[0, 1, 0, 3]]), Err(Misfit::Flat { ring: 0 }));
        assert_eq!(outline(&[&[4, 5, 6, 7], &[3, 2, 1, 0]]), Err(Misfit::Outer { ring: 1 }));
        assert_eq!(outline(&[&[0, 1, 2, 3], &[7, 6, 5, 4]]), Err(Misfit::Hole { ring: 1 }));
    }

    #[test]
    fn scaling_is_exact_at_every_size() {
        for exponent in [-1074, -1022, -500, 0, 500, 1022] {
            let mut outline = outline(&[&[0, 1, 2, 3]]).expect("a plate");
            // In two steps, as one of them would not be a number.
            let half = 2.0_f64.powi(exponent / 2);
            outline.points.iter_mut().for_each(|p| *p = *p / 4.0 * half * 2.0_f64.powi(exponent - exponent / 2));
            let scaled = outline.scaled();
            let largest = scaled.iter().fold(0.0_f64, |largest, p| largest.max(p.max_element()));
            assert!((1e-20..=2.0).contains(&largest), "{exponent}: {largest}");
            assert_eq!(scaled, [DVec2::ZERO, DVec2::X * largest, DVec2::ONE * largest, DVec2::Y * largest]);
        }
    }
}
