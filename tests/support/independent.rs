//! Topology and geometry checks from the definitions, with hash maps and no shared structure.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use coarsen::Mesh;

/// What a mesh is, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Topology {
    /// Vertices used by a face.
    pub vertices: usize,
    /// Distinct vertex pairs joined by a face.
    pub edges: usize,
    /// All faces.
    pub faces: usize,
    /// `vertices − edges + faces`.
    pub euler: i64,
    /// Parts joined through vertices.
    pub components: usize,
    /// Edges of one face.
    pub border_edges: usize,
    /// Connected sets of border edges.
    pub border_loops: usize,
    /// Edges of three or more faces.
    pub non_manifold_edges: usize,
    /// Vertices whose faces form more than one fan.
    pub bow_ties: usize,
    /// Edges of two faces that both run along them the same way.
    pub misoriented_edges: usize,
    /// Faces with a repeated vertex or no area.
    pub degenerate_faces: usize,
    /// Faces on the same three vertices as an earlier one.
    pub duplicate_faces: usize,
    /// Edges of two faces with more than 170° between their normals.
    pub folded_edges: usize,
}

/// Counts everything in [`Topology`].
pub fn topology(mesh: &Mesh) -> Topology {
    let mut directed: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (f, &[a, b, c]) in mesh.faces.iter().enumerate() {
        for edge in [(a, b), (b, c), (c, a)] {
            if edge.0 != edge.1 {
                directed.entry(edge).or_default().push(f);
            }
        }
    }
    let along = |edge: (u32, u32)| directed.get(&edge).map_or(&[][..], |faces| &faces[..]);
    let edges: BTreeSet<(u32, u32)> = directed.keys().map(|&(a, b)| (a.min(b), a.max(b))).collect();
    let vertices: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    let mut counted = Topology {
        vertices: vertices.len(),
        edges: edges.len(),
        faces: mesh.faces.len(),
        euler: vertices.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64,
        components: UnionFind::over(mesh.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c)])).sets(),
        bow_ties: bow_ties(mesh),
        degenerate_faces: mesh.faces.iter().filter(|face| is_degenerate(mesh, face)).count(),
        ..Topology::default()
    };
    let mut borders = Vec::new();
    for &(a, b) in &edges {
        match (along((a, b)), along((b, a))) {
            ([_], []) | ([], [_]) => borders.push((a, b)),
            ([f], [g]) => counted.folded_edges += usize::from(normal_angle(mesh, *f, *g) > 170.0_f64.to_radians()),
            ([_, _], []) | ([], [_, _]) => counted.misoriented_edges += 1,
            _ => counted.non_manifold_edges += 1,
        }
    }
    counted.border_edges = borders.len();
    counted.border_loops = UnionFind::over(borders).sets();
    let mut seen = HashSet::new();
    counted.duplicate_faces = mesh.faces.iter().filter(|face| !seen.insert(sorted(**face))).count();
    counted
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

fn normal(mesh: &Mesh, face: [u32; 3]) -> coarsen::math::DVec3 {
    let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
    (b - a).cross(c - a)
}

fn is_degenerate(mesh: &Mesh, face: &[u32; 3]) -> bool {
    face[0] == face[1] || face[1] == face[2] || face[2] == face[0] || normal(mesh, *face).length() == 0.0
}

fn normal_angle(mesh: &Mesh, f: usize, g: usize) -> f64 {
    let (m, n) = (normal(mesh, mesh.faces[f]), normal(mesh, mesh.faces[g]));
    m.cross(n).length().atan2(m.dot(n))
}

/// Vertices around which walking from face to face over shared edges does not reach every face.
fn bow_ties(mesh: &Mesh) -> usize {
    let mut stars: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for &face in &mesh.faces {
        let corners: BTreeSet<u32> = face.into_iter().collect();
        corners.into_iter().filter(|_| sorted(face).windows(2).all(|w| w[0] != w[1])).for_each(|v| {
            stars.entry(v).or_default().push(face);
        });
    }
    // Each face of the star joins its two other vertices; one fan is one connected set of them.
    let fans = |v: u32, star: &[[u32; 3]]| {
        let opposite = star.iter().map(|face| {
            let mut others = face.iter().copied().filter(|&w| w != v);
            (others.next().unwrap_or(v), others.next().unwrap_or(v))
        });
        UnionFind::over(opposite).sets()
    };
    stars.iter().filter(|&(&v, star)| fans(v, star) > 1).count()
}

/// Sets of vertices, joined pair by pair.
struct UnionFind(HashMap<u32, u32>);

impl UnionFind {
    fn over(pairs: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let mut sets = Self(HashMap::new());
        for (a, b) in pairs {
            let (a, b) = (sets.root(a), sets.root(b));
            sets.0.insert(a.max(b), a.min(b));
        }
        sets
    }

    fn root(&mut self, v: u32) -> u32 {
        let mut path = Vec::new();
        let mut at = v;
        while *self.0.entry(at).or_insert(at) != at {
            path.push(at);
            at = self.0[&at];
        }
        for w in path {
            self.0.insert(w, at);
        }
        at
    }

    fn sets(&self) -> usize {
        self.0.iter().filter(|(v, parent)| v == parent).count()
    }
}

/// A vertex beyond every border, which closes the surface.
const DUMMY: u32 = u32::MAX;

/// Whether contracting the edge `u v` keeps the topology: Lk(u) ∩ Lk(v) = Lk(uv) \[DE99\].
///
/// Links are sets of simplices (sorted vertex lists) in the complex in which every border edge is joined to a dummy
/// vertex, so borders need no rule of their own. For manifold surroundings.
pub fn link_condition(faces: &[[u32; 3]], u: u32, v: u32) -> bool {
    let mut edge_faces: HashMap<Vec<u32>, usize> = HashMap::new();
    for face in faces {
        for edge in subsets(face).into_iter().filter(|s| s.len() == 2) {
            *edge_faces.entry(edge).or_default() += 1;
        }
    }
    let cones = edge_faces.iter().filter(|&(_, &count)| count == 1).map(|(edge, _)| [edge[0], edge[1], DUMMY]);
    let complex: HashSet<Vec<u32>> = faces.iter().copied().chain(cones).flat_map(|face| subsets(&face)).collect();
    // Lk(s) = the simplices apart from s that together with s are a simplex.
    let link = |simplex: &[u32]| -> HashSet<Vec<u32>> {
        let with = complex.iter().filter(|s| simplex.iter().all(|v| s.contains(v)));
        with.map(|s| s.iter().copied().filter(|v| !simplex.contains(v)).collect::<Vec<u32>>())
            .filter(|rest| !rest.is_empty())
            .collect()
    };
    let common: HashSet<Vec<u32>> = link(&[u]).intersection(&link(&[v])).cloned().collect();
    common == link(&[u, v])
}

/// The seven faces of a triangle as simplices: corners, edges, itself, each sorted.
fn subsets(face: &[u32; 3]) -> Vec<Vec<u32>> {
    let [a, b, c] = sorted(*face);
    vec![vec![a], vec![b], vec![c], vec![a, b], vec![b, c], vec![a, c], vec![a, b, c]]
}
