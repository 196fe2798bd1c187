//! Which regions are disks, but for holes.

use rayon::prelude::*;

use crate::mesh::dual::NONE;
use crate::mesh::fan::Fan;
use crate::partition::Partition;
use crate::partition::boundary::Boundary;
use crate::partition::surface::Surface;

/// Vertices that a thread takes at a time.
const ROWS: usize = 1 << 12;

/// For every region whether, glued along the edges inside it, it is a sphere with as many holes as it has loops, one at least:
/// whether V − E + F is two less the loops.
///
/// A vertex counts once for every fan of the region's faces around it. Fans that are not closed are as many as boundary
/// half-edges, and cancel with these.
pub fn planar_regions(surface: &Surface, partition: &Partition, boundary: &Boundary) -> Vec<bool> {
    let labels = &partition.labels;
    let mut doubled = vec![0_i64; partition.region_count];
    for (face, row) in surface.neighbors.iter().enumerate() {
        let inner = row.iter().filter(|&&other| other != NONE && labels[other as usize] == labels[face]);
        doubled[labels[face] as usize] += 2 - inner.count() as i64;
    }
    let centers: Vec<u32> = (0..surface.points.len() as u32)
        .into_par_iter()
        .with_min_len(ROWS)
        .map_init(Vec::new, |walked, vertex| closed_fans(vertex, surface, labels, walked))
        .flatten_iter()
        .collect();
    centers.into_iter().for_each(|region| doubled[region as usize] += 2);
    let euler = |(region, doubled): (usize, i64)| {
        let loops = boundary.loops(region).count() as i64;
        loops > 0 && doubled == 2 * (2 - loops)
    };
    doubled.into_iter().enumerate().map(euler).collect()
}

/// The region of every fan of faces that closes around a vertex within it.
fn closed_fans(vertex: u32, surface: &Surface, labels: &[u32], walked: &mut Vec<bool>) -> Vec<u32> {
    let ring = surface.rings.ring(vertex);
    let label = |face: u32| labels[face as usize];
    match (surface.fans[vertex as usize], ring) {
        (Fan::Open, _) | (_, []) => return Vec::new(),
        (Fan::Closed, [first, rest @ ..]) => {
            let is_inside = rest.iter().all(|&face| label(face) == label(*first));
            return if is_inside { vec![label(*first)] } else { Vec::new() };
        }
        (Fan::Complex, _) => {}
    }
    let mut found = Vec::new();
    walked.clear();
    walked.resize(ring.len(), false);
    for (i, &first) in ring.iter().enumerate() {
        let mut at = i;
        // Across the edge from the vertex to the corner after it, until the fan ends or closes.
        while !std::mem::replace(&mut walked[at], true) {
            let face = ring[at];
            let k = surface.faces[face as usize].iter().position(|&v| v == vertex).unwrap_or(0);
            let other = surface.neighbors[face as usize][k];
            if other == first && label(face) == label(first) {
                found.push(label(first));
            }
            match ring.binary_search(&other) {
                Ok(next) if label(other) == label(face) => at = next,
                _ => break,
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::mesh::{Mesh, shapes};

    fn planar(mesh: &Mesh, label: impl Fn(DVec3) -> bool) -> Vec<bool> {
        let surface = Surface::new(mesh, Some(0.0)).expect("a valid mesh");
        let at = |v: u32| mesh.positions[surface.vertex_source[v as usize] as usize];
        let middle = |face: &[u32; 3]| face.map(at).iter().sum::<DVec3>() / 3.0;
        let labels = surface.faces.iter().map(|face| u32::from(label(middle(face)))).collect();
        let partition = Partition { labels, region_count: 2 };
        planar_regions(&surface, &partition, &Boundary::new(&surface, &partition))
    }

    #[test]
    fn disks_and_rings_are_planar_and_handles_are_not() {
        assert_eq!(planar(&shapes::icosphere(3), |p| p.z > 0.3), [true; 2]);
        assert!(planar(&shapes::icosphere(3), |p| p.z.abs() < 0.3)[1], "a belt");
        assert_eq!(planar(&shapes::torus(24, 12), |p| p.y > 0.0), [true; 2]);
        let torus = shapes::torus(24, 12);
        let most = torus.positions.iter().map(|p| p.x).fold(f64::MIN, f64::max);
        assert_eq!(planar(&torus, |p| p.x > 0.9 * most), [false, true], "a torus less a patch has a handle");
        assert!(!planar(&shapes::icosphere(2), |_| true)[1], "closed");
    }

    /// Two cones on one tip: each fan closes.
    #[test]
    fn fans_on_one_tip_count_each() {
        let ring = |z: f64| (0..3).map(move |i| DVec3::new([1.0, -0.5, -0.5][i], [0.0, 0.8, -0.8][i], z));
        let mut mesh = Mesh::new(std::iter::once(DVec3::ZERO).chain(ring(1.0)).chain(ring(-1.0)).collect(), Vec::new());
        mesh.faces = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 6, 5], [0, 4, 6]];
        assert_eq!(planar(&mesh, |p| p.z > 0.0), [true; 2]);
    }
}
