//! Diagonals of triangulated outlines replaced by others.

use robust::{Coord, incircle};
use rustc_hash::{FxBuildHasher, FxHashMap};

use super::sides::turn;
use super::{Outline, Sketch};
use crate::math::DVec2;

/// Flips of [`improve`] for each triangle, at most. Most outlines need about one, long combs as many as they have teeth.
const MOST_A_TRIANGLE: usize = 16;

/// Flips that [`flip_away`] tries one after another, at most.
const MOST_FLIPS: usize = 4;

/// Replaces diagonals until the triangles are Delaunay's, as far as the outline lets them: of two triangles that are a convex
/// quadrilateral the other two where a corner lies in the circle around the other three.
///
/// Edges of the outline stay, and none becomes an edge whose mesh vertices `is_taken` accepts. The triangles are those of
/// [`triangulate`](super::triangulate).
pub fn improve(outline: &Outline, triangles: &mut [[u32; 3]], is_taken: impl FnMut(u32, u32) -> bool) {
    let Some(mut flips) = Flips::new(outline, triangles, is_taken) else { return };
    // The last edge first, so that what one flip makes possible comes next.
    let mut open: Vec<[u32; 2]> = flips.triangles.iter().flat_map(sides).filter(|[a, b]| a < b).collect();
    let mut left = MOST_A_TRIANGLE * flips.triangles.len();
    while let Some([a, b]) = open.pop() {
        let Some(quad) = flips.quad(a, b).filter(|&quad| flips.is_crowded(quad)) else { continue };
        if flips.flip(quad).is_some() {
            open.extend(quad.sides());
            left -= 1;
            if left == 0 {
                return;
            }
        }
    }
}

/// Replaces diagonals so that none joins these two mesh vertices any more: by a few flips, else by other ears. False, with
/// nothing changed, where neither does it or there is no such diagonal. As in [`improve`], edges of the outline stay and none
/// becomes a taken one; what `is_taken` says of the diagonals that are there does not matter.
pub fn flip_away(
    outline: &Outline,
    triangles: &mut [[u32; 3]],
    diagonal: [u32; 2],
    is_taken: impl Fn(u32, u32) -> bool,
) -> bool {
    let vertex = |i: u32| outline.vertices[i as usize];
    let Some(mut flips) = Flips::new(outline, triangles, &is_taken) else { return false };
    let found = flips.triangles.iter().flat_map(sides).find(|side| side.map(vertex) == diagonal);
    let Some([a, b]) = found.filter(|&[a, b]| flips.quad(a, b).is_some()) else { return false };
    if (1..=MOST_FLIPS).any(|most| flips.clear([a, b], most)) {
        return true;
    }
    let [v, w] = diagonal;
    let own = flips.left;
    let may_join =
        |a: u32, b: u32| [a, b] != [v, w] && [b, a] != [v, w] && (own.contains_key(&[a, b]) || !is_taken(a, b));
    match Sketch::new(outline).and_then(|mut sketch| sketch.clip_ears(may_join)) {
        Some(ears) if ears.len() == triangles.len() => triangles.copy_from_slice(&ears),
        _ => return false,
    }
    true
}

fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Triangles and which lies at every edge.
struct Flips<'a, F> {
    outline: &'a Outline,
    points: Vec<DVec2>,
    triangles: &'a mut [[u32; 3]],
    /// The triangle to the left of every edge, by the mesh vertices.
    left: FxHashMap<[u32; 2], u32>,
    is_taken: F,
}

/// Two triangles, `a b c` and `b a d`, at the diagonal from `a` to `b`.
#[derive(Clone, Copy)]
struct Quad {
    corners: [u32; 4],
    triangles: [u32; 2],
}

impl Quad {
    fn sides(self) -> [[u32; 2]; 4] {
        let [a, b, c, d] = self.corners;
        [[b, c], [c, a], [a, d], [d, b]]
    }
}

