//! The mesh of the faces left and the cells' representatives.

use rayon::prelude::*;

use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;
use crate::mesh::weld::joined_attributes;
use crate::simplify::MOVED;

use super::lattice::{Lattice, unit};
use super::left::NONE;

/// Cells that a thread takes at a time.
const ROWS: usize = 1 << 10;

/// The cells of the result and their members.
#[derive(Debug)]
pub struct Cells {
    /// The cell of every vertex of the input, or [`NONE`].
    pub of_vertices: Vec<u32>,
    /// The lowest vertex of every cell.
    pub firsts: Vec<u32>,
    /// Steps to the side.
    pub steps: u32,
}

impl Cells {
    /// How many of these faces lie in cells that no face is left of.
    pub fn vanished(&self, faces: &[[u32; 3]]) -> usize {
        let is_gone = |face: &&[u32; 3]| face.iter().all(|&v| self.of_vertices[v as usize] == NONE);
        faces.par_iter().with_min_len(ROWS).filter(is_gone).count()
    }
}

/// Where the vertices of the cells go.
#[derive(Debug)]
pub enum Points {
    /// To points about the first vertices, in units.
    Free(Vec<[f32; 4]>),
    /// To vertices of the input.
    At(Vec<u32>),
}

/// The mesh of `faces`, and the input vertex at the position of each vertex, or [`MOVED`].
pub fn made(input: &Mesh, lattice: &Lattice, cells: &Cells, points: &Points, faces: Vec<[u32; 3]>) -> (Mesh, Vec<u32>) {
    let steps_a_unit = 1.0 / f64::from(unit(cells.steps));
    let place = |cell: usize| -> (DVec3, u32) {
        let first = cells.firsts[cell];
        match points {
            Points::At(vertices) => (input.positions[vertices[cell] as usize], vertices[cell]),
            Points::Free(points) => {
                let [x, y, z, _] = points[cell];
                let position = input.positions[first as usize];
                if [x, y, z] == [0.0; 3] {
                    return (position, first);
                }
                let offset = Vec3::new(x, y, z).as_dvec3() * steps_a_unit;
                (lattice.moved(position, offset, cells.steps), MOVED)
            }
        }
    };
    let (positions, origin) = (0..cells.firsts.len()).into_par_iter().with_min_len(ROWS).map(place).unzip();
    let mut mesh = Mesh::new(positions, faces);
    if input.normals.is_some() || input.colors.is_some() {
        let lowest = |(v, &cell): (u32, &u32)| if cell == NONE { v } else { cells.firsts[cell as usize] };
        let lowest: Vec<u32> = (0..).zip(&cells.of_vertices).map(lowest).collect();
        (mesh.normals, mesh.colors) = joined_attributes(input, Some(&lowest), &cells.firsts);
    }
    (mesh, origin)
}
