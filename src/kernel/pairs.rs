//! Which half-edges own a pair, and what is across. In WGSL: `shaders/shared/pairs.wgsl`.
//!
//! A pair is an edge. Of its two half-edges the one that starts at the lower vertex owns it; on a border there is one.

use super::rows::{BORDER, Face, HUB, LOCKED};
use super::stars::Stars;
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
