//! The input under a result: where a vertex stands on it, and the light there.

use super::super::boundary::Boundary;
use super::super::interior::Color;
use super::super::plane::Plane;
use super::super::surface::Surface;
use crate::math::{DVec2, DVec3};

/// Faces or edges that a vertex may cross at once.
const MOST_STEPS: usize = 1 << 12;
/// A point outside a face by less than this share is inside.
const INSIDE: f64 = -1e-9;

/// A place on the surface: the shares of three of its vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    pub corners: [u32; 3],
    pub shares: [f64; 3],
}

impl Stand {
    /// At a vertex.
    pub fn at(vertex: u32) -> Self {
        Self { corners: [vertex; 3], shares: [1.0, 0.0, 0.0] }
    }

    /// A number that the corners have, here: theirs exactly where all have the same.
    pub fn mix(&self, at: impl Fn(u32) -> DVec3) -> DVec3 {
        let [a, b, c] = self.corners.map(at);
        a + (b - a) * self.shares[1] + (c - a) * self.shares[2]
    }
}

/// Along what a vertex may slide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Nothing: it stays.
    Nowhere,
    /// The plane of its region: it stands on this face.
    Plane(u32),
    /// A straight stretch of a chain: it stands on the edge from this place to the next. The direction has length 1.
    Line { place: usize, direction: DVec3 },
}

/// The input, and which regions its faces are of.
#[derive(Debug, Clone, Copy)]
pub struct Ground<'a> {
    pub surface: &'a Surface,
    pub labels: &'a [u32],
    pub boundary: &'a Boundary,
    pub colors: &'a [[f32; 4]],
}

impl Ground<'_> {
    pub fn color(&self, vertex: u32) -> Color {
        let [red, green, blue, _] = self.colors[vertex as usize];
        [red, green, blue].map(f64::from)
    }

    pub fn color_at(&self, stand: &Stand) -> Color {
        stand.mix(|v| DVec3::from(self.color(v))).to_array()
    }

    pub fn point_at(&self, stand: &Stand) -> DVec3 {
        stand.mix(|v| self.surface.points[v as usize])
    }

    /// The place over a point of a region's plane, found from a face of the region; none outside it.
    pub fn over(&self, plane: &Plane, face: u32, at: DVec2) -> Option<(Way, Stand)> {
        let mut face = face;
        for _ in 0..MOST_STEPS {
            let corners = self.surface.faces[face as usize];
            let [a, b, c] = corners.map(|v| plane.project(self.surface.points[v as usize]));
            let area = (b - a).perp_dot(c - a);
            let (of_b, of_c) = ((at - a).perp_dot(c - a) / area, (b - a).perp_dot(at - a) / area);
            let shares = [1.0 - of_b - of_c, of_b, of_c];
            let least = (0..3).fold(0, |least, k| if shares[k] < shares[least] { k } else { least });
            if shares[least] >= INSIDE {
                return Some((Way::Plane(face), Stand { corners, shares }));
            }
            if !shares[least].is_finite() {
                return None;
            }
            // Across the edge that faces the corner of the least share.
            let next = self.surface.across(face, (least + 1) % 3)?;
            if self.labels[next as usize] != self.labels[face as usize] {
                return None;
            }
            face = next;
        }
        None
    }

    /// The place along a chain that is so far along a direction from the start of an edge; none past its ends.
    pub fn along(&self, place: usize, direction: DVec3, target: f64) -> Option<(Way, Stand)> {
        let ends = self.boundary.places(self.boundary.chain_at(place));
        let vertex = |place: usize| self.boundary.chain_vertices[place];
        let along = |place: usize| self.surface.points[vertex(place) as usize].dot(direction);
        let mut place = place;
        for _ in 0..MOST_STEPS {
            let (from, to) = (along(place), along(place + 1));
            if target < from && place > ends.start {
                place -= 1;
            } else if target > to && place + 2 < ends.end {
                place += 1;
            } else {
                let share = (target - from) / (to - from);
                let corners = [vertex(place), vertex(place + 1), vertex(place + 1)];
                let stand = Stand { corners, shares: [1.0 - share, share, 0.0] };
                return (0.0..=1.0).contains(&share).then_some((Way::Line { place, direction }, stand));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;

    #[test]
    fn places_are_found_inside_a_region_and_nowhere_else() {
        let surface = Surface::new(&shapes::plane(6, 4), Some(0.0)).expect("a valid mesh");
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let plane = Plane::of(&surface, &faces).expect("a plane");
        let points: Vec<DVec2> = surface.points.iter().map(|&p| plane.project(p)).collect();
        let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), &p| (low.min(p), high.max(p)));
        let middle = (low.x + high.x) / 2.0;
        let is_right = |f: &[u32; 3]| f.map(|v| points[v as usize].x).iter().sum::<f64>() / 3.0 > middle;
        let labels: Vec<u32> = surface.faces.iter().map(|f| u32::from(is_right(f))).collect();
        let boundary = Boundary::new(&surface, &Partition { labels: labels.clone(), region_count: 2 });
        let colors: Vec<[f32; 4]> = points.iter().map(|p| [p.x as f32, p.y as f32, 0.5, 1.0]).collect();
        let ground = Ground { surface: &surface, labels: &labels, boundary: &boundary, colors: &colors };
        let from = labels.iter().position(|&label| label == 0).expect("a face on the left") as u32;
        let at = |x: f64, y: f64| low + (high - low) * DVec2::new(x, y);
        for target in [at(0.1, 0.1), at(0.41, 0.9), at(0.3, 0.5), low] {
            let (way, stand) = ground.over(&plane, from, target).expect("inside");
            assert!(matches!(way, Way::Plane(face) if surface.faces[face as usize] == stand.corners));
            assert!((plane.project(ground.point_at(&stand)) - target).length() < 1e-9);
            let [red, green, blue] = ground.color_at(&stand);
            assert!((DVec2::new(red, green) - target).length() < 1e-6 && blue == 0.5);
        }
        assert!([at(0.7, 0.5), at(-0.1, 0.5), at(f64::NAN, 0.5)].map(|p| ground.over(&plane, from, p)) == [None; 3]);

        // Along the side where the regions meet, from either of its edges.
        let length = |&chain: &usize| boundary.chain(chain).len();
        let chain = (0..boundary.chain_count()).min_by_key(length).expect("three chains");
        let ends = boundary.places(chain);
        let point = |place: usize| surface.points[boundary.chain_vertices[place] as usize];
        let direction = (point(ends.end - 1) - point(ends.start)).normalize();
        let along = |share: f64| (point(ends.start) + (point(ends.end - 1) - point(ends.start)) * share).dot(direction);
        for place in [ends.start, ends.end - 2] {
            for share in [0.0, 0.3, 0.6, 1.0] {
                let (way, stand) = ground.along(place, direction, along(share)).expect("on the chain");
                assert!(matches!(way, Way::Line { .. }));
                assert!((ground.point_at(&stand).dot(direction) - along(share)).abs() < 1e-9);
            }
            assert!([-0.1, 1.1].map(|share| ground.along(place, direction, along(share))) == [None; 2]);
        }
    }
}
