//! From wedges back to the vertices of a mesh: one for all wedges at a place that agree in what vertices carry. Texture
//! coordinates of the first set and materials belong to corners and faces, and split none.

use bytemuck::Pod;
use rayon::prelude::*;

use crate::math::Vec2;
use crate::mesh::{Channel, Mesh};

use super::carry::MOVED_FROM;
use super::layout::{Layer, Origin};
use super::ranks::Ranks;
use super::restore::Placed;
use super::wedges::Wedges;

/// Rows that a thread fills at a time.
const ROWS: usize = 1 << 12;

/// No vertex.
const NONE: u32 = u32::MAX;

/// A vertex of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Vertex {
    /// Its place in the result: the input vertex that it began as.
    source: u32,
    /// The vertex of the surface.
    at: u32,
    /// A wedge of it, of which it has what vertices carry.
    wedge: u32,
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
    /// Splits the vertices of the faces that live.
    pub fn new(input: &'a Mesh, wedges: &'a Wedges, placed: Placed<'a>) -> Self {
        let (of_wedge, origin) = (wedges.vertices(placed.live_faces()), placed.origin);
        let mut split = Self { input, wedges, vertices: Vec::new(), of_wedge, origin };
        let kept = split.join();
        split.vertices = in_order(kept, input.positions.len());
        // Wedges that were joined follow the one that is kept.
        let mut number = vec![NONE; wedges.len()];
        (0..).zip(&split.vertices).for_each(|(new, vertex)| number[vertex.wedge as usize] = new);
        split.of_wedge.iter_mut().filter(|kept| **kept != NONE).for_each(|kept| *kept = number[*kept as usize]);
        split
    }

    /// Joins the wedges at a place that agree: in `of_wedge`, which has their places, they are given the one that is kept. Those
    /// are returned by place, source and number.
    fn join(&mut self) -> Vec<Vertex> {
        let mut first = vec![NONE; self.origin.len()];
        let mut others = Vec::new();
        for (wedge, &at) in (0..).zip(&self.of_wedge).filter(|(_, at)| **at != NONE) {
            match &mut first[at as usize] {
                first if *first == NONE => *first = wedge,
                _ => others.push((at, wedge)),
            }
        }
        others.sort_unstable();
        let mut others = others.chunk_by(|a, b| a.0 == b.0).peekable();
        let mut kept = Vec::with_capacity(first.len());
        for (at, &wedge) in (0..).zip(&first).filter(|(_, wedge)| **wedge != NONE) {
            let begin = kept.len();
            self.of_wedge[wedge as usize] = wedge;
            kept.push(Vertex { source: self.source(wedge), at, wedge });
            if let Some(group) = others.next_if(|group| group[0].0 == at) {
                let mut group: Vec<Vertex> =
                    group.iter().map(|&(at, wedge)| Vertex { source: self.source(wedge), at, wedge }).collect();
                group.extend(kept.pop());
                group.sort_unstable();
                for vertex in group {
                    let known = kept[begin..].iter().find(|known| self.agree(vertex.wedge, known.wedge));
                    self.of_wedge[vertex.wedge as usize] = known.map_or(vertex.wedge, |known| known.wedge);
                    if known.is_none() {
                        kept.push(vertex);
                    }
                }
            }
            // A vertex that is not split goes by its own origin.
            if let [only] = &mut kept[begin..] {
                only.source = self.origin[at as usize] & !MOVED_FROM;
            }
        }
        kept
    }

    /// The input vertex that a wedge has the numbers of, or began as.
    fn source(&self, wedge: u32) -> u32 {
        let (face, corner, _) = self.wedges.input_corner(wedge);
        self.input.faces[face][corner]
    }

    /// Whether two wedges have the same of what vertices carry.
    fn agree(&self, first: u32, second: u32) -> bool {
        let (a, b) = (self.wedges.row(first), self.wedges.row(second));
        let layers = self.wedges.layout.layers.iter().filter(|layer| layer.origin != Origin::Texcoords);
        layers.into_iter().all(|layer| layer.of(a).iter().zip(layer.of(b)).all(|(a, b)| a.to_bits() == b.to_bits()))
    }

    /// The vertices of the surface that those of the result stand at.
    pub fn vertices(&self) -> impl IndexedParallelIterator<Item = u32> {
        self.vertices.par_iter().with_min_len(ROWS).map(|vertex| vertex.at)
    }

    /// The input vertices that they are, of those that have not changed.
    pub fn origins(&self) -> impl IndexedParallelIterator<Item = Option<u32>> {
        let is_smooth = self.wedges.layout.is_smooth;
        self.vertices.par_iter().with_min_len(ROWS).map(move |vertex| {
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
                (_, Some(layer)) => {
                    let mut uv = [0.0; 2];
                    layer.store(row, &mut uv);
                    uv.into()
                }
                _ => Vec2::ZERO,
            }
        })
    }

    /// Gives the mesh what its vertices carry.
    pub fn fill(&self, mesh: &mut Mesh) {
        for layer in &self.wedges.layout.layers {
            match layer.origin {
                Origin::Normals => {
                    mesh.normals = self.input.normals.as_ref().map(|rows| self.rows(layer, |v| rows[v].as_ref()));
                }
                Origin::Colors => {
                    mesh.colors = self.input.colors.as_ref().map(|rows| self.rows(layer, |v| &rows[v]));
                }
                Origin::Texcoords => {}
                Origin::Channel(number) => {
                    let channel = &self.input.channels[number];
                    let values = self.rows(layer, |v| channel.row(v));
                    mesh.channels.push(Channel { values, name: channel.name.clone(), ..*channel });
                }
            }
        }
        mesh.channels.sort_by_key(|channel| self.input.channels.iter().position(|known| known.name == channel.name));
    }

    /// What the vertices have in a layer: what they had in the input, or what it has become.
    fn rows<'b, T: Pod>(&self, layer: &Layer, input: impl Fn(usize) -> &'b [f32] + Sync) -> Vec<T> {
        let numbers = self.vertices.len() * layer.width;
        let mut rows: Vec<T> = bytemuck::zeroed_vec(numbers * size_of::<f32>() / size_of::<T>());
        let out = bytemuck::cast_slice_mut(&mut rows).par_chunks_mut(layer.width.max(1));
        out.zip(&self.vertices).with_min_len(ROWS).for_each(|(out, vertex)| {
            match self.wedges.input_corner(vertex.wedge) {
                (_, _, true) => layer.store(self.wedges.row(vertex.wedge), out),
                (face, corner, false) => out.copy_from_slice(input(self.input.faces[face][corner] as usize)),
            }
        });
        rows
    }
}

/// Vertices by their sources, places and wedges; sources lie below `bound`.
fn in_order(mut vertices: Vec<Vertex>, bound: usize) -> Vec<Vertex> {
    let ranks = Ranks::new(vertices.iter().map(|vertex| vertex.source), bound);
    if ranks.len() < vertices.len() {
        vertices.par_sort_unstable();
        return vertices;
    }
    let mut ordered = vec![Vertex { source: NONE, at: NONE, wedge: NONE }; vertices.len()];
    vertices.into_iter().for_each(|vertex| ordered[ranks.of(vertex.source)] = vertex);
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_sorted_whether_or_not_they_share_sources() {
        for sources in [[4, 1, 0, 63, 64], [4, 1, 0, 1, 4]] {
            let vertices: Vec<Vertex> =
                (0..).zip(sources).map(|(at, source)| Vertex { source, at, wedge: 2 * at }).collect();
            let mut expected = vertices.clone();
            expected.sort();
            assert_eq!(in_order(vertices, 65), expected);
        }
    }
}
