//! Loops in space to triangles, for regions that no plane shows whole.

use rustc_hash::FxHashSet;

use crate::math::{DVec3, radius_ratio};
use crate::mesh::dynamic::best_triangles;

/// The most points of a loop: the work grows with their cube.
pub const MOST_IN_SPACE: usize = 200;

/// Steps of 1 − cos of the angle between two triangles: bends of less than 10° are all alike, so that rounding decides nothing.
const BEND_STEPS: f64 = 64.0;

/// Triangles of less than this height over length are flat: their normals are noise.
const FLAT: f64 = 1e-9;

/// What triangles are worth, the least best.
///
/// First the sharpest bend, for the least area alone folds over where a loop is narrow; then the area, for the least bend alone
/// stretches far where a loop is nearly plane. A sliver counts twice its area, so that of equal areas the round triangles win.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Worth {
    flat: u32,
    bend: u32,
    area: f64,
}

/// The best triangles between two points of the loop.
#[derive(Debug, Clone, Copy)]
struct Part {
    worth: Worth,
    /// The direction of the triangle at the line that joins them.
    normal: Option<DVec3>,
}

/// The triangles of a closed loop in space, as indices of its points, in its direction.
///
/// `vertices` are the mesh vertices of the points: no diagonal joins one with itself, or two that share an edge of the loop, or
/// two that `is_taken` accepts. `None` for more than [`MOST_IN_SPACE`] points, and where those leave no triangulation.
pub fn fill_in_space(
    points: &[DVec3],
    vertices: &[u32],
    mut is_taken: impl FnMut(u32, u32) -> bool,
) -> Option<Vec<[u32; 3]>> {
    let count = points.len();
    if !(3..=MOST_IN_SPACE).contains(&count) || vertices.len() != count || !points.iter().all(|p| p.is_finite()) {
        return None;
    }
    let points = centered(points);
    let edge = |i: usize, j: usize| [vertices[i].min(vertices[j]), vertices[i].max(vertices[j])];
    let sides: FxHashSet<[u32; 2]> = (0..count).map(|i| edge(i, (i + 1) % count)).collect();
    if sides.len() < count || sides.iter().any(|[a, b]| a == b) {
        return None;
    }
    let join = |corners: [usize; 3], parts: [Part; 2]| {
        let [a, b, c] = corners.map(|i| points[i]);
        let lengths = [b.distance(c), c.distance(a), a.distance(b)];
        let doubled = (b - a).cross(c - a);
        let is_flat = doubled.length() <= FLAT * lengths.iter().map(|l| l * l).sum::<f64>();
        let normal = if is_flat { None } else { doubled.try_normalize() };
        let [first, second] = parts.map(|part| part.worth);
        let bend = |part: Part| {
            let cos = part.normal.zip(normal).map_or(1.0, |(a, b)| a.dot(b));
            ((1.0 - cos) * BEND_STEPS) as u32
        };
        let worth = Worth {
            flat: first.flat + second.flat + u32::from(normal.is_none()),
            bend: first.bend.max(second.bend).max(bend(parts[0])).max(bend(parts[1])),
            area: first.area + second.area + doubled.length() * (1.0 - radius_ratio(lengths)),
        };
        Some(Part { worth, normal })
    };
    let none = Part { worth: Worth { flat: 0, bend: 0, area: 0.0 }, normal: None };
    let may_join = |i: usize, j: usize| {
        let [a, b] = edge(i, j);
        a != b && !sides.contains(&[a, b]) && !is_taken(a, b)
    };
    let beats = |part: Part, best: Option<Part>| best.is_none_or(|best| part.worth < best.worth);
    let (triangles, _) = best_triangles(count, |_| none, may_join, join, beats)?;
    // Where a vertex occurs twice, so may a diagonal.
    let is_diagonal = |&[i, j]: &[usize; 2]| i + 1 < j && (i, j) != (0, count - 1);
    let diagonals: FxHashSet<[u32; 2]> = (triangles.iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [a, c]].into_iter().filter(is_diagonal))
        .map(|[i, j]| edge(i, j))
        .collect();
    (diagonals.len() == count - 3).then(|| triangles.into_iter().map(|t| t.map(|i| i as u32)).collect())
}

