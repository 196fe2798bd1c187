//! Attributes on their way through a run: a row of numbers for every wedge, the corners of a vertex that share them \[HO99\].
//!
//! ```text
//!   \  a | b  /      a vertex on a seam: its corners to the left are one wedge, those to the right another;
//! ---\---v---/---    off the seams all corners of a vertex are one
//! ```
//!
//! A seam is an edge whose faces disagree in the wedge at one of its ends: a cut in the texture, a crease in the normals, a
//! border between materials. A vertex where two edges of a seam meet, two wedges, may move along it, both wedges together; any
//! other vertex on a seam stays.
//!
//! # Invariants
//! - Between rounds the wedges of a vertex stand together, in the order of the vertices; each has a corner.
//! - Within a round faces keep the wedges that they had as it began. A contraction writes the rows of all wedges that become
//!   one, so that the row of a corner is current whatever became of its vertex; `roles` tell which are one by now.

use rayon::prelude::*;

use crate::kernel::contract_faces::renamed;
use crate::kernel::rows::Face;
use crate::kernel::split::CHUNK;
use crate::math::Vec3;
use crate::mesh::orient::input_corner;
use crate::mesh::{Mesh, Rings};

use super::carry::MOVED_FROM;
use super::compact::close_gaps;
use super::gather_wedges::{Creases, Gathered, gather};
use super::layout::{Kind, Layout, Origin};
use super::yielding::Yields;

/// A wedge that is still itself.
const OWN: u32 = u32::MAX;
/// A wedge without a corner has no vertex.
const NO_VERTEX: u32 = u32::MAX;
/// No wedge.
pub const NO_WEDGE: u32 = u32::MAX;

/// The share of vertices with more than two wedges from which normals are those of facets.
const FACETS: f64 = 0.5;

/// The wedges of all live corners.
#[derive(Debug)]
pub struct Wedges {
    pub layout: Layout,
    /// The wedge of every corner of every face.
    corners: Vec<[u32; 3]>,
    /// Where those of each vertex begin, and the end.
    starts: Vec<u32>,
    /// `layout.width` numbers each.
    rows: Vec<f32>,
    /// The corner of the input that each has the numbers of, 3·face + corner; or, with [`MOVED_FROM`], had at the start.
    origin: Vec<u32>,
    /// What each became in this round.
    roles: Vec<u32>,
    /// The material of each, where it matters which seams yield.
    materials: Vec<u32>,
}

impl Wedges {
    /// The wedges of faces that came from those of `mesh`.
    pub fn new(
        mesh: &Mesh,
        layout: Layout,
        rings: &Rings,
        face_origin: &[u32],
        faces: &[[u32; 3]],
        creases: Creases,
    ) -> Self {
        let Gathered { corners, starts, rows, origin } = gather(mesh, &layout, rings, face_origin, faces, creases);
        let roles = vec![OWN; origin.len()];
        let of_origin = |&origin: &u32| layout.material(mesh, (origin & !MOVED_FROM) as usize / 3);
        let asks = layout.has_materials && layout.yields != Yields::Nothing;
        let materials = if asks { origin.iter().map(of_origin).collect() } else { Vec::new() };
        Self { layout, corners, starts, rows, origin, roles, materials }
    }

    /// One wedge a vertex, with the given normals and colors.
    pub fn smooth(
        layout: Layout,
        rings: &Rings,
        face_origin: &[u32],
        faces: &[[u32; 3]],
        (normals, colors): (Option<Vec<Vec3>>, Option<Vec<[f32; 4]>>),
    ) -> Self {
        let vertices = rings.vertex_count();
        let mut rows = vec![0.0; vertices * layout.width];
        for (vertex, row) in rows.chunks_mut(layout.width.max(1)).enumerate() {
            for layer in &layout.layers {
                let out = layer.of_mut(row);
                match layer.origin {
                    Origin::Normals => {
                        out.copy_from_slice(&normals.as_ref().map_or([0.0; 3], |rows| rows[vertex].to_array()))
                    }
                    _ => out.copy_from_slice(&colors.as_ref().map_or([0.0; 4], |rows| rows[vertex])),
                }
            }
        }
        // Joined vertices have the means of their members, which are at no corner of the input.
        let origin = |vertex: u32| {
            let corner = rings.ring(vertex).first().map_or((0, 0), |&f| {
                let k = faces[f as usize].iter().position(|&v| v == vertex).unwrap_or(0);
                input_corner(face_origin[f as usize], k)
            });
            (3 * corner.0 + corner.1) as u32 | MOVED_FROM
        };
        let origin: Vec<u32> = (0..vertices as u32).map(origin).collect();
        let roles = vec![OWN; vertices];
        Self {
            layout,
            corners: faces.to_vec(),
            starts: (0..=vertices as u32).collect(),
            rows,
            origin,
            roles,
            materials: Vec::new(),
        }
    }

