//! Which edges are pairs, and the half-edge and the face that stand for each. In WGSL: `shaders/shared/pairs.wgsl`.
//!
//! A pair is an edge that may be contracted; its lower end lists it. Of its two half-edges the one that starts there stands
//! for it; on a border there is one.

use super::rows::{BORDER, Edge, Face, HUB, LOCKED};
use super::stars::{AROUND, FEW_AROUND, Spoke, Spokes, Stars, spoke};
use crate::backend::{Constant, Switch};
use crate::math::places::Places;

/// No face: what is across a border.
pub const NO_FACE: u32 = u32::MAX;
/// Vertices whose pairs one invocation counts and gathers.
pub const PAIR_BLOCK: u32 = 8;

/// The constants of pairs under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("NO_FACE", Constant::U32(NO_FACE)),
    ("PAIR_BLOCK", Constant::U32(PAIR_BLOCK)),
    ("WINDOW", Constant::U32(WINDOW)),
    ("BORDER", Constant::U32(BORDER)),
    ("LOCKED", Constant::U32(LOCKED)),
    ("HUB", Constant::U32(HUB)),
];

/// Which vertices there are beside ordinary ones: shaders leave out the code for what is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Special {
    /// Some vertex lies on a border.
    pub has_border: bool,
    /// Some vertex is locked or a hub.
    pub has_held: bool,
}

impl Special {
    /// The switches in WGSL.
    pub fn switches(self) -> Vec<Switch> {
        vec![("HAS_BORDER", self.has_border), ("HAS_HELD", self.has_held)]
    }
}

/// Faces around a vertex that a shader looks at together.
const WINDOW: u32 = 8;

/// Whether the edge of `u` and `w` is a pair that `u` lists.
///
/// Edges of more than two faces, and those whose faces disagree in orientation, have both ends locked: no pair.
#[inline(always)]
pub fn lists(u: u32, w: u32, stars: &Stars<'_>) -> bool {
    let (at_u, at_w) = (stars.positions[u as usize].flags, stars.positions[w as usize].flags);
    (u < w) & (at_u & at_w & LOCKED == 0) & ((at_u | at_w) & HUB == 0)
}

/// Tells the pairs that `u` lists, in the order of its ring.
pub fn pairs_at(u: u32, stars: &Stars<'_>, mut tell: impl FnMut(Edge)) {
    if stars.positions[u as usize].flags & HUB != 0 {
        return;
    }
    let around = |f: u32| spoke(stars.faces[f as usize], u);
    for &f in stars.ring(u) {
        let own = around(f);
        if lists(u, own.next, stars) {
            let across = stars.ring(u).iter().copied().find(|&g| around(g).last == own.next);
            tell(Edge { half_edge: 3 * f + own.corner, across: across.unwrap_or(NO_FACE) });
        }
        if stars.positions[u as usize].flags & BORDER != 0
            && lists(u, own.last, stars)
            && !stars.ring(u).iter().any(|&g| around(g).next == own.last)
        {
            tell(Edge { half_edge: 3 * f + (own.corner + 2) % 3, across: NO_FACE });
        }
    }
}

/// Lists the pairs of one vertex after the other, as [`pairs_at`] does.
///
/// Around most vertices with next to no branch that depends on the mesh: every face is written where the next pair belongs,
/// and the face across is looked up by the corner that both share.
#[derive(Debug, Default)]
pub struct Lister {
    /// Where in the ring the face is that comes to a corner.
    places: Places,
}

impl Lister {
    /// Appends what [`pairs_at`] tells.
    #[inline(always)]
    pub fn append(&mut self, u: u32, stars: &Stars<'_>, pairs: &mut Vec<Edge>) {
        let (ring, flags) = (stars.ring(u), stars.positions[u as usize].flags);
        if flags & (BORDER | HUB) != 0 || ring.len() > AROUND {
            append_special(u, stars, pairs);
            return;
        }
        let (mut listed, mut last) = ([[0; 2]; AROUND], [0; AROUND]);
        let mut count = 0;
        for (i, &f) in ring.iter().enumerate() {
            let spoke = spoke(stars.faces[f as usize], u);
            last[i % AROUND] = spoke.last;
            self.places.put(spoke.last, i as u8);
            listed[count % AROUND] = [3 * f + spoke.corner, spoke.next];
            count += usize::from(u < spoke.next);
        }
        let held = HUB | flags & LOCKED;
        for &[half_edge, w] in &listed[..count] {
            if stars.positions[w as usize].flags & held != 0 {
                continue;
            }
            // Past the ring's end `last` is 0, which lists its own pairs.
            let mut place = self.places.of(w) % AROUND;
            if last[place] != w {
                place = last.iter().position(|&last| last == w).unwrap_or(AROUND);
            }
            pairs.push(Edge { half_edge, across: ring.get(place).copied().unwrap_or(NO_FACE) });
        }
    }
}

