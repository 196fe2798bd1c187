//! How far two surfaces are apart, measured on both sides.
//!
//! # Reference
//! Metro \[CRS98\]: e(p, S) is the distance from p to the closest point of the surface S. A side's maximum is the
//! greatest e over its samples (one-sided Hausdorff distance), mean and root mean square are integrals over the surface.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::Spread;
use super::color::{ColorDeviation, ColorSums};
use super::proposals::Proposals;
use super::sampling::{CHUNK, Kind, Kinds, Sample, Sampler};
use super::sums::Sums;
use crate::backend::Device;
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::spatial::{Bvh, Frame, Hit};

/// Chunks whose sums are held at a time.
const BATCH: usize = 64;

/// Steps of the histogram of angles, over half a turn.
const ANGLE_STEPS: usize = 1 << 16;

/// Samples on the faces of a side at most: more than ten a face of the largest mesh that indices can hold. They take hours, and the list
/// of their chunks some 100 MB.
pub const MOST_SAMPLES: u64 = 1 << 34;

/// How to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Options {
    /// Samples on the faces of each side, beside its vertices and edges, up to [`MOST_SAMPLES`]; `None` takes ten a face of the larger
    /// mesh. Where faces are not chosen, it still sets the steps along edges.
    pub samples: Option<usize>,
    /// Another seed puts the samples elsewhere.
    pub seed: u64,
    /// Which kinds of samples to take: all by default. Without faces, mean and root mean square are those of the vertices.
    pub kinds: Kinds,
}

impl Default for Options {
    fn default() -> Self {
        Self { samples: None, seed: 1998, kinds: Kinds::default() }
    }
}

impl Options {
    /// Whether they can be measured by.
    ///
    /// # Errors
    /// [`Error::Parameter`] when neither vertices nor faces are chosen, for there is no mean of edges alone, or there are too many samples.
    pub fn check(&self) -> Result<()> {
        if !self.kinds.vertices && !self.kinds.faces {
            return Err(Error::Parameter("deviations need samples at vertices or on faces".into()));
        }
        match self.samples {
            Some(samples) if samples as u64 > MOST_SAMPLES => {
                Err(Error::Parameter(format!("{samples} samples are more than {MOST_SAMPLES}: give fewer")))
            }
            _ => Ok(()),
        }
    }

