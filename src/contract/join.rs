//! Pairs that no edge joins: vertices that lie close together, found once and followed through the rounds.
//!
//! # Reference
//! \[GH97\] section 3.2 and \[Wu12\]: a pair is an edge or two vertices closer than δ. Departs: pairs join different
//! components, or two border vertices of one; on the inside of a component edges already reach every vertex, and pairs
//! across it only pinch it. A vertex takes part in the pairs of its [`NEAREST`] partners.

use rayon::prelude::*;

use crate::kernel::rows::{BORDER, Face, Position};
use crate::math::Vec3;
use crate::mesh::topology::Components;

/// Partners that a vertex looks for.
const NEAREST: usize = 8;
/// Vertices that it compares itself with, at most: with a δ far beyond the distance of neighbors there are that many in
/// reach, and the first along the curve stand for all.
const MOST_COMPARED: usize = 1 << 12;
/// Vertices a thread takes at a time.
const ROWS: usize = 1 << 10;

/// The pairs that are left.
#[derive(Debug, Default)]
pub struct Joins {
    pairs: Vec<[u32; 2]>,
}

impl Joins {
    /// The pairs of a surface closer than `delta`, in its rows' unit.
    pub fn find(positions: &[Position], faces: &[Face], delta: f32) -> Self {
        if delta.is_nan() || delta <= 0.0 {
            return Self::default();
        }
        let corners: Vec<[u32; 3]> = faces.iter().map(|face| face.corners()).collect();
        let component = Components::new(&corners, positions.len()).of_vertex;
        let grid = Grid::new(positions, delta);
        let mut pairs: Vec<[u32; 2]> = (0..positions.len() as u32)
            .into_par_iter()
            .with_min_len(ROWS)
            .flat_map_iter(|v| {
                let (own, position) = (component[v as usize], positions[v as usize]);
                let joins = |&other: &u32| {
                    let both_on_border = position.flags & positions[other as usize].flags & BORDER != 0;
                    other != v && (component[other as usize] != own || both_on_border)
                };
                let mut near: Vec<(u32, u32)> = (grid.around(v).take(MOST_COMPARED).filter(joins))
                    .map(|other| (position.xyz().distance_squared(positions[other as usize].xyz()), other))
                    .filter(|&(distance_sq, _)| distance_sq < delta * delta)
                    // Bits of positive numbers order as the numbers do.
                    .map(|(distance_sq, other)| (distance_sq.to_bits(), other))
                    .collect();
                near.sort_unstable();
                near.into_iter().take(NEAREST).map(move |(_, other)| [v.min(other), v.max(other)])
            })
            .collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut joins = Self { pairs };
        joins.drop_edges(faces);
        joins
    }

    /// The pairs, ascending.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// Renames vertices to what a round has made of them, on the surface that it left.
    pub fn follow(&mut self, became: &[u32], faces: &[Face]) {
        for pair in &mut self.pairs {
            let [u, w] = pair.map(|v| became[v as usize]);
            *pair = [u.min(w), u.max(w)];
        }
        // Between vertices of a surface: those that lost all their faces have nothing to bring along.
        let has_face = referenced(faces, became.len());
        self.pairs.retain(|[u, w]| u != w && has_face[*u as usize] && has_face[*w as usize]);
        self.pairs.par_sort_unstable();
        self.pairs.dedup();
        self.drop_edges(faces);
    }

    /// Drops those that an edge joins by now.
    fn drop_edges(&mut self, faces: &[Face]) {
        if self.pairs.is_empty() {
            return;
        }
        let sides = faces.par_iter().flat_map_iter(|face| {
            let [a, b, c] = face.corners();
            [[a, b], [b, c], [c, a]].map(|[u, w]| [u.min(w), u.max(w)])
        });
        let mut edges: Vec<[u32; 2]> = sides.filter(|side| self.pairs.binary_search(side).is_ok()).collect();
        edges.par_sort_unstable();
        self.pairs.retain(|pair| edges.binary_search(pair).is_err());
    }
}

/// Which of `count` vertices have a face.
pub fn referenced(faces: &[Face], count: usize) -> Vec<bool> {
    let mut has_face = vec![false; count];
    faces.iter().flat_map(|face| face.corners()).for_each(|v| has_face[v as usize] = true);
    has_face
}

/// Vertices by cell of a grid whose cells are as wide as the distance.
struct Grid {
    cells: Vec<[i32; 3]>,
    /// Vertices in the order of their cells, then of their numbers.
    members: Vec<u32>,
}

