//! The error limit that all parts are reduced to: detail then gets the faces, wherever it is.
//!
//! It is found on samples from the middles of parts, as the limit that leaves them the wanted share of their faces.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::cut::Cut;
use super::marks::Marks;
use super::part::Part;
use super::spill::Spill;
use crate::backend::Device;
use crate::contract;
use crate::error::Result;
use crate::formats::Stream;
use crate::math::DVec3;
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
/// How far below the greatest deviation of a run to the wanted count the limit is looked for first: a few contractions are the
/// dearest, and those that what is frozen forces.
const GREATEST_RATIO: f64 = 64.0;
/// How often it is looked for as far below again.
const MOST_LOWER: usize = 3;
/// A share this close is the wanted one.
const NEAR: f64 = 0.04;
/// Faces that a thread takes at a time.
const FACES: usize = 1 << 8;

/// Pieces of parts.
#[derive(Debug)]
pub struct Samples(Vec<Piece>);

/// A piece, and which of its faces count: the half of them that is farthest from what is frozen, where many stay that would not
/// elsewhere.
#[derive(Debug)]
struct Piece {
    part: Part,
    frozen: Vec<DVec3>,
    /// The squared distance of a face's middle from what is frozen from which on it counts.
    clear_sq: f64,
    /// How many do.
    count: usize,
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
            pieces.push(Piece::new(piece));
        }
        Ok(Self(pieces))
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
        // How many faces that count are left, and the greatest deviation.
        let mut reduce = |budget: Budget| {
            let (mut count, mut deviation) = (0, 0.0_f64);
            for piece in &self.0 {
                let mut report = |_| progress(now);
                let Some(outcome) = piece.part.reduce(options, &budget, device, Some(&mut report))? else { continue };
                if outcome.stop == StopReason::Cancelled {
                    return Ok(ControlFlow::Break(()));
                }
                count += piece.count_left(&outcome);
                deviation = deviation.max(outcome.error_estimate);
            }
            Ok(ControlFlow::Continue((count as f64, deviation)))
        };
        let ControlFlow::Continue((_, greatest)) = reduce(Budget::keep(share))? else { return Ok(None) };
        let wanted = share * self.0.iter().map(|piece| piece.count).sum::<usize>() as f64;
        if wanted == 0.0 {
            return Ok(Some(greatest));
        }
        let (mut low, mut high) = (greatest / GREATEST_RATIO, greatest);
        for _ in 0..MOST_LOWER {
            let ControlFlow::Continue((count, _)) = reduce(Budget::error_abs(low))? else { return Ok(None) };
            if count >= wanted {
                break;
            }
            (low, high) = (low / GREATEST_RATIO, low);
        }
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            let ControlFlow::Continue((count, _)) = reduce(Budget::error_abs(middle))? else { return Ok(None) };
            if (count / wanted - 1.0).abs() < NEAR {
                return Ok(Some(middle));
            }
            if count > wanted { low = middle } else { high = middle }
        }
        Ok(Some(high))
    }
}

impl Piece {
    fn new(part: Part) -> Self {
        let rows = part.mesh.positions.iter().zip(&*part.frozen);
        let frozen: Vec<DVec3> = rows.filter(|&(_, &is_frozen)| is_frozen).map(|(&position, _)| position).collect();
        let mut distances = distances_sq(&part.mesh, |v| part.frozen[v], &frozen);
        let middle = distances.len() / 2;
        let clear_sq = match middle {
            0 => 0.0,
            _ => *distances.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        let count = distances.iter().filter(|&&distance_sq| distance_sq >= clear_sq).count();
        Self { part, frozen, clear_sq, count }
    }

    /// How many faces that count are left.
    fn count_left(&self, outcome: &Outcome) -> usize {
        let is_frozen = |v: usize| match outcome.vertex_origin[v] {
            MOVED => false,
            origin => self.part.frozen[origin as usize],
        };
        let distances = distances_sq(&outcome.mesh, is_frozen, &self.frozen);
        distances.into_iter().filter(|&distance_sq| distance_sq >= self.clear_sq).count()
    }
}

/// The squared distance of the middle of each face to the nearest of `places`, infinite without any. Faces with a frozen corner are left
/// out: where few others are left they reach far inside, however many are wanted.
fn distances_sq(mesh: &Mesh, is_frozen: impl Fn(usize) -> bool + Sync, places: &[DVec3]) -> Vec<f64> {
    let middle = |face: &[u32; 3]| face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
    let least = |from: DVec3| places.iter().map(|place| from.distance_squared(*place)).fold(f64::INFINITY, f64::min);
    let is_free = |face: &&[u32; 3]| !face.iter().any(|&v| is_frozen(v as usize));
    mesh.faces.par_iter().with_min_len(FACES).filter(is_free).map(|face| least(middle(face))).collect()
}
