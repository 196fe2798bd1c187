//! From wedges back to the vertices of a mesh: one for all wedges at a place that agree in what vertices carry. Texture
//! coordinates of the first set and materials belong to corners and faces, and split none.

use rayon::prelude::*;

use crate::kernel::rows::Face;
use crate::math::{Vec2, Vec3};
use crate::mesh::{Channel, Mesh, take};

use super::carry::MOVED_FROM;
use super::layout::Origin;
use super::wedges::Wedges;

/// Faces that a thread looks at at a time.
const ROWS: usize = 1 << 12;

/// No vertex.
const NONE: u32 = u32::MAX;

/// A vertex of the result.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    /// Its place in the result: the input vertex that it began as.
    source: u32,
    /// The vertex of the surface.
    at: u32,
    /// A wedge of it, of which it has what vertices carry.
    wedge: u32,
    /// The face and corner that the wedge is of.
    corner: (u32, u8),
}

/// The vertices of the result, and which of them every corner is.
#[derive(Debug)]
pub struct Split<'a> {
    input: &'a Mesh,
    wedges: &'a Wedges,
    vertices: Vec<Vertex>,
    /// Of every wedge, the vertex.
    of_wedge: Vec<u32>,
    origin: &'a [u32],
}

impl<'a> Split<'a> {
    /// Splits the live faces `face_order`, whose vertices have these origins where they stand.
    pub fn new(input: &'a Mesh, wedges: &'a Wedges, faces: &[Face], face_order: &[u32], origin: &'a [u32]) -> Self {
        // One corner for each wedge, the first.
        let mut of_wedge = vec![NONE; wedges.len()];
        let mut vertices: Vec<Vertex> = Vec::new();
        for &f in face_order {
            for (k, at) in faces[f as usize].corners().into_iter().enumerate() {
                let (wedge, _) = wedges.at(f as usize, k);
                if of_wedge[wedge as usize] == NONE {
                    of_wedge[wedge as usize] = vertices.len() as u32;
                    let (face, corner, _) = wedges.input_corner(wedge);
                    let source = input.faces[face][corner];
                    vertices.push(Vertex { source, at, wedge, corner: (f, k as u8) });
                }
            }
        }
        let mut split = Self { input, wedges, vertices, of_wedge, origin };
        split.join();
        split
    }

    /// Joins the vertices that agree, and sorts them by their places.
    fn join(&mut self) {
        let mut by_vertex: Vec<u32> = (0..self.vertices.len() as u32).collect();
        by_vertex.par_sort_unstable_by_key(|&i| {
            let Vertex { at, source, wedge, .. } = self.vertices[i as usize];
            (at, source, wedge)
        });
        let mut onto: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut kept = Vec::new();
        let mut whole = Vec::new();
        for group in by_vertex.chunk_by(|&a, &b| self.vertices[a as usize].at == self.vertices[b as usize].at) {
            let first = kept.len();
            for &i in group {
                match kept[first..].iter().find(|&&known| self.agree(i, known)) {
                    Some(&known) => onto[i as usize] = known,
                    None => kept.push(i),
                }
            }
            if let &[only] = &kept[first..] {
                whole.push(only);
            }
        }
        // A vertex that is not split goes by its own origin.
        for only in whole {
            let vertex = &mut self.vertices[only as usize];
            vertex.source = self.origin[vertex.at as usize] & !MOVED_FROM;
        }
        kept.par_sort_unstable_by_key(|&i| {
            let Vertex { source, at, wedge, .. } = self.vertices[i as usize];
            (source, at, wedge)
        });
        let mut number = vec![0; self.vertices.len()];
        (0..).zip(&kept).for_each(|(new, &old)| number[old as usize] = new);
        let new_number = |i: u32| number[onto[i as usize] as usize];
        self.of_wedge.iter_mut().filter(|vertex| **vertex != NONE).for_each(|vertex| *vertex = new_number(*vertex));
        self.vertices = take(&self.vertices, &kept);
    }

