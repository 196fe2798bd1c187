//! From wedges back to the vertices of a mesh: one for all wedges at a place that agree in what vertices carry. Texture
//! coordinates of the first set and materials belong to corners and faces, and split none.

use bytemuck::Pod;
use rayon::prelude::*;

use crate::math::Vec2;
use crate::mesh::{Channel, ChannelKind, Mesh};

use super::carry::MOVED_FROM;
use super::layout::{Kind, Layer, Origin};
use super::ranks::Ranks;
use super::restore::{Placed, ROWS};
use super::wedges::{NO_VERTEX, Wedges};

/// None.
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
        let origin = placed.origin;
        let (kept, kept_as) = join(input, wedges, origin, &wedges.vertices(placed.live_faces()));
        let vertices = in_order(kept, input.positions.len());
        let mut number = vec![NONE; wedges.len()];
        (0..).zip(&vertices).for_each(|(new, vertex)| number[vertex.wedge as usize] = new);
        let of_kept = |kept: u32| if kept == NONE { NONE } else { number[kept as usize] };
        let of_wedge = kept_as.into_iter().map(of_kept).collect();
        Self { input, wedges, vertices, of_wedge, origin }
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

    /// Whether a vertex of the result has other numbers than in the input.
    pub fn has_other_numbers(&self, vertex: usize) -> bool {
        self.has_changed(self.vertices[vertex].wedge)
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
                (_, Some(layer)) => layer.stored(row).into(),
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
                Origin::Texcoords | Origin::Pose(_) => {}
                Origin::Channel(number) => {
                    let channel = &self.input.channels[number];
                    let values = self.rows(layer, |v| channel.row(v));
                    // Labels that were given a weight have become amounts.
                    let is_amount = channel.kind == ChannelKind::Label && layer.kind == Kind::Linear;
                    let kind = if is_amount { ChannelKind::Linear } else { channel.kind };
                    mesh.channels.push(Channel { values, kind, name: channel.name.clone(), ..*channel });
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

/// Joins the wedges at a place that agree; `places` has that of each. Returns those that are kept, by place, source and number,
/// and which of them each has become.
fn join(input: &Mesh, wedges: &Wedges, origin: &[u32], places: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
    let vertex = |at: u32, wedge: u32| {
        let (face, corner, _) = wedges.input_corner(wedge);
        Vertex { source: input.faces[face][corner], at, wedge }
    };
    let mut first = vec![NONE; origin.len()];
    let mut others = Vec::new();
    for (wedge, &at) in (0..).zip(places).filter(|(_, at)| **at != NO_VERTEX) {
        match &mut first[at as usize] {
            first if *first == NONE => *first = wedge,
            _ => others.push((at, wedge)),
        }
    }
    others.sort_unstable();
    let mut others = others.chunk_by(|a, b| a.0 == b.0).peekable();
    let mut kept: Vec<Vertex> = Vec::with_capacity(first.len());
    let mut kept_as = vec![NONE; places.len()];
    for (at, &wedge) in (0..).zip(&first).filter(|(_, wedge)| **wedge != NONE) {
        let begin = kept.len();
        if let Some(group) = others.next_if(|group| group[0].0 == at) {
            let mut group: Vec<Vertex> = group.iter().map(|&(at, wedge)| vertex(at, wedge)).collect();
            group.push(vertex(at, wedge));
            group.sort_unstable();
            for vertex in group {
                let known = kept[begin..].iter().find(|known| agree(wedges, vertex.wedge, known.wedge));
                kept_as[vertex.wedge as usize] = known.map_or(vertex.wedge, |known| known.wedge);
                if known.is_none() {
                    kept.push(vertex);
                }
            }
        } else {
            kept_as[wedge as usize] = wedge;
            kept.push(Vertex { source: NONE, at, wedge });
        }
        // A vertex that is not split goes by its own origin.
        if let [only] = &mut kept[begin..] {
            only.source = origin[at as usize] & !MOVED_FROM;
        }
    }
    (kept, kept_as)
}

/// Whether two wedges have the same of what vertices carry.
fn agree(wedges: &Wedges, first: u32, second: u32) -> bool {
    let (a, b) = (wedges.row(first), wedges.row(second));
    let mut layers =
        wedges.layout.layers.iter().filter(|layer| !matches!(layer.origin, Origin::Texcoords | Origin::Pose(_)));
    layers.all(|layer| layer.of(a).iter().zip(layer.of(b)).all(|(a, b)| a.to_bits() == b.to_bits()))
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
