//! Whether faces come to pass through others, as those of both sides of a thin wall, where each is no farther off than its
//! quadric tells.
//!
//! Asked of what passed all filters, on a surface that one task works on: no other moves what is far away meanwhile.

#![expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f64x4};

use crate::math::wide::{WIDE, WideRows, WideVec3};
use crate::math::{DVec3, Vec3};
use crate::spatial::bounds::Bounds;
use crate::spatial::crossing::cross;
use crate::spatial::wide_tree::{EIGHT, WideBounds, WideTree};

use super::advance::is_bent;
use super::meeting::Meeting;
use super::patch::Patch;
use super::star::Star;

/// How far through each other faces lie that only touch, in the normalized frame: what single precision leaves of positions.
const TOUCHING: f64 = 1e-6;
/// Vertices below which all stars are asked, not those alone that are bent: what passes through a flat one is a wall thinner than a step
/// off the surface. With half as many, two spheres, one within the other by 1/200 of the radius, have 884 of 1,638 faces that
/// intersect, with these none; asking all of them in what was small from the first costs 4 % more time. What was large is watched from
/// about there on.
const FEW: usize = 1 << 11;
/// Faces near a pair beyond which they are a tangle, in which all pass through others: there are some thirty.
const MOST_NEAR: usize = 256;

/// Four faces that a pair would leave, about their new vertex.
#[derive(Debug, Clone, Copy, Default)]
struct NewFaces {
    /// The corners after the new vertex.
    points: [WideRows; 2],
    normals: WideRows,
    /// How far from their planes, times the lengths of their normals, is on neither side.
    within: [f64; WIDE],
}

impl NewFaces {
    /// Finds their planes.
    #[inline(always)]
    fn find_planes<S: Simd>(&mut self, simd: S) {
        let normals = self.points[0].load(simd).cross(self.points[1].load(simd));
        self.within = (normals.length_squared().sqrt() * f64x4::splat(simd, TOUCHING)).into();
        self.normals = normals.store();
    }

    /// Which of `lanes` reach to both sides of the other's plane, and have it on both sides of theirs. Its plane first: that leaves few.
    #[inline(always)]
    fn between<S: Simd>(&self, simd: S, lanes: u8, other: &OtherFace<S>) -> u8 {
        let zero = f64x4::splat(simd, 0.0);
        let [a, b, c] = other.corners;
        let at_vertex = zero - other.normal.dot(a);
        let at_first = other.normal.dot(self.points[0].load(simd) - a);
        let at_second = other.normal.dot(self.points[1].load(simd) - a);
        let (least, greatest) = (at_vertex.min(at_first).min(at_second), at_vertex.max(at_first).max(at_second));
        let on_both = least.simd_lt(zero - other.within) & greatest.simd_gt(other.within);
        let through_other = lanes & on_both.to_bitmask() as u8;
        if through_other == 0 {
            return 0;
        }
        let (normals, within): (_, f64x4<S>) = (self.normals.load(simd), self.within.simd_into(simd));
        let (at_a, at_b, at_c) = (normals.dot(a), normals.dot(b), normals.dot(c));
        let on_both = at_a.min(at_b).min(at_c).simd_lt(zero - within) & at_a.max(at_b).max(at_c).simd_gt(within);
        through_other & on_both.to_bitmask() as u8
    }

    /// The corners of a face about the new vertex.
    #[inline(always)]
    fn corners(&self, lane: usize) -> [DVec3; 3] {
        [DVec3::ZERO, self.points[0].get(lane), self.points[1].get(lane)]
    }
}

/// A face that new ones may pass through, about their vertex.
struct OtherFace<S: Simd> {
    corners: [WideVec3<S>; 3],
    normal: WideVec3<S>,
    /// As that of [`NewFaces`].
    within: f64x4<S>,
}

