//! The wedges of the input: the corners of each vertex by what they have.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;

use crate::kernel::split::CHUNK;
use crate::kernel::warm::{faces_near, warm_up};
use crate::math::Vec3;
use crate::mesh::adjacency::corner_of;
use crate::mesh::orient::input_corner;
use crate::mesh::{Mesh, Rings};

use super::carry::MOVED_FROM;
use super::layout::{Kind, Layer, Layout};

/// Where normals of a vertex break.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Creases {
    /// Where they are not the same.
    All,
    /// Where they turn by more than [`LEAST_CREASE`].
    Sharp,
}

/// The share of vertices with more than two normals from which normals are those of facets.
const FACETS: f64 = 0.5;

/// The cosine of the least angle that is a crease of facets: 30°.
const LEAST_CREASE: f32 = 0.866;

impl Creases {
    /// Whether corners with these numbers of a layer are of one wedge.
    fn agree(self, layer: &Layer, a: &[f32], b: &[f32]) -> bool {
        let is_same = || a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()));
        if self != Self::Sharp || layer.kind != Kind::Normal {
            return is_same();
        }
        let [a, b] = [a, b].map(Vec3::from_slice);
        a.dot(b) > LEAST_CREASE * a.length() * b.length() || is_same()
    }
}

/// What corners of the input share that have the same row for sure: their vertex, texture coordinates and material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Source {
    vertex: u32,
    texcoords: [u32; 2],
    material: u32,
}

impl Source {
    fn of(mesh: &Mesh, layout: &Layout, face: usize, corner: usize) -> Self {
        let texcoords = mesh.texcoords.as_ref().map(|rows| rows[face][corner].to_array().map(f32::to_bits));
        Self {
            vertex: mesh.faces[face][corner],
            texcoords: texcoords.unwrap_or_default(),
            material: layout.material(mesh, face),
        }
    }
}

/// Wedges of some consecutive vertices, as they are found.
#[derive(Default)]
struct Found {
    /// How many each vertex has.
    counts: Vec<u32>,
    origin: Vec<u32>,
    rows: Vec<f32>,
    /// Of every corner of the vertices that have several, in the order of the rings, which of these it has.
    of_corners: Vec<u32>,
    /// What those of the last vertex began as.
    sources: Vec<Source>,
}

impl Found {
    /// The wedge of the last vertex, of those from `first` on, that began as a corner like this and is not the sum of others.
    fn known(&self, first: usize, source: Source) -> Option<usize> {
        let is_this = |wedge: &usize| self.origin[*wedge] & MOVED_FROM == 0 && self.sources[*wedge - first] == source;
        (first..self.origin.len()).find(is_this)
    }

    /// Counts a corner to a wedge, which becomes the sum of both if its normal is another.
    fn join(&mut self, layout: &Layout, wedge: usize, row: &[f32]) {
        let sum = &mut self.rows[wedge * layout.width..][..layout.width];
        for layer in layout.of_kind(Kind::Normal) {
            let (sum, normal) = (layer.of_mut(sum), layer.of(row));
            if self.origin[wedge] & MOVED_FROM != 0 || sum != normal {
                self.origin[wedge] |= MOVED_FROM;
                sum.iter_mut().zip(normal).for_each(|(sum, x)| *sum += x);
            }
        }
    }

    /// Whether the wedges from one on have more than two normals; what else parts them does not count.
    fn has_many_normals(&self, layout: &Layout, first: usize) -> bool {
        let row = |wedge: usize| &self.rows[wedge * layout.width..][..layout.width];
        let agree = |a: usize, b: usize| layout.of_kind(Kind::Normal).all(|layer| layer.of(row(a)) == layer.of(row(b)));
        let mut known = [first; 2];
        for wedge in first..self.origin.len() {
            match known.map(|other| agree(wedge, other)) {
                [true, _] | [_, true] => {}
                _ if known[0] == known[1] => known[1] = wedge,
                _ => return true,
            }
        }
        false
    }

    /// Brings the sums from a wedge on to unit length.
    fn finish(&mut self, layout: &Layout, first: usize) {
        for wedge in (first..self.origin.len()).filter(|&wedge| self.origin[wedge] & MOVED_FROM != 0) {
            let row = &mut self.rows[wedge * layout.width..][..layout.width];
            for layer in layout.of_kind(Kind::Normal) {
                let unit = Vec3::from_slice(layer.of(row)).normalize_or_zero() * layer.scale;
                layer.of_mut(row).copy_from_slice(&unit.to_array());
            }
        }
    }
}

