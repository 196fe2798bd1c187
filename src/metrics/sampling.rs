//! Points of a surface: its vertices, its edges at uniform steps, its faces in proportion to their area.
//!
//! Samples come in chunks, each by itself: none has to be kept, and the numbers behind them depend on the seed and the
//! sample's index alone.
//!
//! # Reference
//! Metro \[CRS98\]: the three kinds of samples. Departs: face samples are stratified, one to every equal part
//! of the area, and follow a quasirandom sequence \[Rob18\] within a face, which makes the integral over two faces as
//! exact as over many (independent samples leave 1e-3 of a million); the step along edges is bounded below, so that a
//! surface of slivers has no more than two edge samples to a face sample.

use std::ops::Range;

use rayon::prelude::*;

use crate::math::{DVec3, random};
use crate::mesh::{Mesh, Rings};
use crate::spatial::Frame;

/// Samples to a chunk.
pub const CHUNK: usize = 1 << 12;

/// Faces whose edge samples are counted together.
const BLOCK: usize = 1 << 10;

/// What a sample stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A vertex that a face uses.
    Vertex,
    /// A point between the ends of an edge.
    Edge,
    /// An equal share of the area.
    Face,
}

/// Which kinds of samples to take, as the switches of Metro choose them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Kinds {
    /// All vertices that a face uses.
    pub vertices: bool,
    /// Points along the edges.
    pub edges: bool,
    /// Points on the faces.
    pub faces: bool,
}

impl Default for Kinds {
    fn default() -> Self {
        Self { vertices: true, edges: true, faces: true }
    }
}

impl Kinds {
    /// Whether samples of this kind are taken.
    pub fn contains(self, kind: Kind) -> bool {
        match kind {
            Kind::Vertex => self.vertices,
            Kind::Edge => self.edges,
            Kind::Face => self.faces,
        }
    }
}

/// A point of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where it is, in the frame.
    pub position: DVec3,
    /// A face that it is on.
    pub face: u32,
    /// Its weights at the corners of that face.
    pub weights: [f64; 3],
}

/// The samples of a mesh.
#[derive(Debug)]
pub struct Sampler<'a> {
    mesh: &'a Mesh,
    frame: Frame,
    seed: u64,
    rings: Rings,
    /// The sum of the areas up to and with each face, in squared frame lengths.
    area_ends: Vec<f64>,
    face_samples: usize,
    /// Least length between samples along an edge.
    step: f64,
    /// Edge samples before each block of faces, and all.
    edge_starts: Vec<usize>,
}

impl<'a> Sampler<'a> {
    /// Samples with `face_samples` points on the faces, if they have an area.
    pub fn new(mesh: &'a Mesh, frame: Frame, face_samples: usize, seed: u64) -> Self {
        let rings = Rings::new(&mesh.faces, mesh.positions.len());
        let measure = |face: &[u32; 3]| {
            let [a, b, c] = frame.corners(mesh, *face);
            (0.5 * (b - a).cross(c - a).length(), (b - a).length() + (c - b).length() + (a - c).length())
        };
        // Chunks of equal length, summed in order: the same for any number of threads.
        let perimeters: Vec<f64> =
            mesh.faces.par_chunks(CHUNK).map(|faces| faces.iter().map(|face| measure(face).1).sum()).collect();
        let edges = 0.5 * perimeters.iter().sum::<f64>();
        let mut area_ends: Vec<f64> = mesh.faces.par_iter().map(|face| measure(face).0).collect();
        let mut area = 0.0;
        for end in &mut area_ends {
            area += *end;
            *end = area;
        }
        let face_samples = if area > 0.0 { face_samples } else { 0 };
        let count = face_samples.max(1) as f64;
        let step = (area / count).sqrt().max(edges / count);
        let mut sampler = Self { mesh, frame, seed, rings, area_ends, face_samples, step, edge_starts: Vec::new() };
        let counts: Vec<usize> =
            (0..mesh.faces.len().div_ceil(BLOCK)).into_par_iter().map(|block| sampler.count_edges(block)).collect();
        let mut sum = 0;
        sampler.edge_starts = std::iter::once(0)
            .chain(counts.into_iter().map(|count| {
                sum += count;
                sum
            }))
            .collect();
        sampler
    }

    /// How many indices the samples of a kind have. Vertices without a face have one, but no sample.
    pub fn indices(&self, kind: Kind) -> usize {
        match kind {
            Kind::Vertex => self.mesh.positions.len(),
            Kind::Edge => self.edge_starts.last().copied().unwrap_or(0),
            Kind::Face => self.face_samples,
        }
    }

    /// The chunks of these kinds in order.
    pub fn chunks(&self, kinds: Kinds) -> Vec<(Kind, Range<usize>)> {
        let of = |kind| {
            let count = self.indices(kind);
            (0..count).step_by(CHUNK).map(move |start| (kind, start..(start + CHUNK).min(count)))
        };
        // Faces first: what they find spares most of the work on samples that only count for the maximum.
        let order = [Kind::Face, Kind::Vertex, Kind::Edge];
        order.into_iter().filter(|&kind| kinds.contains(kind)).flat_map(of).collect()
    }

