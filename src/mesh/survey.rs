//! What stands in the way of reducing a mesh.

use rayon::prelude::*;
use serde::Serialize;

use super::adjacency::Rings;
use super::cut::cut;
use super::disjoint::DisjointSets;
use super::fan::{Fan, fans};
use super::layers::Layers;
use super::separate::separate;
use super::topology::{Components, Stars, Topology, topology_of};
use super::{Mesh, PARALLEL_ROWS, orient, take, weld};

/// What a reduction of a mesh will meet, after equal positions are joined and neighboring faces agree in orientation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// The topology after welding and orienting; layers of several materials that lie on each other are counted apart.
    pub topology: Topology,
    /// Vertices joined into another at the same position.
    pub joined_vertices: usize,
    /// Faces dropped because two of their corners fall together.
    pub degenerate_faces: usize,
    /// Faces dropped because a lower one of the same material has the same corners in the same sense.
    pub duplicate_faces: usize,
    /// Faces turned over to agree with their neighbors.
    pub turned_faces: usize,
    /// Vertices that stay where they are: ends of edges with three faces, more than four, or two that cannot agree, and rims where a
    /// sheet ends on its own back. Where the surface only touches itself it is cut apart.
    pub locked_vertices: usize,
    /// The parts, by number of faces, the largest first.
    pub parts: Vec<Part>,
    /// The fewest faces that a reduction which keeps the topology can reach: the sum over the parts. A lower bound.
    pub floor_faces: usize,
    /// What makes the floor as high as it is, in words, the largest share first.
    pub reasons: Vec<String>,
}

/// One part of a mesh, connected over vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Part {
    /// Its faces.
    pub faces: usize,
    /// Its vertices.
    pub vertices: usize,
    /// Its vertices − edges + faces.
    pub euler: i64,
    /// Its border loops.
    pub border_loops: usize,
    /// Its vertices that stay where they are.
    pub locked_vertices: usize,
    /// Its faces between three locked vertices.
    pub locked_faces: usize,
    /// The fewest faces it can be reduced to.
    pub floor_faces: usize,
}

impl Part {
    /// The handles of a part without locked vertices.
    fn genus(&self) -> Option<i64> {
        (self.locked_vertices == 0).then_some((2 - self.euler - self.border_loops as i64) / 2)
    }

    fn floor(&self) -> usize {
        let Some(genus) = self.genus() else { return self.locked_faces.max(1).min(self.faces) };
        let loops = self.border_loops as i64;
        // Euler's formula leaves 5b − 4 + 4g faces where every vertex is on one of b borders of three edges. And triangles on
        // the borders of a part with handles would close it, so it has at most b faces less than a closed one.
        let on_borders = 5 * loops - 4 + 4 * genus;
        let least = match (loops, genus) {
            (0, _) => fewest_closed(genus),
            (_, 0) => on_borders,
            _ => on_borders.max(fewest_closed(genus) - loops),
        };
        (least.max(1) as usize).min(self.faces)
    }
}

/// The faces of the smallest triangulation of a closed surface of this genus (Jungerman and Ringel 1980).
fn fewest_closed(genus: i64) -> i64 {
    let vertices = match genus {
        0 => 4,
        // The one exception among the orientable surfaces.
        2 => 10,
        _ => ((7.0 + (1.0 + 48.0 * genus as f64).sqrt()) / 2.0).ceil() as i64,
    };
    2 * (vertices - 2 + 2 * genus)
}

/// Looks for what blocks the reduction of `mesh`.
pub fn survey(mesh: &Mesh) -> Survey {
    let welded = weld(mesh, 0.0);
    let mut mesh = welded.mesh;
    let mut rings = Rings::new(&mesh.faces, mesh.positions.len());
    let layers = Layers::new(mesh.materials.as_ref());
    if mesh.materials.is_some()
        && let Some(was) = separate(&mut mesh.faces, &mut rings, |f| layers.of(f))
    {
        mesh.positions = take(&mesh.positions, &was);
    }
    let mut turned_faces = 0;
    if let Some(turned) = orient(&mesh.faces, &rings) {
        for (face, _) in mesh.faces.iter_mut().zip(&turned).filter(|(_, turn)| **turn) {
            face.swap(1, 2);
            turned_faces += 1;
        }
    }
    let topology = topology_of(&mesh, &rings);
    let mut fans = fans(&mesh.faces, &rings);
    let Mesh { positions, faces, .. } = &mut mesh;
    if let Some(was) = cut(faces, &mut rings, &mut fans, |v| positions[v as usize]) {
        *positions = take(positions, &was);
    }
    let locked: Vec<bool> = fans.into_iter().map(|fan| fan == Fan::Complex).collect();
    let mut parts = parts(&mesh, &rings, &locked);
    parts.sort_by_key(|part| std::cmp::Reverse(part.faces));
    Survey {
        topology,
        joined_vertices: welded.joined_vertices,
        degenerate_faces: welded.degenerate_faces,
        duplicate_faces: welded.duplicate_faces,
        turned_faces,
        locked_vertices: locked.iter().filter(|&&locked| locked).count(),
        floor_faces: parts.iter().map(|part| part.floor_faces).sum(),
        reasons: reasons(&parts),
        parts,
    }
}

