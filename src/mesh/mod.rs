//! The triangle mesh: positions, faces, and what is carried along at the vertices.
//!
//! # Invariants
//! Checked by [`Mesh::check`]; every function that takes a mesh may rely on them once it has called it.
//! - every index in `faces` is below `positions.len()`;
//! - every coordinate is finite;
//! - `normals`, `colors` and channels, where present, have one row a vertex;
//! - `texcoords`, `face_colors` and materials, where present, have one row a face;
//! - normals, colors and texture coordinates are finite.
//!
//! Functions that return no [`Result`] do not call `check`, and panic on an index out of range.

pub mod adjacency;
pub(crate) mod arrange;
pub mod channel;
mod circle;
pub(crate) mod clip;
mod copies;
mod curve;
pub(crate) mod cut;
pub(crate) mod disjoint;
pub mod dual;
pub(crate) mod dynamic;
pub(crate) mod fan;
pub(crate) mod frame;
pub(crate) mod holes;
pub(crate) mod kept;
pub(crate) mod key_table;
pub(crate) mod layers;
pub(crate) mod limits;
mod near;
pub mod normals;
pub mod orient;
pub(crate) mod parts;
mod polygons;
pub mod prune;
mod regions;
mod repeated;
pub mod samples;
pub(crate) mod separate;
pub mod shapes;
pub mod survey;
pub mod topology;
pub mod validate;
pub mod weld;

pub use adjacency::Rings;
pub use channel::{Channel, ChannelKind, Materials};
pub use kept::{Dropped, Normals};
pub use normals::vertex_normals;
pub use orient::orient;
pub use polygons::Polygons;
pub use prune::prune;
pub use samples::{SAMPLES, parse_sample, sample};
pub use survey::{Survey, survey};
pub use topology::{Topology, complex_vertices, topology};
pub use validate::{Defect, validate};
pub use weld::{Welded, weld};

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::math::{DVec3, Vec2, Vec3};

/// The fewest rows worth handing to another thread.
const PARALLEL_ROWS: usize = 4096;

/// The index of the first row of which this holds, whatever the threads.
///
/// In pieces without a branch: a parallel search for a position looks after every row whether another thread has found one.
pub(crate) fn first_where<T: Sync>(rows: &[T], holds: impl Fn(&T) -> bool + Sync) -> Option<usize> {
    let in_piece = |piece: &[T]| piece.iter().fold(false, |found, row| found | holds(row));
    let first = rows.par_chunks(PARALLEL_ROWS).position_first(in_piece)? * PARALLEL_ROWS;
    rows[first..].iter().position(holds).map(|row| first + row)
}

/// How many of so many rows a task takes, within these bounds: threads share few large tasks badly, and small ones of a large
/// mesh are too many for each to look at every other's.
fn task_len(rows: usize, (least, most): (usize, usize)) -> usize {
    const TASKS: usize = 32;
    (rows / TASKS).clamp(least, most)
}

/// An indexed triangle mesh.
///
/// Vertices may repeat positions (a soup, a crease, a seam); `weld` joins them. Faces are counter-clockwise from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions in model units.
    pub positions: Vec<DVec3>,
    /// Vertex indices of every face, counter-clockwise.
    pub faces: Vec<[u32; 3]>,
    /// Unit normals, one a vertex.
    pub normals: Option<Vec<Vec3>>,
    /// Red, green, blue, alpha in `[0, 1]`, as stored (sRGB), one a vertex.
    pub colors: Option<Vec<[f32; 4]>>,
    /// Texture coordinates, one pair a corner in the order of the face's corners: a seam needs no vertex twice.
    ///
    /// A texture covers `[0, 1]` in both directions and repeats outside. A face without any has zeros.
    pub texcoords: Option<Vec<[Vec2; 3]>>,
    /// Colors as at the vertices, one a face: light that jumps from face to face.
    pub face_colors: Option<Vec<[f32; 4]>>,
    /// What else vertices carry: further texture coordinates, tangents, joints, scalars.
    pub channels: Vec<Channel>,
    /// What every face is made of.
    pub materials: Option<Materials>,
}

/// What a run says that carries colors of vertices alone.
pub(crate) const FACE_COLORS_DROPPED: &str = "face colors are dropped: only those of vertices are carried";

/// How long the diagonal of a box between two corners is.
pub(crate) fn diagonal_between(low: DVec3, high: DVec3) -> f64 {
    let length = (high - low).length();
    if length.is_normal() {
        return length;
    }
    // Squares left the range of numbers, or the difference did.
    let half = high * 0.5 - low * 0.5;
    let longest = half.max_element();
    if longest > 0.0 { (half / longest).length() * longest * 2.0 } else { 0.0 }
}

/// Those of `rows` in this order.
pub(crate) fn take<T: Copy>(rows: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&row| rows[row as usize]).collect()
}

impl Mesh {
    /// A mesh of positions and faces only.
    pub fn new(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        Self { positions, faces, ..Self::default() }
    }

