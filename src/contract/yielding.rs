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
use super::patch::Patch;
use super::placement::Quadric;
use super::side_faces::MOST_ASKED;
use super::sides::{CornerFace, Sides};
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

/// Most edges around a pair that are compared each with each: to sort a few is misjudged at every step. Of more the one that runs
/// back is looked up.
const MOST_COMPARED: usize = 64;

/// An edge of a face around a pair, from the corner of that number to the next.
#[derive(Debug, Clone, Copy, Default)]
pub struct SideEdge {
    ends: [u32; 2],
    wedges: [u32; 2],
    face: usize,
    corner: usize,
}

impl Sides {
    /// Completes the sides of a pair of these flags, of which those are found that vanishing faces tell.
    ///
    /// # Errors
    /// [`Rejection::Seam`] where a seam would have to give way that does not.
    pub fn find_yielding(&mut self, rows: &WedgeRows<'_>, pair: [u32; 2], flags: [u32; 2]) -> Result<(), Rejection> {
        let (on_seam, told) = (flags.map(|flags| flags & SEAM != 0) == [true, true], self.sides.len());
        let agree = |end: usize| {
            let mut wedges = self.sides.iter().map(|side| side.wedges[end]);
            let first = wedges.next();
            first.is_none_or(|first| wedges.all(|wedge| rows.agree_but_in_shading(first, wedge)))
        };
        let is_whole = agree(0) && agree(1);
        if on_seam
            && rows.layout.yields < Yields::Seams
            && (is_whole || self.loses_a_part(pair, |a, b| rows.agree_but_in_shading(a, b)))
        {
            return Err(Rejection::Seam);
        }
        if on_seam && self.loses_a_part(pair, |a, b| rows.same_material(a, b)) {
            return Err(Rejection::Seam);
        }
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
        self.at_an_end = on_seam && (is_whole || flags[0] & flags[1] & CORNER != 0);
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

    /// Adds to a quadric the squared distances to the seams at a pair that lie along no crease alone, as those to a border.
    /// What costs pairs for the gate knows nothing of them.
    pub fn add_seams(&mut self, patch: &Patch<'_>, pair: [u32; 2], quadric: &mut Quadric, weight: f64) {
        let Some(rows) = patch.wedges() else { return };
        let count = self.find_edges_on_seams(patch, pair);
        self.order_edges(count);
        let (edges, order) = (&self.edges[..count], &self.edge_order);
        for edge in edges {
            let ([from, to], [from_wedge, to_wedge]) = (edge.ends, edge.wedges);
            // Each of its two faces tells an edge, the other one from `to` to `from`.
            let parts = |other: &SideEdge| {
                let [start, end] = other.wedges;
                !(rows.agree_but_in_shading(from_wedge, end) && rows.agree_but_in_shading(to_wedge, start))
            };
            if any_back(edges, order, [from, to], parts) {
                let points = self.points(patch, &self.faces[edge.face]);
                let (from, to) = (points[edge.corner], points[(edge.corner + 1) % 3]);
                quadric.add_border(to - from, from, weight / 2.0);
            }
        }
    }

    /// Orders so many edges by their ends, if each with each would be too many.
    fn order_edges(&mut self, count: usize) {
        let Self { edges, edge_order, .. } = self;
        edge_order.clear();
        if count > MOST_COMPARED {
            edge_order.extend(0..count as u32);
            edge_order.sort_unstable_by_key(|&edge| (edges[edge as usize].ends, edge));
        }
    }

    /// Finds the edges of the faces that have one of the pair's ends, and both of their own on seams, and returns how many
    /// there are. Where joined parts tear, flags tell one end of a seam alone, but that vertex is locked: nothing is placed
    /// by what is missed.
    fn find_edges_on_seams(&mut self, patch: &Patch<'_>, pair: [u32; 2]) -> usize {
        let Self { faces, edges, .. } = self;
        edges.resize(edges.len().max(3 * faces.len()), SideEdge::default());
        let mut count = 0;
        for (number, face) in faces.iter().enumerate() {
            let on_seam = face.corners.map(|v| patch.position(v).flags & SEAM != 0);
            let is_end = face.corners.map(|v| (v == pair[0]) | (v == pair[1]));
            for corner in 0..3 {
                let next = (corner + 1) % 3;
                // Written whether it is one or not: a branch would be misjudged at every second.
                edges[count] = SideEdge {
                    ends: [face.corners[corner], face.corners[next]],
                    wedges: [face.wedges[corner], face.wedges[next]],
                    face: number,
                    corner,
                };
                count += usize::from(on_seam[corner] & on_seam[next] & (is_end[corner] | is_end[next]));
            }
        }
        count
    }

    /// Whether a face that vanishes is the last of a part, by which wedges are of one.
    fn loses_a_part(&self, pair: [u32; 2], is_same: impl Fn(u32, u32) -> bool) -> bool {
        let same = |(face, k): (&CornerFace, usize), (other, l): (&CornerFace, usize)| {
            is_same(face.wedges[k], other.wedges[l])
        };
        self.faces.iter().any(|face| face.dies && self.closes(face, pair, same))
    }
}

/// Whether something is so of any of the edges that run back along the one between these ends; looked up in `order`, the numbers of
/// edges by their ends, unless that is empty.
fn any_back(edges: &[SideEdge], order: &[u32], [from, to]: [u32; 2], is_so: impl Fn(&SideEdge) -> bool) -> bool {
    let back = [to, from];
    if !order.is_empty() {
        let first = order.partition_point(|&other| edges[other as usize].ends < back);
        let backs = order[first..].iter().map(|&other| &edges[other as usize]);
        return backs.take_while(|other| other.ends == back).any(is_so);
    }
    // Without a branch: which edge runs back nobody could foretell.
    let (count, last) = edges.iter().enumerate().fold((0, 0), |(count, last), (number, other)| {
        let is_back = (other.ends[0] == to) & (other.ends[1] == from);
        (count + usize::from(is_back), if is_back { number } else { last })
    });
    match count {
        0 => false,
        1 => is_so(&edges[last]),
        _ => edges.iter().any(|other| other.ends == back && is_so(other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::tie_hash;

    /// Edges between a few vertices, some of which run back never, once or often.
    #[test]
    fn what_runs_back_is_found_in_order_as_among_all() {
        let mut told = [0; 2];
        for seed in 0..200 {
            let end = |number: u32| tie_hash(number, seed) % 6;
            let edge = |face: u32| SideEdge {
                ends: [end(2 * face), end(2 * face + 1)],
                face: face as usize,
                ..SideEdge::default()
            };
            let edges: Vec<SideEdge> = (0..12).map(edge).collect();
            let mut order: Vec<u32> = (0..12).collect();
            order.sort_unstable_by_key(|&edge| (edges[edge as usize].ends, edge));
            for SideEdge { ends, .. } in &edges {
                let is_so = |other: &SideEdge| other.face.is_multiple_of(3);
                let found = [&[][..], &order].map(|order| any_back(&edges, order, *ends, is_so));
                let expected = edges.iter().any(|other| other.ends == [ends[1], ends[0]] && is_so(other));
                assert_eq!(found, [expected; 2], "{ends:?} of {edges:?}");
                told[usize::from(expected)] += 1;
            }
        }
        assert!(told.iter().all(|&count| count > 100), "{told:?}");
    }
}
