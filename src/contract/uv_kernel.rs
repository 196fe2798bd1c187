//! The kernel of a polygon in the plane: the points that see all of its edges from inside, which is where a vertex may go
//! for no face around it to turn over.

use crate::math::DVec2;

/// A kernel of less than this share of its box has no inside.
const LEAST_AREA: f64 = 1e-9;

/// Twice the area of a triangle, positive where it runs counter-clockwise. Exact in sign for numbers of single precision
/// whose differences are not 2²⁹ times smaller than themselves.
#[inline(always)]
pub fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// The point nearest to `p` of the edge from `a` to `b`.
fn nearest_on(a: DVec2, b: DVec2, p: DVec2) -> DVec2 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    // Not a number for an edge without length: then it is its start.
    if t > 0.0 { a + along * t.min(1.0) } else { a }
}

/// A convex region, clipped edge by edge.
#[derive(Debug, Default)]
pub struct Kernel {
    /// Counter-clockwise.
    corners: Vec<DVec2>,
    before: Vec<DVec2>,
    box_area: f64,
}

impl Kernel {
    /// Starts anew with a box.
    pub fn start(&mut self, low: DVec2, high: DVec2) {
        self.corners.clear();
        self.corners.extend([low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)]);
        self.box_area = (high - low).element_product();
    }

    /// Keeps what lies to the left of the edge from `a` to `b`; all where they are one point.
    pub fn clip(&mut self, a: DVec2, b: DVec2) {
        if a == b {
            return;
        }
        std::mem::swap(&mut self.corners, &mut self.before);
        self.corners.clear();
        let Some(&last) = self.before.last() else { return };
        let (mut from, mut from_side) = (last, orientation(a, b, last));
        for &to in &self.before {
            let to_side = orientation(a, b, to);
            if (from_side < 0.0) != (to_side < 0.0) {
                self.corners.push(from + (to - from) * (from_side / (from_side - to_side)));
            }
            if to_side >= 0.0 {
                self.corners.push(to);
            }
            (from, from_side) = (to, to_side);
        }
    }

    /// Its area; 0 when nothing is left.
    pub fn area(&self) -> f64 {
        self.triangles().map(|(area, _)| area).sum()
    }

    /// The area of each triangle of a fan, and its center.
    fn triangles(&self) -> impl Iterator<Item = (f64, DVec2)> {
        let (first, others) = self.corners.split_first().map_or((DVec2::ZERO, &[][..]), |(&first, rest)| (first, rest));
        others
            .windows(2)
            .map(move |pair| (orientation(first, pair[0], pair[1]) / 2.0, (first + pair[0] + pair[1]) / 3.0))
    }

    /// The point nearest to `p` of the region shrunk about its center of gravity to `share` of its size; `None` where it
    /// has no inside.
    pub fn nearest(&self, p: DVec2, share: f64) -> Option<DVec2> {
        let area = self.area();
        let has_inside = area > LEAST_AREA * self.box_area;
        if !has_inside {
            return None;
        }
        let center = self.triangles().map(|(area, center)| center * area).sum::<DVec2>() / area;
        let shrunk = |corner: DVec2| center + (corner - center) * share;
        let edges = || {
            let ends = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
            ends.map(|(&a, &b)| (shrunk(a), shrunk(b)))
        };
        if edges().all(|(a, b)| orientation(a, b, p) >= 0.0) {
            return Some(p);
        }
        edges()
            .map(|(a, b)| nearest_on(a, b, p))
            .min_by(|a, b| p.distance_squared(*a).total_cmp(&p.distance_squared(*b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points<const N: usize>(points: [[f64; 2]; N]) -> Vec<DVec2> {
        points.into_iter().map(DVec2::from).collect()
    }

    /// The kernel of a closed polygon that runs counter-clockwise.
    fn kernel(polygon: &[DVec2]) -> Kernel {
        let mut kernel = Kernel::default();
        let far = |pick: fn(DVec2, DVec2) -> DVec2| polygon.iter().copied().reduce(pick).expect("a polygon");
        kernel.start(far(DVec2::min), far(DVec2::max));
        for (i, &a) in polygon.iter().enumerate() {
            kernel.clip(a, polygon[(i + 1) % polygon.len()]);
        }
        kernel
    }

    /// The same corners, wherever the list begins.
    fn assert_corners(found: &Kernel, expected: &[DVec2]) {
        let mut corners = found.corners.clone();
        corners.dedup_by(|a, b| a.distance(*b) < 1e-12);
        assert_eq!(corners.len(), expected.len(), "{corners:?}");
        for corner in expected {
            assert!(corners.iter().any(|found| found.distance(*corner) < 1e-12), "{corner} is not in {corners:?}");
        }
    }

    #[test]
    fn the_kernel_of_a_convex_polygon_is_itself() {
        let hexagon = points([[2.0, 0.0], [4.0, 1.0], [4.0, 3.0], [2.0, 4.0], [0.0, 3.0], [0.0, 1.0]]);
        assert_corners(&kernel(&hexagon), &hexagon);
        let triangle = points([[0.0, 0.0], [3.0, 1.0], [1.0, 2.0]]);
        assert_corners(&kernel(&triangle), &triangle);
        assert_eq!(kernel(&triangle).area(), 2.5);
        // Corners on an edge change nothing.
        let square = points([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 1.0]]);
        assert_eq!(kernel(&square).area(), 4.0);
    }

    #[test]
    fn a_u_with_deep_arms_has_none() {
        let u = |bottom: f64| {
            let top = [[3.0, 4.0], [2.0, 4.0], [2.0, bottom], [1.0, bottom], [1.0, 4.0], [0.0, 4.0]];
            points([[0.0, 0.0], [3.0, 0.0], top[0], top[1], top[2], top[3], top[4], top[5]])
        };
        assert_eq!(kernel(&u(1.0)).nearest(DVec2::ONE, 0.95), None);
        assert_eq!(kernel(&u(1.0)).area(), 0.0);
    }

    #[test]
    fn a_star_has_its_middle() {
        // Four spikes: what all inner corners leave is the square between them.
        let star = points([
            [4.0, 0.0],
            [1.0, 1.0],
            [0.0, 4.0],
            [-1.0, 1.0],
            [-4.0, 0.0],
            [-1.0, -1.0],
            [0.0, -4.0],
            [1.0, -1.0],
        ]);
        let found = kernel(&star);
        // The edge from (4, 0) to (1, 1) meets the axis x = y at (1, 1) and the next spike's at (0, 4/3).
        let r = 4.0 / 3.0;
        assert_corners(
            &found,
            &points([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [r, 0.0], [-r, 0.0], [0.0, r], [0.0, -r]]),
        );
        assert_eq!(found.nearest(DVec2::ZERO, 0.95), Some(DVec2::ZERO));
    }

    #[test]
    fn a_point_outside_goes_to_the_shrunk_edge() {
        let square = points([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        let found = kernel(&square);
        let near = |p: DVec2| found.nearest(p, 0.95).expect("it has an inside");
        assert!(near(DVec2::new(5.0, 1.25)).distance(DVec2::new(1.95, 1.25)) < 1e-12);
        assert!(near(DVec2::new(-1.0, 9.0)).distance(DVec2::new(0.05, 1.95)) < 1e-12);
        assert_eq!(near(DVec2::new(1.9, 1.0)), DVec2::new(1.9, 1.0));
        // Within the polygon, and outside of what was shrunk.
        assert!(near(DVec2::new(1.99, 1.0)).distance(DVec2::new(1.95, 1.0)) < 1e-12);
    }

    #[test]
    fn degenerate_polygons_have_no_inside() {
        let inside = |polygon: &[DVec2]| kernel(polygon).nearest(DVec2::ZERO, 0.95);
        assert_eq!(inside(&points([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])), None);
        assert_eq!(inside(&points([[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]])), None);
        // Clockwise: its edges look the other way.
        assert_eq!(inside(&points([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]])), None);
    }
}
