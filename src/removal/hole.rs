//! The hole that a vertex leaves.
//!
//! ```text
//!     r2 --- r1          v      the vertex, at the origin
//!    /  \   /  \         r0 …   its ring, counter-clockwise; faces[i] lies between r[i] and r[i + 1]
//!  r3 --- v --- r0       an open ring begins and ends at the border
//!    \  /   \  /
//!     r4 --- r5
//! ```

use crate::kernel::removal_costs::is_crease;
use crate::kernel::rows::{BORDER, HUB, Normal};
use crate::kernel::stars::{Stars, has, spoke};
use crate::math::DVec3;

use super::polygon::{Polygon, Worth, height, unit_normal};

/// A vertex's ring and what lies around it.
#[derive(Debug, Default)]
pub struct Hole {
    /// The ring.
    pub ring: Vec<u32>,
    /// Its positions about the vertex.
    pub points: Vec<DVec3>,
    /// The faces that go, in the order of the ring.
    pub faces: Vec<u32>,
    pub is_open: bool,
    /// The face beyond every side of the ring that a face lies at, if there is one.
    pub beyond: Vec<Option<u32>>,
    /// The unit normals of these.
    outside: Vec<Option<DVec3>>,
    /// Whether two vertices of the ring share an edge, but for its own sides; row by row.
    joined: Vec<bool>,
    /// (p1−p0)×(p2−p0) of the faces that go.
    normals: Vec<DVec3>,
}

impl Hole {
    /// Reads the hole at `vertex`; false where the faces around it are not one fan.
    pub fn read(&mut self, vertex: u32, stars: &Stars<'_>) -> bool {
        let faces = stars.ring(vertex);
        let from = |f: u32| spoke(stars.faces[f as usize], vertex);
        let entered = |f: u32| faces.iter().copied().find(|&g| from(g).last == from(f).next);
        self.is_open = stars.positions[vertex as usize].flags & BORDER != 0;
        let first =
            if self.is_open { faces.iter().copied().find(|&f| entered(f).is_none()) } else { faces.first().copied() };
        self.faces.clear();
        self.ring.clear();
        let mut at = first;
        while let Some(face) = at {
            self.faces.push(face);
            self.ring.push(from(face).next);
            let last = from(face).last;
            at = faces.iter().copied().find(|&g| from(g).next == last);
            if at.is_none() {
                self.ring.push(last);
            }
            if at == first || self.faces.len() > faces.len() {
                break;
            }
        }
        let closes = at.is_some() && at == first;
        if faces.is_empty() || self.faces.len() != faces.len() || closes == self.is_open {
            return false;
        }
        let origin = stars.positions[vertex as usize].xyz().as_dvec3();
        let point = |&v: &u32| stars.positions[v as usize].xyz().as_dvec3() - origin;
        self.points.clear();
        self.points.extend(self.ring.iter().map(point));
        let count = self.ring.len();
        let normal = |i: usize| self.points[i].cross(self.points[(i + 1) % count]);
        self.normals.clear();
        self.normals.extend((0..self.faces.len()).map(normal));
        self.look_around(vertex, origin, stars);
        true
    }

    /// The cosine at the sharpest of the edges that go or stay around the hole.
    pub fn least_cos(&self) -> f64 {
        let units: Vec<Option<DVec3>> = self.normals.iter().map(|normal| normal.try_normalize()).collect();
        let inner = (1..units.len()).map(|i| (units[i - 1], units[i]));
        let closing = (!self.is_open).then(|| (units[units.len() - 1], units[0]));
        let outer = (0..units.len()).map(|i| (units[i], self.outside[i]));
        let edges = inner.chain(closing).chain(outer);
        edges.fold(Worth::NONE, |worth, (first, second)| worth.with_edge(first, second)).least_cos
    }

