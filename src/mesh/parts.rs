//! The parts of a mesh as they are once its vertices are joined, found without joining them.

use rayon::prelude::*;

use super::topology::Components;
use super::weld::lowest_within;
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
    /// Of a mesh whose vertices are joined within `tolerance`, in model units.
    pub fn of(mesh: &Mesh, tolerance: f64) -> Self {
        let lowest = lowest_within(&mesh.positions, tolerance);
        let joined = |face: &[u32; 3]| face.map(|v| lowest[v as usize]);
        let faces: Vec<[u32; 3]> = mesh.faces.par_iter().with_min_len(PARALLEL_ROWS).map(joined).collect();
        let found = Components::new(&faces, mesh.positions.len());
        let boxes = boxes(&found, &mesh.positions);
        let around = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let diagonal = around.map_or(0.0, |(low, high)| diagonal_between(low, high));
        let sizes = boxes.into_iter().map(|(low, high)| (high - low).length()).collect();
        Self { found, sizes, diagonal }
    }

    /// Those below a `fraction` of the diagonal of all, which [`prune`](super::prune::prune) drops of the welded mesh.
    pub fn small(&self, fraction: f64) -> Small {
        let least = fraction * self.diagonal;
        let is_small = |&part: &u32| self.sizes.get(part as usize).is_some_and(|&size| size < least);
        let parts = self.sizes.iter().filter(|&&size| size < least).count();
        Small { vertices: self.found.of_vertex.iter().map(is_small).collect(), parts }
    }
}

/// The lower and the upper corner of the box around each part.
pub(crate) fn boxes(parts: &Components, positions: &[DVec3]) -> Vec<(DVec3, DVec3)> {
    let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); parts.count];
    for (&part, &p) in parts.of_vertex.iter().zip(positions) {
        if let Some((low, high)) = boxes.get_mut(part as usize) {
            (*low, *high) = (low.min(p), high.max(p));
        }
    }
    boxes
}

#[cfg(test)]
mod tests {
    use super::super::prune::prune;
    use super::super::shapes;
    use super::super::weld::weld;
    use super::*;

    /// As they come, and with faces that share no vertex until they are welded, exactly or within a distance; with faces that have a
    /// corner twice, between the parts and far away.
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
        let mut with_slits = whole.clone();
        let far = with_slits.positions.len() as u32;
        with_slits.positions.extend([DVec3::splat(50.0), DVec3::splat(60.0)]);
        with_slits.faces.extend([[0, 0, 20], [far, far + 1, far]]);
        for (mesh, tolerance) in [(whole, 0.0), (apart, 0.0), (beside, 1e-5), (with_slits, 0.0)] {
            let parts = Parts::of(&mesh, tolerance);
            let small = parts.small(0.2);
            let mut welded = weld(&mesh, tolerance);
            assert_eq!((parts.sizes.len(), parts.diagonal), (2, welded.mesh.diagonal()));
            let all = welded.vertex_source.clone();
            assert_eq!((prune(&mut welded, 0.2), small.parts), (1, 1));
            let stay: Vec<u32> = all.into_iter().filter(|&v| !small.vertices[v as usize]).collect();
            assert!(stay == welded.vertex_source && stay.len() == 12);
        }
        let none = Parts::of(&Mesh::default(), 0.0);
        assert_eq!((none.sizes.len(), none.diagonal, none.small(1.0).parts), (0, 0.0, 0));
    }
}