impl<S: Simd> OtherFace<S> {
    #[inline(always)]
    fn of(simd: S, [a, b, c]: [DVec3; 3]) -> Self {
        let normal = (b - a).cross(c - a);
        let within = f64x4::splat(simd, TOUCHING * normal.length());
        let corners = [WideVec3::splat(simd, a), WideVec3::splat(simd, b), WideVec3::splat(simd, c)];
        Self { corners, normal: WideVec3::splat(simd, normal), within }
    }
}

/// The faces of a surface by where they are.
#[derive(Debug)]
pub struct Crossings {
    level: Level,
    tree: WideTree,
    /// Faces whose boxes meet that of a pair's star.
    near: Vec<u32>,
    /// The faces that a pair leaves, side by side.
    by_eight: Vec<WideBounds>,
    by_four: Vec<NewFaces>,
    meeting: Meeting,
    /// Which stars that are not bent vertices were last on the rim of, by their numbers, and how many there were.
    rims: Vec<u32>,
    stars: u32,
}

impl Default for Crossings {
    fn default() -> Self {
        Self {
            level: Level::new(),
            tree: WideTree::default(),
            near: Vec::new(),
            by_eight: Vec::new(),
            by_four: Vec::new(),
            meeting: Meeting::default(),
            rims: Vec::new(),
            stars: 0,
        }
    }
}

impl Crossings {
    /// Finds where the faces of a surface are, which the patch is the whole of.
    pub fn start(&mut self, patch: &Patch<'_>) {
        let bounds = |f: u32| live_corners(f, patch).map_or(Bounds::NONE, |now| Bounds::of(positions(now, patch)));
        self.tree.build((0..patch.connectivity.faces.len() as u32).map(bounds));
        self.rims.clear();
        self.rims.resize(patch.len(), 0);
        self.stars = 0;
    }

    /// Whether a face of the star of a pair whose vertex goes to `at` would pass through another, where none of the star touches or
    /// crosses another now.
    ///
    /// Faces on the rim of a star that is not bent are taken to lie beside it.
    pub fn would_cross(&mut self, patch: &Patch<'_>, star: &Star, pair: [u32; 2], at: Vec3) -> bool {
        let mean: DVec3 = (0..star.faces().len()).map(|number| star.quads.normal(number)).sum();
        let is_bent = is_bent(star, (mean != DVec3::ZERO).then_some(mean));
        if !is_bent && patch.len() >= FEW {
            return false;
        }
        self.list_near(patch, star, at);
        self.leave_out_own(patch, star, pair, !is_bent);
        if self.near.is_empty() || self.near.len() > MOST_NEAR {
            return false;
        }
        self.unfold_new(patch, star, at);
        let crossed = dispatch!(self.level, simd => self.find_crossed(simd, patch, at));
        crossed.is_some_and(|crossed| !self.meets_now(patch, star, pair, crossed))
    }

    /// Lists the faces near those that a pair leaves.
    fn list_near(&mut self, patch: &Patch<'_>, star: &Star, at: Vec3) {
        let Self { level, tree, near, .. } = self;
        let corners = star.faces()[..star.survivors()].iter().flat_map(|face| positions(face.others, patch));
        let around = Bounds::of(corners.chain([at]));
        dispatch!(*level, simd => tree.list_meeting(simd, &around, near));
    }

    /// Leaves out a pair's own faces, and those on the rim of its star where these lie beside it.
    fn leave_out_own(&mut self, patch: &Patch<'_>, star: &Star, pair: [u32; 2], lie_beside: bool) {
        let Self { near, rims, stars, .. } = self;
        if lie_beside {
            *stars += 1;
            for v in star.faces()[..star.survivors()].iter().flat_map(|face| face.others) {
                rims[patch.local(v)] = *stars;
                if let Some(absorbed) = patch.absorbed(v) {
                    rims[patch.local(absorbed)] = *stars;
                }
            }
        }
        let faces = patch.connectivity.faces;
        // Ends have the names that they had as the round began, and what vanished into a corner of the rim is on it, too.
        near.retain(|&f| {
            let [a, b, c] = faces[f as usize].corners();
            let is_end = |v: u32| (v == pair[0]) | (v == pair[1]);
            let is_on_rim = |v: u32| rims[patch.local(v)] == *stars;
            let is_own = is_end(a) | is_end(b) | is_end(c);
            !(is_own || lie_beside && (is_on_rim(a) | is_on_rim(b) | is_on_rim(c)))
        });
    }