    /// Finds what lies beyond the ring and which of its vertices share an edge.
    fn look_around(&mut self, vertex: u32, origin: DVec3, stars: &Stars<'_>) {
        let count = self.ring.len();
        self.joined.clear();
        self.joined.resize(count * count, false);
        self.beyond.clear();
        self.beyond.resize(count, None);
        self.outside.clear();
        self.outside.resize(count, None);
        // What lies at the one of most faces is found from the other ends of its edges.
        let longest = self.ring.iter().copied().filter(|&v| stars.positions[v as usize].flags & HUB != 0);
        let longest = longest.max_by_key(|&v| stars.ring(v).len());
        let skipped = longest.filter(|hub| self.ring.iter().filter(|v| *v == hub).count() == 1);
        for (i, at) in self.ring.iter().copied().enumerate() {
            if skipped == Some(at) {
                continue;
            }
            let (before, after) = ((i + count - 1) % count, (i + 1) % count);
            for &f in stars.ring(at) {
                let face = stars.faces[f as usize];
                if has(face, vertex) {
                    continue;
                }
                let seen = spoke(face, at);
                for other in [seen.next, seen.last] {
                    if let Some(j) = self.ring.iter().position(|&v| v == other) {
                        self.joined[i * count + j] = true;
                        self.joined[j * count + i] = true;
                    }
                }
                // Beyond a side of the ring a face runs the other way.
                let follows = i < self.faces.len() && seen.last == self.ring[after];
                let is_of_skipped = before < self.faces.len() && skipped == Some(self.ring[before]);
                let precedes = is_of_skipped && seen.next == self.ring[before];
                for side in follows.then_some(i).into_iter().chain(precedes.then_some(before)) {
                    let corner = |v: u32| stars.positions[v as usize].xyz().as_dvec3() - origin;
                    self.beyond[side] = Some(f);
                    self.outside[side] = unit_normal([corner(at), corner(seen.next), corner(seen.last)]);
                }
            }
        }
    }

    /// The faces that go, about the vertex.
    pub fn shapes(&self) -> Vec<[DVec3; 3]> {
        let count = self.ring.len();
        (0..self.faces.len()).map(|i| [DVec3::ZERO, self.points[i], self.points[(i + 1) % count]]).collect()
    }

    /// Whether a side of the ring is between two places.
    pub fn is_side(&self, i: usize, j: usize) -> bool {
        let follows =
            |from: usize, to: usize| from + 1 == to || (!self.is_open && to == 0 && from + 1 == self.ring.len());
        follows(i, j) || follows(j, i)
    }

    /// Whether the vertices at these places of the ring share an edge that a face beyond the hole has.
    pub fn are_joined(&self, i: usize, j: usize) -> bool {
        self.joined[i * self.ring.len() + j]
    }

    /// Whether the three vertices of a ring are the corners of a face elsewhere.
    pub fn is_face(&self, stars: &Stars<'_>) -> bool {
        let Some(&shortest) = self.ring.iter().min_by_key(|&&v| stars.ring(v).len()) else { return false };
        let mut faces = stars.ring(shortest).iter().map(|&f| stars.faces[f as usize]);
        self.ring.len() == 3 && faces.any(|face| self.ring.iter().all(|&v| has(face, v)))
    }

