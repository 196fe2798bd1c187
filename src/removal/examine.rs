//! One vertex on the state that a round began with: may it go, and what takes the place of its faces.

use crate::kernel::rows::{Face, Normal};
use crate::kernel::stars::{Stars, faces_with};
use crate::math::DVec3;
use crate::mesh::limits::min_cos;

use super::hole::Hole;
use super::polygon::{Rejection, Worth};
use super::samples::{Moved, Samples};
use super::{Fill, Options};

/// Least cosine between the normals of two faces at an edge, unless it was less before: about 154°.
const FOLD_COS: f64 = -0.9;

/// What stays the same over all rounds of a run.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    fill: Fill,
    min_cos: f64,
    pub crease_cos: f32,
    pub keeps_corners: bool,
    /// Greatest distance of a sample to its face, and of an edge to the surface of the start.
    max_deviation: f64,
}

impl Rules {
    /// The rules that `options` set, with an error limit in the frame.
    pub fn new(options: &Options, max_deviation: f64) -> Self {
        Self {
            fill: options.fill,
            min_cos: min_cos(options.max_flip_rad),
            crease_cos: options.crease_cos(),
            keeps_corners: options.keeps_corners(),
            max_deviation,
        }
    }
}

/// What a round began with.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    pub stars: Stars<'a>,
    /// Of the faces; only where there are features.
    pub normals: &'a [Normal],
    /// The vertex of the start that each is.
    pub sources: &'a [u32],
    pub samples: &'a Samples,
}

/// A legal removal.
#[derive(Debug)]
pub struct Removal {
    pub ring: Vec<u32>,
    /// The faces that go.
    pub old: Vec<u32>,
    /// The faces that come.
    pub new: Vec<Face>,
    /// Edges that come, each by its lower vertex first.
    pub edges: Vec<[u32; 2]>,
    /// Where no face comes, the face that is left at the edge, and its vertex across.
    pub remainder: Option<[u32; 2]>,
    /// The samples of the faces that go.
    pub moved: Vec<Moved>,
    /// How far what comes may be out of the surface of the start.
    pub outward: f32,
    /// Greatest distance of either kind.
    pub deviation: f64,
}

impl Removal {
    pub fn faces_removed(&self) -> usize {
        self.old.len() - self.new.len()
    }
}

impl State<'_> {
    /// What removing `vertex` does.
    ///
    /// # Errors
    /// Why it may not.
    pub fn examine(&self, vertex: u32, rules: &Rules, hole: &mut Hole) -> Result<Removal, Rejection> {
        let is_fan = hole.read(vertex, &self.stars);
        if !is_fan || (!hole.is_open && (hole.ring.len() < 3 || hole.is_face(&self.stars))) {
            return Err(Rejection::Link);
        }
        let mut worth = Worth::NONE;
        let mut triangles = Vec::with_capacity(hole.ring.len());
        for polygon in hole.polygons(self.normals, rules.crease_cos) {
            let (filled, own) = rules.fill.fill(&polygon, rules.min_cos)?;
            worth = worth.and(own);
            triangles.extend(filled.into_iter().map(|corners| corners.map(|i| polygon.places[i])));
        }
        if worth.least_cos < FOLD_COS && worth.least_cos < hole.least_cos() {
            return Err(Rejection::Flip);
        }
        let remainder = self.remainder(hole, &triangles)?;

        let mut shapes: Vec<[DVec3; 3]> = triangles.iter().map(|corners| corners.map(|i| hole.points[i])).collect();
        if shapes.is_empty() {
            shapes.extend([[hole.points[0], hole.points[1], hole.points[1]]]);
        }
        let origin = self.stars.positions[vertex as usize].xyz().as_dvec3();
        let (own, mut moved) = (self.sources[vertex as usize], Vec::new());
        let inward = self.samples.nearest(own, &hole.faces, origin, &shapes, &mut moved).sqrt();
        if inward > rules.max_deviation {
            return Err(Rejection::Error);
        }
        let mut places: Vec<[usize; 2]> = (triangles.iter())
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [a, c]])
            .filter(|&[i, j]| !hole.is_side(i, j))
            .map(|[i, j]| [i.min(j), i.max(j)])
            .collect();
        places.sort_unstable();
        places.dedup();
        let middles = places.iter().map(|&[i, j]| (hole.points[i] + hole.points[j]) / 2.0);
        let outward = self.samples.outward(middles, &hole.shapes(), &hole.faces);
        if outward > rules.max_deviation {
            return Err(Rejection::Error);
        }
        let edge = |ends: [usize; 2]| ends.map(|i| hole.ring[i]);
        let edges = places.into_iter().map(edge).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        let face = |corners: [usize; 3]| {
            let [a, b, c] = corners.map(|i| hole.ring[i]);
            Face { a, b, c }
        };
        let mut old = hole.faces.clone();
        old.sort_unstable();
        let new = triangles.into_iter().map(face).collect();
        let (outward, deviation) = (outward as f32, inward.max(outward));
        Ok(Removal { ring: hole.ring.clone(), old, new, edges, remainder, moved, outward, deviation })
    }

    /// Where nothing fills the hole, the face beyond its one side: one there must be, and one only.
    fn remainder(&self, hole: &Hole, triangles: &[[usize; 3]]) -> Result<Option<[u32; 2]>, Rejection> {
        if !triangles.is_empty() {
            return Ok(None);
        }
        let face = hole.beyond[0].ok_or(Rejection::Link)?;
        // With the one that goes.
        let [first, second] = [hole.ring[0], hole.ring[1]];
        let by_faces = |v: u32| self.stars.ring(v).len();
        let (of, around) = if by_faces(first) < by_faces(second) { (second, first) } else { (first, second) };
        if faces_with(of, around, &self.stars) != 2 {
            return Err(Rejection::Link);
        }
        let across = self.stars.faces[face as usize].corners().into_iter().find(|v| !hole.ring.contains(v));
        Ok(Some([face, across.ok_or(Rejection::Link)?]))
    }
}
