//! Triangles by the `earcut` crate.

use super::crossings::NONE;
use super::nodes::Nodes;
use super::sides::compare;
use crate::math::DVec2;
use crate::mesh::clip::Clipper;

/// The triangles of rings and their holes, as points. `west` is what [`sweep`](super::crossings::sweep) found.
pub fn earcut(nodes: &Nodes, points: &[DVec2], west: &[u32]) -> Option<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(nodes.triangle_count());
    let mut clipper = Clipper::new();
    let (mut ring, mut corners, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for (&outer, holes) in nodes.outers.iter().zip(holes_of_outers(nodes, points, west)?) {
        ring.clear();
        starts.clear();
        ring.extend(nodes.ring(outer));
        for hole in holes {
            starts.push(ring.len() as u32);
            ring.extend(nodes.ring(hole));
        }
        corners.clear();
        corners.extend(ring.iter().map(|&node| points[node as usize].to_array()));
        triangles.extend(clipper.clip(&corners, &starts)?.iter().map(|corners| corners.map(|i| ring[i as usize])));
    }
    Some(triangles)
}

/// The holes in each of the outer rings, from the one with the greatest top down.
fn holes_of_outers(nodes: &Nodes, points: &[DVec2], west: &[u32]) -> Option<Vec<Vec<u32>>> {
    let mut outer_of = vec![NONE; points.len()];
    for (outer, &first) in (0..).zip(&nodes.outers) {
        nodes.ring(first).for_each(|node| outer_of[node as usize] = outer);
    }
    let mut holes = nodes.holes.clone();
    holes.sort_unstable_by(|&a, &b| compare(points[b as usize], points[a as usize]).then(a.cmp(&b)));
    let mut rows = vec![Vec::new(); nodes.outers.len()];
    for hole in holes {
        // What lies west of its top is an outer ring or a hole with a greater top, in the same ring.
        let outer = *outer_of.get(*west.get(hole as usize)? as usize)?;
        nodes.ring(hole).for_each(|node| outer_of[node as usize] = outer);
        rows.get_mut(outer as usize)?.push(hole);
    }
    Some(rows)
}
