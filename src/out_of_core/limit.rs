//! The error limit that all parts are reduced to: detail then gets the faces, wherever it is.
//!
//! It is found on samples from the middles of parts, as the limit that leaves them the wanted share of their faces.

use std::ops::ControlFlow;

use super::cut::Cut;
use super::marks::Marks;
use super::part::Part;
use super::spill::Spill;
use crate::backend::Device;
use crate::contract;
use crate::error::Result;
use crate::formats::Stream;
use crate::mesh::Mesh;
use crate::simplify::{Budget, MOVED, OnProgress, Outcome, Progress, StopReason};

/// Samples at most, each from another part.
const SAMPLES: usize = 4;
/// The share of the mesh in all samples, and their faces at least and at most, as far as parts hold them.
const SHARE: f64 = 1.0 / 32.0;
const LEAST_FACES: usize = 1 << 14;
const MOST_FACES: usize = 1 << 19;
/// Halvings of the interval of limits, as exponents.
const STEPS: usize = 7;
/// How far below the greatest deviation of a run to the wanted count the limit may lie: a few contractions are the dearest.
const GREATEST_RATIO: f64 = 64.0;
/// A share this close is the wanted one.
const NEAR: f64 = 0.04;

/// Pieces of parts.
#[derive(Debug)]
pub struct Samples {
    pieces: Vec<Part>,
    faces: usize,
}

impl Samples {
    /// Takes pieces from parts at equal distances.
    ///
    /// # Errors
    /// Those of reading.
    pub fn new(stream: &Stream, cut: &Cut, spill: &Spill, frozen: &Marks, used: &mut Marks) -> Result<Self> {
        let parts = cut.part_count();
        let count = SAMPLES.min(parts);
        let wanted = (stream.face_count() as f64 * SHARE) as usize;
        let wanted = wanted.clamp(LEAST_FACES, MOST_FACES) / count.max(1);
        let mut pieces = Vec::new();
        for part in (0..count).map(|i| (2 * i + 1) * parts / (2 * count)) {
            let cells = cut.middle(part, wanted);
            let is_inside = |face: &[u32; 3]| cells.contains(&cut.cell(*face));
            let (inside, outside): (Vec<_>, Vec<_>) = spill.faces(cut, part)?.into_iter().partition(is_inside);
            let mut piece = Part::load(stream, inside, frozen, used)?;
            outside.iter().flatten().for_each(|&v| used.insert(v));
            piece.freeze(used);
            used.clear();
            pieces.push(piece);
        }
        Ok(Self { faces: pieces.iter().map(|piece| piece.mesh.faces.len()).sum(), pieces })
    }

    /// The limit, in model units, that leaves `share` of the faces; `None` when `progress` asks to stop.
    ///
    /// # Errors
    /// Those of a run.
    pub fn limit(
        &self,
        share: f64,
        options: &contract::Options,
        device: &Device,
        now: Progress,
        progress: &mut OnProgress<'_>,
    ) -> Result<Option<f64>> {
        let mut reduce = |budget: Budget| {
            let (mut faces, mut deviation) = (0.0, 0.0_f64);
            for piece in &self.pieces {
                let mut report = |_| progress(now);
                let Some(outcome) = piece.reduce(options, &budget, device, Some(&mut report))? else { continue };
                if outcome.stop == StopReason::Cancelled {
                    return Ok(ControlFlow::Break(()));
                }
                faces += faces_inside(piece, &outcome);
                deviation = deviation.max(outcome.error_estimate);
            }
            Ok(ControlFlow::Continue((faces, deviation)))
        };
        let ControlFlow::Continue((_, greatest)) = reduce(Budget::keep(share))? else { return Ok(None) };
        let wanted = share * self.faces as f64;
        let (mut low, mut high) = (greatest / GREATEST_RATIO, greatest);
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            let ControlFlow::Continue((faces, _)) = reduce(Budget::error_abs(middle))? else { return Ok(None) };
            if (faces / wanted - 1.0).abs() < NEAR {
                return Ok(Some(middle));
            }
            if faces > wanted { low = middle } else { high = middle }
        }
        Ok(Some(high))
    }
}

/// How many faces a piece would be left with if nothing around it were frozen: as many to an area as away from its border.
fn faces_inside(piece: &Part, outcome: &Outcome) -> f64 {
    let is_held = |v: u32| match outcome.vertex_origin[v as usize] {
        MOVED => false,
        origin => piece.frozen[origin as usize],
    };
    let inside = Mesh {
        faces: outcome.mesh.faces.iter().copied().filter(|face| !face.iter().any(|&v| is_held(v))).collect(),
        ..Mesh::new(outcome.mesh.positions.clone(), Vec::new())
    };
    let area = inside.area();
    if area > 0.0 { inside.faces.len() as f64 * (piece.mesh.area() / area) } else { outcome.mesh.faces.len() as f64 }
}
