//! Counts that say what kind of surface a mesh is.

use rayon::prelude::*;
use serde::Serialize;

use super::adjacency::{EdgeUse, Rings};
use super::disjoint::DisjointSets;
use super::fan::{Fan, fans};
use super::layers::Layers;
use super::weld::Twins;
use super::{Mesh, PARALLEL_ROWS};
use crate::math::DVec3;

/// The topology of a mesh as stored. Faces with a repeated corner are counted and otherwise left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Topology {
    /// Vertices, the unreferenced ones included.
    pub vertices: usize,
    /// Faces, all of them.
    pub faces: usize,
    /// Undirected edges.
    pub edges: usize,
    /// Parts connected over vertices.
    pub components: usize,
    /// Referenced vertices − edges + faces.
    pub euler: i64,
    /// Edges of one face.
    pub border_edges: usize,
    /// Parts of the border, connected over vertices: the holes, where none of them touch.
    pub border_loops: usize,
    /// Edges of more than two faces.
    pub nonmanifold_edges: usize,
    /// Vertices whose faces form more than one fan, connected over edges of any number of faces: bow ties.
    pub nonmanifold_vertices: usize,
    /// Edges of two faces that run along it in the same direction.
    pub misoriented_edges: usize,
    /// Vertices of no face.
    pub unreferenced_vertices: usize,
    /// Faces with a repeated corner.
    pub degenerate_faces: usize,
    /// Faces of three corners on one line.
    pub zero_area_faces: usize,
    /// Faces with the three corners of a lower one, in whatever order.
    pub duplicate_faces: usize,
    /// The number of handles, of all components together. Only a closed, manifold and oriented mesh has one.
    pub genus: Option<i64>,
}

impl Topology {
    /// Whether faces are there and no edge is a border.
    pub fn is_closed(&self) -> bool {
        self.edges > 0 && self.border_edges == 0
    }

    /// Whether every vertex has one fan of faces and every edge one or two faces.
    pub fn is_manifold(&self) -> bool {
        self.nonmanifold_edges == 0 && self.nonmanifold_vertices == 0
    }
}

/// Counts the topology of `mesh` as stored; `weld` first to count seams as joined.
pub fn topology(mesh: &Mesh) -> Topology {
    topology_of(mesh, &Rings::new(&mesh.faces, mesh.positions.len()))
}

/// [`topology`] with the rings of the mesh at hand.
pub fn topology_of(mesh: &Mesh, rings: &Rings) -> Topology {
    let faces = &mesh.faces;
    let vertex_count = mesh.positions.len();
    let stars = Stars::count(faces, rings);
    let degenerate_faces = faces.iter().filter(|face| has_repeated_corner(face)).count();
    let zero_area_faces = (0..faces.len())
        .into_par_iter()
        .with_min_len(PARALLEL_ROWS)
        .filter(|&f| !has_repeated_corner(&faces[f]) && has_no_area(mesh, f))
        .count();
    let twins = Twins::new(faces.len(), vertex_count, |f| faces[f], Layers::ONE);
    let components = Components::new(faces, vertex_count);

    let unreferenced_vertices = (0..vertex_count as u32).filter(|&v| rings.ring(v).is_empty()).count();
    let euler = stars.vertices as i64 - stars.edges as i64 + (faces.len() - degenerate_faces) as i64;
    let mut counts = Topology {
        vertices: vertex_count,
        faces: faces.len(),
        edges: stars.edges,
        components: components.count,
        euler,
        border_edges: stars.border.len(),
        border_loops: border_loops(&stars.border, vertex_count),
        nonmanifold_edges: stars.nonmanifold_edges,
        nonmanifold_vertices: stars.bow_ties.len(),
        misoriented_edges: stars.misoriented_edges,
        unreferenced_vertices,
        degenerate_faces,
        zero_area_faces,
        duplicate_faces: twins.duplicates.len() + twins.opposites.len(),
        genus: None,
    };
    if counts.is_closed() && counts.is_manifold() && counts.misoriented_edges == 0 {
        counts.genus = Some(components.count as i64 - euler / 2);
    }
    counts
}

/// Whether a corner is repeated.
pub(crate) fn has_repeated_corner(&[a, b, c]: &[u32; 3]) -> bool {
    (a == b) | (b == c) | (c == a)
}

