//! For every vertex the nearest others that it may join: closer than a distance, across components or from border to
//! border. Twin: `shaders/near_vertices.wgsl`, line for line.
//!
//! Vertices lie in a grid whose cells are at least as wide as the distance; the host has sorted them by cell. The cells
//! of a column follow each other, so that nine runs of vertices hold all that can be near.
//!
//! # Reference
//! The pairs of \[GH97\] section 3.2 and \[Wu12\] that no edge joins.

use rayon::prelude::*;

use super::rows::{BORDER, FLAGS, Position, Site};
use crate::backend::{Access, Binding, Buffer, Constant, Kernel, params};
use crate::math::exact::{LEAST, LEAST_FACTOR, dot3, flush, flush3, mul, sub3};

/// Vertices that each looks for.
pub const NEAREST: u32 = 8;
/// Vertices that each is compared with, at most: with a distance far beyond that of neighbors there are that many in
/// reach, and the first along the surface's order stand for all.
pub const MOST_COMPARED: u32 = 1 << 12;
/// In place of a vertex: there are no more.
pub const NONE: u32 = u32::MAX;
/// Cells on either side of the origin's; the farthest hold all beyond.
const CELLS: f32 = 1_073_741_824.0;
/// Before any vertex was found.
const NOTHING: [u32; 2] = [NONE, NONE];

/// One invocation a vertex.
pub struct NearVertices<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// The component of every vertex.
    pub components: &'a Buffer<u32>,
    /// The cells that hold a vertex, ascending.
    pub cells: &'a Buffer<Site>,
    /// How many.
    pub cell_count: u32,
    /// Where the members of each start; one more that ends the last.
    pub cell_starts: &'a Buffer<u32>,
    /// V vertices, by cell.
    pub members: &'a Buffer<u32>,
    /// V.
    pub vertex_count: u32,
    /// Cells a unit: a power of two, a cell being no narrower than the distance.
    pub per_unit: f32,
    /// The distance, squared.
    pub reach_sq: f32,
    /// Writes [`NEAREST`] a vertex, the nearest first and the lowest of equally near, then [`NONE`].
    pub near: &'a mut Buffer<u32>,
}

params! {
    /// The uniform block.
    pub struct Params {
        cell_count: u32,
        per_unit: f32,
        reach_sq: f32,
    }
}

/// The cell of a position.
#[inline(always)]
pub fn cell_of(p: Position, per_unit: f32) -> Site {
    Site { x: coordinate(p.x, per_unit), y: coordinate(p.y, per_unit), z: coordinate(p.z, per_unit) }
}

#[inline(always)]
fn coordinate(x: f32, per_unit: f32) -> u32 {
    let cell = flush(mul(x, per_unit), LEAST).floor();
    // From 1 on: cells before the first and after the last are numbers too.
    (cell.clamp(-CELLS, CELLS) as i32 as u32).wrapping_add(0x4000_0001)
}

/// Whether a cell stands before another.
#[inline(always)]
fn is_before(a: Site, b: Site) -> bool {
    a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)))
}

/// What a vertex is compared with.
#[derive(Debug, Clone, Copy)]
struct Grid<'a> {
    positions: &'a [Position],
    components: &'a [u32],
    cells: &'a [Site],
    cell_starts: &'a [u32],
    members: &'a [u32],
}

/// The vertices found so far.
#[derive(Debug, Clone, Copy)]
struct Found {
    /// The bits of the squared distance, which order as it does, and the vertex.
    near: [[u32; 2]; NEAREST as usize],
    compared: u32,
}

