//! The faces in a texture around a pair, and where the new vertex may be among them \[Wu12\].
//!
//! They cover a region of the texture, whose rim is the polygon of the far edges of those that survive. No face turns over
//! where all of the rim is seen from the new place. On a border or a seam the polygon is open: only edges of faces count. A best
//! place may lie past the rim there, as the new vertex may, but not past the picture. Sides that share a place may be each
//! other's mirror images, and so may the faces of one side, where a texture is folded along an edge that is no seam: every face
//! keeps its own sign.

use crate::math::DVec2;

use super::layout::Layer;
use super::sides::CornerFace;
use super::uv_kernel::{Kernel, orientation};
use super::wedges::WedgeRows;

/// How much of a kernel is left for a place that has to be moved into it.
const SHRUNK: f64 = 0.95;

/// A face at one of the ends.
#[derive(Debug, Clone, Copy)]
struct ChartFace {
    side: usize,
    dies: bool,
    uv: [DVec2; 3],
    /// Twice its area in the texture.
    area: f64,
    /// The sign that it may not lose: that of its area, or without one what others tell, or zero.
    sign: f64,
}

/// The faces of the sides that have one place in a texture.
#[derive(Debug, Default)]
pub struct Chart {
    faces: Vec<ChartFace>,
    /// Whether each side has areas that are positive, and negative ones.
    has: Vec<[bool; 2]>,
    kernel: Kernel,
}

impl Chart {
    /// Gathers faces with the numbers of their sides, of which there are so many.
    pub fn gather<'a>(
        &mut self,
        wedges: &WedgeRows<'_>,
        layer: &Layer,
        sides: usize,
        faces: impl Iterator<Item = (usize, &'a CornerFace)>,
    ) {
        let places = |face: &CornerFace| face.wedges.map(|wedge| place(layer, wedges.row(wedge)));
        self.gather_triangles(sides, faces.map(|(side, face)| (side, places(face), face.dies)));
    }

    /// [`Chart::gather`] of triangles in the texture, the first corner of which moves, and whether each vanishes.
    fn gather_triangles(&mut self, sides: usize, faces: impl Iterator<Item = (usize, [DVec2; 3], bool)>) {
        self.faces.clear();
        self.has.clear();
        self.has.resize(sides, [false; 2]);
        for (side, uv, dies) in faces {
            let area = orientation(uv[0], uv[1], uv[2]);
            let [positive, negative] = &mut self.has[side];
            (*positive, *negative) = (*positive | (area > 0.0), *negative | (area < 0.0));
            self.faces.push(ChartFace { side, dies, uv, area, sign: 0.0 });
        }
        self.give_signs();
    }

    /// Faces without an area have the sign of their side, if it has one alone; or where that has no area either, of all.
    fn give_signs(&mut self) {
        let all = self.has.iter().fold([false; 2], |all, has| [all[0] | has[0], all[1] | has[1]]);
        let common = if all == [false; 2] { 1.0 } else { only_sign(all) };
        for face in &mut self.faces {
            face.sign = match (face.area, self.has[face.side]) {
                (0.0, [false, false]) => common,
                (0.0, has) => only_sign(has),
                (area, _) => area.signum(),
            };
        }
    }

    /// The corners of the box around all faces.
    fn bounds(&self) -> (DVec2, DVec2) {
        let corners = self.faces.iter().flat_map(|face| face.uv);
        corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), corner| (low.min(corner), high.max(corner)))
    }

    /// Whether no face has an area: none can turn over.
    pub fn is_flat(&self) -> bool {
        self.faces.iter().all(|face| face.area == 0.0)
    }

    /// The place nearest to `at` in the repeats of the picture, of this size, that the faces lie in.
    pub fn within_repeats(&self, at: DVec2, repeat: f64) -> DVec2 {
        let (low, high) = self.bounds();
        at.clamp((low / repeat).floor() * repeat, (high / repeat).ceil() * repeat)
    }

    /// Whether all faces that survive keep their side with the new vertex there.
    pub fn keeps(&self, at: DVec2) -> bool {
        self.faces.iter().fold(true, |all, face| {
            let after = orientation(at, face.uv[1], face.uv[2]) * face.sign;
            all & (face.dies | (after > 0.0) | ((after >= 0.0) & (face.area == 0.0)))
        })
    }

    /// The place nearest to `best` where they do; `None` where there is none, and where a side is folded: pairs that do not run along
    /// the fold would drag it over the surface.
    pub fn nearest(&mut self, best: DVec2) -> Option<DVec2> {
        if self.has.contains(&[true; 2]) {
            return None;
        }
        let (low, high) = self.bounds();
        self.kernel.start(low, high);
        for face in self.faces.iter().filter(|face| !face.dies && face.sign != 0.0) {
            let [_, a, b] = face.uv;
            if face.sign > 0.0 { self.kernel.clip(a, b) } else { self.kernel.clip(b, a) }
        }
        self.kernel.nearest(best, SHRUNK).map(rounded).filter(|&at| self.keeps(at))
    }
}