/// The wedges of all vertices.
#[derive(Debug)]
pub struct Gathered {
    /// The wedge of every corner of every face.
    pub corners: Vec<[u32; 3]>,
    /// Where those of each vertex begin, and the end.
    pub starts: Vec<u32>,
    /// `layout.width` numbers each.
    pub rows: Vec<f32>,
    /// The corner of the input that each began as, 3·face + corner, with [`MOVED_FROM`] where it is the mean of several.
    pub origin: Vec<u32>,
}

/// Gathers the wedges of `faces`, which came from those of `mesh`; none where all creases would be kept and normals are those of
/// facets.
pub fn gather(
    mesh: &Mesh,
    layout: &Layout,
    rings: &Rings,
    face_origin: &[u32],
    faces: &[[u32; 3]],
    creases: Creases,
) -> Option<Gathered> {
    let vertices = rings.vertex_count();
    let facets =
        (creases == Creases::All && layout.of_kind(Kind::Normal).next().is_some()).then(|| Facets::of(vertices));
    let input = Input { mesh, layout, face_origin, faces, creases };
    let find = |task: usize| input.find(rings, task * CHUNK..vertices.min((task + 1) * CHUNK), facets.as_ref());
    let found: Option<Vec<Found>> = (0..vertices.div_ceil(CHUNK)).into_par_iter().map(find).collect();
    Some(assemble(&found?, rings, faces))
}

/// Counts vertices with more than two normals: where those are most, every face has its own, and no vertex could go anywhere.
struct Facets {
    most: usize,
    many: AtomicUsize,
}

impl Facets {
    /// Of so many vertices.
    fn of(vertices: usize) -> Self {
        Self { most: (FACETS * vertices as f64) as usize, many: AtomicUsize::new(0) }
    }

    /// Counts a vertex with many normals, or one without; returns whether it is plain that they are those of facets. The total decides,
    /// so that neither order nor threads do.
    fn are_found_at(&self, has_many_normals: bool) -> bool {
        let before = if has_many_normals { self.many.fetch_add(1, Relaxed) + 1 } else { self.many.load(Relaxed) };
        before > self.most
    }
}

/// What wedges are gathered from.
struct Input<'a> {
    mesh: &'a Mesh,
    layout: &'a Layout,
    face_origin: &'a [u32],
    faces: &'a [[u32; 3]],
    creases: Creases,
}

impl Input<'_> {
    /// Finds the wedges of consecutive vertices, unless normals turn out to be those of facets.
    fn find(&self, rings: &Rings, vertices: Range<usize>, facets: Option<&Facets>) -> Option<Found> {
        let count = vertices.len();
        // Most vertices have one wedge.
        let mut found = Found {
            counts: Vec::with_capacity(count),
            origin: Vec::with_capacity(count),
            rows: Vec::with_capacity(count * self.layout.width),
            ..Found::default()
        };
        let mut row = vec![0.0; self.layout.width];
        self.warm_up(rings, vertices.clone());
        for vertex in vertices {
            let (first, corners_before) = (found.origin.len(), found.of_corners.len());
            found.sources.clear();
            for &f in rings.ring(vertex as u32) {
                let k = corner_of(self.faces[f as usize], vertex as u32);
                let corner = input_corner(self.face_origin[f as usize], k);
                let wedge = self.wedge(corner, &mut found, first, &mut row);
                found.of_corners.push((wedge - first) as u32);
            }
            found.finish(self.layout, first);
            let count = found.origin.len() - first;
            let has_many_normals = || count > 2 && found.has_many_normals(self.layout, first);
            if facets.is_some_and(|facets| facets.are_found_at(has_many_normals())) {
                return None;
            }
            found.counts.push(count as u32);
            if count == 1 {
                found.of_corners.truncate(corners_before);
            }
        }
        Some(found)
    }

    /// Reads once what corners of consecutive vertices begin as, by loads that do not wait for each other.
    fn warm_up(&self, rings: &Rings, vertices: Range<usize>) {
        let near = faces_near(vertices, &rings.starts, &rings.faces, self.faces.len());
        let bits_of = |&origin: &u32| {
            let (face, corner) = input_corner(origin, 0);
            let Source { vertex, texcoords: [u, v], material } = Source::of(self.mesh, self.layout, face, corner);
            vertex ^ u ^ v ^ material
        };
        warm_up(&self.faces[near.clone()]);
        std::hint::black_box(self.face_origin[near].iter().map(bits_of).fold(0, |all, bits| all ^ bits));
    }

    /// The wedge of a corner of the input, of those from `first` on or new; `row` is overwritten.
    fn wedge(&self, (face, corner): (usize, usize), found: &mut Found, first: usize, row: &mut [f32]) -> usize {
        let Self { mesh, layout, .. } = *self;
        let source = Source::of(mesh, layout, face, corner);
        if let Some(wedge) = found.known(first, source) {
            return wedge;
        }
        layout.read(mesh, face, corner, row);
        if let Some(wedge) = (first..found.origin.len()).find(|&wedge| self.matches(row, source.material, found, wedge))
        {
            found.join(layout, wedge, row);
            return wedge;
        }
        found.rows.extend_from_slice(row);
        found.origin.push((3 * face + corner) as u32);
        found.sources.push(source);
        found.origin.len() - 1
    }

    /// Whether a row of a material is that of a wedge.
    fn matches(&self, row: &[f32], material: u32, found: &Found, wedge: usize) -> bool {
        let layout = self.layout;
        let other = &found.rows[wedge * layout.width..][..layout.width];
        let other_face = (found.origin[wedge] & !MOVED_FROM) as usize / 3;
        layout.layers.iter().all(|layer| self.creases.agree(layer, layer.of(row), layer.of(other)))
            && material == layout.material(self.mesh, other_face)
    }
}

