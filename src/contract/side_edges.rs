//! The seams at a pair, by the distances to which its vertex is placed.

use crate::kernel::rows::SEAM;
use crate::math::places::Places;

use super::patch::Patch;
use super::placement::Quadric;
use super::sides::{CornerFace, Sides};

/// Most edges around a pair that are looked up by a table, which has places up to 255: with more of them more share one, and each that
/// lost its place is looked for among all.
const MOST_IN_TABLE: usize = 64;

/// An edge of a face around a pair, from the corner of that number to the next.
#[derive(Debug, Clone, Copy, Default)]
struct SideEdge {
    ends: [u32; 2],
    wedges: [u32; 2],
    face: usize,
    corner: usize,
    /// Whether a seam parts its face from another along it.
    is_parted: bool,
}

/// Edges of the faces around a pair, each as often as faces have it, and what runs back along them.
#[derive(Debug, Default)]
pub struct SideEdges {
    /// Longer than there are.
    rows: Vec<SideEdge>,
    count: usize,
    /// Where each stands, if they are few and no two run alike.
    places: Places,
    /// Else their numbers, by their ends.
    order: Vec<u32>,
}

impl SideEdge {
    /// What mostly tells it from others around a pair, and from what runs back.
    fn key(&self) -> u32 {
        key(self.ends)
    }
}

/// [`SideEdge::key`] of an edge between these ends.
fn key([from, to]: [u32; 2]) -> u32 {
    from.wrapping_mul(3).wrapping_add(to)
}

impl SideEdges {
    /// Finds those that have one of the pair's ends, and both of their own on seams. Where joined parts tear, flags tell one end of
    /// a seam alone, but that vertex is locked: nothing is placed by what is missed.
    fn find(&mut self, faces: &[CornerFace], patch: &Patch<'_>, pair: [u32; 2]) {
        self.rows.resize(self.rows.len().max(3 * faces.len()), SideEdge::default());
        self.count = 0;
        for (number, face) in faces.iter().enumerate() {
            let on_seam = face.corners.map(|v| patch.position(v).flags & SEAM != 0);
            let is_end = face.corners.map(|v| (v == pair[0]) | (v == pair[1]));
            for corner in 0..3 {
                let next = (corner + 1) % 3;
                // Written whether it is one or not: a branch would be misjudged at every second.
                self.rows[self.count] = SideEdge {
                    ends: [face.corners[corner], face.corners[next]],
                    wedges: [face.wedges[corner], face.wedges[next]],
                    face: number,
                    corner,
                    is_parted: false,
                };
                self.count += usize::from(on_seam[corner] & on_seam[next] & (is_end[corner] | is_end[next]));
            }
        }
        self.arrange();
    }

    fn all(&self) -> &[SideEdge] {
        &self.rows[..self.count]
    }

    /// Makes that what runs back is found.
    fn arrange(&mut self) {
        self.order.clear();
        if self.count > MOST_IN_TABLE || !self.put_in_table() {
            self.order.extend(0..self.count as u32);
            let rows = &self.rows;
            self.order.sort_unstable_by_key(|&edge| (rows[edge as usize].ends, edge));
        }
    }

    /// Notes where each of a few stands; returns whether no two run alike.
    fn put_in_table(&mut self) -> bool {
        let rows = &self.rows[..self.count];
        let mut are_apart = true;
        for (number, edge) in rows.iter().enumerate() {
            let (key, before) = (edge.key(), self.places.of(edge.key()));
            if before < number && Places::are_alike(rows[before].key(), key) {
                are_apart &= rows[..number].iter().all(|other| other.ends != edge.ends);
            }
            self.places.put(key, number as u8);
        }
        are_apart
    }

