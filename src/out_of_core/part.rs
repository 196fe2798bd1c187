//! One part as a mesh of its own.

use std::sync::Arc;

use super::marks::Marks;
use super::rows::each_chunk;
use crate::backend::Device;
use crate::contract;
use crate::error::{Error, Result};
use crate::formats::Stream;
use crate::mesh::Mesh;
use crate::simplify::{Budget, OnProgress, Outcome};

/// Faces of the input with the vertices they use.
#[derive(Debug)]
pub struct Part {
    pub mesh: Mesh,
    /// The vertices of the input.
    pub vertices: Vec<u32>,
    /// Which of them other parts use too.
    pub frozen: Arc<[bool]>,
    /// What was not read as it stands in the file.
    pub told: Option<&'static str>,
}

impl Part {
    /// Takes the vertices of `faces` from the input. `used` is for marks and comes back empty.
    ///
    /// # Errors
    /// Those of reading.
    pub fn load(stream: &Stream, mut faces: Vec<[u32; 3]>, frozen: &Marks, used: &mut Marks) -> Result<Self> {
        faces.iter().flatten().for_each(|&v| used.insert(v));
        let count = used.count();
        faces.iter_mut().flatten().for_each(|v| *v = used.number(*v));
        let (mut vertices, mut room) = (Vec::with_capacity(count), Vec::new());
        let mut mesh = stream.no_mesh();
        reserve(&mut mesh, count);
        each_chunk(stream.vertex_count(), |rows| {
            let first = vertices.len();
            vertices.extend(used.members(rows));
            stream.append_vertices(&vertices[first..], &mut room, &mut mesh)
        })?;
        used.clear();
        let told = Stream::put_right(&mut mesh);
        mesh.faces = faces;
        let frozen = vertices.iter().map(|&v| frozen.contains(v)).collect();
        Ok(Self { mesh, vertices, frozen, told })
    }

    /// Freezes those of its vertices that are marked too.
    pub fn freeze(&mut self, marks: &Marks) {
        let rows = self.vertices.iter().zip(&*self.frozen);
        self.frozen = rows.map(|(&v, &is_frozen)| is_frozen || marks.contains(v)).collect();
    }

    /// Reduces the part; `None` where no face has an area to be kept for.
    ///
    /// # Errors
    /// Those of [`contract::run`].
    pub fn reduce(
        &self,
        options: &contract::Options,
        budget: &Budget,
        device: &Device,
        progress: Option<&mut OnProgress<'_>>,
    ) -> Result<Option<Outcome>> {
        let options = contract::Options { locked: Some(self.frozen.clone()), ..options.clone() };
        match contract::run(&self.mesh, &options, std::slice::from_ref(budget), device, progress) {
            // Every face had two corners at one point.
            Err(Error::Mesh(_)) => Ok(None),
            result => result.map(|mut outcomes| outcomes.pop()),
        }
    }
}

fn reserve(mesh: &mut Mesh, count: usize) {
    mesh.positions.reserve_exact(count);
    mesh.normals.iter_mut().for_each(|rows| rows.reserve_exact(count));
    mesh.colors.iter_mut().for_each(|rows| rows.reserve_exact(count));
}
