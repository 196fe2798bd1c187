//! Polygons to triangles, every corner kept.

use crate::math::{DVec3, Vec2};
use crate::mesh::Mesh;
use crate::mesh::clip::{Clipper, turn};

/// Splits polygons into triangles; holds the scratch memory.
pub(super) struct Triangulator {
    clipper: Clipper,
    flat: Vec<[f64; 2]>,
    /// Places in the polygon, ring by ring, and their points.
    places: Vec<usize>,
    rings: Vec<[f64; 2]>,
}

/// Polygons of more corners become fans. Clipping outlines that cross themselves takes time that grows with the square
/// of the corners: 1.4 s for 30,000, so a hostile file could run for hours.
const GREATEST_CLIPPED: usize = 1 << 15;

impl Triangulator {
    pub(super) fn new() -> Self {
        Self { clipper: Clipper::new(), flat: Vec::new(), places: Vec::new(), rings: Vec::new() }
    }

    /// Appends the `corners.len() - 2` triangles of a polygon to `mesh`; none for fewer than three corners.
    ///
    /// A convex polygon becomes the fan of its first corner, a concave one is clipped ear by ear in its plane, with holes where
    /// bridges join some to it, and without the spikes of no width that it has. What cannot be clipped (no area, crossing itself,
    /// too large) becomes the fan, so that no face is lost. The
    /// corners must be vertices of the mesh. Where it has texture coordinates, those of the corners go along; the corners
    /// without one get zeros.
    #[inline]
    pub(super) fn append(&mut self, corners: &[u32], texcoords: &[Vec2], mesh: &mut Mesh) {
        match (corners, &mesh.texcoords) {
            // By far the most.
            (&[a, b, c], None) => mesh.faces.push([a, b, c]),
            _ => self.append_polygon(corners, texcoords, mesh),
        }
    }

    fn append_polygon(&mut self, corners: &[u32], texcoords: &[Vec2], mesh: &mut Mesh) {
        let Mesh { positions, faces, texcoords: rows, .. } = mesh;
        self.split(corners, positions, |triangle| {
            faces.push(triangle.map(|i| corners[i]));
            if let Some(rows) = rows {
                rows.push(triangle.map(|i| texcoords.get(i).copied().unwrap_or_default()));
            }
        });
    }

    /// Calls `push` with the triangles that [`Self::append`] makes, as places in `corners`.
    pub(super) fn split(&mut self, corners: &[u32], positions: &[DVec3], mut push: impl FnMut([usize; 3])) {
        match corners.len() {
            0..3 => {}
            3 => push([0, 1, 2]),
            count => {
                let is_concave =
                    count <= GREATEST_CLIPPED && self.project(corners, positions) && !is_convex(&self.flat);
                let holes = if is_concave { self.holes(corners) } else { None };
                if let Some(holes) = &holes
                    && let Some(triangles) = self.clipper.clip(&self.rings, holes)
                {
                    return triangles.iter().for_each(|triangle| push(triangle.map(|i| self.places[i as usize])));
                }
                if !is_concave {
                    return (2..count).for_each(|i| push([0, i - 1, i]));
                }
                // Spikes keep the clipper from all the rest.
                self.take_spikes_off(&mut push);
                let clipped = if is_convex(&self.rings) { None } else { self.clipper.clip(&self.rings, &[]) };
                let mut push = |triangle: [usize; 3]| push(triangle.map(|i| self.places[i]));
                match clipped {
                    Some(triangles) => triangles.iter().for_each(|triangle| push(triangle.map(|i| i as usize))),
                    None => (2..self.places.len()).for_each(|i| push([0, i - 1, i])),
                }
            }
        }
    }

    /// Calls `push` with triangles, of no area in the plane, for the corners where the outline turns back on itself, and for those that it
    /// comes back to; the places of all others go to `places`, and their points to `rings`.
    fn take_spikes_off(&mut self, push: &mut impl FnMut([usize; 3])) {
        let count = self.flat.len();
        self.places.clear();
        self.rings.clear();
        if (0..count).all(|place| self.flat[place] != self.flat[(place + 2) % count]) {
            self.places.extend(0..count);
            self.rings.extend_from_slice(&self.flat);
            return;
        }
        let mut before: Vec<usize> = (0..count).map(|place| (place + count - 1) % count).collect();
        let mut after: Vec<usize> = (0..count).map(|place| (place + 1) % count).collect();
        let (mut left, mut is_gone, mut open) = (count, vec![false; count], (0..count).rev().collect::<Vec<_>>());
        while let Some(tip) = open.pop() {
            let (from, to) = (before[tip], after[tip]);
            if is_gone[tip] || left < 5 || self.flat[from] != self.flat[to] {
                continue;
            }
            let next = after[to];
            push([from, tip, to]);
            push([from, to, next]);
            (is_gone[tip], is_gone[to], left) = (true, true, left - 2);
            (after[from], before[next]) = (next, from);
            open.extend([next, from]);
        }
        self.places.extend((0..count).filter(|&place| !is_gone[place]));
        self.rings.extend(self.places.iter().map(|&place| self.flat[place]));
    }