impl Grid<'_> {
    /// Where the members of a cell start, or would.
    #[inline(always)]
    fn start_of(&self, cell: Site) -> u32 {
        let mut low = 0;
        let mut high = self.cells.len() as u32;
        while low < high {
            let middle = (low + high) >> 1;
            if is_before(self.cells[middle as usize], cell) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        self.cell_starts[low as usize]
    }

    /// Compares a vertex with a run of members.
    #[inline(always)]
    fn compare(&self, found: &mut Found, vertex: u32, start: u32, end: u32, reach_sq: f32) {
        let p = self.positions[vertex as usize];
        let component = self.components[vertex as usize];
        let mut i = start;
        while i < end && found.compared < MOST_COMPARED {
            let other = self.members[i as usize];
            let q = self.positions[other as usize];
            found.compared += 1;
            i += 1;
            let both_on_border = (p.flags & q.flags & BORDER) != 0;
            if other == vertex || (self.components[other as usize] == component && !both_on_border) {
                continue;
            }
            let away = flush3(sub3(p.xyz(), q.xyz()), LEAST_FACTOR);
            let distance_sq = dot3(away, away);
            if distance_sq < reach_sq {
                insert(found, [distance_sq.to_bits(), other]);
            }
        }
    }

    #[inline(always)]
    fn near(&self, vertex: u32, per_unit: f32, reach_sq: f32) -> Found {
        let mut found = Found { near: [NOTHING; NEAREST as usize], compared: 0 };
        let own = cell_of(self.positions[vertex as usize], per_unit);
        let own_start = self.start_of(own);
        let own_end = self.start_of(Site { x: own.x, y: own.y, z: own.z + 1 });
        self.compare(&mut found, vertex, own_start, own_end, reach_sq);
        for column in 0..9 {
            let (x, y) = (own.x + column / 3 - 1, own.y + column % 3 - 1);
            let start = self.start_of(Site { x, y, z: own.z - 1 });
            let end = self.start_of(Site { x, y, z: own.z + 2 });
            if column == 4 {
                self.compare(&mut found, vertex, start, own_start, reach_sq);
                self.compare(&mut found, vertex, own_end, end, reach_sq);
            } else {
                self.compare(&mut found, vertex, start, end, reach_sq);
            }
        }
        found
    }
}

/// Puts a vertex in its place among those found, of which the last drops out.
#[inline(always)]
fn insert(found: &mut Found, entry: [u32; 2]) {
    let mut carried = entry;
    for slot in &mut found.near {
        let before = *slot;
        if carried[0] < before[0] || (carried[0] == before[0] && carried[1] < before[1]) {
            *slot = carried;
            carried = before;
        }
    }
}

impl Kernel for NearVertices<'_> {
    const NAME: &'static str = "near_vertices";
    const SOURCE: &'static str = include_str!("../../shaders/near_vertices.wgsl");
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;
    const CONSTANTS: &'static [(&'static str, Constant)] = &[
        FLAGS[0],
        ("NEAREST", Constant::U32(NEAREST)),
        ("MOST_COMPARED", Constant::U32(MOST_COMPARED)),
        ("NONE", Constant::U32(NONE)),
        ("CELLS", Constant::F32(CELLS)),
    ];

    fn params(&self) -> Params {
        Params { cell_count: self.cell_count, per_unit: self.per_unit, reach_sq: self.reach_sq }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("components", Access::Read, self.components),
            Binding::new("cells", Access::Read, self.cells),
            Binding::new("cell_starts", Access::Read, self.cell_starts),
            Binding::new("members", Access::Read, self.members),
            Binding::new("near", Access::Write, self.near),
        ]
    }

    fn invocations(&self) -> u32 {
        self.vertex_count
    }

    fn run_cpu(&mut self) {
        let grid = Grid {
            positions: self.positions.host(),
            components: self.components.host(),
            cells: &self.cells.host()[..self.cell_count as usize],
            cell_starts: self.cell_starts.host(),
            members: self.members.host(),
        };
        let Self { per_unit, reach_sq, .. } = *self;
        let rows = self.near.host_mut().par_chunks_exact_mut(NEAREST as usize).take(self.vertex_count as usize);
        rows.enumerate().with_min_len(64).for_each(|(vertex, row)| {
            let found = grid.near(vertex as u32, per_unit, reach_sq);
            for (near, [_, other]) in row.iter_mut().zip(found.near) {
                *near = other;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_stand_first_and_the_lowest_of_equals() {
        let mut found = Found { near: [NOTHING; NEAREST as usize], compared: 0 };
        for vertex in (0..20).rev() {
            insert(&mut found, [vertex / 2, vertex]);
        }
        assert_eq!(found.near.map(|[_, vertex]| vertex), [0, 1, 2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn cells_are_numbers_from_one_on() {
        let at = |x: f32| cell_of(Position { x, ..Position::default() }, 0.5).x;
        let origin = at(0.0);
        assert_eq!(
            [at(1.9), at(2.0), at(-0.1), at(-1e-40), at(f32::MAX)].map(|x| x.wrapping_sub(origin)),
            [0, 1, u32::MAX, 0, 1 << 30]
        );
        assert_eq!((at(-f32::MAX), origin), (1, (1 << 30) + 1));
    }
}
