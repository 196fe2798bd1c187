//! Progressive meshes \[Hop96\]: the contractions of a run in their order, to replay to any face count and to undo, one
//! vertex split after the other.
//!
//! ```
//! use coarsen::contract::Options;
//! use coarsen::progressive::Replay;
//! use coarsen::{Budget, Device, Method, mesh, simplify};
//!
//! # fn main() -> coarsen::Result<()> {
//! let part = mesh::sample("part", Some(5_000))?;
//! let method = Method::Contract(Options { log: true, ..Options::default() });
//! let outcome = simplify(&part, &method, &Budget::faces(200), &Device::cpu(0)?, None)?;
//!
//! // Levels of detail from one run, in any order.
//! let log = outcome.log.expect("asked for");
//! let mut replay = Replay::new(&part, &log)?;
//! for faces in [2_000, 200, 1_000] {
//!     assert_eq!(replay.to_faces(faces), faces);
//!     assert_eq!(replay.mesh().faces.len(), faces);
//! }
//! replay.seek(log.contractions().len());
//! assert_eq!(replay.mesh(), outcome.mesh);
//! # Ok(())
//! # }
//! ```
//!
//! A record names its two vertices by the input and holds what became of the one. Which faces vanish and which corners
//! change follows from the mesh, but for faces that cancel each other out where parts join, which are listed; so a log is
//! as small as what it cannot leave out: 32 bytes a contraction, without normals and colors.

mod file;
mod replay;
mod rings;
mod sum;

pub use replay::Replay;
pub(crate) use sum::of_bytes as sum_of_bytes;

use crate::error::{Error, Place, Result};
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// The name that errors use.
const NAME: &str = "collapse log";

/// In the place of an input vertex that became none.
const NONE: u32 = u32::MAX;

/// Two vertices that became one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contraction {
    /// The input vertex whose name the new one has: the one at whose position it lies, where it lies at an end.
    pub keep: u32,
    /// The input vertex whose name is gone.
    pub gone: u32,
    /// Where the new vertex lies, in model units.
    pub position: DVec3,
}

/// What a run did to a mesh, contraction by contraction.
///
/// Made by [`crate::simplify()`] with [`log`](crate::contract::Options::log), kept in a file by [`write`](Self::write) and
/// [`read`](Self::read), followed by a [`Replay`]. It does not hold the mesh, and is of use only together with it.
#[derive(Debug, Clone, PartialEq)]
pub struct CollapseLog {
    identity: Identity,
    /// Input vertices that are not themselves, ascending: each with the lower one that it was joined to, or [`NONE`] where
    /// no face is left that uses it.
    joined: Vec<[u32; 2]>,
    /// Input faces that were dropped before the first contraction, ascending.
    dropped_faces: Vec<u32>,
    contractions: Vec<Contraction>,
    /// Faces that vanished though they had not both ends of a contraction, where parts met back to back: each after the
    /// number of its contraction, in order.
    cancelled: Vec<[u32; 2]>,
    /// What the new vertices carry, one row a contraction; none where the input has none.
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<[f32; 4]>>,
}

/// Which mesh a log is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Identity {
    vertices: u32,
    faces: u32,
    /// Over positions and corners.
    hash: u64,
}

impl CollapseLog {
    /// A log without contractions, of a run on `input` that starts with these of its vertices and faces.
    ///
    /// `lowest` is the vertex that each was joined to, if any was; the last tells whether normals and colors are kept.
    pub(crate) fn new(
        input: &Mesh,
        lowest: Option<&[u32]>,
        vertices: &[u32],
        faces: impl IntoIterator<Item = u32>,
        [normals, colors]: [bool; 2],
    ) -> Self {
        let mut lives = vec![false; input.positions.len()];
        vertices.iter().for_each(|&v| lives[v as usize] = true);
        let representative = |v: u32| {
            let lowest = lowest.map_or(v, |lowest| lowest[v as usize]);
            if lives[lowest as usize] { lowest } else { NONE }
        };
        let mut dropped = vec![true; input.faces.len()];
        faces.into_iter().for_each(|f| dropped[f as usize] = false);
        Self {
            identity: Identity::of(input),
            joined: (0..lives.len() as u32).map(|v| [v, representative(v)]).filter(|[v, to]| v != to).collect(),
            dropped_faces: (0..dropped.len() as u32).filter(|&f| dropped[f as usize]).collect(),
            contractions: Vec::new(),
            cancelled: Vec::new(),
            normals: normals.then(Vec::new),
            colors: colors.then(Vec::new),
        }
    }