    /// The samples of a chunk, in order.
    pub fn samples(&self, kind: Kind, indices: Range<usize>) -> Vec<Sample> {
        let mut samples = Vec::with_capacity(indices.len());
        match kind {
            Kind::Vertex => samples.extend(indices.filter_map(|v| self.vertex(v as u32))),
            Kind::Edge => self.edges(indices, &mut samples),
            Kind::Face => self.faces(indices, &mut samples),
        }
        samples
    }

    fn vertex(&self, v: u32) -> Option<Sample> {
        let &face = self.rings.ring(v).first()?;
        let weights = self.mesh.faces[face as usize].map(|corner| corner == v);
        // One corner, where a face has the vertex at several.
        let first = weights.iter().position(|&is| is)?;
        let position = self.frame.to_frame(self.mesh.positions[v as usize]);
        Some(Sample { position, face, weights: [0, 1, 2].map(|k| if k == first { 1.0 } else { 0.0 }) })
    }

    /// Samples between the ends of the edge from corner `k` of a face, 0 when another face has it before.
    fn on_edge(&self, face: u32, k: usize, corners: &[DVec3; 3]) -> usize {
        let length = corners[k].distance(corners[(k + 1) % 3]);
        // Not below two steps: most edges of a fine mesh end here.
        let steps = length / self.step;
        if steps.is_nan() || steps < 2.0 {
            return 0;
        }
        let ends = self.mesh.faces[face as usize];
        let first = self.rings.faces_of_edge(&self.mesh.faces, ends[k], ends[(k + 1) % 3]).next();
        if first.is_some_and(|first| first != face) { 0 } else { steps as usize - 1 }
    }

    fn block(block: usize, faces: usize) -> Range<usize> {
        block * BLOCK..((block + 1) * BLOCK).min(faces)
    }

    fn count_edges(&self, block: usize) -> usize {
        let count = |f: usize| {
            let corners = self.frame.corners(self.mesh, self.mesh.faces[f]);
            (0..3).map(|k| self.on_edge(f as u32, k, &corners)).sum::<usize>()
        };
        Self::block(block, self.mesh.faces.len()).map(count).sum()
    }

    fn edges(&self, indices: Range<usize>, samples: &mut Vec<Sample>) {
        let first = self.edge_starts.partition_point(|&start| start <= indices.start).saturating_sub(1);
        let mut at = self.edge_starts[first];
        for f in first * BLOCK..self.mesh.faces.len() {
            let corners = self.frame.corners(self.mesh, self.mesh.faces[f]);
            for k in 0..3 {
                if at >= indices.end {
                    return;
                }
                let count = self.on_edge(f as u32, k, &corners);
                for i in indices.start.max(at)..indices.end.min(at + count) {
                    let t = (i - at + 1) as f64 / (count + 1) as f64;
                    let mut weights = [0.0; 3];
                    (weights[k], weights[(k + 1) % 3]) = (1.0 - t, t);
                    let position = corners[k] * (1.0 - t) + corners[(k + 1) % 3] * t;
                    samples.push(Sample { position, face: f as u32, weights });
                }
                at += count;
            }
        }
    }

    fn faces(&self, indices: Range<usize>, samples: &mut Vec<Sample>) {
        let Some(&area) = self.area_ends.last() else { return };
        let place = |i: usize| (i as f64 + unit(random(self.seed, i as u64 + 2))) / self.face_samples as f64 * area;
        let last = self.area_ends.len() - 1;
        let mut f = self.area_ends.partition_point(|&end| end <= place(indices.start));
        for i in indices {
            let at = place(i);
            while f < last && self.area_ends[f] <= at {
                f += 1;
            }
            f = f.min(last);
            let [a, b, c] = self.frame.corners(self.mesh, self.mesh.faces[f]);
            // The root makes equal areas of equal shares \[Turk90\].
            let [r, s] = spread(self.seed, i);
            let r = r.sqrt();
            let weights = [1.0 - r, r * (1.0 - s), r * s];
            let position = a * weights[0] + b * weights[1] + c * weights[2];
            samples.push(Sample { position, face: f as u32, weights });
        }
    }
}

/// The bits as a number in `[0, 1)`.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// The point of this index in a sequence that fills the unit square evenly, shifted by the seed: \[Rob18\], steps of 1/g
/// and 1/g² with g³ = g + 1, in units of 2⁻⁶⁴.
fn spread(seed: u64, index: usize) -> [f64; 2] {
    const STEPS: [u64; 2] = [0xc13f_a9a9_02a6_328f, 0x91e1_0da5_c79e_7b1d];
    [0, 1].map(|k| unit(random(seed, k as u64).wrapping_add((index as u64).wrapping_mul(STEPS[k]))))
}
