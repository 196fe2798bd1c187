//! One region with its borders as they are now: triangles, or what keeps it from having any.

use super::Light;
use crate::math::DVec3;
use crate::partition::boundary::{Boundary, Leg};
use crate::partition::chains::{Chains, Segment};
use crate::partition::fit::{Sample, area_at};
use crate::partition::interior::{Color, KeptEdges, Places, Shade, thin};
use crate::partition::plane::Plane;
use crate::partition::surface::Surface;
use crate::partition::triangulate::{
    Flaw, Misfit, Outline, Triangulation, first_joined_otherwise, improve, triangulate,
};

/// What came of a region.
#[derive(Debug)]
pub enum Answer {
    /// Its own faces are as few as can be.
    Least,
    /// Drawn in its plane.
    Flat(Flat),
    /// Filled in space, by vertices of the surface.
    Spatial(Vec<[u32; 3]>),
    /// Its chains need more vertices, at these places.
    Split(Vec<usize>),
    /// No vertices of its chains help: not in this plane.
    Hopeless,
}

/// A region drawn in its plane.
#[derive(Debug)]
pub struct Flat {
    pub outline: Outline,
    /// Vertices of the surface inside the region; those are back for their light that a triangle has.
    pub inner: Vec<u32>,
    /// Indices of the outline's points, and after them of those inside.
    pub triangles: Vec<[u32; 3]>,
    /// The light between its vertices, once it was asked for.
    pub samples: Option<Vec<Sample>>,
}

impl Flat {
    /// Its triangles as vertices of the surface.
    pub fn vertices(&self) -> impl Iterator<Item = [u32; 3]> {
        let of_ring = self.outline.vertices.len();
        let vertex = move |i: u32| match (i as usize).checked_sub(of_ring) {
            Some(inner) => self.inner[inner],
            None => self.outline.vertices[i as usize],
        };
        self.triangles.iter().map(move |triangle| triangle.map(vertex))
    }

    /// Whether a triangle has a vertex that was put back.
    pub fn has_vertices_inside(&self) -> bool {
        self.triangles.iter().flatten().any(|&i| i as usize >= self.outline.vertices.len())
    }

    /// Puts those vertices from inside the region back whose light would be missed.
    pub fn put_back(&mut self, surface: &Surface, faces: &[u32], inner: Vec<u32>, plane: &Plane, light: Light<'_>) {
        let vertices = || self.outline.vertices.iter().chain(&inner).copied();
        let mut points = self.outline.points.clone();
        points.extend(inner.iter().map(|&v| plane.project(surface.points[v as usize])));
        let mut colors: Vec<Color> = vertices().map(|v| light.color(v)).collect();
        let mut areas: Vec<f64> = vertices().map(|v| area_at(surface, v)).collect();
        let vertex_count = points.len() as u32;
        for &f in faces {
            let corners = surface.faces[f as usize];
            let middle = corners.iter().map(|&v| surface.points[v as usize]).sum::<DVec3>() / 3.0;
            points.push(plane.project(middle));
            let Sample { color, area, .. } = light.middle(surface, 0, f);
            colors.push(color);
            areas.push(area);
        }
        let bound_count = vertex_count;
        let places =
            Places { points: &points, colors: &colors, areas: &areas, vertex_count, bound_count, is_outer: &[] };
        let kept: KeptEdges = (0..).zip(self.outline.successors()).map(|(a, b)| [a.min(b), a.max(b)]).collect();
        let (triangles, members) = thin(places, std::mem::take(&mut self.triangles), &kept, light.limits);
        let mut samples = Vec::with_capacity(members.iter().map(Vec::len).sum());
        for ((face, &corners), members) in (0..).zip(&triangles).zip(&members) {
            let corners = corners.map(|v| points[v as usize]);
            let parts = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let shares = Shade::new(corners, parts);
            samples.extend(members.iter().map(|&point| {
                let at = point as usize;
                Sample { face, shares: shares.difference(points[at], [0.0; 3]), color: colors[at], area: areas[at] }
            }));
        }
        (self.triangles, self.samples, self.inner) = (triangles, Some(samples), inner);
    }
}

/// Attempts after which all segments of a region are split instead of those that are in the way: then the vertices double
/// each time, so that it ends soon.
const PATIENCE: u32 = 6;

/// A region, its plane and its borders.
#[derive(Debug, Clone, Copy)]
pub struct Site<'a> {
    pub region: usize,
    pub plane: &'a Plane,
    pub surface: &'a Surface,
    pub boundary: &'a Boundary,
    pub chains: &'a Chains<'a>,
    /// How many attempts gave its chains more vertices.
    pub attempts: u32,
}

