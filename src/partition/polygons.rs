//! The triangles of a region joined into one polygon.
//!
//! Triangles are joined across edges, the longest first, unless they hang together already. What stays of the edges inside are
//! bridges, as short as can be: each is an edge of the triangles, so that no polygon has it besides.

use rayon::prelude::*;

use crate::mesh::disjoint::DisjointSets;
use crate::mesh::{Mesh, Polygons};

/// Regions that a thread takes at a time.
const ROWS: usize = 1 << 8;

/// The faces of every region as one polygon where it `is_whole`, and else as they are; `starts` are those of the regions.
pub fn polygons(mesh: &Mesh, starts: &[u32], is_whole: &[bool]) -> Polygons {
    let rings = (starts.par_windows(2).with_min_len(ROWS).zip(is_whole)).map(|(ends, &is_whole)| {
        let faces = &mesh.faces[ends[0] as usize..ends[1] as usize];
        if is_whole && faces.len() > 1 { joined(mesh, faces) } else { None }
    });
    let rings: Vec<Option<Vec<u32>>> = rings.collect();
    let mut polygons = Polygons { starts: vec![0], corners: Vec::new() };
    let mut push = |corners: &[u32]| {
        polygons.corners.extend_from_slice(corners);
        polygons.starts.push(polygons.corners.len() as u32);
    };
    for (ends, ring) in starts.windows(2).zip(rings) {
        match ring {
            Some(ring) => push(&ring),
            None => mesh.faces[ends[0] as usize..ends[1] as usize].iter().for_each(|face| push(face)),
        }
    }
    polygons
}

/// The ring of faces joined into a disk; `None` where they do not hang together across edges of two faces.
///
/// Half-edge `3f + k` goes from corner `k` of face `f` to the next. Where its face is joined with another, `across` has the
/// half-edge there.
fn joined(mesh: &Mesh, faces: &[[u32; 3]]) -> Option<Vec<u32>> {
    let after = |half: u32| half - half % 3 + (half + 1) % 3;
    let origin = |half: u32| faces[half as usize / 3][half as usize % 3];
    let ends = |half: u32| {
        let [a, b] = [origin(half), origin(after(half))];
        [a.min(b), a.max(b)]
    };
    let mut halves: Vec<u32> = (0..3 * faces.len() as u32).collect();
    halves.sort_unstable_by_key(|&half| (ends(half), half));
    let length = |half: u32| {
        let [a, b] = ends(half).map(|v| mesh.positions[v as usize]);
        (b - a).length_squared()
    };
    let twins = |same: &[u32]| match *same {
        [a, b] if origin(a) == origin(after(b)) => Some((length(a), [a, b])),
        _ => None,
    };
    let mut inner: Vec<(f64, [u32; 2])> = halves.chunk_by(|&a, &b| ends(a) == ends(b)).filter_map(twins).collect();
    inner.sort_unstable_by(|(a, first), (b, second)| b.total_cmp(a).then(first.cmp(second)));
    let mut sets = DisjointSets::new(faces.len());
    let mut across = vec![None; 3 * faces.len()];
    for (_, [a, b]) in inner {
        if sets.join(a / 3, b / 3) {
            (across[a as usize], across[b as usize]) = (Some(b), Some(a));
        }
    }
    let first = (0..3 * faces.len() as u32).find(|&half| across[half as usize].is_none())?;
    let mut ring = Vec::with_capacity(faces.len() + 2);
    let mut half = first;
    loop {
        ring.push(origin(half));
        half = after(half);
        while let Some(other) = across[half as usize] {
            half = after(other);
        }
        if half == first {
            // A disk of n faces has n − 1 joints.
            return (ring.len() == faces.len() + 2).then_some(ring);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::mesh::shapes::plane;

    #[test]
    fn a_square_is_its_four_corners() {
        let mesh = plane(1, 1);
        let whole = polygons(&mesh, &[0, 2], &[true]);
        assert_eq!((whole.len(), whole.corners.len()), (1, 4));
        whole.check(&mesh).expect("polygons of the mesh");
        let own = polygons(&mesh, &[0, 2], &[false]);
        assert_eq!(own.corners, mesh.faces.concat());
        own.check(&mesh).expect("polygons of the mesh");
    }

    /// A hole of three corners in a triangle: one bridge, the shortest edge between them.
    #[test]
    fn a_hole_has_one_bridge() {
        let corners = [[0., 0.], [12., 0.], [0., 12.], [1., 2.], [2., 5.], [4., 2.]];
        let positions = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
        let faces = vec![[0, 1, 5], [0, 5, 3], [0, 3, 4], [0, 4, 2], [2, 4, 1], [1, 4, 5]];
        let mesh = Mesh::new(positions.to_vec(), faces);
        let ring = joined(&mesh, &mesh.faces).expect("they hang together");
        assert_eq!(ring, [0, 1, 2, 0, 3, 4, 5, 3]);
    }

    #[test]
    fn what_hangs_together_by_a_vertex_stays_as_it_is() {
        let mesh = Mesh::new(vec![DVec3::ZERO; 5], vec![[0, 1, 2], [0, 3, 4]]);
        assert_eq!(joined(&mesh, &mesh.faces), None);
        assert_eq!(polygons(&mesh, &[0, 2], &[true]).corners, [0, 1, 2, 0, 3, 4]);
        // All of a tetrahedron: a disk with its cuts as spikes.
        let closed = crate::mesh::shapes::tetrahedron();
        assert_eq!(joined(&closed, &closed.faces).map(|ring| ring.len()), Some(6));
    }
}
