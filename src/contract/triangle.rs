//! A triangle that becomes one vertex: two contractions, both examined on the faces around it before anything changes.
//!
//! ```text
//!      \   /            m, x, y   the corners; m is the lowest
//!    ---m---            first x becomes part of m, then y does: faces on x m and on y m or x y vanish with
//!      / \              the triangle, four of them on the inside
//!  ---x---y---
//! ```
//!
//! # Reference
//! \[Wu12\]: a contraction of a triangle is two of edges, legal where both are: the link condition holds on the surface, and
//! then on what the first leaves. Shapes count only at the end.

use crate::kernel::contract_quadrics::contracted;
use crate::kernel::rows::{Contraction, LOCKED, SEAM};
use crate::math::{DVec3, Vec3};
use crate::spatial::triangle::closest_point;

use super::Placement;
use super::examine::Examiner;
use super::filter::{Rejection, faces_hold, link_condition};
use super::patch::{Accumulated, Patch, Placed};
use super::placement::Quadric;
use super::star::{Outside, Star, StarFace, seen};

/// A legal contraction of a triangle.
#[derive(Debug, Clone, Copy)]
pub struct AcceptedTriangle {
    /// The lowest corner, and those that become part of it one after the other.
    pub ends: [u32; 3],
    /// What either contraction writes.
    pub placed: [Placed; 2],
    /// The corners in the order in which their sides were found, and which of them the new vertex stands at.
    pub corners: [u32; 3],
    pub end: Option<usize>,
    /// The faces that either removes.
    pub faces_removed: [usize; 2],
    pub deviation: f32,
}

/// The live faces around a triangle, about its center.
#[derive(Debug, Default)]
struct TriangleStar {
    /// Faces with all three corners.
    whole: Vec<StarFace>,
    /// Faces with one of the corners alone.
    own: [Vec<StarFace>; 3],
    /// Faces with two: the first and second, seen from the first; the first and third, from the first; the second and
    /// third, from the second.
    mutual: [Vec<StarFace>; 3],
}

impl TriangleStar {
    fn gather(ends: [u32; 3], patch: &Patch<'_>) -> Result<Self, Outside> {
        let mut star = Self::default();
        let [_, second, third] = ends;
        for (end, &vertex) in ends.iter().enumerate() {
            for &f in patch.connectivity.ring(vertex) {
                let Some(face) = seen(f, vertex, patch)? else { continue };
                let told = ends[..end].iter().any(|&before| face.has(before));
                if told {
                    continue;
                }
                let rows = match (end, face.has(second), face.has(third)) {
                    (0, true, true) => &mut star.whole,
                    (0, true, false) => &mut star.mutual[0],
                    (0, false, true) => &mut star.mutual[1],
                    (1, _, true) => &mut star.mutual[2],
                    _ => &mut star.own[end],
                };
                rows.push(face);
            }
        }
        Ok(star)
    }

    /// The faces that two contractions remove, or why one of them is illegal: the first corner takes in `ends[order[0]]`,
    /// then `ends[order[1]]`.
    fn steps(&self, ends: [u32; 3], flags: [u32; 3], order: [usize; 2]) -> Result<[usize; 2], Rejection> {
        let [x, y] = order;
        let (with_x, with_y) = (&self.mutual[x - 1], &self.mutual[y - 1]);
        // Those with both others, seen from x.
        let far: Vec<StarFace> = self.mutual[2].iter().map(|face| seen_from(face, ends[x], ends[y])).collect();
        let joined = |parts: [&[StarFace]; 2]| parts.concat();
        let before = [joined([&self.own[0], with_y]), joined([&self.own[x], &far]), joined([&self.whole, with_x])];
        let before = Star::of(before.each_ref().map(Vec::as_slice));
        link_condition(&before, ends[x], [flags[0], flags[x]])?;
        let between = [joined([&self.own[0], &self.own[x]]), self.own[y].clone(), joined([with_y, &far])];
        let between = Star::of(between.each_ref().map(Vec::as_slice));
        link_condition(&between, ends[y], [flags[0] | flags[x], flags[y]])?;
        Ok([before.shared().len(), between.shared().len()])
    }
}