/// The points about the first, in units of the largest coordinate: nothing overflows.
fn centered(points: &[DVec3]) -> Vec<DVec3> {
    let largest = points.iter().fold(f64::MIN_POSITIVE, |largest, p| largest.max(p.abs().max_element()));
    let first = points.first().map_or(DVec3::ZERO, |&first| first / largest);
    points.iter().map(|&p| p / largest - first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::tie_hash;

    fn fill(points: &[[f64; 3]]) -> Option<Vec<[u32; 3]>> {
        let points: Vec<DVec3> = points.iter().map(|&p| p.into()).collect();
        let vertices: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = fill_in_space(&points, &vertices, |_, _| false)?;
        triangles.sort_unstable();
        Some(triangles)
    }

    fn cross(points: &[[f64; 3]], triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|i| DVec3::from(points[i as usize]));
        (b - a).cross(c - a)
    }

    #[test]
    fn the_shorter_diagonal_of_a_flat_rhombus_wins() {
        assert_eq!(fill(&[[-2., 0., 0.], [0., -1., 0.], [2., 0., 0.], [0., 1., 0.]]), Some(vec![[0, 1, 3], [1, 2, 3]]));
        assert_eq!(fill(&[[-1., 0., 0.], [0., -2., 0.], [1., 0., 0.], [0., 2., 0.]]), Some(vec![[0, 1, 2], [0, 2, 3]]));
    }

    /// 21 steps at the long diagonal against 31 at the short one, which has less area: 3.58 against 3.66.
    #[test]
    fn the_lesser_bend_wins() {
        let points = [[0.0, -1.0, 0.0], [0.3, 0.0, 0.5], [0.0, 1.0, 0.0], [-3.0, 0.0, 0.0]];
        assert_eq!(fill(&points), Some(vec![[0, 1, 3], [1, 2, 3]]));
    }

    #[test]
    fn concave_flat_loops_are_not_folded() {
        for seed in 0..20 {
            let ring = super::super::cases::star([0.0; 2], 40, 1.0, 0.9, seed);
            let points: Vec<[f64; 3]> = ring.iter().map(|&[x, y]| [x, y, 0.5 * x - y]).collect();
            let triangles = fill(&points).expect("a loop");
            assert_eq!(triangles.len(), 38);
            let crosses = triangles.iter().map(|&triangle| cross(&points, triangle));
            let (sum, area) = (crosses.clone().sum::<DVec3>(), crosses.map(DVec3::length).sum::<f64>());
            assert!((sum.length() - area).abs() < 1e-9, "{seed}: {} {area}", sum.length());
        }
    }

    #[test]
    fn corners_on_straight_sides_make_no_flat_triangle() {
        let ring = [[0., 0.], [1., 0.], [2., 0.], [3., 0.], [3., 1.], [3., 2.], [1.5, 2.], [0., 2.], [0., 1.]];
        let points = ring.map(|[x, y]| [x, y, x]);
        let triangles = fill(&points).expect("a loop");
        assert!(triangles.iter().all(|&triangle| cross(&points, triangle).length() > 0.1), "{triangles:?}");
    }

    #[test]
    fn taken_edges_are_avoided() {
        let points = [[-2., 0., 0.], [0., -1., 0.], [2., 0., 0.], [0., 1., 0.]].map(DVec3::from);
        let triangles = |vertices: [u32; 4], taken: [u32; 2]| {
            fill_in_space(&points, &vertices, |a, b| [a, b] == taken || [b, a] == taken)
        };
        assert_eq!(triangles([5, 6, 7, 8], [6, 8]).map(|t| t.len()), Some(2));
        assert_ne!(triangles([5, 6, 7, 8], [6, 8]), triangles([5, 6, 7, 8], [5, 7]));
        assert_eq!(triangles([5, 6, 7, 6], [0, 0]), None);
        assert_eq!(fill_in_space(&points, &[5, 6, 7, 8], |_, _| true), None);
        assert_eq!(fill_in_space(&points[..3], &[5, 6, 7], |_, _| true).map(|t| t.len()), Some(1));
    }

    /// Every vertex twice at most: no diagonal twice, none from a vertex to itself, whatever the loop.
    #[test]
    fn pinched_loops_stay_manifold() {
        let mut filled = 0;
        for seed in 0..200 {
            let count = 5 + tie_hash(seed, 0) % 20;
            let vertices: Vec<u32> = (0..count).map(|i| tie_hash(i, seed) % (2 * count)).collect();
            let at = |v: u32| DVec3::from([1, 2, 3].map(|k| super::super::cases::random(v, seed + 1000 * k)));
            let points: Vec<DVec3> = vertices.iter().map(|&v| at(v)).collect();
            let Some(triangles) = fill_in_space(&points, &vertices, |_, _| false) else { continue };
            filled += 1;
            let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]].map(|side| side.map(|i| vertices[i as usize]));
            let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
            sides.sort_unstable();
            assert!(sides.windows(2).all(|pair| pair[0] != pair[1]) && sides.iter().all(|[a, b]| a != b), "{seed}");
        }
        assert!(filled > 30, "{filled}");
    }

    #[test]
    fn hostile_loops_are_refused() {
        assert_eq!(fill(&[]), None);
        assert_eq!(fill(&[[0.0; 3]; 2]), None);
        assert_eq!(fill(&[[0.0; 3]; MOST_IN_SPACE + 1]), None);
        assert_eq!(fill(&[[f64::NAN; 3]; 5]), None);
        assert_eq!(fill(&[[0.0; 3]; 5]).map(|t| t.len()), Some(3));
        let huge = [[f64::MAX, 0., 0.], [-f64::MAX, 0., 0.], [0., f64::MAX, 0.], [0., -f64::MAX, 1.]];
        assert_eq!(fill(&huge).map(|t| t.len()), Some(2));
    }
}
