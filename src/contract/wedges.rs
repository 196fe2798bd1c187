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
//! - Between rounds the wedges of a vertex stand together, in the order of the vertices; each has a corner, but where every
//!   vertex has one: that of a vertex which lost its faces stays.
//! - Within a round faces keep the wedges that they had as it began. A contraction writes the rows of all wedges that become
//!   one, so that the row of a corner is current whatever became of its vertex; `roles` tell which are one by now.

use std::ops::Range;

use rayon::prelude::*;

use crate::backend::Buffer;
use crate::kernel::rows::Face;
use crate::kernel::split::CHUNK;
use crate::kernel::warm::warm_up;
use crate::math::lanes::numbers_at;
use crate::math::{Vec2, Vec3};
use crate::mesh::adjacency::corner_of;
use crate::mesh::orient::input_corner;
use crate::mesh::{Mesh, Rings};

use super::attribute_rows::WedgeBuffers;
use super::carry::MOVED_FROM;
use super::gather_wedges::{Creases, Gathered, gather};
use super::keep_wedges::Scratch;
use super::layout::{Layout, Origin};
use super::yielding::Yields;

/// A wedge that is still itself.
pub const OWN: u32 = u32::MAX;
/// No wedge.
pub const NO_WEDGE: u32 = u32::MAX;
/// What a wedge without a corner is at.
pub const NO_VERTEX: u32 = u32::MAX;

/// The wedges of all live corners.
#[derive(Debug)]
pub struct Wedges {
    pub layout: Layout,
    /// On the host, with room for more than live.
    pub buffers: WedgeBuffers,
    /// The corner of the input that each has the numbers of, 3·face + corner; or, with [`MOVED_FROM`], had at the start.
    pub(super) origin: Vec<u32>,
    /// What each became in this round.
    pub(super) roles: Vec<u32>,
    /// The material of each, where it matters which seams yield.
    pub(super) materials: Vec<u32>,
    /// Whether every vertex has one, which then has its number, and even where it lost its corners.
    pub(super) are_vertices: bool,
    pub(super) scratch: Scratch,
}

impl Wedges {
    /// The wedges of faces that came from those of `mesh`; none where all creases would be kept and normals are those of facets.
    pub fn new(
        mesh: &Mesh,
        layout: Layout,
        rings: &Rings,
        face_origin: &[u32],
        faces: &[[u32; 3]],
        creases: Creases,
    ) -> Option<Self> {
        let Gathered { corners, starts, rows, origin } = gather(mesh, &layout, rings, face_origin, faces, creases)?;
        Some(Self::of(layout, bytemuck::cast_vec(corners), starts, rows, origin))
    }

    /// Has such seams yield from here on.
    pub fn let_yield(&mut self, mesh: &Mesh, yields: Yields) {
        self.layout.yields = yields;
        self.materials = self.materials_for(mesh, yields);
    }

    /// The material of each, where it matters to such seams; none where it does not.
    pub fn materials_for(&self, mesh: &Mesh, yields: Yields) -> Vec<u32> {
        let Self { layout, origin, .. } = self;
        let of_origin = |&origin: &u32| layout.material(mesh, (origin & !MOVED_FROM) as usize / 3);
        let asks = layout.has_materials && yields != Yields::Nothing;
        if asks { origin.iter().map(of_origin).collect() } else { Vec::new() }
    }

    fn of(layout: Layout, corners: Vec<Face>, starts: Vec<u32>, rows: Vec<f32>, origin: Vec<u32>) -> Self {
        let (corners, starts, rows) = (Buffer::on_host(corners), Buffer::on_host(starts), Buffer::on_host(rows));
        let buffers = WedgeBuffers { corners, starts, rows, width: layout.width };
        let roles = vec![OWN; origin.len()];
        let are_vertices = buffers.starts.host().iter().copied().eq(0..=origin.len() as u32);
        let materials = Vec::new();
        Self { layout, buffers, origin, roles, materials, are_vertices, scratch: Scratch::default() }
    }

