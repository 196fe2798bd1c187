//! Polygons in a plane to triangles by ear clipping, every corner kept.

use earcut::Earcut;
use rustc_hash::FxHashMap;

/// The most corners of a polygon: the clipper addresses its memory with 32 bits.
const MOST_CORNERS: usize = 1 << 24;

/// Clips polygons; holds the scratch memory.
pub(crate) struct Clipper {
    earcut: Earcut<f64>,
    clipped: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Clipper {
    pub fn new() -> Self {
        Self { earcut: Earcut::new(), clipped: Vec::new(), triangles: Vec::new() }
    }

    /// The triangles of a polygon, counter-clockwise: the outer ring first, then the holes, which start at `hole_starts`.
    ///
    /// `None` unless every corner is used and there are as many triangles as corners, less two, and two for each hole. What
    /// crosses itself takes time that grows with the square of the corners.
    pub fn clip(&mut self, corners: &[[f64; 2]], hole_starts: &[u32]) -> Option<&[[u32; 3]]> {
        if corners.len() > MOST_CORNERS {
            return None;
        }
        self.earcut.earcut_slice::<u32>(corners, hole_starts, &mut self.clipped);
        // All triangles wind one way, those without an area too; which way is the clipper's choice.
        let corner = |i: u32| corners[i as usize];
        let area: f64 = self.clipped.chunks_exact(3).map(|t| turn(corner(t[0]), corner(t[1]), corner(t[2]))).sum();
        let wind = |t: &[u32]| if area < 0.0 { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
        self.triangles.clear();
        self.triangles.extend(self.clipped.chunks_exact(3).map(wind));
        self.restore_dropped_corners(corners.len(), hole_starts)?;
        (self.triangles.len() + 2 == corners.len() + 2 * hole_starts.len()).then_some(&self.triangles)
    }

    /// Puts back the corners that the clipper dropped because they add no area: repeated positions and spikes.
    ///
    /// Without them the neighbor across that side would not share its vertices, a crack. A dropped corner `m` between
    /// the used corners `a` and `b` splits the triangle on that side:
    /// ```text
    ///      c             c
    ///     / \           /|\
    ///    a---b   →     a-m-b
    /// ```
    fn restore_dropped_corners(&mut self, corner_count: usize, hole_starts: &[u32]) -> Option<()> {
        let mut used = vec![false; corner_count];
        for &corner in self.triangles.iter().flatten() {
            used[corner as usize] = true;
        }
        if used.iter().all(|&used| used) {
            return Some(());
        }
        let sides = |(at, &[a, b, c]): (u32, &[u32; 3])| [([a, b], at), ([b, c], at), ([c, a], at)];
        let mut triangle_at: FxHashMap<[u32; 2], u32> = (0..).zip(&self.triangles).flat_map(sides).collect();
        let ends = hole_starts.iter().map(|&start| start as usize).chain([corner_count]);
        let mut start = 0;
        for end in ends {
            let ring = start..end;
            start = end;
            let len = ring.len();
            let first = ring.clone().position(|corner| used[corner])?;
            let corner = |step: usize| (ring.start + (first + step) % len) as u32;
            let (mut a, mut ahead) = (corner(0), 0);
            for step in 1..len {
                let m = corner(step);
                if !used[m as usize] {
                    ahead = ahead.max(step);
                    ahead += (ahead..=len).position(|step| used[corner(step) as usize])?;
                    let b = corner(ahead);
                    let at = triangle_at.remove(&[a, b])?;
                    let triangle = &mut self.triangles[at as usize];
                    let c = triangle.iter().copied().find(|&c| c != a && c != b)?;
                    *triangle = [a, m, c];
                    let new = self.triangles.len() as u32;
                    self.triangles.push([m, b, c]);
                    triangle_at.extend([([a, m], at), ([m, c], at), ([m, b], new), ([b, c], new), ([c, m], new)]);
                    used[m as usize] = true;
                }
                a = m;
            }
        }
        Some(())
    }
}

/// Twice the signed area of a triangle in the plane.
pub(crate) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_keep_their_straight_corners() {
        // A plate of 4 × 4 with a hole of 2 × 2, a corner in the middle of each side.
        let plate = [[0., 0.], [2., 0.], [4., 0.], [4., 2.], [4., 4.], [2., 4.], [0., 4.], [0., 2.]];
        let hole = [[1., 1.], [1., 2.], [1., 3.], [2., 3.], [3., 3.], [3., 2.], [3., 1.], [2., 1.]];
        let corners = [plate, hole].concat();
        let mut clipper = Clipper::new();
        let triangles = clipper.clip(&corners, &[8]).expect("a plate with a hole");
        assert_eq!(triangles.len(), 16);
        let corner = |i: u32| corners[i as usize];
        let areas: Vec<f64> = triangles.iter().map(|t| turn(corner(t[0]), corner(t[1]), corner(t[2])) / 2.0).collect();
        assert!(areas.iter().all(|&area| area > 0.0) && areas.iter().sum::<f64>() == 12.0, "{areas:?}");
    }

    #[test]
    fn what_has_no_area_is_refused() {
        let mut clipper = Clipper::new();
        assert_eq!(clipper.clip(&[], &[]), None);
        assert_eq!(clipper.clip(&[[0.0; 2]; 5], &[]), None);
        assert_eq!(clipper.clip(&[[0., 0.], [1., 0.], [2., 0.], [1., 0.]], &[]), None);
    }
}
