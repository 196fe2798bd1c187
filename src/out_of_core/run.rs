//! A run: passes in parts until what they leave fits the memory, and a last one over the whole.

use std::time::Instant;

use super::cut::Survey;
use super::memory::{Room, estimate, mebibytes};
use super::pass::{self, Notes, Pass, Task};
use super::rows::each_chunk;
use super::{Options, Outcome};
use crate::backend::Device;
use crate::contract::{self, NonManifold};
use crate::error::{Error, Result};
use crate::formats::{Scratch, Stream};
use crate::mesh::arrange::NO_FACE_LEFT;
use crate::mesh::{FACE_COLORS_DROPPED, Mesh};
use crate::polish::Flips;
use crate::simplify::{self, Budget, Method, OnProgress, Progress, StopReason};

/// Passes at most: each but the first only where parts of the one before still do not fit.
const MOST_PASSES: usize = 8;
/// Parts are reduced as if to this many faces where the target is lower.
const LEAST_TARGET: usize = 1000;
/// The share of an error limit that is the passes' before the last.
const SHARE_OF_ERROR: f64 = 0.25;
/// A pass that leaves more than this share of the faces will not get there.
const LEAST_GAIN: f64 = 0.95;

/// What a run keeps in mind.
pub struct Run<'a> {
    input: &'a Stream,
    method: &'a contract::Options,
    options: &'a Options,
    device: &'a Device,
    room: Room,
    /// Faces asked for; none with only an error limit.
    target: Option<usize>,
    max_deviation: f64,
    diagonal: f64,
    passes: Vec<Pass>,
    notes: Notes,
    clock: Instant,
}

/// Simplifies the mesh of `input`; the calling thread belongs to the device's pool.
///
/// # Errors
/// Those of [`super::simplify()`].
pub fn run(
    input: &Stream,
    method: &contract::Options,
    budget: &Budget,
    options: &Options,
    device: &Device,
    report: &mut OnProgress<'_>,
) -> Result<Outcome> {
    let clock = Instant::now();
    let faces_in = input.face_count();
    let target = budget.target_faces(faces_in)?;
    check_input(input, method)?;
    let room = Room::new(options.memory_limit, input.vertex_count(), target)?;
    let survey = Survey::new(input)?;
    let (low, high) = survey.bounds;
    let diagonal = Mesh::new(vec![low, high], Vec::new()).diagonal();
    let mut run = Run {
        input,
        method,
        options,
        device,
        room,
        target: budget.counts_faces().then_some(target),
        max_deviation: budget.max_deviation(diagonal)?,
        diagonal,
        passes: Vec::new(),
        notes: notes(input),
        clock,
    };
    let mut report = |step: Progress| report(Progress { faces_in, target, ..step });
    match run.reduce(survey, &mut report)? {
        Some(left) => run.finish(left, &mut report),
        None => Ok(run.cancelled()),
    }
}

/// Refuses what no limit makes possible.
fn check_input(input: &Stream, method: &contract::Options) -> Result<()> {
    if input.face_count() == 0 {
        return Err(Error::Mesh("it has no faces".into()));
    }
    if input.vertex_count() > u32::MAX as usize / 2 {
        return Err(Error::Limit(format!("{} vertices are more than 32-bit indices can hold", input.vertex_count())));
    }
    if input.repeats_positions() && method.weld.is_none() {
        return Err(Error::Unsupported("an STL in parts whose vertices are not joined".into()));
    }
    Ok(())
}

/// What is left out from the start.
fn notes(input: &Stream) -> Notes {
    let mut notes = Notes::default();
    let [texcoords, face_colors, channels] = input.leaves_out();
    if texcoords {
        notes.add("texture coordinates are dropped: they are not carried through parts".into());
    }
    if face_colors {
        notes.add(FACE_COLORS_DROPPED.into());
    }
    if channels {
        notes.add("further properties of vertices are dropped: they are not carried through parts".into());
    }
    notes
}

