//! Which half-edges own a pair. In WGSL: `shaders/shared/pairs.wgsl`.
//!
//! A pair is an edge. Of its two half-edges the one that starts at the lower vertex owns it; on a border there is one.

use super::rows::{BORDER, LOCKED};
use super::stars::Stars;

/// The key of a half-edge that owns no pair, or one that may not be contracted; no vertex either.
pub const NO_PAIR: u32 = u32::MAX;
/// Faces around a vertex past which it takes part in no contraction: work at a vertex grows with the square of its
/// ring, and a hub of thousands of faces shrinks by the pairs on its rim. Real meshes stay below 100.
pub const HUB: u32 = 512;

/// What a half-edge says of its pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// Whether the half-edge owns a pair that may be contracted.
    pub owned: bool,
    /// The vertex opposite in the other face, or [`NO_PAIR`] on a border.
    pub right: u32,
}

/// The vertex opposite the half-edge from `a` to `b` in the first face of the ring of `around` that has it, or
/// [`NO_PAIR`].
#[inline(always)]
pub fn opposite(a: u32, b: u32, around: u32, stars: &Stars<'_>) -> u32 {
    for &f in stars.ring(around) {
        let face = stars.faces[f as usize];
        if face.a == a && face.b == b {
            return face.c;
        }
        if face.b == a && face.c == b {
            return face.a;
        }
        if face.c == a && face.a == b {
            return face.b;
        }
    }
    NO_PAIR
}

/// The pair of the half-edge from `u` to `w`.
///
/// Edges of more than two faces, and those whose faces disagree in orientation, have both ends locked: no pair.
#[inline(always)]
pub fn pair_of(u: u32, w: u32, stars: &Stars<'_>) -> Pair {
    let both = stars.positions[u as usize].flags & stars.positions[w as usize].flags;
    if both & LOCKED != 0 || (u > w && both & BORDER == 0) {
        return Pair { owned: false, right: NO_PAIR };
    }
    if stars.ring_length(u) > HUB || stars.ring_length(w) > HUB {
        return Pair { owned: false, right: NO_PAIR };
    }
    let right = opposite(w, u, u, stars);
    Pair { owned: u < w || right == NO_PAIR, right }
}