/// The parts in order of their lowest vertex.
fn parts(mesh: &Mesh, rings: &Rings, locked: &[bool]) -> Vec<Part> {
    let components = Components::new(&mesh.faces, mesh.positions.len());
    let mut parts = vec![Part::default(); components.count];
    let part_of = |v: u32| components.of_vertex[v as usize] as usize;
    for face in &mesh.faces {
        let part = &mut parts[part_of(face[0])];
        part.faces += 1;
        part.euler += 1;
        part.locked_faces += usize::from(face.iter().all(|&v| locked[v as usize]));
    }
    let edge_counts: Vec<i64> = (0..mesh.positions.len() as u32)
        .into_par_iter()
        .with_min_len(PARALLEL_ROWS)
        .map_init(Vec::new, |scratch, v| rings.edges_from(&mesh.faces, v, scratch).count() as i64)
        .collect();
    for v in 0..mesh.positions.len() as u32 {
        let part = &mut parts[part_of(v)];
        part.vertices += 1;
        part.euler += 1 - edge_counts[v as usize];
        part.locked_vertices += usize::from(locked[v as usize]);
    }
    let mut borders = DisjointSets::new(mesh.positions.len());
    // Every join of a loop but the last connects two sets, so a loop is an edge that connects none.
    for [a, b] in Stars::count(&mesh.faces, rings).border {
        if !borders.join(a, b) {
            parts[part_of(a)].border_loops += 1;
        }
    }
    for part in &mut parts {
        part.floor_faces = part.floor();
    }
    parts
}

fn reasons(parts: &[Part]) -> Vec<String> {
    let share = |of: &dyn Fn(&Part) -> bool| {
        let chosen: Vec<&Part> = parts.iter().filter(|part| of(part)).collect();
        (chosen.len(), chosen.iter().map(|part| part.floor_faces).sum::<usize>(), chosen)
    };
    let mut reasons = Vec::new();
    let mut add = |count: usize, faces: usize, text: String| {
        if count > 0 {
            reasons.push((faces, text));
        }
    };
    let plural = |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });

    let (count, faces, _) = share(&|p| p.genus() == Some(0) && p.border_loops == 0);
    add(count, faces, format!("{} without handles: 4 faces each", plural(count, "closed part")));
    let (count, faces, chosen) = share(&|p| p.genus().is_some_and(|genus| genus > 0));
    let handles: i64 = chosen.iter().filter_map(|part| part.genus()).sum();
    add(
        count,
        faces,
        format!("{} with {}: {}", plural(count, "part"), plural(handles as usize, "handle"), plural(faces, "face")),
    );
    let (count, faces, chosen) = share(&|p| p.genus() == Some(0) && p.border_loops > 0);
    let loops: usize = chosen.iter().map(|part| part.border_loops).sum();
    add(
        count,
        faces,
        format!("{} with {}: {}", plural(count, "open part"), plural(loops, "border loop"), plural(faces, "face")),
    );
    let (count, faces, chosen) = share(&|p| p.genus().is_none());
    let locked: usize = chosen.iter().map(|part| part.locked_vertices).sum();
    add(
        count,
        faces,
        format!(
            "{} held where the surface is not manifold or not orientable, in {}: {}",
            if locked == 1 { "1 vertex".into() } else { format!("{locked} vertices") },
            plural(count, "part"),
            plural(faces, "face")
        ),
    );
    reasons.sort_by_key(|(faces, _)| std::cmp::Reverse(*faces));
    reasons.into_iter().map(|(_, text)| text).collect()
}

#[cfg(test)]
mod tests {
    use super::super::shapes::*;
    use super::*;
    use crate::math::DVec3;

    fn beside(meshes: &[Mesh]) -> Mesh {
        let mut all = Mesh::default();
        for (i, mesh) in meshes.iter().enumerate() {
            let first = all.positions.len() as u32;
            all.positions.extend(mesh.positions.iter().map(|&p| p + DVec3::X * 100.0 * i as f64));
            all.faces.extend(mesh.faces.iter().map(|face| face.map(|v| v + first)));
        }
        all
    }

    #[test]
    fn the_floor_of_known_surfaces() {
        let floors = [icosphere(2), torus(9, 7), double_torus(), plane(4, 4), tube(9), moebius(9), fan3(), bow_tie()]
            .map(|mesh| survey(&mesh).floor_faces);
        assert_eq!(floors, [4, 14, 24, 1, 6, 1, 1, 2]);
    }

    #[test]
    fn parts_are_sorted_and_summed() {
        let survey = survey(&beside(&[tetrahedron(), torus(5, 4), plane(1, 1), icosphere(1)]));
        assert_eq!(survey.parts.iter().map(|part| part.faces).collect::<Vec<_>>(), [80, 40, 4, 2]);
        assert_eq!(survey.parts.iter().map(|part| part.euler).collect::<Vec<_>>(), [2, 0, 2, 1]);
        assert_eq!(survey.floor_faces, 4 + 14 + 4 + 1);
        let reasons = [
            "1 part with 1 handle: 14 faces",
            "2 closed parts without handles: 4 faces each",
            "1 open part with 1 border loop: 1 face",
        ];
        assert_eq!(survey.reasons, reasons);
    }

    #[test]
    fn a_soup_is_welded_and_oriented_first() {
        let ball = icosphere(1);
        let mut soup = Mesh::default();
        for (i, face) in (0..).zip(&ball.faces) {
            soup.positions.extend(face.map(|v| ball.positions[v as usize]));
            soup.faces.push(if i % 5 == 0 { [3 * i, 3 * i + 2, 3 * i + 1] } else { [3 * i, 3 * i + 1, 3 * i + 2] });
        }
        let survey = survey(&soup);
        assert_eq!((survey.joined_vertices, survey.turned_faces, survey.locked_vertices), (240 - 42, 16, 0));
        assert_eq!((survey.topology.genus, survey.floor_faces), (Some(0), 4));
    }

    #[test]
    fn nothing_has_no_floor() {
        let survey = survey(&Mesh::default());
        assert_eq!((survey.floor_faces, survey.reasons.len()), (0, 0));
    }
}