/// A face with the corners `x` and `y`, as its other corners stand from `x`.
fn seen_from(face: &StarFace, x: u32, y: u32) -> StarFace {
    StarFace { others: face.others.map(|v| if v == x { y } else { v }), ..*face }
}

impl Examiner {
    /// The contraction of a triangle whose corners are all free and in the patch, or why it is refused.
    ///
    /// # Errors
    /// When its faces reach out of the patch.
    pub fn examine_triangle(
        &mut self,
        patch: &Patch<'_>,
        corners: [u32; 3],
    ) -> Result<Result<AcceptedTriangle, Rejection>, Outside> {
        let lowest = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        let ends = [0, 1, 2].map(|i| corners[(lowest + i) % 3]);
        let at = ends.map(|v| patch.position(v).xyz().as_dvec3());
        let center = (at[0] + at[1] + at[2]) / 3.0;
        let points = at.map(|p| p - center);
        let star = TriangleStar::gather(ends, patch)?;
        Ok(self.judge_triangle(patch, ends, &star, points, center))
    }

    fn judge_triangle(
        &mut self,
        patch: &Patch<'_>,
        ends: [u32; 3],
        star: &TriangleStar,
        points: [DVec3; 3],
        center: DVec3,
    ) -> Result<AcceptedTriangle, Rejection> {
        let flags = ends.map(|v| patch.position(v).flags);
        let orders = [[1, 2], [2, 1]].map(|order| star.steps(ends, flags, order).map(|removed| (order, removed)));
        let [first, second] = orders;
        let ([x, y], faces_removed) = first.or(second)?;

        let mut quadric = Quadric::default();
        ends.iter().zip(points).for_each(|(&v, p)| quadric.add_plane_quadric(patch.quadric(v), p));
        let [a, b, c] = points;
        let radius_sq = points.iter().fold(0.0, |greatest: f64, p| greatest.max(p.length_squared()));
        let mut held = points.iter().zip(flags).filter(|(_, flags)| flags & (LOCKED | SEAM) != 0);
        let place = match (held.next(), held.next(), self.rules.placement) {
            (Some((&p, _)), None, _) => p,
            (Some(_), Some(_), _) => return Err(Rejection::Link),
            (None, _, Placement::Optimal | Placement::Segment) => {
                quadric.least_near(&[DVec3::ZERO, a, b, c], radius_sq, self.rules.regularization)
            }
            (None, _, Placement::EndpointOrMiddle) => quadric.least_of(&[a, b, c, DVec3::ZERO]),
            (None, _, Placement::Endpoint) => quadric.least_of(&points),
        };
        // To the bit at the corners, whose differences may have been rounded.
        let positions = ends.map(|v| patch.position(v).xyz());
        let corner = points.iter().position(|&p| p == place);
        let at = corner.map_or_else(|| (center + place).as_vec3(), |corner| positions[corner]);
        let moved = at.as_dvec3() - center;
        let quads = &mut self.star.quads;
        for (own, p) in star.own.iter().zip(points) {
            quads.locate(own, 0..own.len(), p, center, patch);
            faces_hold(quads, own.len(), p, moved, self.rules.limits)?;
        }

        let rows = ends.map(|v| *patch.quadric(v));
        let between = contracted(rows[0], rows[x], positions[0], positions[x], at);
        let all = contracted(between, rows[y], at, positions[y], at);
        let [between, all] = [between, all].map(Accumulated::Planes);
        let deviation = all.deviation();
        if f64::from(deviation) > self.rules.max_deviation {
            return Err(Rejection::Error);
        }
        self.sides.gather(patch, ends, center);
        self.sides.find_whole(patch, ends)?;
        self.blend.place(patch, &self.sides, moved, corner)?;
        let (corners, ends) = (ends, [ends[0], ends[x], ends[y]]);
        let [first, second] = shares(at, [positions[0], positions[x], positions[y]]);
        let placed =
            [(first, between), (second, all)].map(|(t, accumulated)| Placed { x: at, t, accumulated, flags: 0 });
        Ok(AcceptedTriangle { ends, placed, corners, end: corner, faces_removed, deviation })
    }
}