    /// Checks the invariants of this module.
    ///
    /// # Errors
    /// [`Error::Mesh`] names the first face or vertex that breaks one; [`Error::Limit`] for more than indices hold.
    pub fn check(&self) -> Result<()> {
        let vertex_count = self.positions.len();
        if vertex_count > u32::MAX as usize / 2 || self.faces.len() > u32::MAX as usize / 3 {
            return Err(Error::Limit(format!(
                "{vertex_count} vertices and {} faces are more than 32-bit indices can hold",
                self.faces.len()
            )));
        }
        if let Some(v) = first_where(&self.positions, |p| !p.is_finite()) {
            return Err(Error::Mesh(format!("vertex {v} has a coordinate that is not finite: {}", self.positions[v])));
        }
        let is_out_of_range = |&[a, b, c]: &[u32; 3]| a.max(b).max(c) as usize >= vertex_count;
        if let Some(f) = first_where(&self.faces, is_out_of_range) {
            return Err(Error::Mesh(format!(
                "face {f} has an index out of range: {:?}, the mesh has {vertex_count} vertices",
                self.faces[f]
            )));
        }
        let (vertices, faces) = ((vertex_count, "vertices"), (self.faces.len(), "faces"));
        for (name, rows, (count, of)) in [
            ("normals", self.normals.as_ref().map(Vec::len), vertices),
            ("colors", self.colors.as_ref().map(Vec::len), vertices),
            ("rows of texture coordinates", self.texcoords.as_ref().map(Vec::len), faces),
            ("face colors", self.face_colors.as_ref().map(Vec::len), faces),
        ] {
            if let Some(rows) = rows
                && rows != count
            {
                return Err(Error::Mesh(format!("{rows} {name} for {count} {of}")));
            }
        }
        self.channels.iter().try_for_each(|channel| channel.check(vertex_count))?;
        self.materials.iter().try_for_each(|materials| materials.check(self.faces.len()))?;
        let normals = self.normals.as_deref().unwrap_or_default();
        if let Some(v) = first_where(normals, |normal| !normal.is_finite()) {
            return Err(Error::Mesh(format!("vertex {v} has a normal that is not finite: {}", normals[v])));
        }
        for (of, colors) in [("vertex", &self.colors), ("face", &self.face_colors)] {
            let colors = colors.as_deref().unwrap_or_default();
            if let Some(row) = first_where(colors, |color| !color.iter().all(|channel| channel.is_finite())) {
                return Err(Error::Mesh(format!("{of} {row} has a color that is not finite: {:?}", colors[row])));
            }
        }
        let texcoords = self.texcoords.as_deref().unwrap_or_default();
        if let Some(f) = first_where(texcoords, |corners| corners.iter().any(|uv| !uv.is_finite())) {
            return Err(Error::Mesh(format!(
                "face {f} has a texture coordinate that is not finite: {:?}",
                texcoords[f].map(|uv| uv.to_array())
            )));
        }
        Ok(())
    }

    /// The corners of the axis-aligned bounding box, or two zeros without vertices.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let Some(&first) = self.positions.first() else { return (DVec3::ZERO, DVec3::ZERO) };
        let joined = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
        self.positions
            .par_chunks(PARALLEL_ROWS)
            .map(|rows| rows.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
            .reduce(|| (first, first), joined)
    }

    /// The length of the bounding box's diagonal, in model units.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        diagonal_between(low, high)
    }

    /// The area of all faces, in squared model units.
    pub fn area(&self) -> f64 {
        self.faces.iter().map(|&face| self.cross(face).length() / 2.0).sum()
    }

    /// The enclosed volume in cubed model units: negative when inside out, without meaning when open.
    pub fn volume(&self) -> f64 {
        // About a corner of the box, so that a far-away model loses no digits.
        let (origin, _) = self.bounds();
        self.faces.iter().map(|&face| self.cross(face).dot(self.positions[face[0] as usize] - origin) / 6.0).sum()
    }

    /// The length along the surface of a unit of a texture with these coordinates at the corners of faces, in model units: the
    /// root of area over area. 0 for a texture without area.
    pub(crate) fn length_of_texture(&self, corners: impl Fn(usize) -> [[f32; 2]; 3]) -> f64 {
        let (mut area, mut in_texture) = (0.0, 0.0);
        for (f, &face) in self.faces.iter().enumerate() {
            let [a, b, c] = corners(f).map(|uv| uv.map(f64::from));
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if twice.is_finite() && twice != 0.0 {
                in_texture += twice.abs();
                area += self.cross(face).length();
            }
        }
        if in_texture > 0.0 { (area / in_texture).sqrt() } else { 0.0 }
    }

    /// Twice the face's area along its normal.
    pub(crate) fn cross(&self, face: [u32; 3]) -> DVec3 {
        let [a, b, c] = face.map(|v| self.positions[v as usize]);
        (b - a).cross(c - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_is_found_in_any_piece() {
        let count = 3 * PARALLEL_ROWS + 10;
        for wanted in [0, 1, PARALLEL_ROWS - 1, PARALLEL_ROWS, 2 * PARALLEL_ROWS + 5, count - 1] {
            let rows: Vec<bool> = (0..count).map(|row| row == wanted || (row > wanted && row % 7 == 0)).collect();
            assert_eq!(first_where(&rows, |&row| row), Some(wanted));
        }
        assert_eq!(first_where(&vec![false; count], |&row| row), None);
        assert_eq!(first_where(&[], |&row: &bool| row), None);
    }
}