/// [`Lister::append`] at a border, at hubs, and where a ring is longer.
#[cold]
fn append_special(u: u32, stars: &Stars<'_>, pairs: &mut Vec<Edge>) {
    let is_worth_it = stars.ring(u).len() > FEW_AROUND && stars.positions[u as usize].flags & HUB == 0;
    match is_worth_it.then(|| Spokes::around(u, stars)).flatten() {
        Some(spokes) => append_by_spokes(u, &spokes, stars, pairs),
        _ => pairs_at(u, stars, |pair| pairs.push(pair)),
    }
}

/// [`pairs_at`] by what is known of the ring of `u`, which may be on a border.
fn append_by_spokes(u: u32, spokes: &Spokes, stars: &Stars<'_>, pairs: &mut Vec<Edge>) {
    let ring = stars.ring(u);
    let on_border = stars.positions[u as usize].flags & BORDER != 0;
    for &f in ring {
        let Spoke { corner, next, last } = spoke(stars.faces[f as usize], u);
        if lists(u, next, stars) {
            let across = ring.get(spokes.with_last(next).trailing_zeros() as usize);
            pairs.push(Edge { half_edge: 3 * f + corner, across: across.copied().unwrap_or(NO_FACE) });
        }
        if on_border && spokes.with_next(last) == 0 && lists(u, last, stars) {
            pairs.push(Edge { half_edge: 3 * f + (corner + 2) % 3, across: NO_FACE });
        }
    }
}

/// The ends of a half-edge, without a branch.
#[inline(always)]
pub fn half_edge_ends(half_edge: u32, faces: &[Face]) -> [u32; 2] {
    let corners: &[u32] = bytemuck::cast_slice(faces);
    [half_edge, next_half_edge(half_edge)].map(|half_edge| corners[half_edge as usize])
}

/// The corners of a half-edge's face, its start first, without a branch.
#[inline(always)]
pub fn half_edge_corners(half_edge: u32, faces: &[Face]) -> [u32; 3] {
    let corners: &[u32] = bytemuck::cast_slice(faces);
    let next = next_half_edge(half_edge);
    [half_edge, next, next_half_edge(next)].map(|half_edge| corners[half_edge as usize])
}

/// The half-edge that follows in its face.
#[inline(always)]
fn next_half_edge(half_edge: u32) -> u32 {
    if half_edge % 3 == 2 { half_edge - 2 } else { half_edge + 1 }
}

#[cfg(test)]
mod tests {
    use super::super::stars::has;
    use super::*;
    use crate::kernel::rows::Position;

    /// Faces and their rings.
    type Rings = (Vec<Face>, Vec<u32>, Vec<u32>);

    fn rings(faces: Vec<Face>, vertices: u32) -> Rings {
        let (mut starts, mut rings) = (vec![0], Vec::new());
        for vertex in 0..vertices {
            rings.extend((0..faces.len() as u32).filter(|&f| has(faces[f as usize], vertex)));
            starts.push(rings.len() as u32);
        }
        // What a round before left.
        rings.extend([u32::MAX; AROUND]);
        (faces, starts, rings)
    }

    /// A fan of `len` faces around vertex 0, and a vertex without faces; closed, it has a face more between the rim and a
    /// vertex below for each.
    fn fan(len: u32, is_closed: bool) -> Rings {
        let rim = if is_closed { len } else { len + 1 };
        let side = |i: u32| [1 + i, 1 + (i + 1) % rim];
        let mut faces: Vec<Face> = (0..len).map(side).map(|[b, c]| Face { a: 0, b, c }).collect();
        if is_closed {
            faces.extend((0..len).map(side).map(|[b, a]| Face { a, b, c: len + 1 }));
        }
        rings(faces, len + 3)
    }

