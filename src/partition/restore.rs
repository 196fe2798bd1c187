//! From a rebuilt partition back to a mesh in the order of the input.

use super::cut::Parts;
use super::named::Named;
use super::polygons::polygons;
use super::rebuild::Rebuilt;
use super::slide::Stand;
use super::surface::Surface;
use super::vsa::Proxy;
use crate::math::{DVec3, Vec3};
use crate::mesh::orient::TURNED;
use crate::mesh::weld::joined_attributes;
use crate::mesh::{Channel, Materials, Mesh, Polygons, take};
use crate::simplify::MOVED;

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

/// What the result carries.
#[derive(Debug, Clone, Copy)]
pub enum Carried<'a> {
    /// The normals and colors of vertices.
    Vertices,
    /// All that corners have.
    Corners,
    /// The same as vertices, with this light.
    Light(VertexLight<'a>),
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
///
/// The vertices of the surface in `moved`, ascending, stand elsewhere on it.
pub fn restore(
    input: &Mesh,
    surface: &Surface,
    parts: &Parts,
    rebuilt: Rebuilt,
    carried: Carried<'_>,
    moved: &[(u32, Stand)],
) -> Restored {
    let whole = |part: u32| parts.whole[part as usize];
    let named = match carried {
        Carried::Corners => Named::with_corners(input, surface, parts, &rebuilt),
        Carried::Vertices | Carried::Light(_) => Named::whole(surface, &rebuilt.faces),
    };
    let Rebuilt { faces, region_starts, is_whole, undrawn, spatial, .. } = rebuilt;
    let mut vertex_origin = named.origins(input, surface);

    let is_turned = turned_regions(surface, parts);
    let mut face_labels = Vec::with_capacity(faces.len());
    for (part, ends) in (0..).zip(region_starts.windows(2)) {
        face_labels.resize(face_labels.len() + (ends[1] - ends[0]) as usize, part);
    }
    let mut labels = vec![NO_REGION; input.faces.len()];
    for (&source, &part) in surface.face_source.iter().zip(&parts.partition.labels) {
        labels[(source & !TURNED) as usize] = whole(part);
    }
    let VertexRows { normals, colors, channels } = vertex_rows(input, surface, &named, &vertex_origin, carried);
    // Vertices carry the light then, without steps between regions.
    let is_lit = matches!(carried, Carried::Light(_));
    let means = input.face_colors.as_ref().filter(|_| !is_lit).map(|rows| means(surface, parts, rows));
    let by_part = |rows: Vec<u32>| face_labels.iter().map(|&part| rows[part as usize]).collect();
    let materials = input.materials.as_ref().map(|materials| Materials {
        of_face: by_part(part_materials(surface, parts, materials)),
        names: materials.names.clone(),
    });
    let mut positions: Vec<DVec3> = named.vertices.iter().map(|vertex| at(input, surface, vertex.at)).collect();
    for (new, vertex) in named.vertices.iter().enumerate().filter(|_| !moved.is_empty()) {
        if let Ok(found) = moved.binary_search_by_key(&vertex.at, |&(v, _)| v) {
            positions[new] = moved[found].1.mix(|v| at(input, surface, v));
            vertex_origin[new] = MOVED;
        }
    }
    let mut mesh = Mesh {
        positions,
        faces: named.faces,
        normals,
        colors,
        texcoords: named.texcoords,
        face_colors: means.map(|means| face_labels.iter().map(|&part| means[part as usize]).collect()),
        channels,
        materials,
    };
    for (face, _) in face_labels.iter().enumerate().filter(|(_, part)| is_turned[**part as usize]) {
        mesh.faces[face].swap(1, 2);
        mesh.texcoords.iter_mut().for_each(|rows| rows[face].swap(1, 2));
    }
    face_labels.iter_mut().for_each(|label| *label = whole(*label));
    // Parts come last: the number of regions is that of the wholes.
    let count = parts.whole.iter().max().map_or(0, |&last| last as usize + 1);
    let polygons = polygons(&mesh, &region_starts, &is_whole);
    let not_planar = NotPlanar { undrawn: undrawn.len(), spatial };
    let regions = Regions { labels, count, face_labels, polygons, not_planar, ..Regions::default() };
    Restored { mesh, vertex_origin, regions }
}

/// What vertices carry.
struct VertexRows {
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<[f32; 4]>>,
    channels: Vec<Channel>,
}

fn vertex_rows(input: &Mesh, surface: &Surface, named: &Named, origin: &[u32], carried: Carried<'_>) -> VertexRows {
    if matches!(carried, Carried::Corners) {
        let order: Vec<u32> = named.vertices.iter().map(|vertex| vertex.source).collect();
        return VertexRows {
            normals: input.normals.as_ref().map(|rows| take(rows, &order)),
            colors: input.colors.as_ref().map(|rows| take(rows, &order)),
            channels: input.channels.iter().map(|channel| channel.take(&order)).collect(),
        };
    }
    let (normals, mut colors) = joined_attributes(input, surface.lowest.as_ref(), origin);
    if let Carried::Light(light @ (VertexLight::Fitted(rows) | VertexLight::Own(rows))) = carried
        && (colors.is_none() || matches!(light, VertexLight::Fitted(_)))
    {
        colors = Some(named.vertices.iter().map(|vertex| rows[vertex.at as usize]).collect());
    }
    VertexRows { normals, colors, channels: Vec::new() }
}

/// Where a vertex of the surface stands in the input.
fn at(input: &Mesh, surface: &Surface, vertex: u32) -> DVec3 {
    input.positions[surface.vertex_source[vertex as usize] as usize]
}

/// The material of every part.
fn part_materials(surface: &Surface, Parts { partition, .. }: &Parts, materials: &Materials) -> Vec<u32> {
    let mut of_part = vec![0; partition.region_count];
    for (face, &part) in (0..).zip(&partition.labels) {
        of_part[part as usize] = materials.of_face[surface.input_face(face) as usize];
    }
    of_part
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
