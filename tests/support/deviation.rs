//! Two-sided deviation between two surfaces, in f64, with a tree of boxes and the exact point–triangle distance.

use coarsen::Mesh;
use coarsen::math::DVec3;
use rayon::prelude::*;

/// How far two surfaces are apart, as fractions of the original's bounding-box diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Root mean square over the original, to the simplified surface.
    pub forward_rms: f64,
    /// Root mean square over the simplified surface, to the original.
    pub backward_rms: f64,
    /// Root of the mean of both squares.
    pub rms: f64,
    /// Greatest over the original's samples and vertices.
    pub forward_max: f64,
    /// Greatest over the simplified surface's samples and vertices.
    pub backward_max: f64,
}

/// Measures with `samples` points a side, spread evenly over the area by a fixed seed.
pub fn deviation(original: &Mesh, simplified: &Mesh, samples: usize) -> Deviation {
    let diagonal = original.diagonal();
    let (forward_rms, forward_max) = one_sided(original, &Tree::new(simplified), samples, 1);
    let (backward_rms, backward_max) = one_sided(simplified, &Tree::new(original), samples, 2);
    let rms = (0.5 * (forward_rms * forward_rms + backward_rms * backward_rms)).sqrt();
    Deviation {
        forward_rms: forward_rms / diagonal,
        backward_rms: backward_rms / diagonal,
        rms: rms / diagonal,
        forward_max: forward_max / diagonal,
        backward_max: backward_max / diagonal,
    }
}

/// Root mean square over the samples, and the maximum over samples and vertices.
fn one_sided(from: &Mesh, to: &Tree, samples: usize, seed: u64) -> (f64, f64) {
    let points = surface_samples(from, samples, seed);
    let squares: Vec<f64> = points.par_iter().map(|&p| to.distance_squared(p)).collect();
    let mut used: Vec<u32> = from.faces.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let at_vertices = used.par_iter().map(|&v| to.distance_squared(from.positions[v as usize]));
    let greatest = squares.iter().copied().fold(at_vertices.reduce(|| 0.0, f64::max), f64::max);
    ((squares.iter().sum::<f64>() / squares.len() as f64).sqrt(), greatest.sqrt())
}

/// Points on the surface: sample i falls into the i-th of `count` equal parts of the total area.
pub fn surface_samples(mesh: &Mesh, count: usize, seed: u64) -> Vec<DVec3> {
    let mut total = 0.0;
    let ends: Vec<f64> = mesh
        .faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
            total += 0.5 * (b - a).cross(c - a).length();
            total
        })
        .collect();
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let at = (i as f64 + random.unit()) / count as f64 * total;
            let f = ends.partition_point(|&end| end <= at).min(mesh.faces.len() - 1);
            let [a, b, c] = mesh.faces[f].map(|v| mesh.positions[v as usize]);
            let (r, s) = (random.unit().sqrt(), random.unit());
            a * (1.0 - r) + b * (r * (1.0 - s)) + c * (r * s)
        })
        .collect()
}

/// The splitmix64 generator.
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Distance from `p` to the nearest of all triangles of `mesh`, one by one.
pub fn brute_force(p: DVec3, mesh: &Mesh) -> f64 {
    let squares = mesh.faces.iter().map(|f| triangle_distance_squared(p, f.map(|v| mesh.positions[v as usize])));
    squares.fold(f64::INFINITY, f64::min).sqrt()
}

/// Squared distance from `p` to the triangle: its face, three edges or three corners, whichever region `p` is in.
pub fn triangle_distance_squared(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    // Inside all three walls that stand on the edges: the nearest point is inside the face.
    let inside = |s: DVec3, e: DVec3| n.dot((e - s).cross(p - s)) > 0.0;
    if n.length_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return n.dot(p - a).powi(2) / n.length_squared();
    }
    [(a, b), (b, c), (c, a)].map(|(s, e)| segment_distance_squared(p, s, e)).into_iter().fold(f64::INFINITY, f64::min)
}

fn segment_distance_squared(p: DVec3, s: DVec3, e: DVec3) -> f64 {
    let along = e - s;
    let length_sq = along.length_squared();
    let t = if length_sq > 0.0 { ((p - s).dot(along) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    p.distance_squared(s + along * t)
}

/// Triangles in a tree of boxes, halved at the median of their centres along the longest side.
#[derive(Debug)]
pub struct Tree {
    low: DVec3,
    high: DVec3,
    triangles: Vec<[DVec3; 3]>,
    halves: Option<Box<(Tree, Tree)>>,
}

impl Tree {
    /// The tree over the faces of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        Self::over(mesh.faces.iter().map(|f| f.map(|v| mesh.positions[v as usize])).collect())
    }

    fn over(mut triangles: Vec<[DVec3; 3]>) -> Self {
        const LEAF: usize = 4;
        let low = triangles.iter().flatten().fold(DVec3::INFINITY, |low, &p| low.min(p));
        let high = triangles.iter().flatten().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
        if triangles.len() <= LEAF {
            return Self { low, high, triangles, halves: None };
        }
        let axis = (high - low).max_position();
        let middle = triangles.len() / 2;
        let centre = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        triangles.select_nth_unstable_by(middle, |s, t| centre(s).total_cmp(&centre(t)));
        let upper = triangles.split_off(middle);
        Self { low, high, triangles: Vec::new(), halves: Some(Box::new((Self::over(triangles), Self::over(upper)))) }
    }

    /// Distance from `p` to the nearest triangle.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.distance_squared(p).sqrt()
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let mut least = f64::INFINITY;
        self.descend(p, &mut least);
        least
    }

    fn descend(&self, p: DVec3, least: &mut f64) {
        if self.box_distance_squared(p) >= *least {
            return;
        }
        for &t in &self.triangles {
            *least = least.min(triangle_distance_squared(p, t));
        }
        if let Some(halves) = &self.halves {
            let (mut near, mut far) = (&halves.0, &halves.1);
            if far.box_distance_squared(p) < near.box_distance_squared(p) {
                (near, far) = (far, near);
            }
            near.descend(p, least);
            far.descend(p, least);
        }
    }

    fn box_distance_squared(&self, p: DVec3) -> f64 {
        p.distance_squared(p.clamp(self.low, self.high))
    }
}