    /// Takes a polygon apart where bridges, edges that it has both ways, join holes to what surrounds them: the outer ring and
    /// the holes go to `rings`, and what is returned says where the holes start. `None` for any other polygon.
    fn holes(&mut self, corners: &[u32]) -> Option<Vec<u32>> {
        let count = corners.len();
        let after = |place: usize| (place + 1) % count;
        let ends = |place: usize| {
            let [a, b] = [corners[place], corners[after(place)]];
            [a.min(b), a.max(b)]
        };
        let mut edges: Vec<usize> = (0..count).collect();
        edges.sort_unstable_by_key(|&place| (ends(place), place));
        let mut twin = vec![None; count];
        for same in edges.chunk_by(|&a, &b| ends(a) == ends(b)) {
            match *same {
                [_] => {}
                [a, b] if corners[a] == corners[after(b)] => (twin[a], twin[b]) = (Some(b), Some(a)),
                _ => return None,
            }
        }
        // Rings of places, and the areas to their left.
        let mut rings: Vec<(f64, Vec<usize>)> = Vec::new();
        let mut is_seen: Vec<bool> = twin.iter().map(Option::is_some).collect();
        for first in 0..count {
            let (mut place, mut ring) = (first, Vec::new());
            while !std::mem::replace(&mut is_seen[place], true) {
                ring.push(place);
                place = after(place);
                while let Some(other) = twin[place] {
                    place = after(other);
                }
            }
            if let [origin, ..] = ring[..] {
                let fan = ring.windows(2).map(|ends| turn(self.flat[origin], self.flat[ends[0]], self.flat[ends[1]]));
                rings.push((fan.sum(), ring));
            }
        }
        rings.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let corners_left = count + 2 - 2 * rings.len().min(count / 2);
        let is_in_place =
            |(at, (area, ring)): (usize, &(f64, Vec<usize>))| ring.len() > 2 && (*area > 0.0) == (at == 0);
        if rings.len() < 2
            || rings.iter().map(|(_, ring)| ring.len()).sum::<usize>() != corners_left
            || !rings.iter().enumerate().all(is_in_place)
        {
            return None;
        }
        let mut starts = Vec::with_capacity(rings.len());
        self.places.clear();
        for (_, ring) in rings {
            starts.push(self.places.len() as u32);
            self.places.extend(ring);
        }
        starts.remove(0);
        self.rings.clear();
        self.rings.extend(self.places.iter().map(|&place| self.flat[place]));
        Some(starts)
    }

    /// Projects the corners counter-clockwise along the greatest axis of the area vector; false without a direction.
    ///
    /// Dropping a coordinate keeps the others exact, and it keeps convexity as any projection of a plane does.
    fn project(&mut self, corners: &[u32], positions: &[DVec3]) -> bool {
        let origin = positions[corners[0] as usize];
        let local = |corner: u32| positions[corner as usize] - origin;
        let size = corners.iter().fold(0.0_f64, |size, &corner| size.max(local(corner).abs().max_element()));
        if !(size > 0.0 && size.is_finite()) {
            return false;
        }
        let scaled = |corner: u32| local(corner) / size;
        let next = corners.iter().cycle().skip(1);
        let area: DVec3 = corners.iter().zip(next).map(|(&a, &b)| scaled(a).cross(scaled(b))).sum();
        let magnitude = area.abs();
        if magnitude.max_element() <= 0.0 {
            return false;
        }
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&corner| {
            let p = scaled(corner);
            let (u, v, toward) = if magnitude.z >= magnitude.x && magnitude.z >= magnitude.y {
                (p.x, p.y, area.z)
            } else if magnitude.y >= magnitude.x {
                (p.z, p.x, area.y)
            } else {
                (p.y, p.z, area.x)
            };
            if toward > 0.0 { [u, v] } else { [v, u] }
        }));
        true
    }
}

