//! Flat regions: faces whose normals are near that of a plane, whose vertices lie in it, and whose corners carry what is linear
//! over it: a texture's seam, or where it bends, parts what is flat.
//!
//! # Reference
//! \[Wu12\] 1.6.

use rayon::prelude::*;

use super::Partition;
use super::corners::{Affine, Corners};
use super::plane::Plane;
use super::surface::Surface;
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::mesh::dual::NONE;
use crate::mesh::limits::{ONE_DEGREE, least_cos};

/// Faces that a thread takes at a time.
const ROWS: usize = 1 << 12;

/// How often a region is grown: it ends with the first that its plane holds, or else with the first half, quarter … of the last.
const MOST_TRIES: usize = 4;

/// Least cosine of the angle between the normal of a plane and that of a face so low that the distance allows any, 45°: regions with
/// what is turned farther wrap around things, and no outline shows them.
const LEAST_NOISY_COS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What rounding to six digits moves a vertex by, as a fraction of the bounding box's diagonal.
const ROUNDING: f64 = 1e-5;

/// What lies in a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flatness {
    /// Largest angle between a face's normal and the plane's, in radians. Faces lower than the distance may be turned by 45° in any
    /// case, as noise within it may have turned them.
    pub angle_rad: f64,
    /// Greatest distance of a vertex from the plane, as a fraction of the bounding box's diagonal.
    pub distance: f64,
}

impl Default for Flatness {
    /// One degree, and what rounding to six digits does.
    fn default() -> Self {
        Self { angle_rad: ONE_DEGREE, distance: ROUNDING }
    }
}

impl Flatness {
    /// # Errors
    /// [`Error::Parameter`] for an angle or a distance out of range.
    pub(super) fn check(self) -> Result<()> {
        if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&self.angle_rad) {
            let degrees = self.angle_rad.to_degrees();
            return Err(Error::Parameter(format!("the angle of flat regions is {degrees}°, not in 0 … 90")));
        }
        if !(self.distance >= 0.0 && self.distance.is_finite()) {
            let distance = self.distance;
            return Err(Error::Parameter(format!("the distance from a plane is {distance}, not a length")));
        }
        Ok(())
    }
}

/// Grows flat regions from the largest faces, within `distance` of a plane in the frame; `is_wall` tells faces that never share a
/// region though they meet.
///
/// Every vertex of a region is within the distance of the plane that it is drawn in, and what `corners` carry is as near to a
/// linear function over it as it may be.
pub fn partition(
    surface: &Surface,
    angle_rad: f64,
    distance: f64,
    corners: Option<&Corners<'_>>,
    is_wall: impl Fn(u32, u32) -> bool,
) -> Partition {
    let mut growth = Growth::new(surface, angle_rad, distance, corners);
    let mut region_count = 0;
    for seed in growth.seeds() {
        if growth.labels[seed as usize] == NONE {
            growth.grow(seed, region_count, &is_wall);
            region_count += 1;
        }
    }
    // What nothing lies beside is on its own.
    for label in growth.labels.iter_mut().filter(|label| **label == NONE) {
        *label = region_count;
        region_count += 1;
    }
    Partition::in_face_order(growth.labels, region_count as usize).0
}

/// What a region lies in: a plane, and what its corners carry over the plane of its seed.
#[derive(Debug, Clone)]
struct Shape {
    plane: Plane,
    carried: Option<Affine>,
}

/// The shape that a region grows in.
#[derive(Debug, Clone)]
struct Growing<'a> {
    shape: Shape,
    /// The plane of the seed.
    own: &'a Plane,
    /// Whether it follows what is found.
    leans: bool,
    /// How far from it a vertex or what a corner carries may be, as a share of what is allowed.
    share: f64,
}

struct Growth<'a> {
    surface: &'a Surface,
    /// Twice the area along the normal, a face.
    normals: Vec<DVec3>,
    least_cos: f64,
    distance: f64,
    /// Height of a face below which rounding, not the surface, decides how it is turned.
    sliver: f64,
    corners: Option<&'a Corners<'a>>,
    labels: Vec<u32>,
    found: Vec<u32>,
    /// Of a corner, overwritten each time.
    row: Vec<f64>,
}

