//! What is partitioned: the mesh welded, oriented and normalized, and who lies across each edge.

use rayon::prelude::*;

use crate::backend::{Buffer, Queue};
use crate::error::Result;
use crate::kernel::rows::{BORDER, Face, Position};
use crate::kernel::{boundary_gains, pairs};
use crate::math::DVec3;
use crate::mesh::arrange::Arranged;
use crate::mesh::dual::{NONE, neighbors};
use crate::mesh::fan::Fan;
use crate::mesh::frame::Frame;
use crate::mesh::orient::{TURNED, turn_to_agree};
use crate::mesh::{Materials, Mesh, Rings};

// The rows of neighbors go to kernels as they are.
const _: () = assert!(NONE == boundary_gains::NONE && NONE == pairs::NO_FACE);

/// Vertices that a thread places at a time.
const ROWS: usize = 1 << 12;

/// A mesh to partition. Vertices lie along a curve through space, and faces by their lowest vertex.
#[derive(Debug)]
pub struct Surface {
    /// Between model units and the coordinates here.
    pub frame: Frame,
    /// V positions in the frame, as the input has them.
    pub points: Vec<DVec3>,
    /// V positions in the frame as kernels have them.
    pub positions: Vec<Position>,
    /// F faces, counter-clockwise; neighbors agree as far as the surface can be oriented.
    pub faces: Vec<[u32; 3]>,
    /// The faces around every vertex.
    pub rings: Rings,
    /// The face across each edge of every face, [`NONE`] at a wall.
    pub neighbors: Vec<[u32; 3]>,
    /// How the faces around every vertex hang together.
    pub fans: Vec<Fan>,
    /// The input vertex of every vertex.
    pub vertex_source: Vec<u32>,
    /// The input face of every face, with [`crate::mesh::orient::TURNED`] where it was turned over.
    pub face_source: Vec<u32>,
    /// The lowest input vertex joined with each; `None` where each is on its own.
    pub lowest: Option<Vec<u32>>,
    /// The bounding box's diagonal, in the frame.
    pub diagonal: f64,
    /// What was dropped or could not be oriented.
    pub warnings: Vec<String>,
}

/// A surface on a queue's device.
#[derive(Debug)]
pub struct Uploaded {
    pub positions: Buffer<Position>,
    pub faces: Buffer<Face>,
    pub ring_starts: Buffer<u32>,
    pub ring_faces: Buffer<u32>,
}

impl Surface {
    /// Prepares `mesh`; `weld` is how far apart joined vertices may be, in model units; `None` joins nothing.
    ///
    /// # Errors
    /// [`Error::Mesh`](crate::Error::Mesh) for an invalid mesh or one that has no face left after welding.
    pub fn new(mesh: &Mesh, weld: Option<f64>) -> Result<Self> {
        let arranged = Arranged::checked(mesh, weld)?;
        let mut warnings: Vec<String> = arranged.warnings().collect();
        let Arranged { vertex_source, mut faces, mut face_source, rings, lowest, bounds, .. } = arranged;
        let oriented = turn_to_agree(&mut faces, &mut face_source, &rings);
        warnings.extend(oriented.warning);
        let at = |v: u32| mesh.positions[vertex_source[v as usize] as usize];
        let frame = Frame::new(&faces, at, bounds);
        let points: Vec<DVec3> =
            (0..vertex_source.len() as u32).into_par_iter().with_min_len(ROWS).map(|v| frame.to_frame(at(v))).collect();
        let row =
            |(&point, &fan): (&DVec3, &Fan)| Position::new(point.as_vec3(), if fan == Fan::Open { BORDER } else { 0 });
        Ok(Self {
            positions: points.par_iter().zip(&oriented.fans).with_min_len(ROWS).map(row).collect(),
            neighbors: neighbors(&faces, &rings),
            fans: oriented.fans,
            diagonal: (frame.to_frame(bounds.1) - frame.to_frame(bounds.0)).length(),
            frame,
            points,
            faces,
            rings,
            vertex_source,
            face_source,
            lowest,
            warnings,
        })
    }

    /// Makes walls of the edges between faces of different materials.
    pub fn wall_off(&mut self, materials: &Materials) {
        let Self { neighbors, face_source, .. } = self;
        let material = |face: u32| materials.of_face[(face_source[face as usize] & !TURNED) as usize];
        neighbors.par_iter_mut().enumerate().with_min_len(ROWS).for_each(|(face, row)| {
            let own = material(face as u32);
            row.iter_mut().filter(|other| **other != NONE && material(**other) != own).for_each(|other| *other = NONE);
        });
    }

    /// Copies it to the device of `queue`.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) when the device is out of memory or was lost.
    pub fn upload(&self, queue: &mut Queue) -> Result<Uploaded> {
        let faces = self.faces.par_iter().with_min_len(ROWS).map(|&[a, b, c]| Face { a, b, c }).collect();
        Ok(Uploaded {
            positions: queue.buffer_from(self.positions.clone())?,
            faces: queue.buffer_from(faces)?,
            ring_starts: queue.buffer_from(self.rings.starts.clone())?,
            ring_faces: queue.buffer_from(self.rings.faces.clone())?,
        })
    }

    /// The face of the input that a face was.
    pub fn input_face(&self, face: u32) -> u32 {
        self.face_source[face as usize] & !TURNED
    }

    /// The face across the edge `k` of a face.
    pub fn across(&self, face: u32, k: usize) -> Option<u32> {
        Some(self.neighbors[face as usize][k]).filter(|&other| other != NONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::mesh::shapes;

    #[test]
    fn a_plane_has_walls_at_its_border() {
        let surface = Surface::new(&shapes::plane(3, 2), Some(0.0)).expect("a valid mesh");
        let walls = surface.neighbors.iter().flatten().filter(|&&other| other == NONE).count();
        assert_eq!((surface.faces.len(), surface.points.len(), walls), (12, 12, 10));
        assert_eq!(surface.positions.iter().filter(|p| p.flags & BORDER != 0).count(), 10);
    }

    #[test]
    fn materials_are_walls() {
        let plane = shapes::plane(3, 2);
        let of_face = (0..12).map(|face| u32::from(face < 6)).collect();
        let mut surface = Surface::new(&plane, Some(0.0)).expect("a valid mesh");
        surface.wall_off(&Materials { of_face, names: vec![String::new(), "wood".into()] });
        let walls = surface.neighbors.iter().flatten().filter(|&&other| other == NONE).count();
        assert_eq!(walls, 10 + 2 * 3, "both sides of three edges between two rows");
    }

    #[test]
    fn what_has_no_face_is_an_error() {
        for mesh in [Mesh::default(), Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]])] {
            assert!(matches!(Surface::new(&mesh, Some(0.0)), Err(Error::Mesh(_))));
        }
    }
}