impl Site<'_> {
    /// Draws the region in its plane.
    pub fn draw(self, by: Triangulation) -> Answer {
        let rings: Vec<Vec<Segment>> =
            self.boundary.loops(self.region).map(|legs| segments(legs, self.chains)).collect();
        let short: Vec<usize> =
            rings.iter().filter(|ring| ring.len() < 3).filter_map(|ring| farthest(ring, self.chains)).collect();
        if !short.is_empty() {
            return Answer::Split(short);
        }
        let vertices: Vec<Vec<u32>> = rings.iter().map(|ring| self.vertices(ring)).collect();
        let outline = match self.outline(&vertices) {
            Ok(outline) => outline,
            Err(Misfit::Empty) => return Answer::Hopeless,
            Err(Misfit::Flat { ring } | Misfit::Outer { ring } | Misfit::Hole { ring }) => {
                return self.split(&rings, &rings[ring]);
            }
        };
        let triangles = triangulate(&outline, by);
        let other = triangles.as_ref().and_then(|_| first_joined_otherwise(&outline));
        if let (Some(mut triangles), None) = (triangles, other) {
            improve(&outline, &mut triangles, |_, _| false);
            return Answer::Flat(Flat { outline, inner: Vec::new(), triangles, samples: None });
        }
        // The outer ring comes first, the others as they were.
        let first = &outline.vertices[..outline.ring_starts[1] as usize];
        let outer = vertices.iter().position(|ring| ring == first).unwrap_or(0);
        let order = std::iter::once(outer).chain((0..rings.len()).filter(|&ring| ring != outer));
        let sides: Vec<Segment> = order.flat_map(|ring| rings[ring].iter().copied()).collect();
        if let Some(point) = other {
            // Its triangles would close a fan at that vertex, or part one: loops follow the region from one edge to the next.
            return self.split(&rings, &[sides[point]]);
        }
        match outline.fault() {
            Some(Flaw::Crossing(edges)) => self.split(&rings, &edges.map(|edge| sides[edge])),
            Some(Flaw::Misplaced(_)) | None => self.split(&rings, &sides),
        }
    }

    fn outline(self, rings: &[Vec<u32>]) -> Result<Outline, Misfit> {
        Outline::from_rings(rings, |v| self.plane.project(self.surface.points[v as usize]))
    }

    /// The vertices where segments begin.
    fn vertices(self, ring: &[Segment]) -> Vec<u32> {
        ring.iter().map(|&[from, _]| self.boundary.chain_vertices[from]).collect()
    }

    /// More vertices where `segments` are in the way, if the region can be drawn with all of them.
    fn split(self, rings: &[Vec<Segment>], segments: &[Segment]) -> Answer {
        if self.attempts == 0 && !self.is_drawable() {
            return Answer::Hopeless;
        }
        let all = || rings.iter().flatten();
        let places: Vec<usize> = if self.attempts < PATIENCE {
            farthest(segments, self.chains).or_else(|| farthest(all(), self.chains)).into_iter().collect()
        } else {
            all().filter_map(|segment| farthest([segment], self.chains)).collect()
        };
        if places.is_empty() { Answer::Hopeless } else { Answer::Split(places) }
    }

    /// Whether the region's loops with all their vertices are an outline whose inside goes on from edge to edge as they do.
    fn is_drawable(self) -> bool {
        let ring = |legs: &[Leg]| {
            let mut ring = Vec::new();
            for leg in legs {
                let chain = self.boundary.chain(leg.chain());
                match leg.is_reversed() {
                    false => ring.extend_from_slice(&chain[..chain.len() - 1]),
                    true => ring.extend(chain[1..].iter().rev()),
                }
            }
            ring
        };
        let rings: Vec<Vec<u32>> = self.boundary.loops(self.region).map(ring).collect();
        self.outline(&rings)
            .is_ok_and(|outline| outline.fault().is_none() && first_joined_otherwise(&outline).is_none())
    }
}

/// The segments of a loop, each from where the loop comes to where it goes.
pub fn segments(legs: &[Leg], chains: &Chains<'_>) -> Vec<Segment> {
    let mut ring = Vec::new();
    for leg in legs {
        let start = ring.len();
        ring.extend(chains.segments(leg.chain()));
        if leg.is_reversed() {
            ring[start..].reverse();
            ring[start..].iter_mut().for_each(|segment| segment.reverse());
        }
    }
    ring
}

/// The place of the vertex that is farthest from its segment.
pub fn farthest<'s>(segments: impl IntoIterator<Item = &'s Segment>, chains: &Chains<'_>) -> Option<usize> {
    let mut worst = None;
    for &[from, to] in segments {
        let Some((place, off)) = chains.farthest([from.min(to), from.max(to)]) else { continue };
        if worst.is_none_or(|(_, most)| off > most) {
            worst = Some((place, off));
        }
    }
    worst.map(|(place, _)| place)
}