impl Run<'_> {
    /// Passes in parts, until all that is left fits the memory; `None` when `report` asks to stop.
    fn reduce(&mut self, mut survey: Survey, report: &mut OnProgress<'_>) -> Result<Option<Stream>> {
        let attributes = attributes_in_parts(&self.method.attributes);
        let in_parts = contract::Options {
            fit: 0,
            flips: Flips::default(),
            prune: Some(0.0),
            close_holes: Some(0.0),
            attributes,
            // Parts are put together by the input's vertices.
            non_manifold: NonManifold::Hold,
            ..self.method.clone()
        };
        let mut left: Option<Stream> = None;
        loop {
            let stream = left.as_ref().unwrap_or(self.input);
            let aim = self.target.map_or(0, |target| self.room.aim(stream.face_count(), target.max(LEAST_TARGET)));
            let task = Task {
                options: &in_parts,
                number: self.passes.len(),
                most_faces: self.options.part_faces.unwrap_or(usize::MAX).clamp(1, self.room.part_faces),
                aim,
                greatest_limit: (self.max_deviation * SHARE_OF_ERROR - self.spent()).max(0.0),
                scratch: Scratch(&self.options.scratch),
                device: self.device,
            };
            let Some((next, pass)) = pass::run(stream, &survey, &task, &mut self.notes, report)? else {
                return Ok(None);
            };
            self.passes.push(pass);
            if next.face_count() <= self.room.whole_faces {
                return Ok(Some(next));
            }
            if self.passes.len() == MOST_PASSES || pass.faces_out as f64 > LEAST_GAIN * pass.faces_in as f64 {
                let (faces, need) = (pass.faces_out, mebibytes(estimate(pass.faces_out, true)));
                return Err(Error::Limit(format!(
                    "parts leave {faces} faces, which need {need} together: give a higher memory limit or a coarser \
                     target"
                )));
            }
            survey = Survey::new(&next)?;
            left = Some(next);
        }
    }

    /// The estimated deviation of the passes so far.
    fn spent(&self) -> f64 {
        self.passes.iter().map(|pass| pass.error_estimate).sum()
    }

    /// The last pass, over the whole.
    fn finish(mut self, left: Stream, report: &mut OnProgress<'_>) -> Result<Outcome> {
        let mut whole = whole(&left)?;
        Stream::put_right(&mut whole).into_iter().for_each(|told| self.notes.add(told.into()));
        drop(left);
        let spent = self.spent();
        let budget = Budget {
            faces: self.target,
            error_abs: self.max_deviation.is_finite().then(|| (self.max_deviation - spent).max(0.0)),
            ..Budget::default()
        };
        let method = Method::Contract(self.method.clone());
        let mut outcome = simplify::simplify(&whole, &method, &budget, self.device, Some(report))?;
        outcome.warnings.drain(..).for_each(|warning| self.notes.add(warning));
        let outcome = simplify::Outcome {
            faces_in: self.input.face_count(),
            target: self.target.unwrap_or(0),
            vertex_origin: Vec::new(),
            error_estimate: outcome.error_estimate + spent,
            seconds: simplify::Phases { total: self.clock.elapsed().as_secs_f64(), ..outcome.seconds },
            warnings: self.notes.into_texts().collect(),
            ..outcome
        };
        Ok(Outcome { outcome, diagonal: self.diagonal, passes: self.passes })
    }

    /// What is told of a run that was stopped: nothing of its mesh.
    fn cancelled(self) -> Outcome {
        let outcome = simplify::Outcome {
            mesh: Mesh::default(),
            vertex_origin: Vec::new(),
            faces_in: self.input.face_count(),
            target: self.target.unwrap_or(0),
            stop: StopReason::Cancelled,
            blocked: simplify::Blocked::default(),
            error_estimate: 0.0,
            cell_size: None,
            quadrics: None,
            flips: 0,
            log: None,
            regions: None,
            rounds: Vec::new(),
            seconds: simplify::Phases::default(),
            bytes_moved: 0,
            device: self.device.description(),
            warnings: Vec::new(),
        };
        Outcome { outcome, diagonal: self.diagonal, passes: Vec::new() }
    }
}

/// What parts carry: normals that are found from the faces of the result are the last pass's.
fn attributes_in_parts(of_run: &contract::Attributes) -> contract::Attributes {
    let replaced = of_run.normals == contract::Normals::Recompute;
    contract::Attributes {
        smooth: true,
        normals: contract::Normals::Keep,
        dropped: contract::Dropped { normals: of_run.dropped.normals || replaced, ..of_run.dropped.clone() },
        ..of_run.clone()
    }
}

/// The mesh that passes left.
fn whole(stream: &Stream) -> Result<Mesh> {
    let mut mesh = stream.no_mesh();
    let mut room = Vec::new();
    let mut vertices = Vec::new();
    each_chunk(stream.vertex_count(), |rows| {
        vertices.clear();
        vertices.extend(rows.start as u32..rows.end as u32);
        stream.append_vertices(&vertices, &mut room, &mut mesh)
    })?;
    let mut faces = Vec::new();
    each_chunk(stream.face_count(), |rows| {
        stream.faces(rows, &mut room, &mut faces)?;
        mesh.faces.extend_from_slice(&faces);
        Ok(())
    })?;
    if mesh.faces.is_empty() {
        return Err(Error::Mesh(NO_FACE_LEFT.into()));
    }
    Ok(mesh)
}