    /// Whether two wedges of a vertex have the same of what vertices carry.
    fn agree(&self, first: u32, second: u32) -> bool {
        let row = |i: u32| {
            let (face, corner) = self.vertices[i as usize].corner;
            self.wedges.at(face as usize, usize::from(corner)).1
        };
        let (a, b) = (row(first), row(second));
        let layers = self.wedges.layout.layers.iter().filter(|layer| layer.origin != Origin::Texcoords);
        layers.into_iter().all(|layer| layer.of(a).iter().zip(layer.of(b)).all(|(a, b)| a.to_bits() == b.to_bits()))
    }

    /// The vertices of the surface that those of the result stand at.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.vertices.iter().map(|vertex| vertex.at)
    }

    /// The input vertices that they are, of those that have not changed.
    pub fn origins(&self) -> impl Iterator<Item = Option<u32>> {
        self.vertices.iter().map(|vertex| {
            let is_smooth = self.wedges.layout.is_smooth;
            let moved =
                self.origin[vertex.at as usize] & MOVED_FROM != 0 || (!is_smooth && self.has_changed(vertex.wedge));
            // Vertices that were joined by distance stand where the first of them stood.
            let (origin, at) = (self.origin[vertex.at as usize] & !MOVED_FROM, &self.input.positions);
            let stands = at[vertex.source as usize] == at[origin as usize];
            (!moved).then_some(if stands { vertex.source } else { origin })
        })
    }

    fn has_changed(&self, wedge: u32) -> bool {
        self.wedges.input_corner(wedge).2
    }

    /// The corners of a face.
    pub fn corners(&self, face: usize) -> [u32; 3] {
        [0, 1, 2].map(|k| self.of_wedge[self.wedges.at(face, k).0 as usize])
    }

    /// Whether corners have texture coordinates.
    pub fn has_texcoords(&self) -> bool {
        self.wedges.layout.layers.iter().any(|layer| layer.origin == Origin::Texcoords)
    }

    /// The texture coordinates of a face's corners.
    pub fn texcoords(&self, face: usize) -> [Vec2; 3] {
        let layer = self.wedges.layout.layers.iter().find(|layer| layer.origin == Origin::Texcoords);
        [0, 1, 2].map(|k| {
            let (wedge, row) = self.wedges.at(face, k);
            let (input_face, corner, changed) = self.wedges.input_corner(wedge);
            match (&self.input.texcoords, layer) {
                (Some(rows), _) if !changed => rows[input_face][corner],
                (_, Some(layer)) => Vec2::from_slice(layer.of(row)) / layer.scale,
                _ => Vec2::ZERO,
            }
        })
    }

    /// Gives the mesh what its vertices carry.
    pub fn fill(&self, mesh: &mut Mesh) {
        for layer in &self.wedges.layout.layers {
            let stored = |vertex: &Vertex, input: &dyn Fn(usize, &mut Vec<f32>)| -> Vec<f32> {
                let (face, corner, changed) = self.wedges.input_corner(vertex.wedge);
                if !changed {
                    let mut row = Vec::with_capacity(layer.width);
                    input(self.input.faces[face][corner] as usize, &mut row);
                    return row;
                }
                let (face, corner) = vertex.corner;
                let row = self.wedges.at(face as usize, usize::from(corner)).1;
                layer.stored(row)
            };
            let vertices = || self.vertices.par_iter().with_min_len(ROWS);
            match layer.origin {
                Origin::Normals => {
                    let Some(rows) = &self.input.normals else { continue };
                    let normal = |v: &Vertex| Vec3::from_slice(&stored(v, &|v, row| row.extend(rows[v].to_array())));
                    mesh.normals = Some(vertices().map(normal).collect());
                }
                Origin::Colors => {
                    let Some(rows) = &self.input.colors else { continue };
                    let color = |v: &Vertex| {
                        let color = stored(v, &|v, row| row.extend(rows[v]));
                        [color[0], color[1], color[2], color[3]]
                    };
                    mesh.colors = Some(vertices().map(color).collect());
                }
                Origin::Texcoords => {}
                Origin::Channel(number) => {
                    let channel = &self.input.channels[number];
                    let values =
                        vertices().flat_map_iter(|v| stored(v, &|v, row| row.extend(channel.row(v)))).collect();
                    mesh.channels.push(Channel { values, name: channel.name.clone(), ..*channel });
                }
            }
        }
        mesh.channels.sort_by_key(|channel| self.input.channels.iter().position(|known| known.name == channel.name));
    }
}