/// The sign of areas of which some are positive, or negative; zero where there are both, or none.
fn only_sign(has: [bool; 2]) -> f64 {
    f64::from(has[0]) - f64::from(has[1])
}

/// Whether no surviving face of a side turns over with the new vertex at `at`, or none has an area: a [`Chart`] of them tells the
/// same, and where it has to be found what else would do. Nor does this tell of faces that differ in sign.
pub fn all_keep<'a>(
    wedges: &WedgeRows<'_>,
    layer: &Layer,
    faces: impl Iterator<Item = &'a CornerFace>,
    at: DVec2,
) -> bool {
    let numbers = wedges.numbers();
    let places = |face: &CornerFace| face.wedges.map(|wedge| numbers.place(wedge, layer.first).as_dvec2());
    all_triangles_keep(faces.map(|face| (places(face), face.dies)), at)
}

/// [`all_keep`] of triangles in the texture, the first corner of which moves, and whether each vanishes.
fn all_triangles_keep(faces: impl Iterator<Item = ([DVec2; 3], bool)>, at: DVec2) -> bool {
    if !at.is_finite() {
        return false;
    }
    // The least and the greatest of all areas, and of those that faces which could turn over have afterwards.
    let (mut areas, mut left) = ([0.0_f64; 2], [f64::INFINITY, f64::NEG_INFINITY]);
    for ([a, b, c], dies) in faces {
        let (area, after) = (orientation(a, b, c), orientation(at, b, c));
        areas = spanned(areas, [area; 2]);
        let is_free = dies | ((area == 0.0) & (after == 0.0));
        left = spanned(left, if is_free { [f64::INFINITY, f64::NEG_INFINITY] } else { [after; 2] });
    }
    match [areas[1] > 0.0, areas[0] < 0.0] {
        [true, true] => false,
        [false, false] => true,
        [true, false] => left[0] > 0.0,
        [false, true] => left[1] < 0.0,
    }
}

/// The least and the greatest of both.
#[inline(always)]
fn spanned([low, high]: [f64; 2], [least, greatest]: [f64; 2]) -> [f64; 2] {
    [if least < low { least } else { low }, if greatest > high { greatest } else { high }]
}

/// Whether a place lies in the repeat of the picture that a corner lies in, or in its closure: in those of all faces at the corner,
/// then, whatever these are. A corner between repeats is in none.
pub fn is_in_repeat_of(corner: DVec2, at: DVec2, repeat: f64) -> bool {
    let corner = corner / repeat;
    at.cmpge(corner.floor() * repeat).all() && at.cmple(corner.ceil() * repeat).all()
}

/// A place as rows hold it.
pub fn rounded(at: DVec2) -> DVec2 {
    at.as_vec2().as_dvec2()
}

