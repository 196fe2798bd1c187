//! The parts of a mesh: how large they are, which of them are small.

use rayon::prelude::*;

use super::topology::Components;
use super::weld::{lowest_within, weld};
use super::{Mesh, PARALLEL_ROWS, diagonal_between};
use crate::math::DVec3;

/// Parts connected over places, in order of their lowest vertex.
#[derive(Debug)]
pub(crate) struct Parts {
    found: Components,
    /// The diagonals of their bounding boxes.
    pub sizes: Vec<f64>,
    /// Of the box around all of them: what no face stands on counts for nothing.
    pub diagonal: f64,
}

/// Which of them are small.
#[derive(Debug, Clone)]
pub(crate) struct Small {
    /// Which vertices, of those that others are joined into.
    pub vertices: Vec<bool>,
    /// How many parts.
    pub parts: usize,
}

impl Parts {
    /// Of a mesh as it is once its vertices are joined within `tolerance`, in model units, without joining them.
    pub fn of(mesh: &Mesh, tolerance: f64) -> Self {
        let lowest = lowest_within(&mesh.positions, tolerance);
        let joined = |face: &[u32; 3]| face.map(|v| lowest[v as usize]);
        let faces: Vec<[u32; 3]> = mesh.faces.par_iter().with_min_len(PARALLEL_ROWS).map(joined).collect();
        Self::of_joined(&faces, &mesh.positions)
    }

    /// Of faces whose vertices are joined.
    pub fn of_joined(faces: &[[u32; 3]], positions: &[DVec3]) -> Self {
        let found = Components::new(faces, positions.len());
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); found.count];
        for (&part, &p) in found.of_vertex.iter().zip(positions) {
            if let Some((low, high)) = boxes.get_mut(part as usize) {
                (*low, *high) = (low.min(p), high.max(p));
            }
        }
        let around = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let diagonal = around.map_or(0.0, |(low, high)| diagonal_between(low, high));
        let sizes = boxes.into_iter().map(|(low, high)| (high - low).length()).collect();
        Self { found, sizes, diagonal }
    }

    /// Whether each is below a `fraction` of the diagonal of all.
    pub fn are_small(&self, fraction: f64) -> Vec<bool> {
        let least = fraction * self.diagonal;
        self.sizes.iter().map(|&size| size < least).collect()
    }

    /// Those that [`prune`](super::prune::prune) drops of the welded mesh.
    pub fn small(&self, fraction: f64) -> Small {
        let are_small = self.are_small(fraction);
        let vertices = self.found.of_vertex.iter().map(|&part| are_small.get(part as usize) == Some(&true)).collect();
        Small { vertices, parts: are_small.into_iter().filter(|&is_small| is_small).count() }
    }

    /// The part of every vertex; `u32::MAX` for those without a face.
    pub fn of_vertex(&self) -> &[u32] {
        &self.found.of_vertex
    }
}

/// How many faces each part of a mesh has once equal positions are joined, those of the smallest first.
pub(crate) fn faces_by_size(mesh: &Mesh) -> Vec<usize> {
    let mesh = weld(mesh, 0.0).mesh;
    let parts = Parts::of_joined(&mesh.faces, &mesh.positions);
    let mut by_size: Vec<(f64, usize)> = parts.sizes.iter().map(|&size| (size, 0)).collect();
    for face in &mesh.faces {
        by_size[parts.of_vertex()[face[0] as usize] as usize].1 += 1;
    }
    by_size.sort_by(|a, b| a.0.total_cmp(&b.0));
    by_size.into_iter().map(|(_, faces)| faces).collect()
}

#[cfg(test)]
mod tests {
    use super::super::prune::prune;
    use super::super::shapes;
    use super::super::weld::weld;
    use super::*;

    /// As they come, and with faces that share no vertex until they are welded, exactly or within a distance; with
    /// degenerate faces, between the parts and far away.
    #[test]
    fn what_is_found_to_be_small_is_what_goes() {
        let whole = shapes::large_and_small();
        let mut apart = Mesh::default();
        for (f, face) in whole.faces.iter().enumerate() {
            apart.faces.push([0, 1, 2].map(|k| 3 * f as u32 + k));
            apart.positions.extend(face.map(|v| whole.positions[v as usize]));
        }
        let mut beside = apart.clone();
        beside.positions.iter_mut().enumerate().for_each(|(v, p)| p.x += 1e-6 * (v % 7) as f64);
        let mut with_degenerate = whole.clone();
        let far = with_degenerate.positions.len() as u32;
        with_degenerate.positions.extend([DVec3::splat(50.0), DVec3::splat(60.0)]);
        with_degenerate.faces.extend([[0, 0, 20], [far, far + 1, far]]);
        for (mesh, tolerance) in [(whole, 0.0), (apart, 0.0), (beside, 1e-5), (with_degenerate, 0.0)] {
            let parts = Parts::of(&mesh, tolerance);
            let small = parts.small(0.2);
            let mut welded = weld(&mesh, tolerance);
            assert_eq!((parts.sizes.len(), parts.diagonal), (2, welded.mesh.diagonal()));
            let all = welded.vertex_source.clone();
            assert_eq!((prune(&mut welded, 0.2), small.parts), (1, 1));
            let stay: Vec<u32> = all.into_iter().filter(|&v| !small.vertices[v as usize]).collect();
            assert!(stay == welded.vertex_source && stay.len() == 12);
        }
        assert_eq!(faces_by_size(&shapes::large_and_small()), [20, 20]);
        let none = Parts::of(&Mesh::default(), 0.0);
        assert_eq!((none.sizes.len(), none.diagonal, none.small(1.0).parts), (0, 0.0, 0));
    }
}
