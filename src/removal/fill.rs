//! The ways to fill a polygon with triangles.

use std::sync::OnceLock;

use super::polygon::{Polygon, Rejection, Tile, Worth};
use super::{Fill, MOST_DYNAMIC, MOST_ENUMERATED};
use crate::mesh::dynamic::best_triangles;

/// Corners in ascending order, by their place in the polygon.
type Triangle = [usize; 3];

/// A fill and its worth.
pub type Filled = (Vec<Triangle>, Worth);

impl Fill {
    /// Fills a polygon, with no normal farther from the average than the cosine says.
    ///
    /// # Errors
    /// Why none of the fills that this policy looks at is legal.
    pub fn fill(self, polygon: &Polygon<'_>, min_cos: f64) -> Result<Filled, Rejection> {
        let count = polygon.len();
        match self {
            // One triangle; or none, where a border takes the place of the last one.
            _ if count < 4 => {
                let triangles = if count == 3 { vec![[0, 1, 2]] } else { Vec::new() };
                let worth = polygon.worth(&triangles, min_cos)?;
                Ok((triangles, worth))
            }
            Self::Fan => best((0..count).map(|apex| fan(count, apex)), polygon, min_cos),
            Self::Ears => ears(polygon, min_cos),
            Self::Exhaustive if count <= MOST_ENUMERATED => best(listed(count).iter().cloned(), polygon, min_cos),
            Self::Dynamic | Self::Exhaustive if count <= MOST_DYNAMIC => dynamic(polygon, min_cos),
            Self::Dynamic | Self::Exhaustive => Self::Fan.fill(polygon, min_cos),
        }
    }
}

/// The best of these, or what most of all keeps one from being legal.
fn best(fills: impl Iterator<Item = Vec<Triangle>>, polygon: &Polygon<'_>, min_cos: f64) -> Result<Filled, Rejection> {
    let mut found: Option<Filled> = None;
    let mut rejection = Rejection::Link;
    for triangles in fills {
        match polygon.worth(&triangles, min_cos) {
            Ok(worth) if worth.beats(found.as_ref().map(|(_, worth)| *worth)) => found = Some((triangles, worth)),
            Ok(_) => {}
            Err(Rejection::Link) => {}
            Err(reason) => rejection = reason,
        }
    }
    found.ok_or(rejection)
}

/// All triangles at one vertex.
fn fan(count: usize, apex: usize) -> Vec<Triangle> {
    let sides = (0..count).map(|i| (i, (i + 1) % count)).filter(|&(i, j)| i != apex && j != apex);
    sides.map(|(i, j)| ascending([apex, i, j])).collect()
}

fn ascending(mut corners: Triangle) -> Triangle {
    corners.sort_unstable();
    corners
}

/// Cuts off the roundest ear until one triangle is left.
fn ears(polygon: &Polygon<'_>, min_cos: f64) -> Result<Filled, Rejection> {
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let mut triangles = Vec::with_capacity(polygon.len() - 2);
    while left.len() > 2 {
        let mut found: Option<(f64, usize)> = None;
        let mut rejection = Rejection::Link;
        for at in 0..left.len() {
            let [before, tip, after] = [left.len() - 1, 0, 1].map(|step| left[(at + step) % left.len()]);
            if left.len() > 3 && !polygon.may_join(before, after) {
                continue;
            }
            let corners = ascending([before, tip, after]);
            let is_ear = |tile: Tile| {
                let others = left.iter().filter(|other| !corners.contains(other));
                let is_better = found.is_none_or(|(ratio, _)| tile.ratio > ratio);
                (is_better && !others.into_iter().any(|&other| holds(polygon, corners, other))).then_some(tile.ratio)
            };
            match polygon.tile(corners, min_cos).map(is_ear) {
                Ok(Some(ratio)) => found = Some((ratio, at)),
                Ok(None) => {}
                Err(reason) => rejection = reason,
            }
        }
        let Some((_, at)) = found else { return Err(rejection) };
        let [before, after] = [left.len() - 1, 1].map(|step| left[(at + step) % left.len()]);
        triangles.push(ascending([before, left[at], after]));
        left.remove(at);
    }
    // The last one is cut off at any of its corners.
    let worth = polygon.worth(&triangles, min_cos)?;
    Ok((triangles, worth))
}

/// Whether another vertex lies in the closed triangle, seen along the average normal.
fn holds(polygon: &Polygon<'_>, [a, b, c]: Triangle, other: usize) -> bool {
    let [a, b, c, p] = [a, b, c, other].map(|i| polygon.point(i));
    let is_left =
        |from: crate::math::DVec3, to: crate::math::DVec3| (to - from).cross(p - from).dot(polygon.normal) >= 0.0;
    is_left(a, b) && is_left(b, c) && is_left(c, a)
}

/// The best fill of the part of a polygon between two of its vertices.
#[derive(Debug, Clone, Copy)]
struct Part {
    worth: Worth,
    /// The normal of the triangle at the side between them; of two neighbors what lies beyond their side.
    normal: Option<crate::math::DVec3>,
}