    /// A copy between rounds, of those of so many live vertices and faces; which seams yield is to be told anew.
    pub fn copy(&self, vertices: usize, faces: usize) -> Self {
        let WedgeBuffers { corners, starts, rows, width } = &self.buffers;
        let buffers = WedgeBuffers {
            corners: Buffer::on_host(corners.host()[..faces].to_vec()),
            starts: Buffer::on_host(starts.host()[..=vertices].to_vec()),
            rows: Buffer::on_host(rows.host()[..self.len() * width].to_vec()),
            width: *width,
        };
        Self {
            layout: self.layout.clone(),
            buffers,
            origin: self.origin.clone(),
            roles: vec![OWN; self.len()],
            materials: Vec::new(),
            are_vertices: self.are_vertices,
            scratch: Scratch::default(),
        }
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
            let corner = rings
                .ring(vertex)
                .first()
                .map_or((0, 0), |&f| input_corner(face_origin[f as usize], corner_of(faces[f as usize], vertex)));
            (3 * corner.0 + corner.1) as u32 | MOVED_FROM
        };
        let origin: Vec<u32> = (0..vertices as u32).map(origin).collect();
        Self::of(layout, bytemuck::cast_slice(faces).to_vec(), (0..=vertices as u32).collect(), rows, origin)
    }

    /// The rows of all, to read and to change.
    pub fn rows(&mut self) -> WedgeRows<'_> {
        let Self { layout, buffers, origin, roles, materials, .. } = self;
        let WedgeBuffers { corners, starts, rows, .. } = buffers;
        let (corners, starts, rows) =
            (corners.host(), starts.host(), &mut rows.host_mut()[..origin.len() * layout.width]);
        WedgeRows { layout, corners, starts, materials, vertex: 0, first: 0, rows, origin, roles }
    }

    /// The wedges of all corners, and where those of each vertex begin; longer than what lives.
    pub fn connectivity(&self) -> (&[Face], &[u32]) {
        (self.buffers.corners.host(), self.buffers.starts.host())
    }

    /// The row of a wedge between rounds.
    pub fn row(&self, wedge: u32) -> &[f32] {
        &self.buffers.rows.host()[wedge as usize * self.layout.width..][..self.layout.width]
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.origin.len()
    }

    /// The numbers that decide, of all wedges one after the other.
    pub fn costed(&self) -> Vec<f32> {
        let Layout { costed, width, .. } = self.layout;
        let mut out = vec![0.0; self.len() * costed];
        if costed > 0 {
            let rows = out.par_chunks_mut(costed).zip(self.buffers.rows.host().par_chunks(width));
            rows.with_min_len(CHUNK).for_each(|(out, row)| out.copy_from_slice(&row[..costed]));
        }
        out
    }

    /// The wedge that a face's corner has by now, and its row.
    pub fn at(&self, face: usize, corner: usize) -> (u32, &[f32]) {
        let wedge = self.buffers.corners.host()[face].corners()[corner];
        (now(wedge, &self.roles), self.row(wedge))
    }

    /// The corner of the input that a wedge has the numbers of, or began with, and whether they have changed.
    pub fn input_corner(&self, wedge: u32) -> (usize, usize, bool) {
        let origin = self.origin[wedge as usize];
        let corner = (origin & !MOVED_FROM) as usize;
        (corner / 3, corner % 3, origin & MOVED_FROM != 0)
    }

    /// The normal and the color of a vertex with one wedge, for a log.
    pub fn of_vertex(&self, vertex: u32) -> (Option<Vec3>, Option<[f32; 4]>) {
        let row = self.row(self.buffers.starts.host()[vertex as usize]);
        let layer = |origin: Origin| self.layout.layers.iter().find(|layer| layer.origin == origin);
        let normal = layer(Origin::Normals).map(|layer| Vec3::from(layer.stored(row)));
        (normal, layer(Origin::Colors).map(|layer| layer.stored(row)))
    }

    /// The vertex that these faces have each wedge at by now; [`NO_VERTEX`] where none has it.
    pub fn vertices(&self, faces: impl Iterator<Item = (u32, Face)>) -> Vec<u32> {
        let (corners, mut vertices) = (self.buffers.corners.host(), vec![NO_VERTEX; self.len()]);
        find_owners(faces.map(|(number, face)| (face, corners[number as usize])), &self.roles, &mut vertices);
        vertices
    }
}