    /// Whether most vertices have many wedges, and normals are among what they disagree in: every face has its own, and no
    /// vertex could go anywhere.
    pub fn has_facets(&self) -> bool {
        let many = self.starts.par_windows(2).filter(|ends| ends[1] - ends[0] > 2).count();
        self.layout.of_kind(Kind::Normal).next().is_some() && many as f64 > FACETS * (self.starts.len() - 1) as f64
    }

    /// The rows of all, to read and to change.
    pub fn rows(&mut self) -> WedgeRows<'_> {
        let Self { layout, corners, starts, rows, origin, roles, materials } = self;
        WedgeRows { layout, corners, starts, materials, vertex: 0, first: 0, rows, origin, roles }
    }

    /// Before a round's compaction: corners take the wedges that theirs have become, and faces that died go.
    pub fn settle(&mut self, faces: &[Face], vertex_roles: &[u32]) {
        let roles = &self.roles;
        let counts = self.corners.par_chunks_mut(CHUNK).zip(faces.par_chunks(CHUNK)).map(|(rows, faces)| {
            let mut live = 0;
            for (i, face) in faces.iter().enumerate() {
                let [a, b, c] = face.corners().map(|v| renamed(v, vertex_roles[v as usize]));
                rows[live] = rows[i].map(|wedge| now(wedge, roles));
                live += usize::from(Face { a, b, c }.is_live());
            }
            live
        });
        let counts: Vec<usize> = counts.collect();
        let left = close_gaps(&mut self.corners, &counts);
        self.corners.truncate(left);
    }

    /// After a round's compaction: numbers the wedges that have corners, by their vertices.
    pub fn compact(&mut self, faces: &[Face], vertices: usize) {
        let width = self.layout.width;
        let mut owners = vec![NO_VERTEX; self.origin.len()];
        for (face, row) in faces.iter().zip(&self.corners) {
            for (vertex, &wedge) in face.corners().into_iter().zip(row) {
                owners[wedge as usize] = vertex;
            }
        }
        let with_corners = || (0..).zip(&owners).filter(|(_, owner)| **owner != NO_VERTEX);
        self.starts.clear();
        self.starts.resize(vertices + 1, 0);
        with_corners().for_each(|(_, &owner): (u32, _)| self.starts[owner as usize + 1] += 1);
        for vertex in 0..vertices {
            self.starts[vertex + 1] += self.starts[vertex];
        }
        let mut next = self.starts.clone();
        let mut kept = vec![0; self.starts[vertices] as usize];
        let mut numbers = vec![0; owners.len()];
        for (wedge, &owner) in with_corners() {
            let number = &mut next[owner as usize];
            kept[*number as usize] = wedge;
            numbers[wedge as usize] = *number;
            *number += 1;
        }
        let renumber = |row: &mut [u32; 3]| *row = row.map(|wedge| numbers[wedge as usize]);
        self.corners[..faces.len()].par_iter_mut().with_min_len(CHUNK).for_each(renumber);
        let mut rows = vec![0.0; kept.len() * width];
        if width > 0 {
            rows.par_chunks_mut(width).zip(&kept).with_min_len(CHUNK).for_each(|(row, &wedge)| {
                row.copy_from_slice(&self.rows[wedge as usize * width..][..width]);
            });
        }
        self.rows = rows;
        self.origin = crate::mesh::take(&self.origin, &kept);
        if !self.materials.is_empty() {
            self.materials = crate::mesh::take(&self.materials, &kept);
        }
        self.roles.clear();
        self.roles.resize(kept.len(), OWN);
    }

    /// What kernels read: the wedges of all corners, and where those of each vertex begin.
    pub fn connectivity(&self) -> (&[[u32; 3]], &[u32]) {
        (&self.corners, &self.starts)
    }

    /// The row of a wedge between rounds.
    pub fn row(&self, wedge: u32) -> &[f32] {
        &self.rows[wedge as usize * self.layout.width..][..self.layout.width]
    }

    /// The material of a wedge, where it matters.
    pub fn material(&self, wedge: u32) -> Option<u32> {
        self.materials.get(wedge as usize).copied()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.origin.len()
    }

    /// Writes the numbers that decide, of all wedges one after the other.
    pub fn costed(&self, out: &mut [f32]) {
        let Layout { costed, width, .. } = self.layout;
        if costed > 0 {
            let rows = out.par_chunks_mut(costed).zip(self.rows.par_chunks(width));
            rows.with_min_len(CHUNK).for_each(|(out, row)| out.copy_from_slice(&row[..costed]));
        }
    }

    /// The wedge that a face's corner has by now, and its row.
    pub fn at(&self, face: usize, corner: usize) -> (u32, &[f32]) {
        let (wedge, width) = (self.corners[face][corner], self.layout.width);
        (now(wedge, &self.roles), &self.rows[wedge as usize * width..][..width])
    }

    /// The corner of the input that a wedge has the numbers of, or began with, and whether they have changed.
    pub fn input_corner(&self, wedge: u32) -> (usize, usize, bool) {
        let origin = self.origin[wedge as usize];
        let corner = (origin & !MOVED_FROM) as usize;
        (corner / 3, corner % 3, origin & MOVED_FROM != 0)
    }

    /// The normal and the color of a vertex with one wedge, for a log.
    pub fn of_vertex(&self, vertex: u32) -> (Option<Vec3>, Option<[f32; 4]>) {
        let wedge = self.starts[vertex as usize] as usize;
        let row = &self.rows[wedge * self.layout.width..][..self.layout.width];
        let stored = |origin: Origin| {
            let layer = self.layout.layers.iter().find(|layer| layer.origin == origin)?;
            Some(layer.stored(row))
        };
        let color = stored(Origin::Colors).map(|color| [color[0], color[1], color[2], color[3]]);
        (stored(Origin::Normals).map(|normal| Vec3::from_slice(&normal)), color)
    }
}