    /// Finds which are parted from what runs back along them; so it `parts` either way.
    fn find_parted(&mut self, parts: impl Fn(&SideEdge, &SideEdge) -> bool) {
        for number in 0..self.count {
            let edge = &self.rows[number];
            let is_parted = if self.order.is_empty() {
                let is_parted_from = |other: usize| match &self.rows[other] {
                    known if other < number => known.is_parted,
                    other => parts(edge, other),
                };
                self.back(edge.ends).is_some_and(is_parted_from)
            } else {
                self.all_back(edge.ends).any(|other| parts(edge, other))
            };
            self.rows[number].is_parted = is_parted;
        }
    }

    /// What runs back along the edge between these ends, where no two run alike.
    fn back(&self, [from, to]: [u32; 2]) -> Option<usize> {
        let (edges, back) = (self.all(), [to, from]);
        let place = self.places.of(key(back));
        match edges.get(place) {
            Some(other) if other.ends == back => Some(place),
            // Another took its place, or there is none.
            _ => edges.iter().position(|other| other.ends == back),
        }
    }

    /// All that do, where they are in order.
    fn all_back(&self, [from, to]: [u32; 2]) -> impl Iterator<Item = &SideEdge> {
        let (edges, back) = (self.all(), [to, from]);
        let first = self.order.partition_point(|&other| edges[other as usize].ends < back);
        let backs = self.order[first..].iter().map(|&other| &edges[other as usize]);
        backs.take_while(move |other| other.ends == back)
    }
}

impl Sides {
    /// Adds to a quadric the squared distances to the seams at a pair that lie along no crease alone, as those to a border.
    /// What costs pairs for the gate knows nothing of them.
    pub fn add_seams(&mut self, patch: &Patch<'_>, pair: [u32; 2], quadric: &mut Quadric, weight: f64) {
        let Some(rows) = patch.wedges() else { return };
        self.edges.find(&self.faces, patch, pair);
        // Each of its two faces tells an edge, the other one from its end to its start.
        self.edges.find_parted(|edge, other| {
            let ([from, to], [start, end]) = (edge.wedges, other.wedges);
            !(rows.agree_but_in_shading(from, end) && rows.agree_but_in_shading(to, start))
        });
        for edge in self.edges.all().iter().filter(|edge| edge.is_parted) {
            let points = self.points(patch, &self.faces[edge.face]);
            let (from, to) = (points[edge.corner], points[(edge.corner + 1) % 3]);
            quadric.add_border(to - from, from, weight / 2.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::tie_hash;

    /// Edges between a few vertices, some of which run back never, once or often.
    #[test]
    fn what_runs_back_is_found_in_a_table_and_in_order_as_among_all() {
        let (mut told, mut in_tables) = ([0; 2], [0; 2]);
        let mut edges = SideEdges::default();
        for seed in 0..400 {
            // Of fewer vertices more run alike; numbers 256 apart share four places.
            let (vertices, apart) = (4 + seed % 40, if seed % 3 == 0 { 256 } else { 5 });
            let end = |number: u32| apart * (tie_hash(number, seed) % vertices);
            let edge = |face: u32| SideEdge {
                ends: [end(2 * face), end(2 * face + 1)],
                face: face as usize,
                ..SideEdge::default()
            };
            let count = if seed % 5 == 0 { 70 } else { 12 };
            (edges.rows, edges.count) = ((0..count).map(edge).collect(), count as usize);
            edges.arrange();
            in_tables[usize::from(edges.order.is_empty())] += 1;
            // So either way.
            let parts = |a: &SideEdge, b: &SideEdge| (a.face + b.face).is_multiple_of(3);
            edges.find_parted(parts);
            for edge in edges.all() {
                let is_back = |other: &&SideEdge| other.ends == [edge.ends[1], edge.ends[0]];
                let expected = edges.all().iter().filter(is_back).any(|other| parts(edge, other));
                assert_eq!(edge.is_parted, expected, "{edge:?} of {:?}", edges.all());
                told[usize::from(expected)] += 1;
            }
        }
        assert!(told.iter().chain(&in_tables).all(|&count| count > 50), "{told:?}, {in_tables:?}");
    }
}