/// How far the vertex at `at` has gone from the first corner to the second, and from there to the third: 0 and 1 only
/// where it is exactly at one.
fn shares(at: Vec3, corners: [Vec3; 3]) -> [f32; 2] {
    match corners.iter().position(|&corner| corner == at) {
        Some(0) => [0.0, 0.0],
        Some(1) => [1.0, 0.0],
        Some(_) => [0.0, 1.0],
        None => {
            let [a, b, c] = closest_point(at.as_dvec3(), corners.map(Vec3::as_dvec3)).weights;
            let first = if a + b > 0.0 { b / (a + b) } else { 0.5 };
            [first, c].map(|share| (share as f32).clamp(f32::EPSILON, 1.0 - f32::EPSILON))
        }
    }
}

/// The contractions of triangles, two each, as two lists that a device follows one after the other: no vertex is twice in
/// one, and the second has the numbers that compaction gives after the first.
pub fn in_two_steps(contractions: &[Contraction]) -> [Vec<Contraction>; 2] {
    let pairs = contractions.chunks_exact(2);
    let first: Vec<Contraction> = pairs.clone().map(|pair| pair[0]).collect();
    let mut gone: Vec<u32> = first.iter().map(|contraction| contraction.gone).collect();
    gone.sort_unstable();
    let renamed = |vertex: u32| vertex - gone.partition_point(|&gone| gone < vertex) as u32;
    let second = pairs.map(|pair| {
        let Contraction { keep, gone, .. } = pair[1];
        Contraction { keep: renamed(keep), gone: renamed(gone), ..pair[1] }
    });
    let second = second.collect();
    [first, second]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_step_has_the_numbers_that_the_first_leaves() {
        let row = |keep, gone| Contraction { keep, gone, ..Contraction::default() };
        let [first, second] = in_two_steps(&[row(2, 7), row(2, 9), row(3, 4), row(3, 6)]);
        assert_eq!(first, [row(2, 7), row(3, 4)]);
        // Without 4 and 7: 9 is now 7, 6 is 5.
        assert_eq!(second, [row(2, 7), row(3, 5)]);
    }

    #[test]
    fn shares_are_exact_at_the_corners_alone() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(shares(Vec3::ZERO, corners), [0.0, 0.0]);
        assert_eq!(shares(Vec3::X, corners), [1.0, 0.0]);
        assert_eq!(shares(Vec3::Y, corners), [0.0, 1.0]);
        assert_eq!(shares(Vec3::new(0.25, 0.5, 3.0), corners), [0.5, 0.5]);
        let [first, second] = shares(Vec3::new(1.0, -1e-9, 0.0), corners);
        assert!(first < 1.0 && second > 0.0);
    }

    /// The wheel of a triangle 0 1 2 inside of a larger one: every corner with a fan of its own.
    #[test]
    fn both_steps_are_examined() {
        let face = |others: [u32; 2]| StarFace { face: 0, others };
        // Around: 3 across the side 0 1, 4 across 1 2, 5 across 2 0; 6 beyond 0, 7 beyond 1, 8 beyond 2.
        let mut star = TriangleStar {
            whole: vec![face([1, 2])],
            own: [vec![face([5, 6]), face([6, 3])], vec![face([3, 7]), face([7, 4])], vec![face([4, 8]), face([8, 5])]],
            mutual: [vec![face([3, 1])], vec![face([2, 5])], vec![face([4, 2])]],
        };
        assert_eq!(star.steps([0, 1, 2], [0; 3], [1, 2]), Ok([2, 2]));
        assert_eq!(star.steps([0, 1, 2], [0; 3], [2, 1]), Ok([2, 2]));
        // 6 and 8 are one: 0 and 2 have it in common, which either order meets, at its own step.
        star.own[2] = vec![face([4, 6]), face([6, 5])];
        assert_eq!(star.steps([0, 1, 2], [0; 3], [1, 2]), Err(Rejection::Link));
        assert_eq!(star.steps([0, 1, 2], [0; 3], [2, 1]), Err(Rejection::Link));
    }
}