/// Puts together what tasks found.
fn assemble(found: &[Found], rings: &Rings, faces: &[[u32; 3]]) -> Gathered {
    let counts = || found.iter().flat_map(|found| &found.counts);
    let mut starts = Vec::with_capacity(rings.vertex_count() + 1);
    starts.push(0);
    starts.extend(counts().scan(0, |start, count| {
        *start += count;
        Some(*start)
    }));
    let mut corners = faces.to_vec();
    if !counts().all(|&count| count == 1) {
        let vertices = &starts[..rings.vertex_count()];
        corners.par_iter_mut().with_min_len(CHUNK).for_each(|face| *face = face.map(|v| vertices[v as usize]));
        // Most vertices have one wedge, which all of their corners have by now.
        for (first, found) in (0..).step_by(CHUNK).zip(found) {
            let mut of_corners = found.of_corners.iter();
            for (vertex, _) in (first..).zip(&found.counts).filter(|&(_, &count)| count > 1) {
                for (&f, wedge) in rings.ring(vertex as u32).iter().zip(&mut of_corners) {
                    let corner = corner_of(faces[f as usize], vertex as u32);
                    corners[f as usize][corner] = starts[vertex] + wedge;
                }
            }
        }
    }
    Gathered {
        corners,
        starts,
        rows: together(found, |found| &found.rows),
        origin: together(found, |found| &found.origin),
    }
}

/// What all tasks have of something, in their order.
fn together<T: Copy>(found: &[Found], of: impl Fn(&Found) -> &Vec<T>) -> Vec<T> {
    let mut all = Vec::with_capacity(found.iter().map(|found| of(found).len()).sum());
    found.iter().for_each(|found| all.extend_from_slice(of(found)));
    all
}

#[cfg(test)]
mod tests {
    use super::super::Metric;
    use super::super::attributes::Attributes;
    use super::*;
    use crate::math::Vec2;
    use crate::mesh::frame::Frame;
    use crate::mesh::shapes;