    fn listed(stars: &Stars<'_>) -> Vec<Edge> {
        let (mut lister, mut pairs) = (Lister::default(), Vec::new());
        (0..stars.ring_starts.len() as u32 - 1).for_each(|u| lister.append(u, stars, &mut pairs));
        pairs
    }

    fn told(stars: &Stars<'_>) -> Vec<Edge> {
        let mut pairs = Vec::new();
        (0..stars.ring_starts.len() as u32 - 1).for_each(|u| pairs_at(u, stars, |pair| pairs.push(pair)));
        pairs
    }

    #[test]
    fn every_edge_is_listed_once_with_both_its_faces() {
        for (len, is_closed) in (3..20).flat_map(|len| [(len, true), (len, false)]) {
            let (faces, ring_starts, ring_faces) = fan(len, is_closed);
            let flags = if is_closed { 0 } else { BORDER };
            let positions = [Position { flags, ..Position::default() }; 32];
            let stars =
                Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
            let found = listed(&stars);
            assert_eq!(found, told(&stars));
            // Where a border is not marked, an edge has no face across.
            let unmarked = [Position::default(); 32];
            let stars = Stars { positions: &unmarked, ..stars };
            assert_eq!(listed(&stars), told(&stars));
            let mut ends: Vec<[u32; 2]> = found
                .iter()
                .map(|edge| {
                    let [u, w, _] = half_edge_corners(edge.half_edge, &faces);
                    let with_both = |f: &u32| has(faces[*f as usize], u) && has(faces[*f as usize], w);
                    let mut around: Vec<u32> = (0..faces.len() as u32).filter(with_both).collect();
                    around.retain(|&f| f != edge.half_edge / 3);
                    assert_eq!(around.first().copied().unwrap_or(NO_FACE), edge.across, "{len}: {u} to {w}");
                    [u.min(w), u.max(w)]
                })
                .collect();
            ends.sort_unstable();
            ends.dedup();
            let edges = if is_closed { 3 * len } else { 2 * len + 1 };
            assert_eq!((ends.len(), found.len()), (edges as usize, edges as usize));
        }
    }

    #[test]
    fn locked_edges_and_hubs_list_nothing() {
        let (faces, ring_starts, ring_faces) = fan(5, true);
        for flags in [LOCKED, HUB] {
            let positions = [Position { flags, ..Position::default() }; 8];
            let stars =
                Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
            assert_eq!(listed(&stars), []);
        }
    }

    #[test]
    fn corners_with_the_same_last_bits_are_told_apart() {
        // A closed fan whose rim is numbered in steps of one table of places and of two.
        for step in [1_024, 2_048] {
            let (faces, _, _) = fan(9, true);
            let spread = |v: u32| if v == 0 { 0 } else { 1 + (v - 1) * step };
            let spread = |face: Face| Face { a: spread(face.a), b: spread(face.b), c: spread(face.c) };
            let (faces, ring_starts, ring_faces) = rings(faces.into_iter().map(spread).collect(), 10 * step);
            let positions = vec![Position::default(); 10 * step as usize];
            let stars =
                Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
            let found = listed(&stars);
            assert_eq!(found, told(&stars));
            assert!(found.len() == 27 && found.iter().all(|edge| edge.across != NO_FACE));
        }
    }

    #[test]
    fn one_end_may_be_locked() {
        let (faces, ring_starts, ring_faces) = fan(5, true);
        for locked in 0..7 {
            let mut positions = [Position::default(); 8];
            positions[locked].flags = LOCKED;
            let stars =
                Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
            assert_eq!(listed(&stars), told(&stars));
            assert_eq!(listed(&stars).len(), 15);
        }
    }

    #[test]
    fn ends_are_the_first_corners() {
        let faces = [Face { a: 5, b: 3, c: 8 }, Face { a: 8, b: 3, c: 9 }];
        let turned = [[5, 3, 8], [3, 8, 5], [8, 5, 3], [8, 3, 9], [3, 9, 8], [9, 8, 3]];
        for (half_edge, [u, w, k]) in (0..).zip(turned) {
            assert_eq!(half_edge_corners(half_edge, &faces), [u, w, k]);
            assert_eq!(half_edge_ends(half_edge, &faces), [u, w]);
        }
    }
}
