//! A mesh to simplify, in the form each contender takes.

use std::time::Instant;

use coarsen::math::DVec3;
use coarsen::{Error, Mesh};

use crate::cli::failure::at;
use crate::cli::source::Source;

/// A mesh to simplify.
pub struct Case {
    /// As the command line names it.
    pub name: String,
    pub mesh: Mesh,
    pub read_secs: f64,
}

/// A mesh as meshoptimizer takes it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Single {
    pub positions: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
}

impl Case {
    /// Reads or makes it: geometry only, since meshoptimizer's functions carry no more.
    ///
    /// # Errors
    /// As [`Source::read`], and a mesh that is invalid or has no faces.
    pub fn read(source: &Source) -> anyhow::Result<Self> {
        Self::read_with(source, |Mesh { positions, faces, .. }| Mesh::new(positions, faces))
    }

    /// As [`Case::read`], with colors.
    ///
    /// # Errors
    /// As [`Case::read`].
    pub fn read_lit(source: &Source) -> anyhow::Result<Self> {
        let lit = |Mesh { positions, faces, colors, face_colors, .. }| Mesh {
            colors,
            face_colors,
            ..Mesh::new(positions, faces)
        };
        Self::read_with(source, lit)
    }

    fn read_with(source: &Source, keep: impl Fn(Mesh) -> Mesh) -> anyhow::Result<Self> {
        let clock = Instant::now();
        let mesh = source.read()?;
        let read_secs = clock.elapsed().as_secs_f64();
        let (name, mesh) = (source.to_string(), keep(mesh));
        // The rivals trust their input.
        mesh.check().map_err(|error| at(name.as_ref(), error))?;
        if mesh.faces.is_empty() {
            return Err(at(name.as_ref(), Error::Mesh("it has no faces".into())));
        }
        Ok(Self { name, mesh, read_secs })
    }

    /// A copy in single precision.
    pub fn single(&self) -> Single {
        Single {
            positions: self.mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect(),
            indices: self.mesh.faces.as_flattened().to_vec(),
        }
    }
}

impl Single {
    /// The mesh without the vertices that no face uses.
    pub fn into_mesh(self) -> Mesh {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut positions = Vec::new();
        let mut renumber = |v: u32| {
            let number = &mut number[v as usize];
            if *number == u32::MAX {
                *number = positions.len() as u32;
                positions.push(DVec3::from_array(self.positions[v as usize].map(f64::from)));
            }
            *number
        };
        let faces = self.indices.as_chunks().0.iter().map(|corners: &[u32; 3]| corners.map(&mut renumber)).collect();
        Mesh::new(positions, faces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_vertices_are_dropped() {
        let positions = vec![[9.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [9.0; 3], [0.0, 1.0, 0.5]];
        let mesh = Single { positions, indices: vec![4, 1, 2, 2, 1, 4] }.into_mesh();
        assert_eq!(mesh.positions, [DVec3::new(0.0, 1.0, 0.5), DVec3::ZERO, DVec3::X]);
        assert_eq!(mesh.faces, [[0, 1, 2], [2, 1, 0]]);
    }

    #[test]
    fn a_mesh_goes_to_single_precision_and_back() {
        let mesh = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 0.1, 2.0)], vec![[0, 1, 2]]);
        let case = Case { name: String::new(), mesh, read_secs: 0.0 };
        let back = case.single().into_mesh();
        assert_eq!(back.faces, case.mesh.faces);
        assert_eq!(back.positions[2], DVec3::new(0.0, f64::from(0.1_f32), 2.0));
    }
}