impl<'a, F: FnMut(u32, u32) -> bool> Flips<'a, F> {
    fn new(outline: &'a Outline, triangles: &'a mut [[u32; 3]], is_taken: F) -> Option<Self> {
        let is_known = |&i: &u32| (i as usize) < outline.points.len();
        if !outline.is_sound() || !triangles.iter().flatten().all(is_known) {
            return None;
        }
        let left = FxHashMap::with_capacity_and_hasher(3 * triangles.len(), FxBuildHasher);
        let mut flips = Self { outline, points: outline.scaled(), triangles, left, is_taken };
        (0..flips.triangles.len()).for_each(|at| flips.put(at as u32, flips.triangles[at]));
        Some(flips)
    }

    /// Makes this the triangle of that number.
    fn put(&mut self, at: u32, triangle: [u32; 3]) {
        self.triangles[at as usize] = triangle;
        for [a, b] in sides(&triangle) {
            self.left.insert(self.side(a, b), at);
        }
    }

    fn side(&self, a: u32, b: u32) -> [u32; 2] {
        [a, b].map(|i| self.outline.vertices[i as usize])
    }

    /// The triangle to the left of an edge, and its third corner.
    fn apex(&self, a: u32, b: u32) -> Option<(u32, u32)> {
        let triangle = *self.left.get(&self.side(a, b))?;
        let is_other = |&&c: &&u32| !self.side(a, b).contains(&self.outline.vertices[c as usize]);
        Some((triangle, *self.triangles[triangle as usize].iter().find(is_other)?))
    }

    fn quad(&self, a: u32, b: u32) -> Option<Quad> {
        let (first, c) = self.apex(a, b)?;
        let (second, d) = self.apex(b, a)?;
        Some(Quad { corners: [a, b, c, d], triangles: [first, second] })
    }

    /// Whether a corner lies in the circle around the other three.
    fn is_crowded(&self, quad: Quad) -> bool {
        let [a, b, c, d] = quad.corners.map(|i| self.points[i as usize]).map(|p| Coord { x: p.x, y: p.y });
        incircle(a, b, c, d) > 0.0
    }

    /// Replaces the diagonal from `a` to `b`, if that is legal, and returns the other one.
    /// ```text
    ///     c            c
    ///   /   \        / | \
    ///  a --- b   →  a  |  b
    ///   \   /        \ | /
    ///     d            d
    /// ```
    fn flip(&mut self, quad: Quad) -> Option<[u32; 2]> {
        let [p, q, r, s] = quad.corners.map(|i| self.points[i as usize]);
        let is_convex = turn(p, s, r) > 0.0 && turn(s, q, r) > 0.0;
        let [a, b, c, d] = quad.corners;
        let [v, w] = self.side(c, d);
        let is_new = v != w && !self.left.contains_key(&[v, w]) && !self.left.contains_key(&[w, v]);
        if !is_convex || !is_new || (self.is_taken)(v, w) {
            return None;
        }
        self.replace([a, b], quad.triangles, [[a, d, c], [d, b, c]]);
        Some([c, d])
    }

    /// Puts two triangles in the place of those at a diagonal.
    fn replace(&mut self, [a, b]: [u32; 2], places: [u32; 2], triangles: [[u32; 3]; 2]) {
        self.left.remove(&self.side(a, b));
        self.left.remove(&self.side(b, a));
        places.into_iter().zip(triangles).for_each(|(at, triangle)| self.put(at, triangle));
    }

