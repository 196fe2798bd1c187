//! One pass: cut, reduce every part on its own, put them together again by vertex.

use std::time::Instant;

use super::bridges;
use super::cut::{Cut, Survey};
use super::limit::Samples;
use super::marks::Marks;
use super::part::Part;
use super::spill::{Spill, mark_repeats};
use crate::backend::Device;
use crate::contract;
use crate::error::Result;
use crate::formats::{Rows, Scratch, ScratchFile, Stream};
use crate::simplify::{Budget, MOVED, OnProgress, Outcome, Progress, StopReason};

/// What one pass did.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Pass {
    /// Parts that the mesh was cut into.
    pub parts: usize,
    /// Faces before and after.
    pub faces_in: usize,
    /// Faces after.
    pub faces_out: usize,
    /// Vertices that several parts shared, which stayed.
    pub frozen: usize,
    /// The estimated deviation that every contraction stayed below, in model units.
    pub error_limit: f64,
    /// The greatest there was.
    pub error_estimate: f64,
    /// Wall-clock seconds: of cutting and of finding the limit, and of all.
    pub cut_seconds: f64,
    /// All seconds of the pass.
    pub seconds: f64,
}

/// What a pass is to do.
pub struct Task<'a> {
    pub options: &'a contract::Options,
    /// Its number, from 0: each cuts elsewhere.
    pub number: usize,
    /// Faces of a part at most.
    pub most_faces: usize,
    /// Faces that all parts together are to have after it.
    pub aim: usize,
    /// What the error limit may not pass, in model units.
    pub greatest_limit: f64,
    pub scratch: Scratch<'a>,
    pub device: &'a Device,
}

/// New numbers of vertices that no part has met.
const NONE: u32 = u32::MAX;
/// The share of the aim that every part may keep, however small its error: the last pass takes from those that are flat.
const LEAST_KEPT: f64 = 0.5;
/// The share of the mesh's extent below which deviations are rounding.
const ROUNDING: f64 = 1e-7;
/// Bytes that are written at a time.
const WRITTEN_BYTES: usize = 1 << 20;

/// Reduces the mesh of `stream` in parts; `None` when `progress` asks to stop.
pub fn run(
    stream: &Stream,
    survey: &Survey,
    task: &Task<'_>,
    notes: &mut Notes,
    progress: &mut OnProgress<'_>,
) -> Result<Option<(Stream, Pass)>> {
    let clock = Instant::now();
    let mut cut = Cut::new(stream, survey, task.number, task.most_faces)?;
    let mut frozen = Marks::new(stream.vertex_count());
    let spill = Spill::new(stream, &cut, task.scratch, &mut frozen)?;
    if task.options.weld.is_some() {
        mark_repeats(stream, &mut frozen)?;
    }
    let (rows, dropped) = (stream.rows(), &task.options.attributes.dropped);
    let rows = Rows { normals: rows.normals && !dropped.normals, colors: rows.colors && !dropped.colors };
    let mut merge = Merge::new(rows, frozen, task.scratch)?;
    let mut used = Marks::new(stream.vertex_count());

    let faces_in = stream.face_count();
    let mut now = Progress { faces: faces_in, faces_in, target: task.aim };
    let share = task.aim as f64 / faces_in.max(1) as f64;
    let mut error_limit = task.greatest_limit;
    if task.aim > 0 {
        let samples = Samples::new(stream, &cut, &spill, &merge.frozen, &mut used)?;
        let Some(limit) = samples.limit(share, task.options, task.device, now, progress)? else { return Ok(None) };
        error_limit = limit.max(survey.extent() * ROUNDING).min(error_limit);
    }
    // The room for parts does not count it.
    cut.forget_cells();
    let cut_seconds = clock.elapsed().as_secs_f64();

    let mut error_estimate = 0.0_f64;
    for number in 0..cut.part_count() {
        let part = Part::load(stream, spill.faces(&cut, number)?, &merge.frozen, &mut used)?;
        part.told.into_iter().for_each(|told| notes.add(told.into()));
        let faces = part.mesh.faces.len();
        let mut report = |step: Progress| progress(Progress { faces: now.faces - (faces - step.faces), ..now });
        let least = (faces as f64 * share * LEAST_KEPT) as usize;
        let budget = Budget { faces: Some(least), error_abs: Some(error_limit), ..Budget::default() };
        let outcome = part.reduce(task.options, &budget, task.device, Some(&mut report))?;
        let Some(mut outcome) = outcome else {
            now.faces -= faces;
            if faces > 0 {
                notes.add(format!("degenerate faces dropped: {faces}"));
            }
            continue;
        };
        if outcome.stop == StopReason::Cancelled {
            return Ok(None);
        }
        bridges::split(&part, number, &mut outcome);
        now.faces = now.faces - faces + outcome.mesh.faces.len();
        error_estimate = error_estimate.max(outcome.error_estimate);
        merge.add(&part, &outcome)?;
        outcome.warnings.into_iter().for_each(|warning| notes.add(warning));
    }
    let pass = Pass {
        parts: cut.part_count(),
        faces_in,
        faces_out: merge.faces,
        frozen: merge.new_of_frozen.len(),
        error_limit,
        error_estimate,
        cut_seconds,
        seconds: clock.elapsed().as_secs_f64(),
    };
    Ok(Some((merge.finish()?, pass)))
}