impl<'a> Growth<'a> {
    fn new(surface: &'a Surface, angle_rad: f64, distance: f64, corners: Option<&'a Corners<'a>>) -> Self {
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| surface.points[v as usize]);
            (b - a).cross(c - a)
        };
        Self {
            surface,
            normals: surface.faces.par_iter().with_min_len(ROWS).map(normal).collect(),
            least_cos: least_cos(angle_rad),
            distance,
            sliver: distance.min(ROUNDING * surface.diagonal),
            corners,
            labels: vec![NONE; surface.faces.len()],
            found: Vec::new(),
            row: Vec::new(),
        }
    }

    /// The faces that have another beside them in their own plane, the largest first.
    fn seeds(&self) -> Vec<u32> {
        let has_other = |&face: &u32| {
            let normal = self.normals[face as usize];
            let length = normal.length();
            let origin = self.surface.points[self.surface.faces[face as usize][0] as usize];
            let near = |v: u32| (self.surface.points[v as usize] - origin).dot(normal).abs() <= self.distance * length;
            length > 0.0
                && self.surface.neighbors[face as usize].iter().any(|&other| {
                    other != NONE
                        && self.surface.faces[other as usize].into_iter().all(near)
                        && self.faces_along(other, normal / length)
                })
        };
        let faces = (0..self.surface.faces.len() as u32).into_par_iter().with_min_len(ROWS);
        // Areas are positive: their bits are in their order.
        let key = |face: u32| (!self.normals[face as usize].length_squared().to_bits(), face);
        let mut seeds: Vec<(u64, u32)> = faces.filter(has_other).map(key).collect();
        seeds.par_sort_unstable();
        seeds.into_iter().map(|(_, face)| face).collect()
    }

    /// Grows a region from `seed`: with a shape that leans to what is found, then with that of all that was found, then nearer
    /// and nearer to its shapes until the one that it has at last holds it, or what was found first of it.
    fn grow(&mut self, seed: u32, label: u32, is_wall: &impl Fn(u32, u32) -> bool) {
        let [a, ..] = self.surface.faces[seed as usize];
        let own = Plane::new(self.surface.points[a as usize], self.normals[seed as usize]);
        let first = Shape { plane: own, carried: self.carried(&own, &[seed]) };
        let mut share = 1.0;
        for attempt in 1..=MOST_TRIES {
            self.spread(seed, label, Growing { shape: first.clone(), own: &own, leans: true, share }, is_wall);
            let Some(shape) = self.shape_that_is_off(&own) else { return };
            self.let_go();
            self.spread(seed, label, Growing { shape, own: &own, leans: false, share }, is_wall);
            if self.shape_that_is_off(&own).is_none() {
                return;
            }
            if attempt < MOST_TRIES {
                self.let_go();
                share /= 2.0;
            }
        }
        // In the order in which they were found any first ones hang together.
        while self.found.len() > 1 && self.shape_that_is_off(&own).is_some() {
            for face in self.found.drain(self.found.len().div_ceil(2)..) {
                self.labels[face as usize] = NONE;
            }
        }
    }

    /// What faces carry over the plane of their seed.
    fn carried(&mut self, own: &Plane, faces: &[u32]) -> Option<Affine> {
        self.corners.map(|corners| corners.fit(self.surface, own, faces, &mut self.row))
    }

    /// What those that were found carry over the plane of their seed.
    fn carried_by_found(&mut self, own: &Plane) -> Option<Affine> {
        let Self { corners, surface, found, row, .. } = self;
        corners.map(|corners| corners.fit(surface, own, found, row))
    }

    /// Whether what a face carries is within a share of what it may be off `map`.
    fn carries(&mut self, face: u32, own: &Plane, map: Option<&Affine>, share: f64) -> bool {
        let Some((corners, map)) = self.corners.zip(map) else { return true };
        corners.off(self.surface, own, map, (&[face], &mut self.row)) <= share
    }

    /// The shape of what was found, if a vertex is too far from it, or what a corner carries.
    fn shape_that_is_off(&mut self, own: &Plane) -> Option<Shape> {
        let plane = Plane::of(self.surface, &self.found)?;
        let carried = self.carried_by_found(own);
        let Self { corners, surface, found, row, distance, .. } = self;
        let is_off = |v: u32| plane.height(surface.points[v as usize]).abs() > *distance;
        let is_away = found.iter().any(|&face| surface.faces[face as usize].into_iter().any(is_off));
        let slips = |(corners, map): (&Corners<'_>, &Affine)| corners.off(surface, own, map, (found, row)) > 1.0;
        (is_away || corners.zip(carried.as_ref()).is_some_and(slips)).then_some(Shape { plane, carried })
    }

    /// Takes the labels back from what was found.
    fn let_go(&mut self) {
        for &face in &self.found {
            self.labels[face as usize] = NONE;
        }
    }

    /// Labels what hangs together with `seed` and is of the shape.
    fn spread(&mut self, seed: u32, label: u32, growing: Growing<'_>, is_wall: &impl Fn(u32, u32) -> bool) {
        let surface = self.surface;
        let Growing { shape: Shape { mut plane, mut carried }, own, leans, share } = growing;
        let near = share * self.distance;
        self.labels[seed as usize] = label;
        self.found.clear();
        self.found.push(seed);
        let (mut done, mut next_lean) = (0, 8);
        while let Some(&face) = self.found.get(done) {
            done += 1;
            for &other in &surface.neighbors[face as usize] {
                if other == NONE || self.labels[other as usize] != NONE || is_wall(face, other) {
                    continue;
                }
                let is_near = |v: u32| plane.height(surface.points[v as usize]).abs() <= near;
                if self.faces_along(other, plane.normal)
                    && surface.faces[other as usize].into_iter().all(is_near)
                    && self.carries(other, own, carried.as_ref(), share)
                {
                    self.labels[other as usize] = label;
                    self.found.push(other);
                }
            }
            // Whenever it has doubled: the plane of few faces is theirs, rounded.
            if leans && self.found.len() >= next_lean {
                next_lean = 2 * self.found.len();
                plane = Plane::of(surface, &self.found).unwrap_or(plane);
                carried = self.carried_by_found(own);
            }
        }
    }

    /// Whether a face is turned as a plane is. One without an area is; so is a sliver, whose corners tell all there is, and one that
    /// noise within the distance may have turned.
    fn faces_along(&self, face: u32, normal: DVec3) -> bool {
        let own = self.normals[face as usize];
        let along = own.dot(normal);
        if along >= self.least_cos * own.length() {
            return true;
        }
        let corners = self.surface.faces[face as usize].map(|v| self.surface.points[v as usize]);
        let longest_sq = (0..3).map(|k| (corners[(k + 1) % 3] - corners[k]).length_squared()).fold(0.0, f64::max);
        let is_lower_than = |height: f64| own.length_squared() <= height * height * longest_sq;
        is_lower_than(self.sliver) || (along >= LEAST_NOISY_COS * own.length() && is_lower_than(self.distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, shapes};

    fn regions(mesh: &Mesh, flatness: Flatness) -> usize {
        let surface = Surface::new(mesh, Some(0.0)).expect("a valid mesh");
        let distance = flatness.distance * surface.diagonal;
        let partition = partition(&surface, flatness.angle_rad, distance, None, |_, _| false);
        assert_eq!(partition.validate(&surface.neighbors), []);
        partition.region_count
    }

    #[test]
    fn flats_are_regions() {
        assert_eq!(regions(&shapes::plane(9, 7), Flatness::default()), 1);
        assert_eq!(regions(&shapes::double_torus(), Flatness::default()), 6 + 8);
        let sphere = shapes::icosphere(3);
        assert_eq!(regions(&sphere, Flatness::default()), sphere.faces.len());
        assert!(regions(&sphere, Flatness { angle_rad: 0.3, distance: 0.02 }) < sphere.faces.len() / 8);
    }

    #[test]
    fn every_vertex_is_within_the_distance() {
        let surface = Surface::new(&shapes::icosphere(4), Some(0.0)).expect("a valid mesh");
        let distance = 0.01 * surface.diagonal;
        let partition = partition(&surface, 1.0, distance, None, |_, _| false);
        let (starts, faces) = partition.faces_by_region();
        let mut most = 0;
        for ends in starts.windows(2) {
            let faces = &faces[ends[0] as usize..ends[1] as usize];
            let plane = Plane::of(&surface, faces).expect("a direction");
            let corners = faces.iter().flat_map(|&f| surface.faces[f as usize]);
            let highest = corners.map(|v| plane.height(surface.points[v as usize]).abs()).fold(0.0, f64::max);
            assert!(highest <= distance * (1.0 + 1e-9), "{} of {} faces", highest / distance, faces.len());
            most = most.max(faces.len());
        }
        assert!(most > 20, "{most} faces in the largest region");
    }

    /// However fine a mesh is, what bends falls into about as many regions.
    #[test]
    fn finer_faces_make_no_more_regions() {
        let flatness = Flatness { angle_rad: 0.35, distance: 0.02 };
        let [coarse, fine] = [4, 6].map(|levels| regions(&shapes::icosphere(levels), flatness));
        assert!(fine < 2 * coarse, "{coarse} regions, {fine} with sixteen times the faces");
    }

    /// What rounding may turn is a matter of rounding, not of how far off a plane the caller lets vertices be.
    #[test]
    fn a_greater_distance_takes_no_walls_for_slivers() {
        let mesh = shapes::voxels([40, 40, 4], |_| true);
        for distance in [1e-5, 0.01, 0.05] {
            assert_eq!(regions(&mesh, Flatness { distance, ..Flatness::default() }), 6, "{distance}");
        }
    }

    #[test]
    fn walls_part_what_is_flat() {
        let surface = Surface::new(&shapes::plane(4, 4), Some(0.0)).expect("a valid mesh");
        assert_eq!(partition(&surface, 0.1, 0.1, None, |_, _| true).region_count, 32);
    }
}