    /// Takes an edge out of the way of another one, then that one, by so many flips at most; false with nothing changed.
    fn clear(&mut self, [a, b]: [u32; 2], most: usize) -> bool {
        if most == 0 {
            return false;
        }
        let Some(quad) = self.quad(a, b) else { return false };
        if self.flip(quad).is_some() {
            return true;
        }
        for [e, f] in quad.sides() {
            let Some(beside) = self.quad(e, f) else { continue };
            let before = beside.triangles.map(|at| self.triangles[at as usize]);
            let Some(new) = self.flip(beside) else { continue };
            if self.clear([a, b], most - 1) {
                return true;
            }
            self.replace(new, beside.triangles, before);
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::{BOTH, check, checked, comb, outline, plate, spiral, star, turned};
    use super::super::sides::segments_meet;
    use super::*;

    #[test]
    fn flips_make_rounder_triangles() {
        for shape in [plate(5, 20, 0.5, 1), comb(30), turned(spiral(100, 3.0), 0.5)] {
            let angle = |triangles: &[[u32; 3]]| {
                let angles = triangles.iter().map(|t| {
                    let [a, b, c] = t.map(|i| shape.points[i as usize]);
                    (b - a).angle_to(c - a).min((c - b).angle_to(a - b)).min((a - c).angle_to(b - c))
                });
                angles.sum::<f64>() / triangles.len() as f64
            };
            for by in BOTH {
                let mut triangles = checked(&shape, by);
                let before = angle(&triangles);
                improve(&shape, &mut triangles, |_, _| false);
                check(&shape, &triangles);
                assert!(angle(&triangles) > before, "{by:?}: {} after {before}", angle(&triangles));
                let again = triangles.clone();
                improve(&shape, &mut triangles, |_, _| false);
                assert_eq!(triangles, again, "not done the first time");
            }
        }
        // The long diagonal of a kite, unless the short one is taken.
        let kite = outline(&[vec![[0., 0.], [3., -1.], [6., 0.], [3., 1.]]]);
        let long = [[0, 1, 2], [0, 2, 3]];
        let mut triangles = long;
        improve(&kite, &mut triangles, |a, b| [a.min(b), a.max(b)] == [1, 3]);
        assert_eq!(triangles, long);
        improve(&kite, &mut triangles, |_, _| false);
        check(&kite, &triangles);
        assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{triangles:?}");
    }

    /// Whether some other diagonal of an outline without pinches crosses one of its own.
    fn is_avoidable(outline: &Outline, [a, b]: [u32; 2]) -> bool {
        let at = |i: u32| outline.points[i as usize];
        let n = outline.points.len() as u32;
        let crosses = |[p, q]: [u32; 2], [r, s]: [u32; 2]| {
            let shares_end = [p, q].iter().any(|end| [r, s].contains(end));
            !shares_end && segments_meet([p, q].map(at), [r, s].map(at))
        };
        let all = (0..n).flat_map(|p| (0..p).map(move |q| [p, q]));
        all.into_iter().any(|[p, q]| {
            let is_free = || {
                (0..n).all(|i| {
                    let on_it = i != p
                        && i != q
                        && turn(at(p), at(q), at(i)) == 0.0
                        && segments_meet([at(p), at(q)], [at(i); 2]);
                    !on_it && !crosses([p, q], [i, outline.successor(i)])
                })
            };
            crosses([p, q], [a, b]) && is_free()
        })
    }

    #[test]
    fn an_edge_is_flipped_away() {
        for shape in [plate(3, 12, 0.5, 1), outline(&[star([0.0; 2], 60, 1.0, 0.9, 1)]), comb(8)] {
            for by in BOTH {
                let triangles = checked(&shape, by);
                let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
                let has = |triangles: &[[u32; 3]], [a, b]: [u32; 2]| {
                    triangles.iter().flat_map(sides).any(|side| side == [a, b] || side == [b, a])
                };
                let (mut gone, mut kept) = (0, 0);
                for diagonal in triangles.iter().flat_map(sides) {
                    let mut after = triangles.clone();
                    if flip_away(&shape, &mut after, diagonal, |_, _| false) {
                        gone += 1;
                        check(&shape, &after);
                        assert!(!has(&after, diagonal));
                    } else {
                        assert_eq!(after, triangles);
                        let is_side = (0..).zip(shape.successors()).any(|side| diagonal == [side.0, side.1]);
                        kept += usize::from(!is_side && is_avoidable(&shape, diagonal));
                    }
                    let mut after = triangles.clone();
                    assert!(!flip_away(&shape, &mut after, diagonal, |_, _| true) && after == triangles);
                }
                // What another diagonal crosses can go, but not always so simply.
                assert!(4 * kept < gone, "{by:?}: {gone} gone, {kept} kept");
            }
        }
    }
}