/// The place in a texture that a row tells.
pub fn place(layer: &Layer, row: &[f32]) -> DVec2 {
    match layer.of(row) {
        &[u, v, ..] => DVec2::new(f64::from(u), f64::from(v)),
        _ => DVec2::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::tie_hash;

    /// One pass over a side tells what its chart does, of triangles with and without areas, at any place.
    #[test]
    fn one_pass_tells_what_a_chart_does() {
        let mut told = [0; 3];
        for seed in 0..4000 {
            let mut number = 0;
            let mut below = |count: u32| {
                number += 1;
                tie_hash(number, seed) % count
            };
            let mut at = || DVec2::new(f64::from(below(4)), f64::from(below(4)));
            // A ring around a corner, which may lie outside of it; now and then a face ends where the new vertex is, or vanishes.
            let [center, moved] = [at(), at()];
            let ring = [[3, 1], [3, 3], [1, 3], [0, 1], [1, 0]].map(|[x, y]: [i32; 2]| DVec2::new(x.into(), y.into()));
            let faces: Vec<([DVec2; 3], bool)> = (0..5)
                .map(|i| {
                    let corner = |k: usize| ring[(i + k) % 5];
                    let odd = tie_hash(i as u32, seed) % 12;
                    let last = if odd == 0 { moved } else { corner(1) };
                    ([center, corner(0), last], odd == 1)
                })
                .collect();
            let mut chart = Chart::default();
            chart.gather_triangles(1, faces.iter().map(|&(uv, dies)| (0, uv, dies)));
            let (is_folded, keeps) = (chart.has[0] == [true; 2], chart.is_flat() || chart.keeps(moved));
            assert_eq!(all_triangles_keep(faces.into_iter(), moved), !is_folded && keeps, "{seed}");
            told[if is_folded { 2 } else { usize::from(keeps) }] += 1;
        }
        assert!(told.iter().all(|&count| count > 100), "{told:?}");
    }

    /// Triangles by the numbers of their sides.
    fn chart(faces: &[(usize, [[f64; 2]; 3])]) -> Chart {
        let mut chart = Chart::default();
        let sides = faces.iter().map(|&(side, _)| side + 1).max().unwrap_or(0);
        chart.gather_triangles(sides, faces.iter().map(|&(side, uv)| (side, uv.map(DVec2::from), false)));
        chart
    }

    /// On two sides, and on one that is folded along the edge that they share.
    #[test]
    fn mirror_images_keep_a_sign_each() {
        for sides in [[0, 1], [0, 0]] {
            let mut both = chart(&[
                (sides[0], [[0.0, 0.0], [0.75, 0.0], [0.75, 0.75]]),
                (sides[1], [[0.0, 0.0], [0.75, 0.75], [0.75, 0.0]]),
            ]);
            assert!(both.keeps(DVec2::new(0.5, 0.25)) && !both.keeps(DVec2::new(1.5, 0.25)));
            // Along a fold nothing is moved to where it has to be.
            let nearest = both.nearest(DVec2::new(1.5, 0.25));
            assert_eq!(nearest.is_some_and(|at| both.keeps(at)), sides[0] != sides[1]);
        }
    }

    /// A face without an area may take the sign of those of its side, and where these have both, either.
    #[test]
    fn faces_without_an_area_take_the_sign_of_their_side_alone() {
        let flat = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]];
        let (up, down) = ([[0.0, 0.0], [2.0, 1.0], [1.0, 2.0]], [[0.0, 0.0], [1.0, -2.0], [2.0, -1.0]]);
        let keeps = |faces: &[[[f64; 2]; 3]], y: f64| {
            let faces: Vec<_> = faces.iter().map(|&face| (0, face)).collect();
            chart(&faces).keeps(DVec2::new(0.0, y))
        };
        // Seen from above the flat one is positive.
        let of = |faces: &[[[f64; 2]; 3]]| [-0.125, 0.125].map(|y| keeps(faces, y));
        assert_eq!(of(&[flat, up]), [false, true]);
        let mirrored = up.map(|[x, y]| [-x, y]);
        assert_eq!(of(&[flat, mirrored]), [true, false]);
        let folded = [down, down.map(|[x, y]| [-x, y])];
        assert_eq!(of(&[flat, folded[0], folded[1]]), [true, true]);
    }

    #[test]
    fn places_stay_in_the_repeats_of_their_faces() {
        let one = chart(&[(0, [[0.25, 0.25], [0.75, 0.25], [0.25, 1.75]])]);
        for (at, held) in [([0.9, 0.1], [0.9, 0.1]), ([-0.1, 2.5], [0.0, 2.0]), ([1.5, -0.5], [1.0, 0.0])] {
            let (at, held) = (DVec2::from(at), DVec2::from(held));
            assert_eq!(one.within_repeats(at, 1.0), held);
            // Where it lies in the repeat of a corner nothing is held.
            let is_in = one.faces[0].uv.iter().any(|&corner| is_in_repeat_of(corner, at, 1.0));
            assert!(!is_in || at == held, "{at}");
        }
        // On the edge of the picture as well.
        let edge = DVec2::new(1.0, 0.5);
        assert!(
            !is_in_repeat_of(edge, DVec2::new(1.01, 0.5), 1.0) && !is_in_repeat_of(edge, DVec2::new(0.99, 0.5), 1.0)
        );
        let near = DVec2::new(0.99, 0.5);
        assert!(is_in_repeat_of(near, edge, 1.0) && !is_in_repeat_of(near, DVec2::new(1.01, 0.5), 1.0));
        assert_eq!(one.within_repeats(DVec2::splat(3.0), 4.0), DVec2::splat(3.0));
        assert!(is_in_repeat_of(DVec2::splat(3.0), DVec2::splat(0.5), 4.0));
    }

    /// What lets a pair on the inside of a chart go without [`Chart::within_repeats`].
    #[test]
    fn where_a_closed_fan_keeps_its_faces_is_in_their_repeats() {
        let random = |i: u64| (crate::math::random(7, i) >> 40) as f64 / f64::from(1 << 24);
        let mut kept = 0;
        for case in 0..2_000 {
            let own = |k: u64| random(100 * case + k);
            // A fan around the origin of three to nine faces, from which the place strays as far as its rim and farther.
            let count = 3 + case % 7;
            let at = |k: u64| {
                let angle = (k as f64 + 0.9 * own(k)) * std::f64::consts::TAU / count as f64;
                rounded(DVec2::from_angle(angle) * (0.2 + own(20 + k)))
            };
            // Every second is a mirror image.
            let sign = if case % 2 == 0 { 1.0 } else { -1.0 };
            let corners: Vec<DVec2> = (0..count).map(at).map(|corner| DVec2::new(corner.x * sign, corner.y)).collect();
            let uv = |k: usize| [DVec2::ZERO, corners[k], corners[(k + 1) % corners.len()]];
            let mut fan = Chart::default();
            fan.gather_triangles(1, (0..corners.len()).map(|k| (0, uv(k), false)));
            let place = rounded(DVec2::new(own(50) - 0.5, own(51) - 0.5) * 1.5);
            // A gap of more than half a turn makes no fan.
            if fan.faces.iter().all(|face| face.area * sign > 0.0) && fan.keeps(place) {
                assert_eq!(fan.within_repeats(place, 1.0 / 64.0), place, "{corners:?}");
                kept += 1;
            }
        }
        assert!(kept > 100, "{kept}");
    }
}