/// Whether the corners lie on one line: the cross product of the edges is zero, where their coordinates are not rounded away.
pub(super) fn has_no_area(mesh: &Mesh, face: usize) -> bool {
    let [a, b, c] = mesh.faces[face].map(|v| mesh.positions[v as usize]);
    let (ab, ac, bc) = (b - a, c - a, c - b);
    // Over the longest edge first: neither tiny nor huge models leave the range of the squares.
    let longest = ab.abs().max(ac.abs()).max(bc.abs()).max_element();
    longest == 0.0 || (ab / longest).cross(ac / longest) == DVec3::ZERO
}

/// What the faces around the vertices say.
#[derive(Default)]
pub(super) struct Stars {
    /// Vertices with an edge.
    pub vertices: usize,
    pub edges: usize,
    pub nonmanifold_edges: usize,
    pub misoriented_edges: usize,
    /// Edges of one face, ascending.
    pub border: Vec<[u32; 2]>,
    /// Vertices of several fans, ascending.
    pub bow_ties: Vec<u32>,
}

impl Stars {
    pub fn count(faces: &[[u32; 3]], rings: &Rings) -> Self {
        let parts: Vec<Self> = (0..rings.vertex_count() as u32)
            .into_par_iter()
            .with_min_len(PARALLEL_ROWS)
            .fold(
                || (Self::default(), Vec::new()),
                |(mut stars, mut scratch), v| {
                    stars.add(faces, rings, v, &mut scratch);
                    (stars, scratch)
                },
            )
            .map(|(stars, _)| stars)
            .collect();
        parts.into_iter().reduce(Self::joined).unwrap_or_default()
    }

    fn add(&mut self, faces: &[[u32; 3]], rings: &Rings, vertex: u32, scratch: &mut Vec<EdgeUse>) {
        let ring = rings.ring(vertex);
        let mut fans = DisjointSets::new(ring.len());
        let mut fan_count = ring.iter().filter(|&&f| !has_repeated_corner(&faces[f as usize])).count();
        self.vertices += usize::from(fan_count > 0);
        for uses in rings.edges_at(faces, vertex, scratch) {
            for pair in uses.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|u| ring.partition_point(|&f| f < u.face()) as u32);
                fan_count -= usize::from(fans.join(a, b));
            }
            if uses[0].far() > vertex {
                self.edges += 1;
                match uses {
                    [_] => self.border.push([vertex, uses[0].far()]),
                    [a, b] => self.misoriented_edges += usize::from(a.outward() == b.outward()),
                    _ => self.nonmanifold_edges += 1,
                }
            }
        }
        if fan_count > 1 {
            self.bow_ties.push(vertex);
        }
    }

    fn joined(mut self, after: Self) -> Self {
        self.vertices += after.vertices;
        self.edges += after.edges;
        self.nonmanifold_edges += after.nonmanifold_edges;
        self.misoriented_edges += after.misoriented_edges;
        self.border.extend(after.border);
        self.bow_ties.extend(after.bow_ties);
        self
    }
}

fn border_loops(border: &[[u32; 2]], vertex_count: usize) -> usize {
    let mut sets = DisjointSets::new(vertex_count);
    for &[a, b] in border {
        sets.join(a, b);
    }
    let mut lowest: Vec<u32> = border.iter().map(|&[a, _]| sets.find(a)).collect();
    lowest.sort_unstable();
    lowest.dedup();
    lowest.len()
}

/// The parts of a mesh connected over vertices, in order of their lowest vertex.
#[derive(Debug)]
pub(crate) struct Components {
    pub count: usize,
    /// The component of every vertex; `u32::MAX` for those without a face.
    pub of_vertex: Vec<u32>,
}

impl Components {
    pub fn new(faces: &[[u32; 3]], vertex_count: usize) -> Self {
        let mut sets = DisjointSets::new(vertex_count);
        let mut of_vertex = vec![u32::MAX; vertex_count];
        for &[a, b, c] in faces.iter().filter(|face| !has_repeated_corner(face)) {
            sets.join(a, b);
            sets.join(b, c);
            for v in [a, b, c] {
                of_vertex[v as usize] = 0;
            }
        }
        let mut count = 0;
        for v in 0..vertex_count as u32 {
            if of_vertex[v as usize] == 0 {
                let lowest = sets.find(v);
                of_vertex[v as usize] = if lowest == v { count } else { of_vertex[lowest as usize] };
                count += u32::from(lowest == v);
            }
        }
        Self { count: count as usize, of_vertex }
    }
}