    /// One of the faces near a pair that one of its new faces passes through.
    #[inline(always)]
    fn find_crossed<S: Simd>(&mut self, simd: S, patch: &Patch<'_>, at: Vec3) -> Option<u32> {
        let Self { tree, near, by_eight, by_four, .. } = self;
        let from = at.as_dvec3();
        // Loops: closures are compiled for any processor.
        for four in by_four.iter_mut() {
            four.find_planes(simd);
        }
        for &f in near.iter() {
            let bounds = tree.bounds(f as usize);
            let mut other = None;
            for (eight, four) in by_eight.iter().zip(by_four.chunks(EIGHT / WIDE)) {
                let met = eight.meeting(simd, &bounds);
                if met == 0 {
                    continue;
                }
                if other.is_none() {
                    let Some(now) = live_corners(f, patch) else { break };
                    let corners = positions(now, patch).map(|p| p.as_dvec3() - from);
                    other = Some((corners, OtherFace::of(simd, corners)));
                }
                let Some((corners, wide)) = &other else { break };
                for (half, new) in four.iter().enumerate() {
                    let mut lanes = (met >> (half * WIDE)) & ((1 << WIDE) - 1);
                    if lanes != 0 {
                        lanes = new.between(simd, lanes, wide);
                    }
                    while lanes != 0 {
                        if cross(new.corners(lanes.trailing_zeros() as usize), *corners, TOUCHING) {
                            return Some(f);
                        }
                        lanes &= lanes - 1;
                    }
                }
            }
        }
        None
    }

    /// Whether a face of a star touches or crosses one that is none of it: that which new ones cross, or another of the `near`.
    #[cold]
    fn meets_now(&mut self, patch: &Patch<'_>, star: &Star, pair: [u32; 2], crossed: u32) -> bool {
        let Self { near, meeting, .. } = self;
        meeting.gather(patch, star, pair, TOUCHING);
        let meets = |f: u32| live_corners(f, patch).is_some_and(|vertices| meeting.meets(vertices, patch));
        meets(crossed) || near.iter().any(|&f| meets(f))
    }

    /// Lays the faces that a pair leaves side by side.
    fn unfold_new(&mut self, patch: &Patch<'_>, star: &Star, at: Vec3) {
        let Self { by_eight, by_four, .. } = self;
        let (count, from) = (star.survivors(), at.as_dvec3());
        by_eight.clear();
        by_eight.resize(count.div_ceil(EIGHT), WideBounds::NONE);
        by_four.clear();
        by_four.resize(count.div_ceil(WIDE), NewFaces::default());
        for (number, face) in star.faces()[..count].iter().enumerate() {
            let points = positions(face.others, patch);
            by_eight[number / EIGHT].set(number % EIGHT, Bounds::of([at, points[0], points[1]]));
            for (rows, p) in by_four[number / WIDE].points.iter_mut().zip(points) {
                rows.set(number % WIDE, p.as_dvec3() - from);
            }
        }
    }

    /// Follows the contraction of a pair whose vertex went to `at`.
    pub fn follow(&mut self, patch: &Patch<'_>, star: &Star, at: Vec3) {
        for face in &star.faces()[..star.survivors()] {
            let [p1, p2] = positions(face.others, patch);
            self.tree.replace(face.face as usize, Bounds::of([at, p1, p2]));
        }
        for face in star.shared() {
            self.tree.replace(face.face as usize, Bounds::NONE);
        }
    }
}

