//! Holes of a surface, where a scanner saw nothing, and faces that close them.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::Mesh;
use super::adjacency::{Rings, corner_of};
use super::dynamic::best_triangles;
use super::fan::{Fan, VERTICES_EACH};
use crate::math::DVec3;

/// A corner of a face, 3·face + corner.
pub type Corner = u32;

/// The most sides that a hole may have to be closed: what decides on the faces takes as long as the third power of them.
const MOST_SIDES: usize = 64;
/// No side.
const NONE: Corner = Corner::MAX;

/// A loop of border edges at whose vertices the surface is one fan: a hole, or what a part ends at.
#[derive(Debug, Clone, PartialEq)]
pub struct Hole {
    /// Its edges, each by the corner of its face that it leads away from, along the faces.
    pub sides: Vec<Corner>,
    /// The diagonal of its bounding box.
    pub size: f64,
}

/// The holes of oriented faces with such fans, one after the other along the borders. `place` numbers where vertices are: what
/// touches itself there is several holes.
pub fn find(faces: &[[u32; 3]], rings: &Rings, fans: &[Fan], place: &[u32], at: impl Fn(u32) -> DVec3) -> Vec<Hole> {
    let exit = |(vertex, &fan): (usize, &Fan)| {
        if fan == Fan::Open { exit(faces, rings.ring(vertex as u32), vertex as u32) } else { NONE }
    };
    let mut exits: Vec<Corner> = fans.par_iter().enumerate().with_min_len(VERTICES_EACH).map(exit).collect();
    let vertex_at = |side: Corner| faces.as_flattened()[side as usize];
    let place_at = |side: Corner| place[vertex_at(side) as usize] as usize;
    // Which of the sides that were passed leads away from a place.
    let mut passed = vec![NONE; place.iter().max().map_or(0, |&last| last as usize + 1)];
    let (mut sides, mut holes): (Vec<Corner>, Vec<Hole>) = (Vec::new(), Vec::new());
    for first in 0..exits.len() {
        let mut vertex = first;
        loop {
            let before = std::mem::replace(&mut passed[place[vertex] as usize], NONE);
            if before != NONE {
                let sides: Vec<Corner> = sides.drain(before as usize..).collect();
                sides.iter().for_each(|&side| passed[place_at(side)] = NONE);
                let box_of = |(low, high): (DVec3, DVec3), p: DVec3| (low.min(p), high.max(p));
                let points = sides.iter().map(|&side| at(vertex_at(side)));
                let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), box_of);
                holes.push(Hole { sides, size: (high - low).length() });
            }
            // One that is not one fan ends the way, and so does one that was passed before.
            let side = std::mem::replace(&mut exits[vertex], NONE);
            if side == NONE {
                break;
            }
            passed[place[vertex] as usize] = sides.len() as u32;
            sides.push(side);
            vertex = vertex_at(next(side)) as usize;
        }
        sides.drain(..).for_each(|side| passed[place_at(side)] = NONE);
    }
    holes
}

/// The corner of the face of an open fan from which its border edge leads away from the vertex.
fn exit(faces: &[[u32; 3]], ring: &[u32], vertex: u32) -> Corner {
    let spokes = || {
        ring.iter().map(|&f| {
            let corners = faces[f as usize];
            let corner = corner_of(corners, vertex);
            (3 * f + corner as u32, corners[(corner + 1) % 3], corners[(corner + 2) % 3])
        })
    };
    // Sorted, for a fan may have a million faces.
    let mut entered: Vec<u32> = spokes().map(|(_, _, last)| last).collect();
    entered.sort_unstable();
    let found = spokes().find(|(_, next, _)| entered.binary_search(next).is_err());
    found.map_or(NONE, |(corner, ..)| corner)
}

/// The face of a corner, and which of its corners it is.
pub fn face_of(corner: Corner) -> (usize, usize) {
    (corner as usize / 3, corner as usize % 3)
}

/// The corner of the same face after one.
pub fn next(corner: Corner) -> Corner {
    corner - corner % 3 + (corner + 1) % 3
}

impl Hole {
    /// Whether it has as many sides as can be closed.
    pub fn has_few_sides(&self) -> bool {
        (3..=MOST_SIDES).contains(&self.sides.len())
    }

