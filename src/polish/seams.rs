//! What flips may not cross: seams of the texture, borders of materials, vertices that stand at one place.

use crate::math::Vec2;
use crate::mesh::weld::lowest_at_position;
use crate::mesh::{Mesh, Rings};

/// The texture at the corners of a mesh whose edges turn.
#[derive(Debug)]
pub struct Seams {
    pub texcoords: Option<Vec<[Vec2; 3]>>,
    /// Of every vertex, whether it lies on one, or is not alone at its place.
    on_seam: Vec<bool>,
}

impl Seams {
    /// Those of a mesh.
    pub fn new(mesh: &Mesh, rings: &Rings) -> Self {
        let lowest = lowest_at_position(&mesh.positions);
        let mut on_seam: Vec<bool> = (0..).zip(&lowest).map(|(v, &lowest): (u32, _)| v != lowest).collect();
        lowest
            .iter()
            .enumerate()
            .filter(|(v, lowest)| *v != **lowest as usize)
            .for_each(|(_, &v)| on_seam[v as usize] = true);
        let at = |v: u32, f: u32| {
            let k = mesh.faces[f as usize].iter().position(|&w| w == v).unwrap_or(0);
            let uv = mesh.texcoords.as_ref().map(|rows| rows[f as usize][k].to_array().map(f32::to_bits));
            (uv, mesh.materials.as_ref().map(|materials| materials.of_face[f as usize]))
        };
        for (v, on_seam) in (0..).zip(&mut on_seam) {
            let ring = rings.ring(v);
            *on_seam |=
                ring.split_first().is_some_and(|(&first, others)| others.iter().any(|&f| at(v, f) != at(v, first)));
        }
        Self { texcoords: mesh.texcoords.clone(), on_seam }
    }

    /// Whether the edge from `u` to `v` of the faces `f` and `g` may give way to that between their other corners `k` and `l`.
    pub fn allow(&self, [u, v, k, l]: [u32; 4], [f, g]: [u32; 2], faces: &[[u32; 3]]) -> bool {
        let crosses = |a: u32, b: u32| self.on_seam[a as usize] && self.on_seam[b as usize];
        if crosses(u, v) || crosses(k, l) {
            return false;
        }
        let Some(rows) = &self.texcoords else { return true };
        let [at_u, at_v, at_k, at_l] = Self::corners(rows, [u, v, k, l], [f, g], faces);
        let area = |a: Vec2, b: Vec2, c: Vec2| (b - a).as_dvec2().perp_dot((c - a).as_dvec2());
        let before = [area(at_u, at_v, at_k), area(at_v, at_u, at_l)];
        let after = [area(at_u, at_l, at_k), area(at_l, at_v, at_k)];
        before.iter().chain(&after).all(|area| *area > 0.0) || before.iter().chain(&after).all(|area| *area < 0.0)
    }

    /// Turns the texture along with the edge.
    pub fn turn(&mut self, corners: [u32; 4], [f, g]: [u32; 2], faces: &[[u32; 3]]) {
        if let Some(rows) = &mut self.texcoords {
            let [u, v, k, l] = Self::corners(rows, corners, [f, g], faces);
            (rows[f as usize], rows[g as usize]) = ([u, l, k], [l, v, k]);
        }
    }

    /// The coordinates of the corners of two faces side by side.
    fn corners(rows: &[[Vec2; 3]], [u, v, k, l]: [u32; 4], [f, g]: [u32; 2], faces: &[[u32; 3]]) -> [Vec2; 4] {
        let at = |face: u32, vertex: u32| {
            let k = faces[face as usize].iter().position(|&w| w == vertex).unwrap_or(0);
            rows[face as usize][k]
        };
        [at(f, u), at(f, v), at(f, k), at(g, l)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn edges_turn_within_a_chart_alone() {
        let mut mesh = shapes::plane(1, 1);
        let place = |v: u32| mesh.positions[v as usize].truncate().as_vec2();
        mesh.texcoords = Some(mesh.faces.iter().map(|face| face.map(place)).collect());
        let seams = |mesh: &Mesh| Seams::new(mesh, &Rings::new(&mesh.faces, 4));
        let [f, g] = [mesh.faces[0], mesh.faces[1]];
        let shared: Vec<u32> = f.into_iter().filter(|v| g.contains(v)).collect();
        let k = f.into_iter().find(|v| !g.contains(v)).expect("a corner");
        let l = g.into_iter().find(|v| !f.contains(v)).expect("a corner");
        let at = f.iter().position(|&v| v == k).expect("a corner");
        let (u, v) = (f[(at + 1) % 3], f[(at + 2) % 3]);
        assert!(shared.contains(&u) && shared.contains(&v));
        let mut whole = seams(&mesh);
        assert!(whole.allow([u, v, k, l], [0, 1], &mesh.faces));
        whole.turn([u, v, k, l], [0, 1], &mesh.faces);
        assert_eq!(whole.texcoords.expect("a texture"), [[u, l, k].map(place), [l, v, k].map(place)]);
        let torn = mesh.texcoords.as_mut().expect("a texture");
        torn[1].iter_mut().for_each(|uv| uv.x += 2.0);
        assert!(!seams(&mesh).allow([u, v, k, l], [0, 1], &mesh.faces));
    }
}
