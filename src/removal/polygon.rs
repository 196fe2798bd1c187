//! A polygon to fill: which faces may lie in it, and what a fill is worth.

use crate::math::{DVec3, radius_ratio};

use super::hole::Hole;

/// Least height of a face over its length, unless one that it replaces was lower: thinner ones have normals of noise.
const LEAST_HEIGHT: f64 = 1e-3;
/// The normals of what goes cancel out where their sum is shorter than this share of theirs: nothing tells the sides apart.
const FOLDED: f64 = 1e-3;

/// Why a hole stays open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rejection {
    /// An edge or a face that the fill needs is there already.
    Link,
    /// A face would turn over.
    Flip,
    /// A face would become a sliver.
    Aspect,
    /// The error limit.
    Error,
}

/// A side of a hole, or all of it.
#[derive(Debug)]
pub struct Polygon<'a> {
    pub hole: &'a Hole,
    /// Places in the ring, counter-clockwise.
    pub places: Vec<usize>,
    /// The sum of the normals of what goes, as long as twice their areas.
    pub normal: DVec3,
    /// The sum of their lengths.
    pub area: f64,
    /// Least height over length of what goes.
    pub least_height: f64,
}

/// A face that may lie in a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// The unit normal; `None` without area.
    pub normal: Option<DVec3>,
    /// The ratio of the radii of the circles in and around it, 0 … ½.
    pub ratio: f64,
}

/// What a fill is worth: the cosine at its sharpest edge, then the sum of the ratios.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Worth {
    pub least_cos: f64,
    pub ratios: f64,
}

impl Worth {
    /// Of nothing.
    pub const NONE: Self = Self { least_cos: 1.0, ratios: 0.0 };

    /// Of both together.
    pub fn and(self, other: Self) -> Self {
        Self { least_cos: self.least_cos.min(other.least_cos), ratios: self.ratios + other.ratios }
    }

    /// With an edge between these normals.
    pub fn with_edge(self, first: Option<DVec3>, second: Option<DVec3>) -> Self {
        let cos = first.zip(second).map_or(1.0, |(first, second)| first.dot(second));
        Self { least_cos: self.least_cos.min(cos), ..self }
    }

    /// Whether it is better.
    pub fn beats(self, other: Option<Self>) -> bool {
        other.is_none_or(|other| self > other)
    }
}

/// The direction of (p1−p0)×(p2−p0), where there is one.
pub fn unit_normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    (b - a).cross(c - a).try_normalize()
}

/// Twice the area over the sum of the squares of the sides: about the height over the length.
pub fn height([a, b, c]: [DVec3; 3]) -> f64 {
    let sides_sq = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
    if sides_sq > 0.0 { (b - a).cross(c - a).length() / sides_sq } else { 0.0 }
}

impl Polygon<'_> {
    /// Vertices.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    pub fn point(&self, i: usize) -> DVec3 {
        self.hole.points[self.places[i]]
    }

    /// The unit normal beyond the side from one vertex to the next.
    pub fn outside(&self, i: usize) -> Option<DVec3> {
        self.hole.outside(self.places[i], self.places[(i + 1) % self.len()])
    }

    /// Whether an edge may join two vertices: a side of the hole, or one that is no edge yet.
    pub fn may_join(&self, i: usize, j: usize) -> bool {
        let (i, j) = (self.places[i], self.places[j]);
        self.hole.is_side(i, j) || !self.hole.are_joined(i, j)
    }

    /// The face on three vertices in ascending order, if it keeps its side and shape.
    ///
    /// # Errors
    /// [`Rejection::Flip`] or [`Rejection::Aspect`].
    pub fn tile(&self, corners: [usize; 3], min_cos: f64) -> Result<Tile, Rejection> {
        let [a, b, c] = corners.map(|i| self.point(i));
        let doubled = (b - a).cross(c - a);
        let (dot, length) = (doubled.dot(self.normal), doubled.length());
        // What has no area may take any shape.
        if self.area > 0.0 {
            let sum = self.normal.length();
            let keeps_side = sum > FOLDED * self.area && dot > min_cos * length * sum;
            if !keeps_side {
                return Err(Rejection::Flip);
            }
            if height([a, b, c]) < self.least_height.min(LEAST_HEIGHT) {
                return Err(Rejection::Aspect);
            }
        }
        let ratio = radius_ratio([(c - b).length(), (a - c).length(), (b - a).length()]);
        Ok(Tile { normal: doubled.try_normalize(), ratio })
    }

    /// Whether these triangles, in ascending order of corners, are a fill, and what it is worth.
    ///
    /// # Errors
    /// Why not.
    pub fn worth(&self, triangles: &[[usize; 3]], min_cos: f64) -> Result<Worth, Rejection> {
        let count = self.len();
        let mut worth = Worth::NONE;
        let mut sides: Vec<Option<Option<DVec3>>> = vec![None; count * count];
        for side in 0..count {
            let (i, j) = (side.min((side + 1) % count), side.max((side + 1) % count));
            sides[i * count + j] = self.outside(side).map(Some);
        }
        for &[a, b, c] in triangles {
            if !(self.may_join(a, b) && self.may_join(b, c) && self.may_join(a, c)) {
                return Err(Rejection::Link);
            }
            let tile = self.tile([a, b, c], min_cos)?;
            worth.ratios += tile.ratio;
            for (i, j) in [(a, b), (b, c), (a, c)] {
                match &mut sides[i * count + j] {
                    Some(other) => worth = worth.with_edge(*other, tile.normal),
                    none => *none = Some(tile.normal),
                }
            }
        }
        Ok(worth)
    }
}
