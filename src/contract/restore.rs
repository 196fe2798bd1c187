//! From the rows of a run back to a mesh, in the order of the input.

use rayon::prelude::*;

use crate::kernel::contract_faces::renamed;
use crate::kernel::rows::{Face, Position};
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::mesh::frame::Frame;
use crate::mesh::orient::TURNED;
use crate::simplify::MOVED;

use super::carry::{Carried, MOVED_FROM};
use super::join::referenced;
use super::ranks::Ranks;
use super::shading::mend;
use super::unwedge::Split;

/// Rows that a thread moves at a time.
pub const ROWS: usize = 1 << 12;

/// A surface: vertices where they are now, with the origins that they have there, faces as the round found them, and what it
/// made of every vertex; between rounds nothing.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    pub positions: &'a [Position],
    pub origin: &'a [u32],
    pub faces: &'a [Face],
    pub roles: &'a [u32],
}

impl Placed<'_> {
    /// A face as it is now.
    pub fn face(&self, face: u32) -> Face {
        let [a, b, c] = self.faces[face as usize].corners().map(|v| renamed(v, self.roles[v as usize]));
        Face { a, b, c }
    }

    /// Those that live, with their numbers.
    pub fn live_faces(&self) -> impl Iterator<Item = (u32, Face)> + Clone {
        (0..self.faces.len() as u32).map(|f| (f, self.face(f))).filter(|(_, face)| face.is_live())
    }
}

/// The mesh of what lives of a surface and what it carries, and the input vertex at the position of each vertex, or [`MOVED`].
///
/// Vertices that lost all their faces, where parts met back to back, are left out; one whose corners disagree in what vertices
/// carry becomes several. A vertex takes the place of the input vertex that it stands at or began as, a face that of its own:
/// what nothing happened to comes back as it was.
pub fn restore(input: &Mesh, frame: Frame, placed: Placed<'_>, carried: &Carried) -> (Mesh, Vec<u32>) {
    let Placed { positions, origin, .. } = placed;
    let face_origin = &carried.face_origin;
    let at = |v: u32| model_position(input, frame, origin[v as usize], positions[v as usize]);
    let face_order = || {
        let live = placed.live_faces().map(|(f, _)| f);
        by_origin(live, input.faces.len(), |f| face_origin[f as usize] & !TURNED)
    };
    let Some(wedges) = &carried.wedges else {
        let vertices = || {
            let has_face = referenced(placed.live_faces().map(|(_, face)| face), positions.len());
            let live = (0..positions.len() as u32).filter(|&v| has_face[v as usize]);
            by_origin(live, input.positions.len(), |v| origin[v as usize] & !MOVED_FROM)
        };
        let (vertex_order, face_order) = rayon::join(vertices, face_order);
        let mut new_vertex = vec![0; origin.len()];
        (0..).zip(&vertex_order).for_each(|(new, &old)| new_vertex[old as usize] = new);
        let corners =
            |&f: &u32| as_input(face_origin[f as usize], placed.face(f).corners().map(|v| new_vertex[v as usize]));
        let mesh = Mesh {
            positions: vertex_order.par_iter().with_min_len(ROWS).map(|&v| at(v)).collect(),
            faces: face_order.par_iter().with_min_len(ROWS).map(corners).collect(),
            ..Mesh::default()
        };
        let stays = |&v: &u32| if origin[v as usize] & MOVED_FROM == 0 { origin[v as usize] } else { MOVED };
        return (mesh, vertex_order.par_iter().with_min_len(ROWS).map(stays).collect());
    };
    let (split, face_order) = rayon::join(|| Split::new(input, wedges, placed), face_order);
    let corners = |&f: &u32| as_input(face_origin[f as usize], split.corners(f as usize));
    let texcoords = |&f: &u32| as_input(face_origin[f as usize], split.texcoords(f as usize));
    let was: Vec<u32> = face_order.iter().map(|&f| face_origin[f as usize] & !TURNED).collect();
    let materials = input.materials.as_ref().filter(|_| wedges.layout.has_materials).map(|rows| rows.take(&was));
    let mut mesh = Mesh {
        positions: split.vertices().map(at).collect(),
        faces: face_order.par_iter().with_min_len(ROWS).map(corners).collect(),
        texcoords: split.has_texcoords().then(|| face_order.par_iter().with_min_len(ROWS).map(texcoords).collect()),
        materials,
        ..Mesh::default()
    };
    split.fill(&mut mesh);
    // A log tells normals as they were contracted.
    if !wedges.layout.is_smooth {
        mend(&mut mesh, input, &was, |v| split.has_other_numbers(v));
    }
    (mesh, split.origins().map(|origin| origin.unwrap_or(MOVED)).collect())
}

/// What belongs to the corners of a face of this origin, in the order that the input had them.
fn as_input<T>(origin: u32, [a, b, c]: [T; 3]) -> [T; 3] {
    if origin & TURNED == 0 { [a, b, c] } else { [a, c, b] }
}

/// Where a vertex of this origin and row lies in model units: what stands at an input vertex, exactly there.
pub fn model_position(input: &Mesh, frame: Frame, origin: u32, row: Position) -> DVec3 {
    let kept: Option<&DVec3> = input.positions.get(origin as usize).filter(|_| origin & MOVED_FROM == 0);
    kept.copied().unwrap_or_else(|| frame.to_model(row.xyz()))
}

/// Rows in ascending order of their origins, which lie below `bound`; those of one origin as they come.
fn by_origin(rows: impl Iterator<Item = u32> + Clone, bound: usize, origin: impl Fn(u32) -> u32) -> Vec<u32> {
    let ranks = Ranks::new(rows.clone().map(&origin), bound);
    let mut ordered = vec![0; ranks.len()];
    let mut count = 0;
    for row in rows.clone() {
        ordered[ranks.of(origin(row))] = row;
        count += 1;
    }
    if count > ordered.len() {
        ordered = rows.collect();
        ordered.sort_by_key(|&row| origin(row));
    }
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_and_the_winding_of_the_input_come_back() {
        let corners = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 0.0]].map(DVec3::from);
        let input = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [1, 2, 3]]);
        let frame = Frame::new(&input.faces, |v| corners[v as usize], input.bounds());
        // Stored as 3, 2, 0, 1, of which the input's 3 has moved; the input's face 1 came first, turned over.
        let moved = Position::new(frame.to_rows(DVec3::splat(2.0)), 0);
        let rows = [moved, moved, moved, moved];
        let faces = [Face { a: 3, b: 0, c: 1 }, Face { a: 2, b: 3, c: 1 }];
        let carried = Carried {
            origin: Vec::new(),
            wedges: None,
            drift: Vec::new(),
            weights: Vec::new(),
            face_origin: vec![1 | TURNED, 0],
        };
        let placed = Placed { positions: &rows, origin: &[3 | MOVED_FROM, 2, 0, 1], faces: &faces, roles: &[0; 4] };
        let (mesh, origin) = restore(&input, frame, placed, &carried);
        let expected = Mesh { positions: [&corners[..3], &[DVec3::splat(2.0)]].concat(), ..input };
        assert_eq!(mesh, expected);
        assert_eq!(origin, [0, 1, 2, MOVED]);
    }
}
