//! How far two surfaces are apart, measured on both sides.
//!
//! # Reference
//! Metro \[CRS98\]: e(p, S) is the distance from p to the closest point of the surface S. A side's maximum is the
//! greatest e over its samples (one-sided Hausdorff distance), mean and root mean square are integrals over the surface.

use rayon::prelude::*;

use super::Spread;
use super::sampling::{Kind, Sample, Sampler};
use crate::backend::Device;
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::spatial::{Bvh, Frame, Hit};

/// Chunks whose sums are held at a time.
const BATCH: usize = 64;

/// Steps of the histogram of angles, over half a turn.
const ANGLE_STEPS: usize = 1 << 16;

/// How to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Options {
    /// Samples on the faces of each side, beside its vertices and edges; `None` takes ten a face of the larger mesh.
    pub samples: Option<usize>,
    /// Another seed puts the samples elsewhere.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { samples: None, seed: 1998 }
    }
}

/// How angles are spread, in radians.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct AngleSpread {
    /// Their mean.
    pub mean_rad: f64,
    /// 95 in a hundred are at most this, to π/65,536.
    pub p95_rad: f64,
    /// The greatest.
    pub max_rad: f64,
}

/// What was measured from one surface to the other.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Side {
    /// Samples of all kinds: vertices, edges, faces.
    pub samples: usize,
    /// Distance to the other surface. The maximum looks at all samples, mean and root mean square at those on faces; on
    /// a surface without area at its vertices.
    pub distance: Spread,
    /// Angle between the flat normals at a face sample and at its closest point; faces without area are left out.
    pub normals: AngleSpread,
    /// The sample with the greatest distance.
    pub worst: [f64; 3],
}

/// How far two surfaces are apart.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Deviation {
    /// Of the first mesh's bounding box.
    pub diagonal: f64,
    /// From the first surface to the second.
    pub forward: Side,
    /// From the second surface to the first.
    pub backward: Side,
}

impl Deviation {
    /// The greater of both sides; its maximum is the Hausdorff distance.
    pub fn symmetric(&self) -> Spread {
        self.forward.distance.greater(self.backward.distance)
    }
}

/// Measures how far the surfaces of `a` and `b` are apart, from either side.
///
/// With the meshes swapped the sides are swapped, bit for bit.
///
/// # Errors
/// [`Error::Mesh`] when a mesh breaks the invariants of [`Mesh::check`] or has no faces, for there is no distance to
/// nothing; the message says which.
pub fn deviation(a: &Mesh, b: &Mesh, options: &Options, device: &Device) -> Result<Deviation> {
    check(a, "first")?;
    check(b, "second")?;
    let samples = options.samples.unwrap_or_else(|| a.faces.len().max(b.faces.len()).saturating_mul(10));
    device.install(|| {
        let frame = Frame::of(a, b);
        // One after the other, so that only one tree is held.
        let forward = side(a, b, frame, samples, options.seed);
        let backward = side(b, a, frame, samples, options.seed);
        Ok(Deviation { diagonal: a.diagonal(), forward, backward })
    })
}

/// The distance from every vertex of `a` to the surface of `b`.
///
/// # Errors
/// [`Error::Mesh`] when a mesh breaks the invariants of [`Mesh::check`] or `b` has no faces.
pub fn vertex_distances(a: &Mesh, b: &Mesh, device: &Device) -> Result<Vec<f64>> {
    a.check().map_err(|error| named("first", error))?;
    check(b, "second")?;
    device.install(|| {
        let frame = Frame::of(a, b);
        let bvh = Bvh::new(b, frame);
        let mut distances = vec![0.0; a.positions.len()];
        distances.par_chunks_mut(super::sampling::CHUNK).enumerate().for_each(|(chunk, distances)| {
            let mut guess = 0;
            for (distance, &position) in distances.iter_mut().zip(&a.positions[chunk * super::sampling::CHUNK..]) {
                if let Some(hit) = bvh.closest(frame.to_frame(position), guess) {
                    guess = hit.face;
                    *distance = frame.length_to_model(hit.distance_sq.sqrt());
                }
            }
        });
        Ok(distances)
    })
}

fn check(mesh: &Mesh, which: &str) -> Result<()> {
    mesh.check().map_err(|error| named(which, error))?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh(format!("the {which} mesh has no faces to compare")));
    }
    Ok(())
}

fn named(which: &str, error: Error) -> Error {
    match error {
        Error::Mesh(message) => Error::Mesh(format!("the {which} mesh: {message}")),
        other => other,
    }
}