/// The best fill of every part from the best fills of smaller ones: exact but for the bends at the sides of parts, where
/// only the triangle counts that is best on its own.
fn dynamic(polygon: &Polygon<'_>, min_cos: f64) -> Result<Filled, Rejection> {
    let last = polygon.len() - 1;
    let mut rejection = Rejection::Link;
    // At a border the last side is as new as a diagonal.
    if !polygon.may_join(0, last) {
        return Err(rejection);
    }
    let join = |corners: Triangle, [first, second]: [Part; 2]| match polygon.tile(corners, min_cos) {
        Ok(Tile { normal, ratio }) => {
            let mut worth = first.worth.and(second.worth);
            worth.ratios += ratio;
            worth = worth.with_edge(first.normal, normal).with_edge(second.normal, normal);
            if (corners[0], corners[2]) == (0, last) {
                worth = worth.with_edge(polygon.outside(last), normal);
            }
            Some(Part { worth, normal })
        }
        Err(reason) => {
            rejection = reason;
            None
        }
    };
    let filled = best_triangles(
        polygon.len(),
        |i| Part { worth: Worth::NONE, normal: polygon.outside(i) },
        |i, j| polygon.may_join(i, j),
        join,
        |part, best| part.worth.beats(best.map(|best| best.worth)),
    );
    filled.map(|(triangles, whole)| (triangles, whole.worth)).ok_or(rejection)
}

/// All triangulations of a convex polygon of so many vertices: 1, 2, 5, 14, 42 from three on, the Catalan numbers.
pub fn triangulations(count: usize) -> Vec<Vec<Triangle>> {
    fn between(i: usize, j: usize) -> Vec<Vec<Triangle>> {
        if j <= i + 1 {
            return vec![Vec::new()];
        }
        let at_tip = |tip: usize| {
            let (first, second) = (between(i, tip), between(tip, j));
            first.into_iter().flat_map(move |first| {
                let second = second.clone();
                second.into_iter().map(move |second| [&[[i, tip, j]], &first[..], &second[..]].concat())
            })
        };
        (i + 1..j).flat_map(at_tip).collect()
    }
    if count < 3 { Vec::new() } else { between(0, count - 1) }
}

/// [`triangulations`] of up to [`MOST_ENUMERATED`] vertices, found once.
fn listed(count: usize) -> &'static [Vec<Triangle>] {
    static LISTS: OnceLock<Vec<Vec<Vec<Triangle>>>> = OnceLock::new();
    &LISTS.get_or_init(|| (0..=MOST_ENUMERATED).map(triangulations).collect())[count]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::rows::{Face, Position};
    use crate::kernel::stars::Stars;
    use crate::removal::hole::Hole;

    const MIN_COS: f64 = 0.2;

    /// The hole of the hub of `count` faces whose rim goes up and down.
    fn hole(count: u32, seed: u32) -> Hole {
        let up = |i: u32| (crate::math::tie_hash(i, seed) % 1000) as f32 / 1500.0;
        let at = |i: u32| {
            let angle = i as f32 / count as f32 * std::f32::consts::TAU;
            Position { x: angle.cos(), y: angle.sin(), z: up(i), flags: 0 }
        };
        let positions: Vec<Position> = (0..count).map(at).chain([Position::default()]).collect();
        let faces: Vec<Face> = (0..count).map(|i| Face { a: i, b: (i + 1) % count, c: count }).collect();
        let corners: Vec<[u32; 3]> = faces.iter().map(|face| face.corners()).collect();
        let rings = crate::mesh::Rings::new(&corners, positions.len());
        let stars =
            Stars { positions: &positions, faces: &faces, ring_starts: &rings.starts, ring_faces: &rings.faces };
        let mut hole = Hole::default();
        assert!(hole.read(count, &stars));
        hole
    }

    #[test]
    fn the_ring_is_in_order() {
        let hole = hole(6, 0);
        assert_eq!((&hole.ring[..], hole.is_open), (&[0, 1, 2, 3, 4, 5][..], false));
        assert!(hole.is_side(5, 0) && hole.is_side(2, 1) && !hole.is_side(0, 2));
    }

    #[test]
    fn all_triangulations_hold_the_best_one() {
        let mut gained = 0;
        for (count, seed) in (4..=7).flat_map(|count| (0..40).map(move |seed| (count, seed))) {
            let hole = hole(count, seed);
            let polygons = hole.polygons(&[], -2.0);
            let fill = |fill: Fill| fill.fill(&polygons[0], MIN_COS);
            let Ok((triangles, best)) = fill(Fill::Exhaustive) else { continue };
            assert_eq!(triangles.len(), count as usize - 2);
            for other in [Fill::Fan, Fill::Ears, Fill::Dynamic].into_iter().filter_map(|other| fill(other).ok()) {
                assert!(other.1.least_cos <= best.least_cos, "{count} {seed}: {other:?}");
                assert_eq!(polygons[0].worth(&other.0, MIN_COS).map(|worth| worth.least_cos), Ok(other.1.least_cos));
                gained += u32::from(other.1.least_cos < best.least_cos);
            }
        }
        assert!(gained > 0, "all fill alike");
    }
}