/// Whether no corner turns right and the outline goes around once.
fn is_convex(flat: &[[f64; 2]]) -> bool {
    let n = flat.len();
    let corner = |i: usize| flat[i % n];
    // A fan of a convex outline has no triangle turned over; together with the corners this also refuses stars.
    (0..n).all(|i| turn(corner(i), corner(i + 1), corner(i + 2)) >= 0.0)
        && (1..n - 1).all(|i| turn(corner(0), corner(i), corner(i + 1)) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangulate(points: &[[f64; 3]]) -> (Vec<[u32; 3]>, DVec3, f64) {
        let positions: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let mut mesh = Mesh::new(positions, Vec::new());
        mesh.texcoords = Some(Vec::new());
        let texcoords: Vec<Vec2> = corners.iter().map(|&corner| Vec2::splat(corner as f32)).collect();
        Triangulator::new().append(&corners, &texcoords, &mut mesh);
        let rows: Vec<[Vec2; 3]> =
            mesh.faces.iter().map(|face| face.map(|corner| Vec2::splat(corner as f32))).collect();
        assert_eq!(mesh.texcoords, Some(rows), "the texture coordinates left their corners");
        let areas = mesh.faces.iter().map(|&face| mesh.cross(face) / 2.0);
        (mesh.faces.clone(), areas.clone().sum(), areas.map(DVec3::length).sum())
    }

    #[test]
    fn convex_polygons_are_fans_of_the_first_corner() {
        let (faces, ..) = triangulate(&[[0., 0., 0.], [2., 0., 0.], [3., 1., 0.], [1., 3., 0.], [0., 1., 0.]]);
        assert_eq!(faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    /// The dart: corner 2 is dented in, so the fan of corner 0 would fold over. Area by hand: 2·(1·1/2) = 1.
    #[test]
    fn a_dart_keeps_its_area_in_every_plane_and_winding() {
        let dart = [[0.0, 0.0], [1.0, 1.0], [0.0, 2.0], [0.5, 1.0]];
        for start in 0..4 {
            for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]] {
                let points: Vec<[f64; 3]> = (0..4)
                    .map(|i| {
                        let p = dart[(start + i) % 4];
                        let mut q = [0.0; 3];
                        (q[axes[0]], q[axes[1]], q[axes[2]]) = (p[0], p[1], 0.25 * p[0] - p[1]);
                        q
                    })
                    .collect();
                let (faces, vector, area) = triangulate(&points);
                assert_eq!(faces.len(), 2, "{points:?}");
                // No triangle is turned over: the areas add up to the length of their vector sum.
                assert!((vector.length() - area).abs() < 1e-12, "{points:?}: {faces:?}");
                assert!((vector.to_array()[axes[2]].abs() - 0.5).abs() < 1e-12, "{points:?}: {vector}");
            }
        }
    }

    /// An L with two corners in the middle of straight sides: nothing may be dropped.
    #[test]
    fn corners_on_straight_sides_are_kept() {
        let (faces, vector, area) = triangulate(&[
            [0., 0., 0.],
            [1., 0., 0.],
            [2., 0., 0.],
            [2., 1., 0.],
            [1., 1., 0.],
            [1., 2., 0.],
            [0., 2., 0.],
            [0., 1., 0.],
        ]);
        assert_eq!(faces.len(), 6);
        assert_eq!((vector, area), (DVec3::new(0., 0., 3.), 3.0));
        let mut used: Vec<u32> = faces.into_iter().flatten().collect();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used, [0, 1, 2, 3, 4, 5, 6, 7]);
    }

    /// Combs with teeth of seeded lengths and corners along their straight back, on a slanted plane.
    #[test]
    fn combs_keep_their_area_and_every_corner() {
        let mut state = 1_u64;
        for teeth in 1..60 {
            let mut outline = Vec::new();
            for tooth in 0..teeth {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let length = 1.0 + (state >> 60) as f64;
                let x = 2.0 * f64::from(tooth);
                outline.extend([[x, 0.0], [x, length], [x + 1.0, length], [x + 1.0, 0.0]]);
            }
            outline.extend((0..=teeth).rev().map(|i| [2.0 * f64::from(i) - 0.5, -1.0]));
            let points: Vec<[f64; 3]> = outline.iter().map(|&[x, y]| [x, 0.5 * x - y, y]).collect();
            let (faces, vector, area) = triangulate(&points);
            assert_eq!(faces.len(), points.len() - 2, "{teeth} teeth");
            assert!((vector.length() - area).abs() < 1e-9 * area, "{teeth} teeth: {vector} but {area}");
            let sides = |face: &[u32; 3]| [[face[0], face[1]], [face[1], face[2]], [face[2], face[0]]];
            let all: Vec<[u32; 2]> = faces.iter().flat_map(sides).collect();
            let n = points.len() as u32;
            assert!((0..n).all(|i| all.contains(&[i, (i + 1) % n])), "{teeth} teeth: a side is no triangle's");
        }
    }

    /// Two corners at one place, as modeling programs leave them: the clipper drops one of each.
    #[test]
    fn repeated_positions_are_kept() {
        let dart = [[0., 0., 0.], [1., 1., 0.], [0., 2., 0.], [0.5, 1., 0.]];
        for repeated in 0..4 {
            let mut points = dart.to_vec();
            points.insert(repeated, dart[repeated]);
            let (faces, vector, area) = triangulate(&points);
            assert_eq!((faces.len(), vector, area), (3, DVec3::new(0., 0., 0.5), 0.5), "{repeated}: {faces:?}");
        }
    }

    /// A C of two arcs with a spike without a width at one of its corners: the triangles cover what they do without it.
    #[test]
    fn a_spike_leaves_the_rest_as_it_is() {
        let arc = |radius: f64| {
            (0..12).map(move |i| 0.4 + 0.49 * f64::from(i)).map(move |t| [radius * t.cos(), radius * t.sin(), 0.0])
        };
        let clean: Vec<[f64; 3]> = arc(1.0).chain(arc(0.8).rev()).collect();
        let (_, area, _) = triangulate(&clean);
        for at in 0..clean.len() {
            let mut points = clean.clone();
            let base = points[at];
            points.insert(at + 1, base.map(|x| 1.2 * x));
            points.insert(at + 2, base);
            let (faces, vector, all) = triangulate(&points);
            assert_eq!(faces.len(), points.len() - 2, "{at}");
            assert!((vector - area).length() < 1e-12 && (all - area.length()).abs() < 1e-12, "{at}: {vector}, {all}");
        }
    }

    /// A square with a square hole in its middle, from every start: the bridge is walked both ways.
    #[test]
    fn holes_behind_bridges_stay_holes() {
        let points = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 1.], [1., 3.], [3., 3.], [3., 1.]];
        let positions: Vec<DVec3> = points.iter().map(|&[x, y]| DVec3::new(x, y, x - y)).collect();
        let mut ring = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4];
        for start in 0..ring.len() {
            let mut mesh = Mesh::new(positions.clone(), Vec::new());
            Triangulator::new().append(&ring, &[], &mut mesh);
            let areas = mesh.faces.iter().map(|&face| mesh.cross(face).z / 2.0);
            assert!(areas.clone().all(|area| area > 0.0) && areas.clone().sum::<f64>() == 12.0, "{start}: {areas:?}");
            assert_eq!(mesh.faces.len(), 8);
            ring.rotate_left(1);
        }
    }

    /// Edges both ways that lead to no hole: a spike, and a strip that turns back on itself.
    #[test]
    fn other_edges_both_ways_are_no_bridges() {
        let points = [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 1.]];
        let positions: Vec<DVec3> = points.iter().map(|&[x, y]| DVec3::new(x, y, 0.0)).collect();
        for ring in [&[0, 4, 0, 1, 2, 3][..], &[0, 1, 2, 1], &[0, 1, 0, 1, 0, 1], &[0, 1, 2, 0, 1, 2, 3]] {
            let mut mesh = Mesh::new(positions.clone(), Vec::new());
            Triangulator::new().append(ring, &[], &mut mesh);
            assert_eq!(mesh.faces.len(), ring.len() - 2, "{ring:?}");
        }
    }

    #[test]
    fn hostile_polygons_become_fans() {
        for points in [
            [[0.0; 3]; 5],
            [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.], [1., 0., 0.]],
            [[f64::MAX, 0., 0.], [-f64::MAX, 0., 0.], [0., f64::MAX, 0.], [0., -f64::MAX, 0.], [1., 1., 1.]],
            [[0., 0., 0.], [2., 3., 0.], [4., 0., 0.], [0., 2., 0.], [4., 2., 0.]],
        ] {
            assert_eq!(triangulate(&points).0.len(), 3, "{points:?}");
        }
        assert!(triangulate(&[[0.0; 3]; 2]).0.is_empty());
    }
}