    /// How the surface goes on across it: the mean cosine between the normal of what would close it and those of the faces beside it, 1
    /// in a plane, 0 at the end of a tube.
    pub fn flatness(&self, faces: &[[u32; 3]], at: impl Fn(u32) -> DVec3) -> f64 {
        let corners = |side: Corner| {
            let (face, corner) = face_of(side);
            [0, 1, 2].map(|k| at(faces[face][(corner + k) % 3]))
        };
        let origin = self.sides.first().map_or(DVec3::ZERO, |&side| corners(side)[0]);
        // Those of what closes it run the other way.
        let spanned = |sum: DVec3, &side: &Corner| {
            let [a, b, _] = corners(side);
            sum + (b - origin).cross(a - origin)
        };
        let normal = self.sides.iter().fold(DVec3::ZERO, spanned).normalize_or_zero();
        let cosine = |&side: &Corner| {
            let [a, b, c] = corners(side);
            (b - a).cross(c - a).normalize_or_zero().dot(normal)
        };
        self.sides.iter().map(cosine).sum::<f64>() / self.sides.len().max(1) as f64
    }

    /// The corners of faces that close it, each of one of its sides: of all choices the one with the least area. None where it has too
    /// many sides, where one of them has another face elsewhere, or where every choice would put a new edge where one is already.
    ///
    /// `faces` and `rings` are those of places, so that what only was cut apart counts; the new edges are `taken` from then on.
    pub fn close(
        &self,
        faces: &[[u32; 3]],
        rings: &Rings,
        taken: &mut FxHashSet<[u32; 2]>,
        at: impl Fn(Corner) -> DVec3,
    ) -> Vec<[Corner; 3]> {
        // The other way around than the faces beside it.
        let corners: Vec<Corner> = self.sides.iter().rev().copied().collect();
        let places: Vec<u32> = corners.iter().map(|&corner| faces.as_flattened()[corner as usize]).collect();
        let faces_with = |i: usize, j: usize| rings.faces_of_edge(faces, places[i], places[j]).count();
        let count = corners.len();
        if !self.has_few_sides() || (0..count).any(|i| faces_with(i, (i + 1) % count) != 1) {
            return Vec::new();
        }
        // Of three sides the one face that all have would be there twice.
        if count == 3 && corners.iter().all(|&corner| face_of(corner).0 == face_of(corners[0]).0) {
            return Vec::new();
        }
        let edge = |i: usize, j: usize| [places[i].min(places[j]), places[i].max(places[j])];
        let points: Vec<DVec3> = corners.iter().map(|&corner| at(corner)).collect();
        let area = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(points[c] - points[a]).length();
        let found = best_triangles(
            count,
            |_| 0.0,
            |i, j| faces_with(i, j) == 0 && !taken.contains(&edge(i, j)),
            |triangle, [first, second]: [f64; 2]| Some(first + second + area(triangle)),
            |sum, best| best.is_none_or(|best| sum < best),
        );
        let triangles = found.map(|(triangles, _)| triangles).unwrap_or_default();
        taken.extend(triangles.iter().flat_map(|&[i, tip, j]| [edge(i, tip), edge(tip, j), edge(i, j)]));
        triangles.into_iter().map(|triangle| triangle.map(|i| corners[i])).collect()
    }
}

/// A mesh with further faces after its own, each of corners that there are: of their vertices and texture coordinates, and of the
/// color and material of the first one's face.
pub fn with_faces(mesh: &Mesh, added: &[[Corner; 3]]) -> Mesh {
    let mut closed = mesh.clone();
    let first_faces = || added.iter().map(|&[first, ..]| face_of(first).0);
    closed.faces.extend(added.iter().map(|corners| corners.map(|corner| mesh.faces.as_flattened()[corner as usize])));
    if let (Some(rows), Some(given)) = (&mut closed.texcoords, &mesh.texcoords) {
        rows.extend(added.iter().map(|corners| corners.map(|corner| given.as_flattened()[corner as usize])));
    }
    if let (Some(rows), Some(given)) = (&mut closed.face_colors, &mesh.face_colors) {
        rows.extend(first_faces().map(|face| given[face]));
    }
    if let (Some(materials), Some(given)) = (&mut closed.materials, &mesh.materials) {
        materials.of_face.extend(first_faces().map(|face| given.of_face[face]));
    }
    closed
}