/// Parts on their way back into one mesh: what is frozen meets itself under its number.
struct Merge {
    rows: Rows,
    frozen: Marks,
    new_of_frozen: Vec<u32>,
    vertex_file: ScratchFile,
    face_file: ScratchFile,
    vertices: usize,
    faces: usize,
    room: Vec<u8>,
}

impl Merge {
    fn new(rows: Rows, mut frozen: Marks, scratch: Scratch<'_>) -> Result<Self> {
        Ok(Self {
            rows,
            new_of_frozen: vec![NONE; frozen.count()],
            frozen,
            vertex_file: scratch.file()?,
            face_file: scratch.file()?,
            vertices: 0,
            faces: 0,
            room: Vec::new(),
        })
    }

    fn add(&mut self, part: &Part, outcome: &Outcome) -> Result<()> {
        let mut new_vertex = Vec::with_capacity(outcome.vertex_origin.len());
        for (vertex, &origin) in outcome.vertex_origin.iter().enumerate() {
            let is_frozen = origin != MOVED && part.frozen[origin as usize];
            let known = is_frozen.then(|| self.frozen.number(part.vertices[origin as usize]) as usize);
            let new = match known.map(|number| self.new_of_frozen[number]) {
                None | Some(NONE) => {
                    self.rows.push_vertex(&outcome.mesh, vertex, &mut self.room);
                    if self.room.len() >= WRITTEN_BYTES {
                        self.vertex_file.write(&mut self.room)?;
                    }
                    self.vertices += 1;
                    (self.vertices - 1) as u32
                }
                Some(new) => new,
            };
            known.into_iter().for_each(|number| self.new_of_frozen[number] = new);
            new_vertex.push(new);
        }
        self.vertex_file.write(&mut self.room)?;
        for face in &outcome.mesh.faces {
            self.rows.push_face(face.map(|v| new_vertex[v as usize]), &mut self.room);
            if self.room.len() >= WRITTEN_BYTES {
                self.face_file.write(&mut self.room)?;
            }
        }
        self.faces += outcome.mesh.faces.len();
        self.face_file.write(&mut self.room)
    }

    fn finish(self) -> Result<Stream> {
        let Self { rows, vertex_file, face_file, vertices, faces, .. } = self;
        Stream::of_rows(rows, &vertex_file.folder, [vertex_file.file, face_file.file], [vertices, faces])
    }
}

/// What parts and passes have to say, told once: what they count is summed.
#[derive(Debug, Default)]
pub struct Notes(Vec<(String, Option<u64>)>);

impl Notes {
    /// Adds a text; one that ends with a count is added to those that begin alike.
    pub fn add(&mut self, text: String) {
        let counted = text.rsplit_once(": ").and_then(|(what, count)| Some((what.to_string(), count.parse().ok()?)));
        let (what, count) = counted.map_or((text, None), |(what, count)| (what, Some(count)));
        match self.0.iter_mut().find(|(known, own)| *known == what && own.is_some() == count.is_some()) {
            Some((_, sum)) => *sum = sum.zip(count).map(|(sum, count): (u64, u64)| sum.saturating_add(count)),
            None => self.0.push((what, count)),
        }
    }

    /// The texts in the order they came.
    pub fn into_texts(self) -> impl Iterator<Item = String> {
        self.0.into_iter().map(|(what, count)| match count {
            Some(count) => format!("{what}: {count}"),
            None => what,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_summed_and_texts_told_once() {
        let mut notes = Notes::default();
        for text in
            ["dropped: 2", "GPU: it is lost", "dropped: 3", "GPU: it is lost", "vertices that stay: 4", "dropped"]
        {
            notes.add(text.into());
        }
        let told = ["dropped: 5", "GPU: it is lost", "vertices that stay: 4", "dropped"];
        assert_eq!(notes.into_texts().collect::<Vec<_>>(), told);
    }
}
