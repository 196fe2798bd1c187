//! Separates faces that lie on each other and are no repetitions: a decal on a wall, two figures in one pose.
//!
//! Joined by position, three or more faces meet on every edge there. Each layer goes on in its own faces: whatever there is of it
//! becomes a surface of its own, which ends where its faces do. Where one leaves the other, nothing opens.

use rayon::prelude::*;

use super::adjacency::{EdgeUse, Rings};
use super::copies::{Copies, hand_out};
use super::disjoint::DisjointSets;
use super::fan::VERTICES_EACH;

/// Gives each layer vertices of its own wherever a face of another lies on one of its: renames corners and puts rings right.
/// Returns the vertex that each was, ascending, a copy after the vertex that it is of; `None` where no faces lie on each other.
pub(crate) fn separate(
    faces: &mut [[u32; 3]],
    rings: &mut Rings,
    layer: impl Fn(u32) -> u32 + Sync,
) -> Option<Vec<u32>> {
    let surface = Surface { faces, rings, layer };
    let vertices = (0..rings.vertex_count() as u32).into_par_iter().with_min_len(VERTICES_EACH);
    let all: Vec<Copies> =
        vertices.map_init(Scratch::default, |scratch, v| surface.copies(v, scratch)).flatten_iter().collect();
    (!all.is_empty()).then(|| hand_out(faces, rings, &all))
}

/// Room that outlives a vertex.
#[derive(Default)]
struct Scratch {
    uses: Vec<EdgeUse>,
    keys: Vec<(u32, bool, u32)>,
}

struct Surface<'a, L> {
    faces: &'a [[u32; 3]],
    rings: &'a Rings,
    layer: L,
}

