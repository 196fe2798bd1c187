//! Which half-edges own a pair, and what is across. In WGSL: `shaders/shared/pairs.wgsl`.
//!
//! A pair is an edge. Of its two half-edges the one that starts at the lower vertex owns it; on a border there is one.

use super::rows::{BORDER, Face, HUB, LOCKED};
use super::stars::{Stars, has};
use crate::backend::Constant;

/// No face: what is across a border.
pub const NO_FACE: u32 = u32::MAX;
/// Faces whose pairs one invocation counts and gathers.
pub const PAIR_BLOCK: u32 = 16;

/// The constants of pairs under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("NO_FACE", Constant::U32(NO_FACE)),
    ("PAIR_BLOCK", Constant::U32(PAIR_BLOCK)),
    ("BORDER", Constant::U32(BORDER)),
    ("LOCKED", Constant::U32(LOCKED)),
    ("HUB", Constant::U32(HUB)),
];

/// The first face of the ring of `around` that has the half-edge from `a` to `b`, or [`NO_FACE`].
#[inline(always)]
pub fn face_with(a: u32, b: u32, around: u32, stars: &Stars<'_>) -> u32 {
    for &f in stars.ring(around) {
        let face = stars.faces[f as usize];
        if (face.a == a && face.b == b) || (face.b == a && face.c == b) || (face.c == a && face.a == b) {
            return f;
        }
    }
    NO_FACE
}

/// Faces around a vertex that [`across`] compares at once; few vertices have more.
const WINDOW: usize = 8;

/// All bits where `condition` holds: selections that must not become branches, since no branch predictor knows rings.
#[inline(always)]
fn mask(condition: bool) -> u32 {
    u32::from(condition).wrapping_neg()
}

/// The faces around a vertex and then [`NO_FACE`], where there are few.
#[inline(always)]
fn window(vertex: u32, stars: &Stars<'_>) -> Option<[u32; WINDOW]> {
    let start = stars.ring_starts[vertex as usize];
    let len = stars.ring_starts[vertex as usize + 1] - start;
    let mut window: [u32; WINDOW] = *stars.ring_faces.get(start as usize..)?.first_chunk()?;
    for (i, face) in window.iter_mut().enumerate() {
        *face |= mask(i as u32 >= len);
    }
    (len <= WINDOW as u32).then_some(window)
}

/// The first face around both `u` and `w` but `f`, or [`NO_FACE`].
///
/// The shader walks the ring of `u` and looks at its faces' corners. Here both rings are compared as they stand in
/// memory, each face with each, which takes neither a branch nor a face's row.
#[inline(always)]
pub fn across(f: u32, u: u32, w: u32, stars: &Stars<'_>) -> u32 {
    let (Some(around_u), Some(around_w)) = (window(u, stars), window(w, stars)) else {
        return across_walking(f, u, w, stars);
    };
    let mut shared = [0; WINDOW];
    for other in around_w {
        for (shared, face) in shared.iter_mut().zip(around_u) {
            *shared |= mask(face == other);
        }
    }
    // A bit for every face that both have: rings ascend, so the lowest is the first.
    let mut found = 0;
    for (i, (shared, face)) in shared.into_iter().zip(around_u).enumerate() {
        found |= shared & mask(face != f) & mask(face != NO_FACE) & (1 << i);
    }
    if found == 0 { NO_FACE } else { around_u[found.trailing_zeros() as usize % WINDOW] }
}

#[cold]
fn across_walking(f: u32, u: u32, w: u32, stars: &Stars<'_>) -> u32 {
    let is_across = |&&face: &&u32| face != f && has(stars.faces[face as usize], w);
    stars.ring(u).iter().find(is_across).copied().unwrap_or(NO_FACE)
}

/// Whether the half-edge from `u` to `w` owns a pair that may be contracted.
///
/// Edges of more than two faces, and those whose faces disagree in orientation, have both ends locked: no pair.
#[inline(always)]
pub fn owns_pair(u: u32, w: u32, stars: &Stars<'_>) -> bool {
    let (at_u, at_w) = (stars.positions[u as usize].flags, stars.positions[w as usize].flags);
    if at_u & at_w & LOCKED != 0 || (at_u | at_w) & HUB != 0 {
        return false;
    }
    if u > w && at_u & at_w & BORDER == 0 {
        return false;
    }
    if u < w {
        return true;
    }
    face_with(w, u, u, stars) == NO_FACE
}

/// The ends of a half-edge, without a branch.
#[inline(always)]
pub fn half_edge_ends(half_edge: u32, faces: &[Face]) -> [u32; 2] {
    let corners: &[u32] = bytemuck::cast_slice(faces);
    let next = if half_edge % 3 == 2 { half_edge - 2 } else { half_edge + 1 };
    [corners[half_edge as usize], corners[next as usize]]
}

/// The corners of a half-edge's face, its start first.
#[inline(always)]
pub fn half_edge_corners(half_edge: u32, faces: &[Face]) -> [u32; 3] {
    let Face { a, b, c } = faces[(half_edge / 3) as usize];
    match half_edge % 3 {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, a, b],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::rows::Position;

    /// A fan of `len` faces around vertex 0 and their rings.
    fn fan(len: u32, is_closed: bool) -> (Vec<Face>, Vec<u32>, Vec<u32>) {
        let rim = if is_closed { len } else { len + 1 };
        let faces: Vec<Face> = (0..len).map(|i| Face { a: 0, b: 1 + i, c: 1 + (i + 1) % rim }).collect();
        let (mut starts, mut rings) = (vec![0], Vec::new());
        for vertex in 0..=rim {
            rings.extend((0..len).filter(|&f| has(faces[f as usize], vertex)));
            starts.push(rings.len() as u32);
        }
        (faces, starts, rings)
    }

    #[test]
    fn windows_find_what_a_walk_finds() {
        let positions = [Position::default(); 32];
        for (len, is_closed) in (3..20).flat_map(|len| [(len, true), (len, false)]) {
            let (faces, ring_starts, mut ring_faces) = fan(len, is_closed);
            for spare in [0, 16] {
                // Behind the last ring a buffer holds what an earlier round left.
                ring_faces.resize(ring_faces.len() + spare, 0);
                let stars =
                    Stars { positions: &positions, faces: &faces, ring_starts: &ring_starts, ring_faces: &ring_faces };
                for (f, face) in (0..).zip(&faces) {
                    for [u, w] in [[face.a, face.b], [face.b, face.c], [face.c, face.a]] {
                        assert_eq!(across(f, u, w, &stars), across_walking(f, u, w, &stars), "{len}: {u} to {w}");
                    }
                }
                let first = across(0, 0, faces[0].b, &stars);
                assert_eq!(first, if is_closed { len - 1 } else { NO_FACE });
            }
        }
    }

    #[test]
    fn ends_are_the_first_corners() {
        let faces = [Face { a: 5, b: 3, c: 8 }, Face { a: 8, b: 3, c: 9 }];
        for half_edge in 0..6 {
            let [u, w, _] = half_edge_corners(half_edge, &faces);
            assert_eq!(half_edge_ends(half_edge, &faces), [u, w]);
        }
    }
}