#[cfg(test)]
mod tests {
    use super::super::fan::fans;
    use super::super::topology::topology;
    use super::super::{Materials, shapes};
    use super::*;
    use crate::math::Vec2;

    /// The holes of a mesh as it is, and the faces that close each.
    fn holes(mesh: &Mesh) -> Vec<(Hole, Vec<[Corner; 3]>)> {
        let rings = Rings::new(&mesh.faces, mesh.positions.len());
        let place: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let at = |v: u32| mesh.positions[v as usize];
        let found = find(&mesh.faces, &rings, &fans(&mesh.faces, &rings), &place, at);
        let mut taken = FxHashSet::default();
        let corner = |corner: Corner| at(mesh.faces.as_flattened()[corner as usize]);
        found.into_iter().map(|hole| (hole.clone(), hole.close(&mesh.faces, &rings, &mut taken, corner))).collect()
    }

    fn flatness(mesh: &Mesh, hole: &Hole) -> f64 {
        hole.flatness(&mesh.faces, |v| mesh.positions[v as usize])
    }

    #[test]
    fn closed_holes_leave_the_surface_that_was_there() {
        let whole = shapes::icosphere(3);
        let mut mesh = whole.clone();
        // A face, the faces around a vertex, and far from both two that share an edge.
        let shares_edge = |f: usize| whole.faces[f].iter().filter(|v| whole.faces[700].contains(v)).count() == 2;
        let pair = [700, (0..whole.faces.len()).find(|&f| shares_edge(f)).expect("a neighbor")];
        let around = mesh.faces[300][0];
        let mut number = 0;
        mesh.faces.retain(|face| {
            number += 1;
            number != 1 && !pair.contains(&(number - 1)) && !face.contains(&around)
        });
        let found = holes(&mesh);
        let mut sides: Vec<usize> = found.iter().map(|(hole, _)| hole.sides.len()).collect();
        sides.sort_unstable();
        assert_eq!(sides, [3, 4, 6]);
        for (hole, faces) in &found {
            assert_eq!(faces.len(), hole.sides.len() - 2);
            let flatness = flatness(&mesh, hole);
            assert!((0.9..1.0).contains(&flatness), "{flatness}");
            assert!((0.1..0.5).contains(&hole.size), "{}", hole.size);
        }
        let added: Vec<[Corner; 3]> = found.into_iter().flat_map(|(_, faces)| faces).collect();
        let closed = topology(&with_faces(&mesh, &added));
        let is_closed = closed.is_closed() && closed.is_manifold() && closed.misoriented_edges == 0;
        // One vertex fewer, which lost its faces.
        assert!(is_closed && closed.faces == whole.faces.len() - 2 && closed.genus == Some(0), "{closed:?}");
    }

    #[test]
    fn outlines_and_the_ends_of_tubes_are_told_apart() {
        let plane = shapes::plane(6, 6);
        let found = holes(&plane);
        assert_eq!((found.len(), found[0].0.sides.len()), (1, 24));
        assert!((flatness(&plane, &found[0].0) + 1.0).abs() < 1e-9);
        let tube = shapes::tube(24);
        let found = holes(&tube);
        assert_eq!(found.iter().map(|(hole, _)| hole.sides.len()).collect::<Vec<_>>(), [24, 24]);
        assert!(found.iter().all(|(hole, _)| flatness(&tube, hole).abs() < 1e-9));
    }

