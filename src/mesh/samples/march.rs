//! Triangles of an implicit surface by marching tetrahedra, visiting only the cells near it.

use rayon::prelude::*;

use super::super::{Mesh, weld};
use crate::math::DVec3;

/// Where to look for a surface.
#[derive(Clone, Copy)]
pub struct Lattice {
    /// The corner with the least coordinates.
    pub low: DVec3,
    /// The side of the cube that holds the surface.
    pub side: f64,
    /// The side of a cell.
    pub cell: f64,
}

/// Cells along the side of a block: the unit of work.
pub const BLOCK: u32 = 8;
/// Cells along the side of a part of a block that is skipped when the surface is too far away.
const PART: u32 = 4;
const POINTS: u32 = BLOCK + 1;
/// How much faster than the distance the field may change; what is skipped is far enough for that.
const STEEPEST: f64 = 1.7;
/// Crossings keep this much of an edge away from its ends, so that no two vertices fall together.
const MARGIN: f64 = 0.05;

impl Lattice {
    /// The surface between negative (inside) and positive values of `field`: a closed 2-manifold inside the cube.
    ///
    /// `field` must be positive on the cube's sides and change by at most 1.7 a unit of length.
    pub fn surface(&self, field: &(impl Fn(DVec3) -> f64 + Sync)) -> Mesh {
        self.surface_in(&self.blocks(field), field)
    }

    /// The piece of the surface in these blocks: open where they end.
    pub fn surface_in(&self, blocks: &[[u32; 3]], field: &(impl Fn(DVec3) -> f64 + Sync)) -> Mesh {
        let pieces: Vec<Mesh> =
            blocks.par_iter().map_init(Block::default, |block, &at| block.march(self, at, field)).collect();
        let mut soup = Mesh::default();
        for piece in pieces {
            let first = soup.positions.len() as u32;
            soup.positions.extend(piece.positions);
            soup.faces.extend(piece.faces.into_iter().map(|face| face.map(|v| v + first)));
        }
        // Blocks compute the vertices on their common sides from the same values, so they are equal to the bit.
        weld(&soup, 0.0).mesh
    }

    /// Blocks that may hold a piece of the surface, by their first cell, in an order that keeps neighbors near.
    pub fn blocks(&self, field: &(impl Fn(DVec3) -> f64 + Sync)) -> Vec<[u32; 3]> {
        let count = (self.side / (self.cell * f64::from(BLOCK))).ceil().max(1.0) as u32;
        let mut size = count.next_power_of_two() * BLOCK;
        let mut blocks = vec![[0; 3]];
        while size > BLOCK {
            size /= 2;
            let halves = |at: [u32; 3]| (0..8).map(move |i| [0, 1, 2].map(|k| at[k] + (i >> k & 1) * size));
            blocks = blocks.into_par_iter().flat_map_iter(halves).filter(|&at| self.is_near(at, size, field)).collect();
        }
        blocks
    }

    /// The height of the points that lie so many cells above the lowest: vertices on this plane are exactly there.
    pub fn height(&self, cells: u32) -> f64 {
        self.point([0, 0, cells]).z
    }

    fn is_near(&self, at: [u32; 3], size: u32, field: &impl Fn(DVec3) -> f64) -> bool {
        let half = f64::from(size) / 2.0;
        let middle = self.low + (DVec3::from(at.map(f64::from)) + half) * self.cell;
        field(middle).abs() <= STEEPEST * half * self.cell * 3f64.sqrt()
    }

    fn point(&self, at: [u32; 3]) -> DVec3 {
        self.low + DVec3::from(at.map(f64::from)) * self.cell
    }
}

/// Room for one block.
struct Block {
    /// The field at the block's points, not a number where it was not needed.
    values: Vec<f64>,
    /// The vertex on each of the seven edges that go up from a point, by point and direction.
    vertices: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Default for Block {
    fn default() -> Self {
        let points = POINTS.pow(3) as usize;
        Self { values: vec![f64::NAN; points], vertices: vec![NONE; points * 7] }
    }
}

/// The six tetrahedra around the diagonal of a cell; corners are three bits x, y, z. Positively oriented.
const TETRAHEDRA: [[u32; 4]; 6] = [[0, 1, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 3, 2, 7], [0, 6, 4, 7], [0, 5, 1, 7]];

/// By the bits of the corners inside: an even order of the corners that puts the odd one out, or the inner two, first.
const ORDERS: [[usize; 4]; 16] = {
    let one = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
    let mut orders = [[0, 1, 2, 3]; 16];
    let mut i = 0;
    while i < 4 {
        orders[1 << i] = one[i];
        orders[15 ^ (1 << i)] = one[i];
        i += 1;
    }
    orders[0b0101] = [0, 2, 3, 1];
    orders[0b1001] = [0, 3, 1, 2];
    orders[0b0110] = [1, 2, 0, 3];
    orders[0b1010] = [1, 3, 2, 0];
    orders[0b1100] = [2, 3, 0, 1];
    orders
};

impl Block {
    fn march(&mut self, lattice: &Lattice, at: [u32; 3], field: &impl Fn(DVec3) -> f64) -> Mesh {
        self.values.fill(f64::NAN);
        self.vertices.fill(NONE);
        let mut mesh = Mesh::default();
        for part in cube(BLOCK / PART).map(|part| part.map(|k| k * PART)) {
            let start = [0, 1, 2].map(|k| at[k] + part[k]);
            if !lattice.is_near(start, PART, field) {
                continue;
            }
            for step in cube(PART + 1) {
                let local = [0, 1, 2].map(|k| part[k] + step[k]);
                let value = &mut self.values[index(local)];
                if value.is_nan() {
                    *value = field(lattice.point([0, 1, 2].map(|k| at[k] + local[k])));
                }
            }
            for step in cube(PART) {
                self.cell(lattice, at, [0, 1, 2].map(|k| part[k] + step[k]), &mut mesh);
            }
        }
        mesh
    }

