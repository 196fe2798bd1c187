//! Pairs that no edge joins: vertices that lie close together, found once and followed through the rounds.
//!
//! # Reference
//! \[GH97\] section 3.2 and \[Wu12\]: a pair is an edge or two vertices closer than δ. Departs: pairs join different
//! components, or two border vertices of one; on the inside of a component edges already reach every vertex, and pairs
//! across it only pinch it. A vertex takes part in the pairs of its [`NEAREST`] partners.

use rayon::prelude::*;

use crate::backend::Queue;
use crate::error::Result;
use crate::kernel::near_vertices::{NEAREST, NONE, NearVertices, cell_of};
use crate::kernel::rows::{Face, Position, Site};
use crate::math::exact::{LEAST_FACTOR, flush, mul};
use crate::mesh::topology::Components;

/// Widest and narrowest cells, as powers of two.
const EXPONENTS: (i32, i32) = (-100, 100);
/// Bits below the exponent of a number, and what is added to that.
const MANTISSA: u32 = 23;
const BIAS: i32 = 127;

/// The pairs that are left.
#[derive(Debug, Default)]
pub struct Joins {
    pairs: Vec<[u32; 2]>,
}

impl Joins {
    /// The pairs of a surface closer than `delta`, in its rows' unit, found on the device of `queue`.
    ///
    /// # Errors
    /// Of the device.
    pub fn find(queue: &mut Queue, positions: &[Position], faces: &[Face], delta: f32) -> Result<Self> {
        if delta.is_nan() || delta <= 0.0 {
            return Ok(Self::default());
        }
        let corners: Vec<[u32; 3]> = faces.iter().map(|face| face.corners()).collect();
        let near = near_vertices(queue, positions, Components::new(&corners, positions.len()).of_vertex, delta)?;
        let of_vertex = (0_u32..).zip(near.chunks_exact(NEAREST as usize));
        let found = of_vertex.flat_map(|(v, near)| near.iter().map(move |&other| (v, other)));
        let mut pairs: Vec<[u32; 2]> =
            found.filter(|&(_, other)| other != NONE).map(|(v, other)| [v.min(other), v.max(other)]).collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut joins = Self { pairs };
        joins.drop_edges(faces);
        Ok(joins)
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
        let has_face = referenced(faces.iter().copied(), became.len());
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
pub fn referenced(faces: impl IntoIterator<Item = Face>, count: usize) -> Vec<bool> {
    let mut has_face = vec![false; count];
    faces.into_iter().flat_map(|face| face.corners()).for_each(|v| has_face[v as usize] = true);
    has_face
}

/// One over the least power of two that is no less than `delta`. From its bits: logarithms differ between platforms.
fn cells_a_unit(delta: f32) -> f32 {
    let (least, most) = EXPONENTS;
    let bits = delta.to_bits();
    let floor = (bits >> MANTISSA) as i32 - BIAS;
    let is_power = bits.trailing_zeros() >= MANTISSA;
    let exponent = if is_power { floor } else { floor + 1 }.clamp(least, most);
    f32::from_bits(((BIAS - exponent) as u32) << MANTISSA)
}

/// The nearest [`NEAREST`] of every vertex, by a grid whose cells are the power of two next above the distance.
fn near_vertices(queue: &mut Queue, positions: &[Position], components: Vec<u32>, delta: f32) -> Result<Vec<u32>> {
    let per_unit = cells_a_unit(delta);
    let vertex_count = positions.len();
    let cell_of = |v: u32| {
        let Site { x, y, z } = cell_of(positions[v as usize], per_unit);
        [x, y, z]
    };
    let mut by_cell: Vec<([u32; 3], u32)> = (0..vertex_count as u32).into_par_iter().map(|v| (cell_of(v), v)).collect();
    by_cell.par_sort_unstable();
    let (mut cells, mut starts) = (Vec::new(), Vec::new());
    for (i, &(cell, _)) in by_cell.iter().enumerate() {
        if i == 0 || by_cell[i - 1].0 != cell {
            let [x, y, z] = cell;
            cells.push(Site { x, y, z });
            starts.push(i as u32);
        }
    }
    starts.push(vertex_count as u32);
    let cell_count = cells.len() as u32;
    let positions = queue.buffer_from(positions.to_vec())?;
    let components = queue.buffer_from(components)?;
    let cells = queue.buffer_from(cells)?;
    let cell_starts = queue.buffer_from(starts)?;
    let members = queue.buffer_from(by_cell.into_iter().map(|(_, v)| v).collect())?;
    let mut near = queue.buffer(NEAREST as usize * vertex_count)?;
    queue.run(NearVertices {
        positions: &positions,
        components: &components,
        cells: &cells,
        cell_count,
        cell_starts: &cell_starts,
        members: &members,
        vertex_count: vertex_count as u32,
        per_unit,
        reach_sq: flush(mul(delta, delta), LEAST_FACTOR),
        near: &mut near,
    })?;
    let mut rows = Vec::new();
    queue.read(&near, 0..near.len(), &mut rows)?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::kernel::rows::BORDER;

    fn find(positions: &[Position], faces: &[Face], delta: f32) -> Joins {
        let mut queue = Device::cpu(2).expect("threads start").cpu_queue();
        Joins::find(&mut queue, positions, faces, delta).expect("host memory")
    }

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
        assert_eq!(find(&positions, &faces, 0.2).pairs(), [[1, 3], [2, 5]]);
        // δ itself is too far.
        let (positions, faces) = two(0.5);
        assert_eq!(find(&positions, &faces, 0.5).pairs().len(), 0);
        for delta in [0.0, -1.0, f32::NAN] {
            assert_eq!(find(&positions, &faces, delta).pairs().len(), 0);
        }
    }

    #[test]
    fn cells_are_no_narrower_than_the_distance_and_less_than_twice_as_wide() {
        for delta in
            [1e-20_f32, 0.1, 0.25, 0.5, 0.5 + f32::EPSILON, 1.0, 1.0 - f32::EPSILON, 1.0 + f32::EPSILON, 3.0, 1e20]
        {
            let width = 1.0 / cells_a_unit(delta);
            assert!(width >= delta && width < 2.0 * delta && width.to_bits().trailing_zeros() >= MANTISSA, "{delta}");
        }
        let (narrowest, widest) = (2.0_f32.powi(-100), 2.0_f32.powi(100));
        let extremes = [f32::MIN_POSITIVE, 1e-45, 3e38, f32::INFINITY];
        assert_eq!(extremes.map(|delta| 1.0 / cells_a_unit(delta)), [narrowest, narrowest, widest, widest]);
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
        assert_eq!(find(&positions, &faces, 0.3).pairs(), expected);
    }

    #[test]
    fn pairs_follow_what_they_became() {
        let (positions, faces) = two(0.1);
        let mut joins = find(&positions, &faces, 0.2);
        // Vertices 1 and 3 became one, and with them the edges to 2 and to 5.
        let left = [Face { a: 0, b: 1, c: 2 }, Face { a: 1, b: 3, c: 4 }];
        joins.follow(&[0, 1, 2, 1, 3, 4], &left);
        assert_eq!(joins.pairs(), [[2, 4]]);
        joins.follow(&[0, 1, 2, 3, 2], &[Face { a: 0, b: 1, c: 2 }, Face { a: 1, b: 3, c: 2 }]);
        assert_eq!(joins.pairs().len(), 0);
    }
}