    /// Two holes of a plane that touch in a vertex: one loop around both would close it across.
    #[test]
    fn holes_that_touch_are_several() {
        let mut mesh = shapes::plane(5, 5);
        let corners = |face: &[u32; 3]| face.map(|v| (v % 6, v / 6));
        let is_within = |face: &[u32; 3], (x, y): (u32, u32)| {
            corners(face).iter().all(|&(cx, cy)| (x..=x + 1).contains(&cx) && (y..=y + 1).contains(&cy))
        };
        mesh.faces.retain(|face| !is_within(face, (1, 1)) && !is_within(face, (2, 2)));
        let rings = Rings::new(&mesh.faces, mesh.positions.len());
        // Cut apart there, as a run begins.
        let touching = fans(&mesh.faces, &rings).iter().position(|&fan| fan == Fan::Complex).expect("a vertex of both");
        let (mut place, mut faces) = ((0..mesh.positions.len() as u32).collect::<Vec<_>>(), mesh.faces.clone());
        let is_lower = |face: &[u32; 3]| face.iter().map(|&v| v / 6 + 6 - v % 6).sum::<u32>() > 18;
        for face in faces.iter_mut().filter(|face| is_lower(face)) {
            face.iter_mut().filter(|v| **v == touching as u32).for_each(|v| *v = place.len() as u32);
        }
        place.push(touching as u32);
        let at = |v: u32| mesh.positions[place[v as usize] as usize];
        let rings = Rings::new(&faces, place.len());
        let fans = fans(&faces, &rings);
        assert!(fans[touching] == Fan::Open && fans[place.len() - 1] == Fan::Open);
        let found = find(&faces, &rings, &fans, &place, at);
        let mut sides: Vec<usize> = found.iter().map(|hole| hole.sides.len()).collect();
        sides.sort_unstable();
        assert_eq!(sides, [4, 4, 20]);
        let (whole, mut taken) = (Rings::new(&mesh.faces, mesh.positions.len()), FxHashSet::default());
        let corner = |corner: Corner| at(faces.as_flattened()[corner as usize]);
        let small = found.iter().filter(|hole| hole.sides.len() == 4);
        let added: Vec<[Corner; 3]> =
            small.flat_map(|hole| hole.close(&mesh.faces, &whole, &mut taken, corner)).collect();
        let closed = topology(&with_faces(&mesh, &added));
        assert!(closed.is_manifold() && closed.border_loops == 1 && closed.faces == 50, "{closed:?}");
    }

    #[test]
    fn no_new_edge_is_where_one_is() {
        // The other side of two faces takes the other diagonal, or it would lie on them.
        let mut mesh = shapes::plane(1, 1);
        mesh.positions[3].z = 0.5;
        let found = holes(&mesh);
        assert_eq!((found.len(), found[0].1.len()), (1, 2));
        let closed = topology(&with_faces(&mesh, &found[0].1));
        assert!(closed.is_closed() && closed.is_manifold() && closed.edges == 6, "{closed:?}");
        // Nor where another hole has put one.
        let rings = Rings::new(&mesh.faces, 4);
        let (mut taken, corner) = (FxHashSet::from_iter([[1, 2], [0, 3]]), |corner: Corner| {
            mesh.positions[mesh.faces.as_flattened()[corner as usize] as usize]
        });
        assert!(found[0].0.close(&mesh.faces, &rings, &mut taken, corner).is_empty());
        // A face alone has no other side.
        let alone = Mesh::new(vec![DVec3::ZERO; 3], vec![[0, 1, 2]]);
        assert!(matches!(&holes(&alone)[..], [(hole, faces)] if hole.sides.len() == 3 && faces.is_empty()));
        // Too many sides.
        assert!(holes(&shapes::plane(17, 17))[0].1.is_empty());
    }

    #[test]
    fn new_faces_have_what_those_beside_them_have() {
        let mut mesh = shapes::plane(2, 2);
        let count = mesh.faces.len();
        mesh.texcoords = Some((0..count).map(|f| [0, 1, 2].map(|k| Vec2::new(f as f32, k as f32))).collect());
        mesh.face_colors = Some((0..count).map(|f| [f as f32; 4]).collect());
        let of_face = (0..count as u32).collect();
        mesh.materials = Some(Materials { of_face, names: vec![String::new(); count] });
        let closed = with_faces(&mesh, &[[3 * 5 + 1, 3 * 2, 3 * 4 + 2]]);
        closed.check().expect("a valid mesh");
        assert_eq!(closed.faces[count], [mesh.faces[5][1], mesh.faces[2][0], mesh.faces[4][2]]);
        let texcoords = closed.texcoords.expect("texture coordinates")[count];
        assert_eq!(texcoords, [Vec2::new(5.0, 1.0), Vec2::new(2.0, 0.0), Vec2::new(4.0, 2.0)]);
        assert_eq!(closed.face_colors.expect("colors")[count], [5.0; 4]);
        assert_eq!(closed.materials.expect("materials").of_face[count], 5);
    }
}