/// Which vertices a contraction had better leave alone: the faces around them are not one consistently oriented fan.
///
/// True for bow ties, for both ends of an edge with more than two faces or with two faces that disagree in orientation, and for
/// the corners of a face that repeats one. False without faces.
pub fn complex_vertices(faces: &[[u32; 3]], rings: &Rings) -> Vec<bool> {
    fans(faces, rings).into_iter().map(|fan| fan == Fan::Complex).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::shapes::*;
    use super::*;

    fn complex(mesh: &Mesh) -> Vec<u32> {
        let complex = complex_vertices(&mesh.faces, &Rings::new(&mesh.faces, mesh.positions.len()));
        (0..complex.len() as u32).filter(|&v| complex[v as usize]).collect()
    }

    #[test]
    fn handles_are_counted() {
        assert_eq!(topology(&icosphere(1)).genus, Some(0));
        assert_eq!(topology(&torus(5, 3)).genus, Some(1));
        assert_eq!(topology(&double_torus()).genus, Some(2));
        assert_eq!(topology(&plane(2, 2)).genus, None);
        assert_eq!(topology(&Mesh::default()), Topology::default());
    }

    #[test]
    fn the_whole_count_of_a_tube() {
        let expected = Topology {
            vertices: 12,
            faces: 12,
            edges: 24,
            components: 1,
            euler: 0,
            border_edges: 12,
            border_loops: 2,
            ..Topology::default()
        };
        assert_eq!(topology(&tube(6)), expected);
    }

    #[test]
    fn what_is_not_a_surface() {
        let fan = topology(&fan3());
        assert_eq!((fan.edges, fan.nonmanifold_edges, fan.nonmanifold_vertices, fan.border_edges), (7, 1, 0, 6));
        assert_eq!(complex(&fan3()), [0, 1]);
        let tie = topology(&bow_tie());
        assert_eq!((tie.edges, tie.nonmanifold_edges, tie.nonmanifold_vertices, tie.components), (6, 0, 1, 1));
        assert_eq!(complex(&bow_tie()), [0]);
        // The strip's last square meets the first the wrong way round.
        assert_eq!(topology(&moebius(6)).misoriented_edges, 1);
        assert_eq!(complex(&moebius(6)), [0, 1]);
    }

    #[test]
    fn a_whole_surface_has_no_complex_vertex() {
        for mesh in [icosphere(2), torus(6, 4), plane(3, 3), tube(4), cylinder(40), double_torus()] {
            assert_eq!(complex(&mesh), [] as [u32; 0]);
        }
        assert_eq!(complex(&Mesh::new(vec![DVec3::ZERO; 2], vec![])), [] as [u32; 0]);
    }

    #[test]
    fn poor_faces_are_told_apart() {
        // A needle on the edge 0–1 of the first face, a repeated corner, a duplicate and its reverse.
        let positions = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 0.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let faces = vec![[0, 1, 2], [0, 3, 1], [2, 2, 1], [1, 2, 0], [0, 2, 1]];
        let counts = topology(&Mesh::new(positions.to_vec(), faces));
        assert_eq!((counts.degenerate_faces, counts.zero_area_faces, counts.duplicate_faces), (1, 1, 2));
        assert_eq!((counts.edges, counts.nonmanifold_edges, counts.border_edges), (5, 3, 2));
    }

    proptest! {
        /// The fast walk around a vertex against the definition in terms of edges and fans.
        #[test]
        fn complex_vertices_are_as_defined(faces in prop::collection::vec([0u32..8, 0u32..8, 0u32..8], 0..14)) {
            let mesh = Mesh::new(vec![DVec3::ZERO; 8], faces);
            let rings = Rings::new(&mesh.faces, 8);
            let mut expected: Vec<u32> = Stars::count(&mesh.faces, &rings).bow_ties;
            let mut scratch = Vec::new();
            for v in 0..8 {
                for uses in rings.edges_at(&mesh.faces, v, &mut scratch) {
                    if uses.len() > 2 || uses.len() == 2 && uses[0].outward() == uses[1].outward() {
                        expected.push(v);
                    }
                }
            }
            expected.extend(mesh.faces.iter().filter(|f| has_repeated_corner(f)).flatten());
            expected.sort_unstable();
            expected.dedup();
            prop_assert_eq!(complex(&mesh), expected);
        }
    }
}