impl Grid {
    fn new(positions: &[Position], width: f32) -> Self {
        // Saturates: where cells are too many to number, the farthest share one.
        let cell = |p: Vec3| (p / width).floor().to_array().map(|x| x as i32);
        let cells: Vec<[i32; 3]> = positions.par_iter().map(|p| cell(p.xyz())).collect();
        let mut members: Vec<u32> = (0..positions.len() as u32).collect();
        members.par_sort_unstable_by_key(|&v| (cells[v as usize], v));
        Self { cells, members }
    }

    /// The vertices of the cells around that of `v`, its own first.
    fn around(&self, v: u32) -> impl Iterator<Item = u32> {
        let [x, y, z] = self.cells[v as usize];
        let own = self.column([x, y], z..=z);
        let others = (0..9).flat_map(move |i| {
            let column = [x.saturating_add(i / 3 - 1), y.saturating_add(i % 3 - 1)];
            self.column(column, z.saturating_sub(1)..=z.saturating_add(1))
        });
        own.iter().copied().chain(others.copied().filter(move |&other| self.cells[other as usize] != [x, y, z]))
    }

    /// The members of a run of cells along the last axis, which stand together.
    fn column(&self, [x, y]: [i32; 2], z: std::ops::RangeInclusive<i32>) -> &[u32] {
        let start = self.members.partition_point(|&v| self.cells[v as usize] < [x, y, *z.start()]);
        let end = self.members.partition_point(|&v| self.cells[v as usize] <= [x, y, *z.end()]);
        &self.members[start..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, y: f32, flags: u32) -> Position {
        Position { x, y, z: 0.0, flags }
    }

    /// Two triangles side by side, `gap` apart, on the border all around.
    fn two(gap: f32) -> (Vec<Position>, Vec<Face>) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0 + gap, 0.0], [2.0 + gap, 0.0], [1.0 + gap, 1.0]];
        let faces = vec![Face { a: 0, b: 1, c: 2 }, Face { a: 3, b: 4, c: 5 }];
        (corners.map(|[x, y]| at(x, y, BORDER)).to_vec(), faces)
    }

    #[test]
    fn near_vertices_of_two_parts_are_pairs() {
        let (positions, faces) = two(0.1);
        assert_eq!(Joins::find(&positions, &faces, 0.2).pairs(), [[1, 3], [2, 5]]);
        // δ itself is too far.
        let (positions, faces) = two(0.5);
        assert_eq!(Joins::find(&positions, &faces, 0.5).pairs().len(), 0);
        for delta in [0.0, -1.0, f32::NAN] {
            assert_eq!(Joins::find(&positions, &faces, delta).pairs().len(), 0);
        }
    }

    #[test]
    fn all_pairs_agree_with_comparing_each_with_each() {
        // Single triangles strewn about, no two of whose corners meet.
        let place = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 8) as f32 / (1 << 24) as f32 * 4.0;
        let positions: Vec<Position> = (0..60).map(|i| at(place(2 * i), place(2 * i + 1), 0)).collect();
        let faces: Vec<Face> = (0..20).map(|i| Face { a: 3 * i, b: 3 * i + 1, c: 3 * i + 2 }).collect();
        let near = |u: usize, w: usize| positions[u].xyz().distance_squared(positions[w].xyz()) < 0.3 * 0.3;
        let all = (0..60).flat_map(|u| (u + 1..60).map(move |w| [u, w]));
        let expected: Vec<[u32; 2]> =
            all.filter(|&[u, w]| u / 3 != w / 3 && near(u, w)).map(|pair| pair.map(|v| v as u32)).collect();
        assert!(expected.len() > 20);
        assert_eq!(Joins::find(&positions, &faces, 0.3).pairs(), expected);
    }

    #[test]
    fn pairs_follow_what_they_became() {
        let (positions, faces) = two(0.1);
        let mut joins = Joins::find(&positions, &faces, 0.2);
        // Vertices 1 and 3 became one, and with them the edges to 2 and to 5.
        let left = [Face { a: 0, b: 1, c: 2 }, Face { a: 1, b: 3, c: 4 }];
        joins.follow(&[0, 1, 2, 1, 3, 4], &left);
        assert_eq!(joins.pairs(), [[2, 4]]);
        joins.follow(&[0, 1, 2, 3, 2], &[Face { a: 0, b: 1, c: 2 }, Face { a: 1, b: 3, c: 2 }]);
        assert_eq!(joins.pairs().len(), 0);
    }
}
