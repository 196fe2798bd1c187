//! From a rebuilt partition back to a mesh in the order of the input.

use rayon::prelude::*;

use super::cut::Parts;
use super::polygons::polygons;
use super::rebuild::Rebuilt;
use super::surface::Surface;
use super::vsa::Proxy;
use crate::mesh::orient::TURNED;
use crate::mesh::weld::joined_attributes;
use crate::mesh::{Mesh, Polygons};

/// The region of a face that the input's preparation dropped.
pub const NO_REGION: u32 = u32::MAX;

/// The regions of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Regions {
    /// The region of every face of the input; [`NO_REGION`] of those that are degenerate or repeat another.
    pub labels: Vec<u32>,
    /// How many regions there are.
    pub count: usize,
    /// The region of every face of the result; empty where edges were turned after, also those on borders.
    pub face_labels: Vec<u32>,
    /// The result without edges inside regions: each is one polygon, or several where it was cut to be drawn, and one a face
    /// where it keeps its faces or has vertices inside. Edge flips come after this and change no polygon.
    pub polygons: Polygons,
    /// Those that are not drawn in a plane.
    pub not_planar: NotPlanar,
    /// What each region is like on the whole, in model units, of variational shape approximation.
    pub proxies: Vec<Proxy>,
    /// Its energy after every pass, the last that of the regions.
    pub energies: Vec<f64>,
}

/// How many regions, or parts of them where they were cut, no plane shows without folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NotPlanar {
    /// They keep the input's faces.
    pub undrawn: usize,
    /// They are filled between their borders in space.
    pub spatial: usize,
}

/// The mesh, the input vertex of each of its vertices, and its regions.
#[derive(Debug)]
pub struct Restored {
    pub mesh: Mesh,
    pub vertex_origin: Vec<u32>,
    pub regions: Regions,
}

/// The light at the vertices of the surface.
#[derive(Debug, Clone, Copy)]
pub enum VertexLight<'a> {
    /// Their colors, or what was made of those of faces.
    Own(&'a [[f32; 4]]),
    /// Moved, in the place of their colors.
    Fitted(&'a [[f32; 4]]),
}

/// Names vertices in the order of the input and turns regions back over that were turned to agree with others.
pub fn restore(
    input: &Mesh,
    surface: &Surface,
    parts: &Parts,
    rebuilt: Rebuilt,
    light: Option<VertexLight<'_>>,
) -> Restored {
    let Rebuilt { faces, region_starts, is_whole, undrawn, spatial, .. } = rebuilt;
    let whole = |part: u32| parts.whole[part as usize];
    let (order, renamed) = names(surface, &faces);
    let vertex_origin: Vec<u32> = order.iter().map(|&v| surface.vertex_source[v as usize]).collect();

    let is_turned = turned_regions(surface, parts);
    let mut face_labels = Vec::with_capacity(faces.len());
    for (part, ends) in (0..).zip(region_starts.windows(2)) {
        face_labels.resize(face_labels.len() + (ends[1] - ends[0]) as usize, part);
    }
    let named = |(&face, &part): (&[u32; 3], &u32)| {
        let [a, b, c] = face.map(|v| renamed[v as usize]);
        if is_turned[part as usize] { [a, c, b] } else { [a, b, c] }
    };
    let mut labels = vec![NO_REGION; input.faces.len()];
    for (&source, &part) in surface.face_source.iter().zip(&parts.partition.labels) {
        labels[(source & !TURNED) as usize] = whole(part);
    }
    let (normals, mut colors) = joined_attributes(input, surface.lowest.as_ref(), &vertex_origin);
    if let Some(VertexLight::Fitted(rows) | VertexLight::Own(rows)) = light
        && (colors.is_none() || matches!(light, Some(VertexLight::Fitted(_))))
    {
        colors = Some(order.iter().map(|&v| rows[v as usize]).collect());
    }
    // Vertices carry the light then, without steps between regions.
    let means = input.face_colors.as_ref().filter(|_| light.is_none()).map(|rows| means(surface, parts, rows));
    let mesh = Mesh {
        positions: vertex_origin.iter().map(|&v| input.positions[v as usize]).collect(),
        faces: faces.iter().zip(&face_labels).map(named).collect(),
        normals,
        colors,
        texcoords: None,
        face_colors: means.map(|means| face_labels.iter().map(|&part| means[part as usize]).collect()),
        ..Mesh::default()
    };
    face_labels.iter_mut().for_each(|label| *label = whole(*label));
    // Parts come last: the number of regions is that of the wholes.
    let count = parts.whole.iter().max().map_or(0, |&last| last as usize + 1);
    let polygons = polygons(&mesh, &region_starts, &is_whole);
    let not_planar = NotPlanar { undrawn: undrawn.len(), spatial };
    let regions = Regions { labels, count, face_labels, polygons, not_planar, ..Regions::default() };
    Restored { mesh, vertex_origin, regions }
}

/// The vertices that faces use in the order of the input, and the place of each there.
fn names(surface: &Surface, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut used = vec![false; surface.points.len()];
    faces.iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut order: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
    order.par_sort_unstable_by_key(|&v| surface.vertex_source[v as usize]);
    let mut renamed = vec![0; used.len()];
    (0..).zip(&order).for_each(|(new, &old)| renamed[old as usize] = new);
    (order, renamed)
}

/// The mean color of every part's faces, by area: theirs, where they have one.
fn means(surface: &Surface, Parts { partition, .. }: &Parts, colors: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let mut sums = vec![Mixed::default(); partition.region_count];
    for (face, &label) in (0..).zip(&partition.labels) {
        let [a, b, c] = surface.faces[face as usize].map(|v| surface.points[v as usize]);
        sums[label as usize].add(colors[surface.input_face(face) as usize], (b - a).cross(c - a).length());
    }
    sums.into_iter().map(Mixed::color).collect()
}

/// Colors mixed by area.
#[derive(Debug, Clone, Copy, Default)]
struct Mixed {
    first: Option<[f32; 4]>,
    is_one: bool,
    sum: [f64; 4],
    area: f64,
}

impl Mixed {
    fn add(&mut self, color: [f32; 4], area: f64) {
        self.is_one = self.first.is_none_or(|first| self.is_one && first == color);
        self.first.get_or_insert(color);
        (0..4).for_each(|k| self.sum[k] += f64::from(color[k]) * area);
        self.area += area;
    }

    /// The one color that there is, exactly, or the mean; the first where no face has an area.
    fn color(self) -> [f32; 4] {
        if self.is_one || self.area <= 0.0 {
            return self.first.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        }
        self.sum.map(|sum| (sum / self.area) as f32)
    }
}

/// For every region whether most of its faces were turned over.
fn turned_regions(surface: &Surface, Parts { partition, .. }: &Parts) -> Vec<bool> {
    let mut balance = vec![0_i64; partition.region_count];
    for (&source, &label) in surface.face_source.iter().zip(&partition.labels) {
        balance[label as usize] += if source & TURNED == 0 { -1 } else { 1 };
    }
    balance.into_iter().map(|balance| balance > 0).collect()
}