/// Measures from the surface of `from` to that of `to`.
fn side(from: &Mesh, to: &Mesh, frame: Frame, samples: usize, seed: u64) -> Side {
    // The tree first: building it holds more than the sampler does.
    let bvh = Bvh::new(to, frame);
    let sampler = Sampler::new(from, frame, samples, seed);
    let mut sums = Sums::default();
    let mut histogram = vec![0u64; ANGLE_STEPS];
    for batch in sampler.chunks().chunks(BATCH) {
        let measured: Vec<(Sums, Vec<u16>)> = batch
            .par_iter()
            .map_init(Vec::new, |samples, (kind, indices)| {
                sampler.samples(*kind, indices.clone(), samples);
                measure(samples, *kind, from, &bvh)
            })
            .collect();
        for (part, steps) in measured {
            sums.merge(&part);
            steps.into_iter().for_each(|step| histogram[usize::from(step)] += 1);
        }
    }
    sums.finish(&histogram, frame)
}

/// Measures the samples of a chunk. With the step in the histogram of every angle.
fn measure(samples: &[Sample], kind: Kind, from: &Mesh, bvh: &Bvh<'_>) -> (Sums, Vec<u16>) {
    let mut sums = Sums::default();
    let mut steps = Vec::new();
    let mut guess = 0;
    for sample in samples {
        let Some(hit) = bvh.closest(sample.position, guess) else { continue };
        guess = hit.face;
        sums.add_distance(sample, hit, kind);
        if kind == Kind::Face
            && let Some(angle) =
                angle(normal(from, bvh.frame(), sample.face), normal(bvh.mesh(), bvh.frame(), hit.face))
        {
            sums.angle_sum += angle;
            sums.angle_max = sums.angle_max.max(angle);
            let step = angle / std::f64::consts::PI * ANGLE_STEPS as f64;
            steps.push((step as usize).min(ANGLE_STEPS - 1) as u16);
        }
    }
    (sums, steps)
}

/// Along the normal of a face.
fn normal(mesh: &Mesh, frame: Frame, face: u32) -> DVec3 {
    let [a, b, c] = frame.corners(mesh, mesh.faces[face as usize]);
    (b - a).cross(c - a)
}

/// The angle between two vectors; none where one is zero.
fn angle(m: DVec3, n: DVec3) -> Option<f64> {
    let angle = m.cross(n).length().atan2(m.dot(n));
    (m != DVec3::ZERO && n != DVec3::ZERO).then_some(angle)
}

/// Sums over samples, in the frame.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    samples: usize,
    greatest_sq: f64,
    worst: Option<DVec3>,
    /// Vertices and faces: count, sum of distances, sum of their squares.
    vertices: (usize, f64, f64),
    faces: (usize, f64, f64),
    angle_sum: f64,
    angle_max: f64,
}

impl Sums {
    fn add_distance(&mut self, sample: &Sample, hit: Hit, kind: Kind) {
        self.samples += 1;
        if self.worst.is_none() || hit.distance_sq > self.greatest_sq {
            (self.greatest_sq, self.worst) = (hit.distance_sq, Some(sample.position));
        }
        let of_kind = match kind {
            Kind::Vertex => &mut self.vertices,
            Kind::Face => &mut self.faces,
            Kind::Edge => return,
        };
        add(of_kind, (1, hit.distance_sq.sqrt(), hit.distance_sq));
    }

    fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        if other.worst.is_some() && (self.worst.is_none() || other.greatest_sq > self.greatest_sq) {
            (self.greatest_sq, self.worst) = (other.greatest_sq, other.worst);
        }
        add(&mut self.vertices, other.vertices);
        add(&mut self.faces, other.faces);
        self.angle_sum += other.angle_sum;
        self.angle_max = self.angle_max.max(other.angle_max);
    }

    fn finish(&self, histogram: &[u64], frame: Frame) -> Side {
        let (count, sum, squares) = if self.faces.0 > 0 { self.faces } else { self.vertices };
        let count = count.max(1) as f64;
        let to_model = |length| frame.length_to_model(length);
        let distance = Spread {
            max: to_model(self.greatest_sq.sqrt()),
            mean: to_model(sum / count),
            rms: to_model((squares / count).sqrt()),
        };
        let angles: u64 = histogram.iter().sum();
        let mut below = 0;
        let p95 = histogram.iter().position(|&count| {
            below += count;
            20 * below >= 19 * angles
        });
        let normals = AngleSpread {
            mean_rad: self.angle_sum / angles.max(1) as f64,
            p95_rad: p95.unwrap_or(0) as f64 / ANGLE_STEPS as f64 * std::f64::consts::PI,
            max_rad: self.angle_max,
        };
        let worst = frame.to_model(self.worst.unwrap_or(DVec3::ZERO)).to_array();
        Side { samples: self.samples, distance, normals, worst }
    }
}

fn add(sums: &mut (usize, f64, f64), more: (usize, f64, f64)) {
    sums.0 += more.0;
    sums.1 += more.1;
    sums.2 += more.2;
}
