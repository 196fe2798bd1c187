//! What a run has come to, as an outcome: its surface fitted, where asked for, and restored. The run may go on from where
//! it was, even in the midst of a round.

use std::borrow::Cow;
use std::time::Instant;

use crate::backend::{Queue, fallback};
use crate::kernel::rows::Position;
use crate::simplify::{Outcome, StopReason};

use super::carry::MOVED_FROM;
use super::driver::{Run, warn_once};
use super::fit::{Shape, fit};
use super::fit_guard::Guard;
use super::follower::Follower;
use super::levels::Level;
use super::record::Recorder;
use super::restore::{Placed, restore};
use super::surface::Start;

impl Run<'_> {
    /// Makes the outcomes of `levels`, which all end here.
    pub fn make(&mut self, levels: Vec<Level>, stop: StopReason) {
        let Some((last, others)) = levels.split_last() else { return };
        let outcome = self.outcome(stop);
        let of = |level: &Level, outcome| (level.index, Outcome { target: level.target, ..outcome });
        self.made.extend(others.iter().map(|level| of(level, outcome.clone())));
        self.made.push(of(last, outcome));
    }

    /// The bytes that went to a GPU and back.
    pub fn bytes_moved_by_now(&self) -> u64 {
        self.bytes_moved + self.follower.as_ref().map_or(0, Follower::bytes_moved)
    }

    /// The outcome of a level that ends here.
    fn outcome(&mut self, stop: StopReason) -> Outcome {
        let fitted = if stop == StopReason::Cancelled { None } else { self.fit() };
        let (vertices, faces) = (self.host.vertex_count, self.host.face_count);
        let (positions, origin) = match &fitted {
            Some((positions, origin)) => (&positions[..], &origin[..]),
            None => (&self.host.positions.host()[..vertices], &self.prepared.carried.origin[..]),
        };
        let frame = self.prepared.frame;
        let (faces, roles) = (&self.host.faces.host()[..faces], self.host.roles.host());
        let placed = Placed { positions, origin, faces, roles };
        let clock = Instant::now();
        let (mesh, vertex_origin) = restore(self.input, frame, placed, &self.prepared.carried);
        self.seconds.restore += clock.elapsed().as_secs_f64();
        self.seconds.total = self.clock.elapsed().as_secs_f64();
        let mut device = self.device.description();
        if self.device.is_gpu() && !self.rounds.iter().any(|round| round.on_gpu) {
            device = self.device.cpu_description();
        }
        let is_last = self.levels.goal().is_none();
        Outcome {
            mesh,
            vertex_origin,
            faces_in: self.input.faces.len(),
            target: 0,
            stop,
            blocked: self.rounds.last().map(|round| round.blocked).unwrap_or_default(),
            error_estimate: frame.length_to_model(f64::from(self.deviation)),
            flips: 0,
            cell_size: None,
            quadrics: self.quadrics,
            log: self.recorder.take_if(|_| is_last).map(Recorder::into_log),
            regions: None,
            rounds: self.rounds.clone(),
            seconds: self.seconds,
            bytes_moved: self.bytes_moved_by_now(),
            device,
            warnings: self.warnings.clone(),
        }
    }

    /// The vertices fitted to the original, where asked for, with the origins that they have then: on the GPU if that
    /// evaluated a round.
    fn fit(&mut self) -> Option<(Vec<Position>, Vec<u32>)> {
        let clock = Instant::now();
        let is_last = self.levels.goal().is_none();
        let (original, history) = self.history.as_mut()?;
        let owners = history.owners(original.positions.len());
        // Nothing needs it after the last level.
        let original = if is_last { Cow::Owned(std::mem::take(original)) } else { Cow::Borrowed(&*original) };
        let (vertices, faces) = (self.host.vertex_count, self.host.face_count);
        let shape = Shape {
            faces: &self.host.faces.host()[..faces],
            ring_starts: &self.host.ring_starts.host()[..=vertices],
            ring_faces: &self.host.ring_faces.host()[..3 * faces],
        };
        let guard = Guard { limits: self.rules.limits };
        let mut positions = self.host.positions.host()[..vertices].to_vec();
        let mut left = self.options.fit;
        let mut on = |mut queue: Queue, original: Start| {
            fit(&mut queue, original, owners, shape, &mut positions, &mut left, &guard)
        };
        let gpu = self.device.gpu_queue().filter(|_| self.rounds.iter().any(|round| round.on_gpu));
        let on_gpu = gpu.map(|queue| on(queue, original.clone().into_owned()));
        if let Some(Err(reason)) = &on_gpu {
            warn_once(&mut self.warnings, fallback(reason));
        }
        if !matches!(on_gpu, Some(Ok(())))
            && let Err(reason) = on(self.device.cpu_queue(), original.into_owned())
        {
            self.warnings.push(format!("the result is not fitted: {reason}"));
        }
        let mut origin = self.prepared.carried.origin.clone();
        let before = &self.host.positions.host()[..vertices];
        for ((before, after), origin) in before.iter().zip(&positions).zip(&mut origin) {
            if before != after {
                *origin |= MOVED_FROM;
            }
        }
        self.seconds.fit += clock.elapsed().as_secs_f64();
        Some((positions, origin))
    }
}
