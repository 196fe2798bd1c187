//! The vertices of a result in the order of the input, split where corners carry different things at one place.

use rayon::prelude::*;

use super::cut::Parts;
use super::rebuild::Rebuilt;
use super::surface::Surface;
use crate::math::Vec2;
use crate::mesh::dual::NONE;
use crate::mesh::orient::input_corner;
use crate::mesh::{Mesh, take};

/// A corner of a face of the input.
type Corner = (usize, usize);

/// A vertex of the result.
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    /// The vertex of the surface that it stands at.
    pub at: u32,
    /// The input vertex there, of which it has what vertices carry.
    pub source: u32,
}

/// The result's vertices, and which of them the corners of its faces are.
#[derive(Debug)]
pub struct Named {
    pub vertices: Vec<Vertex>,
    pub faces: Vec<[u32; 3]>,
    /// Of every face's corners, where these are followed.
    pub texcoords: Option<Vec<[Vec2; 3]>>,
}

impl Named {
    /// One vertex for each that faces use.
    pub fn whole(surface: &Surface, faces: &[[u32; 3]]) -> Self {
        let mut used = vec![false; surface.points.len()];
        faces.iter().flatten().for_each(|&v| used[v as usize] = true);
        let mut order: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
        order.par_sort_unstable_by_key(|&v| surface.vertex_source[v as usize]);
        let mut renamed = vec![0; used.len()];
        (0..).zip(&order).for_each(|(new, &old)| renamed[old as usize] = new);
        let vertex = |&at: &u32| Vertex { at, source: surface.vertex_source[at as usize] };
        Self {
            vertices: order.iter().map(vertex).collect(),
            faces: faces.iter().map(|face| face.map(|v| renamed[v as usize])).collect(),
            texcoords: None,
        }
    }

    /// Corners with what those of their region have at the same vertex in the input, the first of them.
    pub fn with_corners(input: &Mesh, surface: &Surface, parts: &Parts, rebuilt: &Rebuilt) -> Self {
        let corners = corners(surface, parts, rebuilt);
        let of_row = |row: &[Corner; 3], rows: &[[Vec2; 3]]| row.map(|(face, k)| rows[face][k]);
        let texcoords = input.texcoords.as_ref().map(|rows| corners.iter().map(|row| of_row(row, rows)).collect());
        let carries = input.normals.is_some() || input.colors.is_some() || !input.channels.is_empty();
        if !carries {
            return Self { texcoords, ..Self::whole(surface, &rebuilt.faces) };
        }
        let of_corner = |(&at, (face, k)): (&u32, Corner)| Vertex { at, source: input.faces[face][k] };
        let uses: Vec<Vertex> =
            rebuilt.faces.iter().flatten().zip(corners.into_iter().flatten()).map(of_corner).collect();
        let (vertices, numbers) = split(input, surface, &uses);
        let faces = numbers.chunks_exact(3).map(|row| [row[0], row[1], row[2]]).collect();
        Self { vertices, faces, texcoords }
    }

    /// The input vertices that they are: where some were joined by distance, that at the place.
    pub fn origins(&self, input: &Mesh, surface: &Surface) -> Vec<u32> {
        self.vertices.iter().map(|&vertex| origin(input, surface, vertex)).collect()
    }
}

fn origin(input: &Mesh, surface: &Surface, Vertex { at, source }: Vertex) -> u32 {
    let place = surface.vertex_source[at as usize];
    let stands = input.positions[source as usize] == input.positions[place as usize];
    if stands { source } else { place }
}

/// The vertices that corners are, those at one place that agree in what vertices carry as one; and the number of each corner's.
fn split(input: &Mesh, surface: &Surface, uses: &[Vertex]) -> (Vec<Vertex>, Vec<u32>) {
    let key = |Vertex { at, source }: Vertex| (at, source);
    let mut all = uses.to_vec();
    all.par_sort_unstable_by_key(|&vertex| key(vertex));
    all.dedup_by_key(|vertex| key(*vertex));
    let mut onto = Vec::with_capacity(all.len());
    let mut kept: Vec<Vertex> = Vec::new();
    for group in all.chunk_by(|a, b| a.at == b.at) {
        let first = kept.len();
        for vertex in group {
            let known = kept[first..].iter().position(|known| agree(input, known.source, vertex.source));
            onto.push((first + known.unwrap_or(kept.len() - first)) as u32);
            kept.extend(known.is_none().then_some(*vertex));
        }
        // One that is not split goes by the surface's name for it.
        if let [only] = &mut kept[first..] {
            let name = surface.vertex_source[only.at as usize];
            only.source = if agree(input, only.source, name) { name } else { only.source };
        }
    }
    let mut order: Vec<u32> = (0..kept.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| {
        let vertex = kept[i as usize];
        (origin(input, surface, vertex), key(vertex))
    });
    let mut renamed = vec![0; kept.len()];
    (0..).zip(&order).for_each(|(new, &old)| renamed[old as usize] = new);
    let number = |&vertex: &Vertex| {
        let place = all.binary_search_by_key(&key(vertex), |&known| key(known)).unwrap_or(0);
        renamed[onto[place] as usize]
    };
    (take(&kept, &order), uses.par_iter().map(number).collect())
}

/// Whether two vertices of the input have the same of what vertices carry.
fn agree(input: &Mesh, a: u32, b: u32) -> bool {
    let [a, b] = [a as usize, b as usize];
    let same = |x: &[f32], y: &[f32]| x.iter().map(|x| x.to_bits()).eq(y.iter().map(|y| y.to_bits()));
    a == b
        || input.normals.as_ref().is_none_or(|rows| same(&rows[a].to_array(), &rows[b].to_array()))
            && input.colors.as_ref().is_none_or(|rows| same(&rows[a], &rows[b]))
            && input.channels.iter().all(|channel| same(channel.row(a), channel.row(b)))
}

/// For every corner of the result, one of the input's that its region has at the same vertex.
fn corners(surface: &Surface, parts: &Parts, rebuilt: &Rebuilt) -> Vec<[Corner; 3]> {
    let (starts, members) = parts.partition.faces_by_region();
    // The region that was at a vertex last, and its corner there.
    let mut last = vec![(NONE, (0, 0)); surface.points.len()];
    let mut corners = Vec::with_capacity(rebuilt.faces.len());
    for (region, (own, new)) in (0..).zip(starts.windows(2).zip(rebuilt.region_starts.windows(2))) {
        for &face in &members[own[0] as usize..own[1] as usize] {
            for (k, &v) in surface.faces[face as usize].iter().enumerate() {
                if last[v as usize].0 != region {
                    last[v as usize] = (region, input_corner(surface.face_source[face as usize], k));
                }
            }
        }
        let faces = &rebuilt.faces[new[0] as usize..new[1] as usize];
        corners.extend(faces.iter().map(|face| face.map(|v| last[v as usize].1)));
    }
    corners
}