/// Notes the vertex that each wedge is at by now, of faces with the wedges of their corners.
pub fn find_owners(faces: impl Iterator<Item = (Face, Face)>, roles: &[u32], owners: &mut [u32]) {
    for (face, wedges) in faces {
        for (vertex, wedge) in face.corners().into_iter().zip(wedges.corners()) {
            owners[now(wedge, roles) as usize] = vertex;
        }
    }
}

/// What a wedge has become in this round.
pub fn now(wedge: u32, roles: &[u32]) -> u32 {
    match roles[wedge as usize] {
        OWN => wedge,
        other => other,
    }
}

/// The rows of consecutive wedges, to read.
#[derive(Debug, Clone, Copy)]
pub struct WedgeNumbers<'a> {
    rows: &'a [f32],
    first: u32,
    width: usize,
}

impl<'a> WedgeNumbers<'a> {
    /// Rows of `width` numbers each, of the wedges from `first` on.
    pub fn new(rows: &'a [f32], first: u32, width: usize) -> Self {
        Self { rows, first, width }
    }

    /// So many numbers from one of a wedge's on: past its row those of the next.
    #[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
    #[inline(always)]
    pub fn at<const COUNT: usize>(&self, wedge: u32, number: usize) -> [f32; COUNT] {
        numbers_at(self.rows, (wedge - self.first) as usize * self.width + number)
    }

    /// Two numbers of a wedge's, a place in a texture.
    #[inline]
    pub fn place(&self, wedge: u32, number: usize) -> Vec2 {
        Vec2::from_array(self.at(wedge, number))
    }
}

/// The wedges of consecutive vertices, and the corners of all faces.
#[derive(Debug)]
pub struct WedgeRows<'a> {
    pub layout: &'a Layout,
    corners: &'a [Face],
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

    /// Reads these rows once, and those of the corners of `faces`.
    pub fn warm_up(&self, faces: Range<usize>) {
        warm_up(&self.corners[faces]);
        warm_up(self.rows);
        warm_up(self.roles);
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
        self.corners[face as usize].corners()[corner]
    }

    /// Those that the corners of a face had, from one of its corners on, without a branch: they are looked up where they lie, for
    /// a choice among three becomes branches, of which half are misjudged.
    #[inline(always)]
    pub fn wedges_from(&self, face: u32, corner: usize) -> [u32; 3] {
        const TURNS: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];
        let wedges: &[u32; 3] = bytemuck::cast_ref(&self.corners[face as usize]);
        TURNS[corner].map(|corner| wedges[corner])
    }

    /// What it is now.
    pub fn now(&self, wedge: u32) -> u32 {
        match self.roles[self.local(wedge)] {
            OWN => wedge,
            other => other,
        }
    }

    /// All rows, as they are now.
    pub fn numbers(&self) -> WedgeNumbers<'_> {
        WedgeNumbers::new(self.rows, self.first, self.layout.width)
    }

    /// Its row, as it is now.
    pub fn row(&self, wedge: u32) -> &[f32] {
        &self.rows[self.local(wedge) * self.layout.width..][..self.layout.width]
    }

    /// Whether the faces of two wedges have the same material.
    pub fn same_material(&self, a: u32, b: u32) -> bool {
        self.materials.get(a as usize) == self.materials.get(b as usize)
    }

    /// Whether there are materials, which then matter to the seams that yield.
    pub fn asks_for_materials(&self) -> bool {
        !self.materials.is_empty()
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