impl<L: Fn(u32) -> u32> Surface<'_, L> {
    /// The copies that a vertex needs, if any.
    fn copies(&self, vertex: u32, Scratch { uses, keys }: &mut Scratch) -> Option<Copies> {
        let ring = self.rings.ring(vertex);
        let place = |used: EdgeUse| ring.partition_point(|&f| f < used.face()) as u32;
        let mut parts = DisjointSets::new(ring.len());
        let mut join = |group: &[EdgeUse]| {
            group.windows(2).for_each(|two| {
                parts.join(place(two[0]), place(two[1]));
            });
        };
        for uses in self.rings.edges_at(self.faces, vertex, uses) {
            if self.is_covered(vertex, uses, keys) {
                self.groups(uses).iter().for_each(|group| join(group));
            } else {
                join(uses);
            }
        }
        Copies::of_parts(vertex, ring, &mut parts)
    }

    /// Whether two of the faces on an edge of `vertex` have the same corners and the same turning sense, and are of different
    /// layers.
    fn is_covered(&self, vertex: u32, uses: &[EdgeUse], keys: &mut Vec<(u32, bool, u32)>) -> bool {
        let go_one_way = |two: &[EdgeUse]| two[0].outward() == two[1].outward();
        if uses.len() < 2 || (uses.len() == 2 && !go_one_way(uses)) {
            return false;
        }
        let tip = |used: EdgeUse| {
            let corners = self.faces[used.face() as usize];
            corners.into_iter().find(|&v| v != vertex && v != used.far()).unwrap_or(vertex)
        };
        keys.clear();
        keys.extend(uses.iter().map(|&used| (tip(used), used.outward(), (self.layer)(used.face()))));
        keys.sort_unstable();
        keys.windows(2).any(|two| (two[0].0, two[0].1) == (two[1].0, two[1].1) && two[0].2 != two[1].2)
    }

    /// The faces on an edge where one lies on another, in groups that go on in each other: the only two of a layer, and all others.
    /// Of these the last of their layers end there where they all run one way; and of two that do and one that does not, the higher.
    fn groups(&self, uses: &[EdgeUse]) -> Vec<Vec<EdgeUse>> {
        let layer = |used: &EdgeUse| (self.layer)(used.face());
        let mut sorted = uses.to_vec();
        sorted.sort_by_key(layer);
        let of_layers = sorted.chunk_by(|a, b| layer(a) == layer(b));
        let (mut groups, others): (Vec<_>, Vec<_>) = of_layers.map(<[EdgeUse]>::to_vec).partition(|of| of.len() == 2);
        let are_last = others.iter().all(|of_layer| of_layer.len() == 1);
        let mut others = others.concat();
        others.sort_unstable();
        let outward = others.iter().filter(|used| used.outward()).count();
        match (are_last, outward, others.len() - outward) {
            (true, 0, _) | (true, _, 0) => {}
            (true, 1, 2) | (true, 2, 1) => {
                let of_two = |used: &EdgeUse| used.outward() == (outward == 2);
                let above = others.iter().rposition(of_two);
                above.map(|above| others.remove(above));
                groups.push(others);
            }
            _ => groups.push(others),
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, Topology, shapes, topology};
    use super::*;

    /// The square sheet, and on it layers of some of its faces; every one of a material of its own.
    fn layered(on_it: &[[usize; 2]]) -> (Mesh, Vec<u32>) {
        let mut mesh = shapes::plane(8, 8);
        let wall = mesh.faces.clone();
        let mut of_face = vec![0; wall.len()];
        for (material, &[first, end]) in (1..).zip(on_it) {
            mesh.faces.extend_from_slice(&wall[first..end]);
            of_face.resize(mesh.faces.len(), material);
        }
        (mesh, of_face)
    }

    /// The topology of the mesh whose layers went apart; `None` where nothing lies on anything.
    fn apart(mut mesh: Mesh, of_face: &[u32]) -> Option<Topology> {
        let mut rings = Rings::new(&mesh.faces, mesh.positions.len());
        let before = mesh.clone();
        let was = separate(&mut mesh.faces, &mut rings, |f| of_face[f as usize])?;
        assert_eq!(rings, Rings::new(&mesh.faces, was.len()));
        let named: Vec<_> = mesh.faces.iter().map(|face| face.map(|v| was[v as usize])).collect();
        assert_eq!(named, before.faces);
        mesh.positions = was.iter().map(|&v| before.positions[v as usize]).collect();
        Some(topology(&mesh))
    }

    #[test]
    fn every_layer_is_a_surface_of_its_own() {
        // Two rows of squares have 20 border edges, four 24, all eight 32.
        for (on_it, parts, border_edges) in [
            (vec![[32, 64]], 2, 32 + 20),
            (vec![[32, 64], [80, 112], [0, 128]], 4, 2 * (32 + 20)),
            // Stripes that meet go on in each other, as two materials of a wall do.
            (vec![[32, 64], [64, 96]], 2, 32 + 24),
            (vec![[0, 128], [0, 128], [0, 128], [0, 128]], 5, 5 * 32),
        ] {
            let (mesh, of_face) = layered(&on_it);
            let found = apart(mesh, &of_face).expect("layers");
            assert!(found.is_manifold() && found.misoriented_edges == 0, "{on_it:?}: {found:?}");
            assert_eq!((found.components, found.border_edges), (parts, border_edges), "{on_it:?}");
        }
    }

    #[test]
    fn a_layer_that_ends_at_a_border_of_materials_does_not_hold_it() {
        // A wall of two materials, and a decal that covers one of them as far as the other.
        let (mesh, mut of_face) = layered(&[[0, 64]]);
        of_face[64..128].fill(9);
        let found = apart(mesh, &of_face).expect("layers");
        assert!(found.is_manifold(), "{found:?}");
        assert_eq!((found.components, found.border_edges), (2, 32 + 24));
    }

    #[test]
    fn a_layer_that_leaves_another_goes_on() {
        // A ball, and a coat over its upper half that stands off from it below.
        let ball = shapes::icosphere(3);
        let mut mesh = ball.clone();
        let is_high = |&&face: &&[u32; 3]| face.iter().all(|&v| ball.positions[v as usize].z >= 0.0);
        let (high, low): (Vec<[u32; 3]>, Vec<[u32; 3]>) = ball.faces.iter().partition(is_high);
        let outside = ball.positions.iter().map(|&p| if p.z < 0.0 { 1.1 * p } else { p });
        mesh.positions.extend(outside);
        let number = |v: u32| if ball.positions[v as usize].z < 0.0 { v + ball.positions.len() as u32 } else { v };
        mesh.faces.extend(high);
        mesh.faces.extend(low.into_iter().map(|face| face.map(number)));
        let of_face: Vec<u32> = (0..mesh.faces.len()).map(|f| u32::from(f >= ball.faces.len())).collect();
        let found = apart(mesh, &of_face).expect("layers");
        assert!(found.is_manifold(), "{found:?}");
        assert_eq!((found.components, found.border_edges), (2, 0));
    }

    #[test]
    fn what_lies_on_nothing_stays() {
        let (mesh, of_face) = layered(&[]);
        assert_eq!(apart(mesh, &of_face), None);
        // Front and back of two materials are no layers.
        let mut doubled = shapes::plane(2, 2);
        let back: Vec<_> = doubled.faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
        doubled.faces.extend(back);
        assert_eq!(apart(doubled, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1]), None);
        // Nor are faces of one: nothing tells which goes on in which.
        let (mesh, of_face) = layered(&[[0, 128]]);
        assert_eq!(apart(mesh, &vec![0; of_face.len()]), None);
    }
}