/// What a wedge has become in this round.
fn now(wedge: u32, roles: &[u32]) -> u32 {
    match roles[wedge as usize] {
        OWN => wedge,
        other => other,
    }
}

/// The wedges of consecutive vertices, and the corners of all faces.
#[derive(Debug)]
pub struct WedgeRows<'a> {
    pub layout: &'a Layout,
    corners: &'a [[u32; 3]],
    starts: &'a [u32],
    materials: &'a [u32],
    /// The first vertex, and its first wedge.
    vertex: usize,
    first: u32,
    rows: &'a mut [f32],
    origin: &'a mut [u32],
    roles: &'a mut [u32],
}

impl<'a> WedgeRows<'a> {
    /// Those of the first `size` vertices, and the others.
    pub fn split_at(self, size: usize) -> (Self, Self) {
        let Self { layout, corners, starts, materials, vertex, first, rows, origin, roles } = self;
        let next = starts[vertex + size];
        let wedges = (next - first) as usize;
        let (rows, other_rows) = rows.split_at_mut(wedges * layout.width);
        let (origin, other_origin) = origin.split_at_mut(wedges);
        let (roles, other_roles) = roles.split_at_mut(wedges);
        let others = Self {
            layout,
            corners,
            starts,
            materials,
            vertex: vertex + size,
            first: next,
            rows: other_rows,
            origin: other_origin,
            roles: other_roles,
        };
        (Self { layout, corners, starts, materials, vertex, first, rows, origin, roles }, others)
    }

    fn local(&self, wedge: u32) -> usize {
        (wedge - self.first) as usize
    }

    /// The wedge of a vertex that had one as the round began.
    pub fn only(&self, vertex: u32) -> Option<u32> {
        let (first, end) = (self.starts[vertex as usize], self.starts[vertex as usize + 1]);
        (end - first == 1).then_some(first)
    }

    /// The wedge that a face's corner had as the round began.
    pub fn wedge(&self, face: u32, corner: usize) -> u32 {
        self.corners[face as usize][corner]
    }

    /// What it is now.
    pub fn now(&self, wedge: u32) -> u32 {
        match self.roles[self.local(wedge)] {
            OWN => wedge,
            other => other,
        }
    }

    /// Where its row starts in [`Self::all`].
    pub fn start(&self, wedge: u32) -> usize {
        self.local(wedge) * self.layout.width
    }

    /// The rows of all these wedges, one after the other, as they are now.
    pub fn all(&self) -> &[f32] {
        self.rows
    }

    /// Its row, as it is now.
    pub fn row(&self, wedge: u32) -> &[f32] {
        &self.rows[self.local(wedge) * self.layout.width..][..self.layout.width]
    }

    /// Whether the faces of two wedges have the same material.
    pub fn same_material(&self, a: u32, b: u32) -> bool {
        self.materials.get(a as usize) == self.materials.get(b as usize)
    }

    /// Whether two wedges differ in no more than shading.
    pub fn agree_but_in_shading(&self, a: u32, b: u32) -> bool {
        a == b || (self.same_material(a, b) && self.layout.agree_but_in_shading(self.row(a), self.row(b)))
    }

    /// Gives a wedge a row, and the origin of `from` if the row is its own.
    pub fn write(&mut self, wedge: u32, row: &[f32], from: Option<u32>) {
        let (place, width) = (self.local(wedge), self.layout.width);
        self.rows[place * width..][..width].copy_from_slice(row);
        self.origin[place] = from.map_or(self.origin[place] | MOVED_FROM, |from| self.origin[self.local(from)]);
    }

    /// Has a wedge become another.
    pub fn join(&mut self, gone: u32, kept: u32) {
        let place = self.local(gone);
        self.roles[place] = kept;
    }
}
