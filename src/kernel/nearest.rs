//! The point of a mesh nearest to a given one, among the faces around a vertex and around what lies beyond their rim. In
//! WGSL: `shaders/shared/nearest.wgsl`.

use super::nearest_point::{nearest_weights, point_at};
use super::stars::Stars;
use crate::backend::Constant;
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, dot3, flush3, sub3};

/// No face was found.
pub const NO_FACE: u32 = u32::MAX;
/// Farther than anything, squared: infinity does not exist in WGSL.
pub const FAR: f32 = 3.0e38;
/// Steps of a search from ring to ring at most. A search that ends after one takes strangers for nearest faces where a
/// vertex stands for a large flat: fandisk at 10 % then rises to 1.3 times the deviation without a fit.
pub const MOST_STEPS: u32 = 64;
/// Marks the face of a sample whose nearest one is not around its vertex: it counts, but pulls nothing.
pub const APART: u32 = 1 << 31;
/// The constants above under their names in WGSL.
pub const CONSTANTS: &[(&str, Constant)] = &[
    ("NO_FACE", Constant::U32(NO_FACE)),
    ("FAR", Constant::F32(FAR)),
    ("MOST_STEPS", Constant::U32(MOST_STEPS)),
    ("APART", Constant::U32(APART)),
];

/// The nearest point of a mesh found so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The face it lies on, or [`NO_FACE`].
    pub face: u32,
    /// Its weights of the face's corners.
    pub weights: Vec3,
    /// Its squared distance.
    pub distance_sq: f32,
}

/// The corners of a face about `point`.
#[inline(always)]
pub fn corners_about(point: Vec3, face: u32, stars: &Stars<'_>) -> [Vec3; 3] {
    let row = stars.faces[face as usize];
    let corner = |v: u32| flush3(sub3(stars.positions[v as usize].xyz(), point), LEAST_FACTOR);
    [corner(row.a), corner(row.b), corner(row.c)]
}

/// The nearer of `best` and the nearest point of the faces around `vertex`.
#[inline(always)]
pub fn nearer_around(vertex: u32, point: Vec3, best: Nearest, stars: &Stars<'_>) -> Nearest {
    let mut nearest = best;
    for &face in stars.ring(vertex) {
        let [a, b, c] = corners_about(point, face, stars);
        let weights = nearest_weights(a, b, c);
        let away = flush3(point_at(weights, a, b, c), LEAST_FACTOR);
        let distance_sq = dot3(away, away);
        if distance_sq < nearest.distance_sq {
            nearest = Nearest { face, weights, distance_sq };
        }
    }
    nearest
}

/// The nearest point of the faces around `vertex`, then of those beyond it while it lies on a rim and gets nearer.
#[inline(always)]
pub fn nearest_from(vertex: u32, point: Vec3, stars: &Stars<'_>) -> Nearest {
    let none = Nearest { face: NO_FACE, weights: Vec3::ZERO, distance_sq: FAR };
    let mut nearest = nearer_around(vertex, point, none, stars);
    for _ in 0..MOST_STEPS {
        let w = nearest.weights;
        if nearest.face == NO_FACE || (w.x > 0.0 && w.y > 0.0 && w.z > 0.0) {
            break;
        }
        let last = nearest.face;
        let corners = stars.faces[last as usize];
        if w.x > 0.0 && corners.a != vertex {
            nearest = nearer_around(corners.a, point, nearest, stars);
        }
        if w.y > 0.0 && corners.b != vertex {
            nearest = nearer_around(corners.b, point, nearest, stars);
        }
        if w.z > 0.0 && corners.c != vertex {
            nearest = nearer_around(corners.c, point, nearest, stars);
        }
        if nearest.face == last {
            break;
        }
    }
    nearest
}
