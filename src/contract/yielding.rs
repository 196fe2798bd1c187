//! Seams that give way, where a run that keeps them all cannot come to the number of faces asked for, or not well.
//!
//! Wedges of the ends that no vanishing face links stay two. Those of an end stand alone on a side of their own, and take the
//! best numbers of their faces where the new vertex stands:
//!
//! ```text
//!    a | b           three facets meet at u, two at w; along the crease a becomes one with d, and b with e,
//!  -c--u---w- c      and the facet c reaches the new vertex with a wedge of its own
//!    d | e
//! ```
//!
//! # Invariants
//! - Faces and what they share are those of any contraction: no seam opens, and materials stay closed.
//! - What agreed across a seam at the ends agrees at the new vertex, textures included.
//! - No face turns over in a texture.

use crate::kernel::rows::{CORNER, LOCKED, SEAM};

use super::filter::Rejection;
use super::side_faces::MOST_ASKED;
use super::sides::Sides;
use super::wedges::WedgeRows;

/// Which seams give way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Yields {
    /// None: where more than two meet, or one ends, the vertex stays.
    #[default]
    Nothing,
    /// Creases: normals and tangents hold nothing.
    Creases,
    /// The vertices where other seams meet or end, too, along one of these.
    Corners,
    /// All: seams may come together. A region of a material keeps a face.
    Seams,
}

impl Yields {
    /// What gives way when this was not enough.
    pub fn more(self) -> Option<Self> {
        match self {
            Self::Nothing => Some(Self::Creases),
            Self::Creases => Some(Self::Corners),
            Self::Corners => Some(Self::Seams),
            Self::Seams => None,
        }
    }

    /// What the user is told.
    pub fn warning(self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Creases => Some("creases of the normals yield: they would keep more faces than asked for"),
            Self::Corners => Some("corners of seams yield: they would keep more faces than asked for"),
            Self::Seams => Some("seams yield: they would keep more faces than asked for"),
        }
    }
}

impl Sides {
    /// Completes the sides of a pair of these flags, of which those are found that vanishing faces tell.
    ///
    /// # Errors
    /// [`Rejection::Seam`] where both ends have to stay where they are.
    pub fn find_yielding(&mut self, rows: &WedgeRows<'_>, flags: [u32; 2]) -> Result<(), Rejection> {
        let (on_seam, told) = (flags.map(|flags| flags & SEAM != 0) == [true, true], self.sides.len());
        let agree = |end: usize| {
            let mut wedges = self.sides.iter().map(|side| side.wedges[end]);
            let first = wedges.next();
            first.is_none_or(|first| wedges.all(|wedge| rows.agree_but_in_shading(first, wedge)))
        };
        let is_whole = agree(0) && agree(1);
        // Where a seam ends, both sides have one wedge.
        let meets = |end: usize| match &self.sides[..] {
            [a, b] => a.wedges[end] == b.wedges[end] || (!is_whole && agree(end)),
            _ => false,
        };
        let stays =
            |end: usize| flags[end] & LOCKED != 0 || meets(end) || flags[end] & !flags[1 - end] & (SEAM | CORNER) != 0;
        self.fixed = match [stays(0), stays(1)] {
            [true, true] => return Err(Rejection::Seam),
            [true, false] => Some(0),
            [false, true] => Some(1),
            [false, false] => None,
        };
        self.at_an_end = on_seam && is_whole;
        self.yields = true;
        self.alone.clear();
        for f in 0..self.faces.len() {
            let face = self.faces[f];
            let (end, wedge) = (face.end, face.wedges[0]);
            let few = if self.alone.is_empty() { &self.sides[..] } else { &self.sides[..told] };
            if few.iter().any(|side| side.has(&face)) || self.alone.contains_key(&(end, wedge)) {
                continue;
            }
            let number = self.sides.len();
            self.push_alone(usize::from(end), wedge, rows);
            if number == told + MOST_ASKED {
                // Too many to be asked one after the other from here on.
                for (side, number) in self.sides[told..].iter().zip(told as u32..) {
                    let own = (0..2).find_map(|end| Some((end, side.wedge(usize::from(end))?)));
                    self.alone.extend(own.map(|key| (key, number)));
                }
            } else if number > told + MOST_ASKED {
                self.alone.insert((end, wedge), number as u32);
            }
        }
        Ok(())
    }
}