    fn cell(&mut self, lattice: &Lattice, at: [u32; 3], local: [u32; 3], mesh: &mut Mesh) {
        let corners: [usize; 8] = std::array::from_fn(|i| index(corner(local, i as u32)));
        let inside = (0..8).fold(0u32, |bits, i| bits | u32::from(self.values[corners[i]] < 0.0) << i);
        if inside == 0 || inside == 0xff {
            return;
        }
        for tetrahedron in TETRAHEDRA {
            let mask = (0..4).fold(0, |bits, i| bits | (inside >> tetrahedron[i] & 1) << i);
            let [a, b, c, d] = ORDERS[mask as usize].map(|i| tetrahedron[i]);
            let mut cross = |from: u32, to: u32| self.vertex(lattice, at, local, [from.min(to), from.max(to)], mesh);
            match mask.count_ones() {
                1 => {
                    let face = [cross(a, b), cross(a, c), cross(a, d)];
                    mesh.faces.push(face);
                }
                2 => {
                    let [p, q, r, s] = [cross(a, c), cross(a, d), cross(b, d), cross(b, c)];
                    mesh.faces.extend([[p, q, r], [p, r, s]]);
                }
                3 => {
                    let face = [cross(a, b), cross(a, d), cross(a, c)];
                    mesh.faces.push(face);
                }
                _ => {}
            }
        }
    }

    /// The vertex between two corners of a cell, the lower of which has none of the coordinates of the higher exceeded.
    fn vertex(
        &mut self,
        lattice: &Lattice,
        at: [u32; 3],
        local: [u32; 3],
        [from, to]: [u32; 2],
        mesh: &mut Mesh,
    ) -> u32 {
        let [start, end] = [from, to].map(|bits| corner(local, bits));
        let key = index(start) * 7 + (to ^ from) as usize - 1;
        if self.vertices[key] == NONE {
            let [f, g] = [start, end].map(|point| self.values[index(point)]);
            let [p, q] = [start, end].map(|point| lattice.point([0, 1, 2].map(|k| at[k] + point[k])));
            self.vertices[key] = mesh.positions.len() as u32;
            mesh.positions.push(p + (q - p) * (f / (f - g)).clamp(MARGIN, 1.0 - MARGIN));
        }
        self.vertices[key]
    }
}

fn cube(side: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..side).flat_map(move |z| (0..side).flat_map(move |y| (0..side).map(move |x| [x, y, z])))
}

fn corner(local: [u32; 3], bits: u32) -> [u32; 3] {
    [0, 1, 2].map(|k| local[k as usize] + (bits >> k & 1))
}

fn index([x, y, z]: [u32; 3]) -> usize {
    ((z * POINTS + y) * POINTS + x) as usize
}

#[cfg(test)]
mod tests {
    use super::super::super::{topology, validate};
    use super::*;

    #[test]
    fn a_ball_is_closed_and_round() {
        let lattice = Lattice { low: DVec3::splat(-1.2), side: 2.4, cell: 0.07 };
        let mesh = lattice.surface(&|p: DVec3| p.length() - 1.0);
        assert_eq!(topology(&mesh).genus, Some(0));
        assert_eq!(validate(&mesh), []);
        let volume = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((mesh.volume() / volume - 1.0).abs() < 0.01, "{} is not near {volume}", mesh.volume());
    }

    #[test]
    fn a_ring_has_a_handle() {
        let lattice = Lattice { low: DVec3::splat(-1.5), side: 3.0, cell: 0.1 };
        let ring = |p: DVec3| DVec3::new((p.x * p.x + p.y * p.y).sqrt() - 1.0, p.z, 0.0).length() - 0.3;
        assert_eq!(topology(&lattice.surface(&ring)).genus, Some(1));
    }
}