    /// The polygons to fill: one, or one on either side of the two features that run through the vertex.
    pub fn polygons(&self, normals: &[Normal], crease_cos: f32) -> Vec<Polygon<'_>> {
        let count = self.ring.len();
        let whole = || vec![self.polygon((0..count).collect(), 0..self.faces.len())];
        if self.is_open || crease_cos < -1.0 {
            return whole();
        }
        let bends = |&i: &usize| {
            let [before, after] = [self.faces[(i + count - 1) % count], self.faces[i]].map(|f| normals[f as usize]);
            is_crease(before, after, crease_cos)
        };
        let creases: Vec<usize> = (0..count).filter(bends).collect();
        let [i, j] = creases[..] else { return whole() };
        let sides = [(i..=j).collect::<Vec<_>>(), (j..=i + count).map(|k| k % count).collect()];
        let faces = [(i..j), (j..i + count)];
        let sides = sides.into_iter().zip(faces).filter(|(side, _)| side.len() > 2);
        sides.map(|(side, faces)| self.polygon(side, faces)).collect()
    }

    /// The polygon through these places of the ring, which replaces these faces.
    fn polygon(&self, places: Vec<usize>, faces: std::ops::Range<usize>) -> Polygon<'_> {
        let count = self.normals.len();
        let mut normal = DVec3::ZERO;
        let (mut area, mut least_height) = (0.0, f64::INFINITY);
        for face in faces.map(|face| face % count) {
            let own = self.normals[face];
            normal += own;
            area += own.length();
            let corners = [DVec3::ZERO, self.points[face], self.points[(face + 1) % self.points.len()]];
            least_height = least_height.min(height(corners));
        }
        Polygon { hole: self, places, normal, area, least_height }
    }

    /// The unit normal beyond the side of the ring between two places, where there is a face.
    pub fn outside(&self, from: usize, to: usize) -> Option<DVec3> {
        if (from + 1) % self.ring.len() == to { self.outside[from] } else { None }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::Options;
    use super::super::prepare::prepare;
    use super::*;
    use crate::backend::Device;
    use crate::kernel::rows::{HUB_FACES, Position};
    use crate::mesh::Mesh;

    /// Rings of `sides` vertices about an apex, `parts` of a full turn.
    fn cone(sides: u32, parts: f64) -> Mesh {
        let is_closed = parts == 1.0;
        let spokes = if is_closed { sides } else { sides + 1 };
        let place = |ring: u32, i: u32| {
            let (r, angle) = (f64::from(ring), TAU * parts * f64::from(i) / f64::from(sides));
            DVec3::new(r * angle.cos(), r * angle.sin(), -0.1 * r)
        };
        let rim = |ring: u32| (0..spokes).map(move |i| place(ring, i));
        let at = |ring: u32, i: u32| 1 + (ring - 1) * spokes + i % spokes;
        let fan = (0..sides).map(|i| [0, at(1, i), at(1, i + 1)]);
        let band =
            (0..sides).flat_map(|i| [[at(1, i), at(2, i), at(2, i + 1)], [at(1, i), at(2, i + 1), at(1, i + 1)]]);
        Mesh::new([DVec3::ZERO].into_iter().chain(rim(1)).chain(rim(2)).collect(), fan.chain(band).collect())
    }

    /// A rim of `sides` vertices between two apexes.
    fn bipyramid(sides: u32) -> Mesh {
        let rim = (0..sides).map(|i| TAU * f64::from(i) / f64::from(sides)).map(|a| DVec3::new(a.cos(), a.sin(), 0.0));
        let next = |i: u32| 2 + (i + 1) % sides;
        let faces = (0..sides).flat_map(|i| [[0, 2 + i, next(i)], [1, next(i), 2 + i]]);
        Mesh::new([DVec3::Z, -DVec3::Z].into_iter().chain(rim).collect(), faces.collect())
    }

    #[test]
    fn a_hub_is_seen_from_the_other_ends() {
        let device = Device::cpu(1).expect("a device");
        let sides = HUB_FACES + 40;
        for mesh in [cone(sides, 1.0), cone(sides, 0.5), bipyramid(sides)] {
            let prepared = prepare(&mesh, &Options::default(), &mut device.cpu_queue()).expect("a valid mesh");
            let stars = prepared.surface.stars();
            assert!(stars.positions.iter().any(|p| p.flags & HUB != 0));
            let plain: Vec<Position> =
                stars.positions.iter().map(|&p| Position { flags: p.flags & !HUB, ..p }).collect();
            let plain = Stars { positions: &plain, ..stars };
            let (mut seen, mut expected) = (Hole::default(), Hole::default());
            for vertex in 0..stars.positions.len() as u32 {
                assert_eq!(seen.read(vertex, &stars), expected.read(vertex, &plain));
                assert_eq!(
                    (&seen.ring, &seen.joined, &seen.beyond),
                    (&expected.ring, &expected.joined, &expected.beyond)
                );
                assert_eq!(seen.is_face(&stars), expected.is_face(&plain));
                for (side, other) in seen.outside.iter().zip(&expected.outside) {
                    let off = side.zip(*other).map(|(a, b)| (a - b).length());
                    assert!(side.is_some() == other.is_some() && off.unwrap_or(0.0) < 1e-12, "{vertex}: {off:?}");
                }
            }
        }
    }
}