    /// Planes whose first vertices have a normal in each of their faces, for several tasks: up to half of the vertices may.
    #[test]
    fn normals_are_those_of_facets_where_more_than_half_of_the_vertices_have_many() {
        let flat = shapes::plane(90, 90);
        let vertices = flat.positions.len();
        let rings = Rings::new(&flat.faces, vertices);
        let origins: Vec<u32> = (0..flat.faces.len() as u32).collect();
        let many_below = |limit: usize| (0..limit).filter(|&v| rings.ring(v as u32).len() > 2).count();
        let is_gathered = |limit: usize, has_normals: bool, creases: Creases| {
            let corners = || flat.faces.iter().flatten().map(|&v| v as usize);
            let normal = |(corner, v): (usize, usize)| match v < limit {
                true => Vec3::new(corner as f32, 1.0, 1.0).normalize(),
                false => Vec3::Z,
            };
            let mesh = Mesh {
                positions: corners().map(|v| flat.positions[v]).collect(),
                faces: (0..flat.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
                normals: has_normals.then(|| corners().enumerate().map(normal).collect()),
                colors: (!has_normals)
                    .then(|| corners().enumerate().map(normal).map(|n| n.extend(1.0).into()).collect()),
                ..Mesh::default()
            };
            let frame = Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds());
            let layout =
                Layout::new(&mesh, &Attributes::default(), Metric::Volume, frame, false).expect("an attribute");
            gather(&mesh, &layout, &rings, &origins, &flat.faces, creases).is_some()
        };
        let half = (0..vertices).find(|&limit| many_below(limit) == vertices / 2).expect("a limit");
        let more = (half..vertices).find(|&limit| many_below(limit) > vertices / 2).expect("a limit");
        assert!(is_gathered(half, true, Creases::All) && !is_gathered(more, true, Creases::All));
        assert!(is_gathered(more, false, Creases::All) && is_gathered(more, true, Creases::Sharp));
    }

    /// A sphere of smooth normals in whose texture every face has a chart of its own.
    #[test]
    fn what_a_texture_parts_are_no_facets() {
        let mut mesh = shapes::icosphere(3);
        mesh.normals = Some(mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect());
        let chart = |f: usize| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[u, v]| Vec2::new(2.0 * f as f32 + u, v));
        mesh.texcoords = Some((0..mesh.faces.len()).map(chart).collect());
        let vertices = mesh.positions.len();
        let frame = Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds());
        let layout = Layout::new(&mesh, &Attributes::default(), Metric::Volume, frame, false).expect("attributes");
        let rings = Rings::new(&mesh.faces, vertices);
        let origins: Vec<u32> = (0..mesh.faces.len() as u32).collect();
        let found = gather(&mesh, &layout, &rings, &origins, &mesh.faces, Creases::All).expect("no facets");
        assert_eq!(found.origin.len(), 3 * mesh.faces.len());
    }

    /// Vertices of several tasks, cut along every tenth column: every corner has the row that it has
    /// in the input, and a vertex no row twice.
    #[test]
    fn every_corner_has_its_own_numbers_and_a_vertex_none_twice() {
        let mut mesh = shapes::plane(100, 100);
        let column = |f: usize| f / 2 % 100;
        let texcoords = |f: usize| {
            mesh.faces[f].map(|v| Vec2::new((v % 101) as f32 + 200.0 * (column(f) / 10) as f32, (v / 101) as f32))
        };
        mesh.texcoords = Some((0..mesh.faces.len()).map(texcoords).collect());
        let vertices = mesh.positions.len();
        assert!(vertices > 2 * CHUNK);
        let frame = Frame::new(&mesh.faces, |v| mesh.positions[v as usize], mesh.bounds());
        let layout = Layout::new(&mesh, &Attributes::default(), Metric::Volume, frame, false).expect("a texture");
        let rings = Rings::new(&mesh.faces, vertices);
        let origins: Vec<u32> = (0..mesh.faces.len() as u32).collect();
        let found = gather(&mesh, &layout, &rings, &origins, &mesh.faces, Creases::All).expect("no facets");
        let row = |wedge: u32| &found.rows[wedge as usize * layout.width..][..layout.width];
        let mut own = vec![0.0; layout.width];
        for (f, wedges) in found.corners.iter().enumerate() {
            for (k, &wedge) in wedges.iter().enumerate() {
                layout.read(&mesh, f, k, &mut own);
                let vertex = mesh.faces[f][k] as usize;
                assert!((found.starts[vertex]..found.starts[vertex + 1]).contains(&wedge));
                assert_eq!(row(wedge), own, "corner {k} of face {f}");
            }
        }
        let count = |vertex: usize| found.starts[vertex + 1] - found.starts[vertex];
        // Nine cuts between ten strips.
        let on_cut = |vertex: usize| (vertex % 101).is_multiple_of(10) && !(vertex % 101).is_multiple_of(100);
        assert!((0..vertices).all(|vertex| count(vertex) == if on_cut(vertex) { 2 } else { 1 }));
        assert_eq!(found.starts.last(), Some(&(found.origin.len() as u32)));
    }
}