/// The corners of a face as they are now; `None` for one that died this round.
#[inline(always)]
fn live_corners(f: u32, patch: &Patch<'_>) -> Option<[u32; 3]> {
    let [a, b, c] = patch.connectivity.faces[f as usize].corners().map(|v| patch.current(v));
    let [a, b, c] = [a?, b?, c?];
    (a != b && b != c && c != a).then_some([a, b, c])
}

/// Where vertices stand.
#[inline(always)]
fn positions<const N: usize>(vertices: [u32; N], patch: &Patch<'_>) -> [Vec3; N] {
    vertices.map(|v| patch.position(v).xyz())
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::patch::{Accumulated, Placed};
    use super::super::prepare::prepare;
    use super::super::surface::Surface;
    use super::*;
    use crate::backend::Device;
    use crate::mesh::{Mesh, shapes};
    use crate::spatial::crossing::lies_on;

    const SIDE: u32 = 6;
    const GAP: f64 = 0.125;

    /// Two planes of `side`² squares, one so far above the other, and where `has_wall` another that stands in both.
    fn sheets(side: u32, has_wall: bool) -> Mesh {
        let plane = shapes::plane(side, side);
        let half = f64::from(side) / 2.0;
        let mut mesh = Mesh::default();
        let mut add = |place: &dyn Fn(DVec3) -> DVec3| {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(plane.positions.iter().map(|&p| place(p)));
            mesh.faces.extend(plane.faces.iter().map(|face| face.map(|v| v + first)));
        };
        add(&|p| p);
        add(&|p| p + DVec3::Z * GAP);
        if has_wall {
            add(&|p| DVec3::new(half + 0.01, p.x - 0.005, p.y - half));
        }
        mesh
    }

    /// Tells a patch that is the whole of a mesh, with its crossings, and how long the mesh's unit is in it.
    fn on_patch(mesh: &Mesh, test: impl FnOnce(Patch<'_>, &mut Crossings, f64)) {
        let mut prepared = prepare(mesh, &Options::default()).expect("a valid mesh");
        let device = Device::cpu(1).expect("a device");
        let length = prepared.frame.length_to_rows(1.0);
        let start = prepared.take_start();
        let mut surface = Surface::new(&mut device.cpu_queue(), start, false).expect("room");
        let patch = Patch::whole(&mut surface, &mut prepared.carried);
        let mut crossings = Crossings::default();
        crossings.start(&patch);
        test(patch, &mut crossings, length);
    }

    /// A pair away from borders and its star, in one of the horizontal sheets.
    struct Flat {
        pair: [u32; 2],
        star: Star,
        middle: DVec3,
        is_upper: bool,
    }

    fn flats(patch: &Patch<'_>) -> Vec<Flat> {
        let at = |v: u32| patch.position(v).xyz().as_dvec3();
        let mut flats = Vec::new();
        for corners in patch.connectivity.faces.iter().map(|face| face.corners()) {
            for pair @ [u, w] in [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]) {
                let (h, middle) = ((at(w) - at(u)) * 0.5, (at(u) + at(w)) * 0.5);
                let is_inside = |v: u32| patch.connectivity.ring(v).len() == 6;
                if u > w || !is_inside(u) || !is_inside(w) {
                    continue;
                }
                let mut star = Star::default();
                star.gather(pair, h, patch).expect("all of the surface");
                star.locate(middle, patch);
                if (0..star.faces().len()).all(|number| star.quads.normal(number).z > 0.0) {
                    flats.push(Flat { pair, star, middle, is_upper: false });
                }
            }
        }
        let lowest = flats.iter().map(|flat| flat.middle.z).fold(f64::INFINITY, f64::min);
        flats.iter_mut().for_each(|flat| flat.is_upper = flat.middle.z > lowest);
        flats
    }

    #[test]
    fn a_star_that_reaches_through_a_sheet_crosses_it_and_one_in_front_of_it_does_not() {
        on_patch(&sheets(SIDE, false), |patch, crossings, length| {
            let mut asked = [0; 2];
            for Flat { pair, star, middle, is_upper } in &flats(&patch) {
                for (share, reaches) in [(0.0, false), (0.5, false), (0.99, false), (1.1, true), (3.0, true)] {
                    for toward in [false, true] {
                        let up = if *is_upper == toward { -share } else { share };
                        let at = (*middle + DVec3::Z * up * GAP * length).as_vec3();
                        let found = crossings.would_cross(&patch, star, *pair, at);
                        assert_eq!(found, reaches && toward, "{share} {toward}");
                        asked[usize::from(found)] += 1;
                    }
                }
            }
            assert!(asked[0] > 100 && asked[1] > 100, "{asked:?}");
        });
        // Where many vertices are left a flat star is not asked.
        on_patch(&sheets(32, false), |patch, crossings, length| {
            assert!(patch.len() >= FEW);
            let flats = flats(&patch);
            let Flat { pair, star, middle, .. } = flats.iter().find(|flat| !flat.is_upper).expect("a star");
            assert!(!crossings.would_cross(&patch, star, *pair, (*middle + DVec3::Z * 3.0 * GAP * length).as_vec3()));
        });
    }

    /// A cube whose walls have dents, so that stars of all kinds reach through what is beside them.
    #[test]
    fn what_is_found_is_what_a_look_at_all_faces_finds() {
        let mut mesh = shapes::cube(5);
        for (v, p) in mesh.positions.iter_mut().enumerate() {
            let v = v as f64;
            *p += DVec3::new((7.0 * v).sin(), (11.0 * v).sin(), (5.0 * v).sin()) * 0.3;
        }
        on_patch(&mesh, |patch, crossings, _| {
            let (mut bent, mut flat, mut on_rim) = ([0; 2], [0; 2], 0);
            let at = |v: u32| patch.position(v).xyz().as_dvec3();
            for corners in patch.connectivity.faces.iter().map(|face| face.corners()) {
                for pair @ [u, w] in [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]) {
                    let (h, middle) = ((at(w) - at(u)) * 0.5, (at(u) + at(w)) * 0.5);
                    let mut star = Star::default();
                    star.gather(pair, h, &patch).expect("all of the surface");
                    star.locate(middle, &patch);
                    let mean: DVec3 = (0..star.faces().len()).map(|number| star.quads.normal(number)).sum();
                    let is_bent = is_bent(&star, Some(mean));
                    for aside in DVec3::AXES.into_iter().chain(DVec3::AXES.map(|axis| -axis)) {
                        let x = (middle + aside * 3.0 * h.length()).as_vec3();
                        let new = star.faces()[..star.survivors()]
                            .iter()
                            .map(|face| [x.as_dvec3(), at(face.others[0]), at(face.others[1])]);
                        let has_rim = |face: &[u32; 3]| star.faces().iter().any(|own| face.iter().any(|&v| own.has(v)));
                        let faces = patch.connectivity.faces.iter().map(|face| face.corners());
                        let others: Vec<[u32; 3]> =
                            faces.filter(|face| !face.contains(&u) && !face.contains(&w)).collect();
                        let crossed = |face: &&[u32; 3]| new.clone().any(|new| cross(new, face.map(at), TOUCHING));
                        let all: Vec<_> = others.iter().filter(crossed).collect();
                        let asked = all.iter().filter(|face| is_bent || !has_rim(face)).count();
                        let expected = asked > 0 && !meets_any(&patch, &star, pair, &others);
                        assert_eq!(crossings.would_cross(&patch, &star, pair, x), expected);
                        let counts = if is_bent { &mut bent } else { &mut flat };
                        counts[usize::from(expected)] += 1;
                        on_rim += u32::from(is_bent && expected && all.iter().all(|face| has_rim(face)));
                    }
                }
            }
            assert!(bent.iter().chain(&flat).all(|&count| count > 20) && on_rim > 20, "{bent:?} {flat:?} {on_rim}");
        });
    }

    /// Whether the star of a pair crosses or touches one of some faces as it is.
    fn meets_any(patch: &Patch<'_>, star: &Star, pair: [u32; 2], others: &[[u32; 3]]) -> bool {
        let at = |v: u32| patch.position(v).xyz().as_dvec3();
        let own = (0..star.faces().len()).map(|number| {
            let end = pair[usize::from(star.numbers_of_second().contains(&number))];
            [end, star.face(number).others[0], star.face(number).others[1]]
        });
        let on = |corners: [u32; 3], face: [u32; 3]| {
            corners.iter().any(|v| !face.contains(v) && lies_on(at(*v), face.map(at), TOUCHING))
        };
        own.into_iter().any(|own| {
            others.iter().any(|&face| cross(own.map(at), face.map(at), TOUCHING) || on(own, face) || on(face, own))
        })
    }

    #[test]
    fn what_meets_already_may_cross() {
        on_patch(&sheets(SIDE, true), |patch, crossings, length| {
            let positions = |v: u32| patch.position(v).xyz();
            let stands = |p: &[Vec3; 3]| p[0].x == p[1].x && p[1].x == p[2].x;
            let mut faces = patch.connectivity.faces.iter().map(|face| face.corners().map(positions));
            let wall = faces.find(stands).expect("a wall")[0].x;
            let (mut met, mut free) = (0, 0);
            for Flat { pair, star, middle, .. } in flats(&patch).iter().filter(|flat| !flat.is_upper) {
                let at = (*middle + DVec3::Z * 2.0 * GAP * length).as_vec3();
                let along = || star.faces().iter().flat_map(|face| face.others).map(|v| positions(v).x);
                let has_wall = along().any(|x| x < wall) && along().any(|x| x > wall);
                assert_eq!(crossings.would_cross(&patch, star, *pair, at), !has_wall);
                if has_wall { met += 1 } else { free += 1 }
            }
            assert!(met > 0 && free > 0, "{met}, {free}");
        });
    }

    #[test]
    fn what_was_contracted_is_where_it_is_now() {
        on_patch(&sheets(SIDE, false), |mut patch, crossings, length| {
            let flats = flats(&patch);
            let below: Vec<_> = flats.iter().filter(|flat| !flat.is_upper).collect();
            let Flat { pair, star, middle, .. } = below[below.len() / 2];
            let is_facing = |other: &&Flat| {
                let beside = other.middle - *middle;
                other.is_upper && beside.x.hypot(beside.y) < 1e-6 * length
            };
            let facing = flats.iter().find(is_facing).expect("a pair above");
            let at = |share: f64| (*middle + DVec3::Z * share * GAP * length).as_vec3();
            let facing_crosses = |crossings: &mut Crossings, patch: &Patch<'_>, share: f64| {
                crossings.would_cross(patch, &facing.star, facing.pair, at(share))
            };
            // One goes up to just below the sheet above, whose pair goes halfway down: after it that crosses.
            assert!(!facing_crosses(crossings, &patch, 0.5));
            assert!(!crossings.would_cross(&patch, star, *pair, at(0.9)));
            let accumulated = Accumulated::Drift(0.0);
            patch.contract(*pair, &Placed { x: at(0.9), t: 0.5, accumulated, flags: 0 });
            crossings.follow(&patch, star, at(0.9));
            assert!(facing_crosses(crossings, &patch, 0.5) && !facing_crosses(crossings, &patch, 1.5));
            // Also for a commit that begins now.
            crossings.start(&patch);
            assert!(facing_crosses(crossings, &patch, 0.5) && !facing_crosses(crossings, &patch, 1.5));
        });
    }
}