    /// Appends a contraction and what the new vertex carries, where the input carries it.
    pub(crate) fn push(&mut self, contraction: Contraction, normal: Option<Vec3>, color: Option<[f32; 4]>) {
        self.contractions.push(contraction);
        if let (Some(rows), Some(normal)) = (&mut self.normals, normal) {
            rows.push(normal);
        }
        if let (Some(rows), Some(color)) = (&mut self.colors, color) {
            rows.push(color);
        }
    }

    /// Lets an input face vanish with the last contraction.
    pub(crate) fn cancel(&mut self, face: u32) {
        if let Some(last) = self.contractions.len().checked_sub(1) {
            self.cancelled.push([last as u32, face]);
        }
    }

    /// The faces that vanish with a contraction beside those between its ends.
    fn cancelled_by(&self, contraction: usize) -> impl Iterator<Item = u32> {
        let first = self.cancelled.partition_point(|row| (row[0] as usize) < contraction);
        let rows = self.cancelled[first..].iter();
        rows.take_while(move |row| row[0] as usize == contraction).map(|row| row[1])
    }

    /// Vertices of the mesh that it is of.
    pub fn vertices_in(&self) -> usize {
        self.identity.vertices as usize
    }

    /// Faces of the mesh that it is of.
    pub fn faces_in(&self) -> usize {
        self.identity.faces as usize
    }

    /// The contractions, from the input on.
    pub fn contractions(&self) -> &[Contraction] {
        &self.contractions
    }

    /// The input faces that were dropped before the first contraction, ascending: degenerate, repeated or pruned.
    pub fn dropped_faces(&self) -> &[u32] {
        &self.dropped_faces
    }

    /// The input vertex that `vertex` was joined to before the first contraction, itself where it was to none; `None`
    /// where no face was left that uses it.
    pub fn representative(&self, vertex: u32) -> Option<u32> {
        match self.joined.binary_search_by_key(&vertex, |row| row[0]) {
            Ok(row) => Some(self.joined[row][1]).filter(|&to| to != NONE),
            Err(_) => Some(vertex).filter(|&v| v < self.identity.vertices),
        }
    }

    /// The representatives of all input vertices, [`NONE`] for those without, once every row is found to fit `input`.
    fn start_on(&self, input: &Mesh) -> Result<Vec<u32>> {
        self.identity.check(input)?;
        let (vertices, faces) = (self.identity.vertices, self.identity.faces);
        let mut representative: Vec<u32> = (0..vertices).collect();
        let mut last = None;
        for &[v, to] in &self.joined {
            // What a vertex is joined to lies below it, so it has its own place by now.
            let fits = v < vertices && last < Some(v) && (to == NONE || (to < v && representative[to as usize] == to));
            if !fits {
                return Err(malformed(format!("vertex {v} is joined to {to}")));
            }
            representative[v as usize] = to;
            last = Some(v);
        }
        if !self.dropped_faces.is_sorted_by(|a, b| a < b) || self.dropped_faces.last().is_some_and(|&f| f >= faces) {
            return Err(malformed("the dropped faces are not in order".into()));
        }
        let in_order = self.cancelled.is_sorted_by_key(|row| row[0]);
        let fits = |row: &[u32; 2]| (row[0] as usize) < self.contractions.len() && row[1] < faces;
        if !in_order || !self.cancelled.iter().all(fits) {
            return Err(malformed("the cancelled faces are not in order".into()));
        }
        let mut lives: Vec<bool> = (0..vertices).map(|v| representative[v as usize] == v).collect();
        let is_live = |lives: &[bool], v: u32| lives.get(v as usize) == Some(&true);
        for (i, &Contraction { keep, gone, position }) in self.contractions.iter().enumerate() {
            if keep == gone || !is_live(&lives, keep) || !is_live(&lives, gone) || !position.is_finite() {
                return Err(malformed(format!("contraction {i} joins {gone} to {keep} at {position}")));
            }
            lives[gone as usize] = false;
        }
        Ok(representative)
    }
}

/// The log contradicts itself, though the bytes of its file are those that were written.
fn malformed(message: String) -> Error {
    Error::format(NAME, Place::File, message)
}

impl Identity {
    fn of(mesh: &Mesh) -> Self {
        Self { vertices: mesh.positions.len() as u32, faces: mesh.faces.len() as u32, hash: sum::of_mesh(mesh) }
    }

    fn check(self, mesh: &Mesh) -> Result<()> {
        let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
        let counts = (self.vertices as usize, self.faces as usize);
        if counts != (vertices, faces) {
            return Err(Error::Parameter(format!(
                "the log is of another mesh: of {} vertices and {} faces, this one has {vertices} and {faces}",
                counts.0, counts.1
            )));
        }
        if self.hash != sum::of_mesh(mesh) {
            return Err(Error::Parameter(format!(
                "the log is of another mesh: it too has {vertices} vertices and {faces} faces, but others"
            )));
        }
        Ok(())
    }
}