    fn samples_between(&self, a: &Mesh, b: &Mesh) -> usize {
        self.samples.unwrap_or_else(|| a.faces.len().max(b.faces.len()).saturating_mul(10))
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
    /// Samples of all chosen kinds: vertices, edges, faces.
    pub samples: usize,
    /// Distance to the other surface. The maximum looks at all samples, mean and root mean square at those on faces;
    /// where there are none, because they were not chosen or the surface has no area, at its vertices.
    pub distance: Spread,
    /// Angle between the flat normals at a face sample and at its closest point; faces without area are left out. Zeros
    /// without face samples.
    pub normals: AngleSpread,
    /// The sample with the greatest distance; some vertex where all are at zero.
    pub worst: [f64; 3],
    /// Of the colors at a face sample and at its closest point, interpolated, where both meshes have colors.
    pub colors: Option<ColorDeviation>,
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
/// With the meshes swapped the sides are swapped, bit for bit. A GPU proposes closest faces and the CPU makes sure of
/// them, so that the result is the same on every device; when the GPU fails, the CPU goes on alone.
///
/// # Errors
/// [`Error::Mesh`] when a mesh breaks the invariants of [`Mesh::check`] or has no faces, for there is no distance to
/// nothing; the message says which. [`Error::Parameter`] as [`Options::check`].
pub fn deviation(a: &Mesh, b: &Mesh, options: &Options, device: &Device) -> Result<Deviation> {
    options.check()?;
    check(a, "first")?;
    check(b, "second")?;
    device.install(|| {
        let frame = Frame::of(a, b);
        // One after the other, so that only one tree is held.
        let forward = side(a, b, frame, options, device);
        let backward = side(b, a, frame, options, device);
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
        distances.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, distances)| {
            let mut guess = 0;
            for (distance, &position) in distances.iter_mut().zip(&a.positions[chunk * CHUNK..]) {
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

/// What is compared on one side.
struct Pair<'a> {
    from: &'a Mesh,
    to: Bvh<'a>,
    /// The colors of both, where both have them.
    colors: Option<[&'a [[f32; 4]]; 2]>,
    /// Mean and root mean square are those of the vertices, for want of area.
    by_vertices: bool,
}

/// Measures from the surface of `from` to that of `to`.
fn side(from: &Mesh, to: &Mesh, frame: Frame, options: &Options, device: &Device) -> Side {
    let samples = options.samples_between(from, to);
    // The tree first: building it holds more than the sampler does.
    let to = Bvh::new(to, frame);
    let sampler = Sampler::new(from, frame, samples, options.seed);
    let colors = from.colors.as_deref().zip(to.mesh().colors.as_deref()).map(|(a, b)| [a, b]);
    let by_vertices = !options.kinds.faces || sampler.indices(Kind::Face) == 0;
    // Chosen or not, they are all that a surface without area has.
    let kinds = Kinds { vertices: options.kinds.vertices || by_vertices, ..options.kinds };
    let mut proposals = Proposals::of(&to, device, samples, BATCH * CHUNK);
    let pair = Pair { from, to, colors, by_vertices };
    let mut sums = SideSums::default();
    let mut histogram = vec![0u64; ANGLE_STEPS];
    for batch in sampler.chunks(kinds).chunks(BATCH) {
        let enough = sums.greatest_sq;
        let measured: Vec<(SideSums, Vec<u16>)> = match &mut proposals {
            None => (batch.par_iter())
                .map(|(kind, indices)| {
                    let samples = sampler.samples(*kind, indices.clone());
                    pair.measure(&samples, *kind, enough, &[])
                })
                .collect(),
            Some(on_gpu) => {
                let drawn: Vec<Vec<Sample>> =
                    batch.par_iter().map(|(kind, indices)| sampler.samples(*kind, indices.clone())).collect();
                let found = on_gpu.propose(drawn.iter().flatten().map(|sample| sample.position));
                if found.is_none() {
                    proposals = None;
                }
                let guesses = found.unwrap_or_default();
                let starts = drawn.iter().scan(0, |start, samples| {
                    *start += samples.len();
                    Some(*start - samples.len())
                });
                let work: Vec<_> = starts.zip(&drawn).zip(batch).collect();
                work.into_par_iter()
                    .map(|((start, samples), (kind, _))| {
                        let guesses = guesses.get(start..start + samples.len()).unwrap_or(&[]);
                        pair.measure(samples, *kind, enough, guesses)
                    })
                    .collect()
            }
        };
        for (part, steps) in measured {
            sums.merge(&part);
            steps.into_iter().for_each(|step| histogram[usize::from(step)] += 1);
        }
    }
    let first = from.positions[from.faces[0][0] as usize];
    sums.finish(&histogram, frame, first)
}

impl Pair<'_> {
    /// Measures the samples of a chunk, of which those that are no farther than `enough` need not be measured where only
    /// the greatest distance counts. `guesses` are triangles of the tree, one a sample, or none: then the face of the
    /// sample before is the guess. With the step in the histogram of every angle.
    fn measure(&self, samples: &[Sample], kind: Kind, enough: f64, guesses: &[u32]) -> (SideSums, Vec<u16>) {
        let mut sums = SideSums { greatest_sq: enough, ..SideSums::default() };
        let mut steps = Vec::new();
        let only_greatest = kind == Kind::Edge || (kind == Kind::Vertex && !self.by_vertices);
        let mut before = 0;
        for (i, sample) in samples.iter().enumerate() {
            let guess = guesses.get(i).and_then(|&triangle| self.to.faces().get(triangle as usize)).copied();
            let enough = if only_greatest { sums.greatest_sq } else { -1.0 };
            let Some(hit) = self.to.closest_beyond(sample.position, guess.unwrap_or(before), enough) else { continue };
            before = hit.face;
            sums.samples += 1;
            if hit.distance_sq > sums.greatest_sq {
                (sums.greatest_sq, sums.worst) = (hit.distance_sq, Some(sample.position));
            }
            if only_greatest {
                continue;
            }
            sums.distance.add(hit.distance_sq.sqrt());
            if kind == Kind::Face {
                self.measure_attributes(sample, hit, &mut sums, &mut steps);
            }
        }
        (sums, steps)
    }

    fn measure_attributes(&self, sample: &Sample, hit: Hit, sums: &mut SideSums, steps: &mut Vec<u16>) {
        let frame = self.to.frame();
        if let Some(angle) = angle(normal(self.from, frame, sample.face), normal(self.to.mesh(), frame, hit.face)) {
            sums.angle_sum += angle;
            sums.angle_max = sums.angle_max.max(angle);
            let step = angle / PI * ANGLE_STEPS as f64;
            steps.push((step as usize).min(ANGLE_STEPS - 1) as u16);
        }
        if let Some([ours, theirs]) = self.colors {
            let ours = interpolated(ours, self.from.faces[sample.face as usize], sample.weights);
            let theirs = interpolated(theirs, self.to.mesh().faces[hit.face as usize], hit.weights);
            sums.colors.add(ours, theirs);
        }
    }
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

/// The color at a point of a face.
fn interpolated(colors: &[[f32; 4]], face: [u32; 3], weights: [f64; 3]) -> [f32; 4] {
    let corners = face.map(|v| colors[v as usize]);
    std::array::from_fn(|k| (0..3).map(|i| weights[i] * f64::from(corners[i][k])).sum::<f64>() as f32)
}

/// Sums over the samples of a side, in the frame.
#[derive(Debug, Clone, Copy, Default)]
struct SideSums {
    samples: usize,
    greatest_sq: f64,
    /// Where the greatest distance is, unless it is zero.
    worst: Option<DVec3>,
    distance: Sums,
    angle_sum: f64,
    angle_max: f64,
    colors: ColorSums,
}

impl SideSums {
    fn merge(&mut self, other: &Self) {
        self.samples += other.samples;
        if other.worst.is_some() && other.greatest_sq > self.greatest_sq {
            (self.greatest_sq, self.worst) = (other.greatest_sq, other.worst);
        }
        self.distance.merge(&other.distance);
        self.angle_sum += other.angle_sum;
        self.angle_max = self.angle_max.max(other.angle_max);
        self.colors.merge(&other.colors);
    }

    fn finish(&self, histogram: &[u64], frame: Frame, first: DVec3) -> Side {
        let to_model = |length| frame.length_to_model(length);
        let Spread { mean, rms, .. } = self.distance.finish().unwrap_or_default();
        let distance = Spread { max: to_model(self.greatest_sq.sqrt()), mean: to_model(mean), rms: to_model(rms) };
        let angles: u64 = histogram.iter().sum();
        let mut below = 0;
        let p95 = histogram.iter().position(|&count| {
            below += count;
            20 * below >= 19 * angles
        });
        let normals = AngleSpread {
            mean_rad: self.angle_sum / angles.max(1) as f64,
            p95_rad: p95.unwrap_or(0) as f64 / ANGLE_STEPS as f64 * PI,
            max_rad: self.angle_max,
        };
        let worst = self.worst.map_or(first, |worst| frame.to_model(worst)).to_array();
        Side { samples: self.samples, distance, normals, worst, colors: self.colors.finish() }
    }
}
