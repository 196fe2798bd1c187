//! One attempt: seeds, moves, exchanges, from one random seed.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::backend::Queue;
use crate::error::Result;
use crate::math::random;

use super::exchange::{add, exchange, merge_down, split_all};
use super::flood::fill;
use super::greedy::Greedy;
use super::labeling::Labeling;
use super::lloyd;
use super::rounds::Rounds;
use super::scene::Scene;
use super::seeds::grow;
use super::{OnPass, Options, Pass};

/// An exchange that gains less than this share of the energy is the last.
const LEAST_GAIN: f64 = 1e-3;
/// A pass that gains less than this share of the energy is the last before an exchange: the long tail of small moves is worth
/// its time only once.
const ROUGH: f64 = 2e-4;

/// Takes what attempts tell, and says whether to go on.
type Listener<'b> = Box<dyn FnMut(Pass) -> ControlFlow<()> + Send + 'b>;

/// Passes on what attempts tell, one at a time.
pub struct Watch<'b> {
    listener: Mutex<Listener<'b>>,
    is_cancelled: AtomicBool,
}

impl<'b> Watch<'b> {
    pub fn new<'y: 'b>(mut on_pass: Option<&'b mut OnPass<'y>>) -> Self {
        let listener = move |pass| on_pass.as_mut().map_or(ControlFlow::Continue(()), |on_pass| on_pass(pass));
        Self { listener: Mutex::new(Box::new(listener)), is_cancelled: AtomicBool::new(false) }
    }

    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    fn tell(&self, pass: Pass) {
        if self.listener.lock().is_ok_and(|mut listener| listener(pass).is_break()) {
            self.is_cancelled.store(true, Ordering::Relaxed);
        }
    }
}

/// An attempt as it goes: the partition, and its energy over time.
pub struct Attempt<'a, 'b> {
    pub scene: &'a Scene<'a>,
    pub options: &'a Options,
    pub watch: &'a Watch<'b>,
    /// Which one, from 0.
    pub index: usize,
    pub regions: Labeling,
    pub energies: Vec<f64>,
}

impl<'a, 'b> Attempt<'a, 'b> {
    /// An attempt with no regions.
    pub fn new(scene: &'a Scene<'a>, options: &'a Options, watch: &'a Watch<'b>, index: usize) -> Self {
        Self { scene, options, watch, index, regions: Labeling::none(scene), energies: Vec::new() }
    }

    fn seed(&self) -> u64 {
        random(self.options.seed, self.index as u64)
    }

    /// Notes the energy and tells of it; whether to go on.
    pub fn record(&mut self) -> bool {
        let Self { regions, energies, watch, index, .. } = self;
        record(regions, energies, watch, *index)
    }

    /// Grows `count` regions from seeds.
    pub fn start(&mut self, count: usize) {
        self.regions = start(self.scene, count, self.seed());
        self.record();
    }

    /// Lloyd's iterations for `count` regions and exchanges of regions in turn, while they gain.
    pub fn iterate(&mut self, count: usize) {
        self.regions = lloyd::start(self.scene, count, self.seed());
        if self.record() {
            self.settle_by_lloyd();
        }
        for _ in 0..self.options.teleports {
            let before = self.regions.clone();
            if self.watch.is_cancelled() || exchange(self.scene, &mut self.regions, None) == 0 {
                return;
            }
            self.record();
            self.settle_by_lloyd();
            let gained = before.energy() - self.regions.energy();
            if gained < 0.0 {
                self.regions = before;
            }
            if gained < LEAST_GAIN * self.regions.energy() {
                return;
            }
        }
    }

    fn settle_by_lloyd(&mut self) {
        let Self { scene, regions, energies, watch, index, .. } = self;
        lloyd::iterate(scene, regions, |regions| record(regions, energies, watch, *index));
    }

    /// Parallel rounds from number `*round` on.
    ///
    /// # Errors
    /// As [`Rounds::run`].
    pub fn rounds(&mut self, queue: &mut Queue, rounds: &mut Rounds, round: &mut u32) -> Result<()> {
        let Self { regions, energies, watch, index, .. } = self;
        rounds.run(queue, self.scene, regions, round, |regions| record(regions, energies, watch, *index))
    }

    /// Moves faces until none gains.
    pub fn settle(&mut self) {
        let mut greedy = Greedy::new(self.scene, &self.regions, self.options.connectivity);
        self.settle_with(&mut greedy);
    }

    fn settle_with(&mut self, greedy: &mut Greedy<'_>) {
        let Self { regions, energies, watch, index, .. } = self;
        greedy.run(regions, |regions| record(regions, energies, watch, *index));
    }

    /// Moves faces until a pass gains little.
    fn settle_roughly(&mut self, greedy: &mut Greedy<'_>) {
        let Self { regions, energies, watch, index, .. } = self;
        let mut energy = regions.energy();
        greedy.run(regions, |regions| {
            let before = std::mem::replace(&mut energy, regions.energy());
            record(regions, energies, watch, *index) && before - energy > ROUGH * before
        });
    }

    /// Moves faces and exchanges regions in turn, then moves faces until none gains.
    pub fn improve(&mut self) {
        let mut greedy = Greedy::new(self.scene, &self.regions, self.options.connectivity);
        for _ in 0..self.options.teleports {
            let before = self.regions.energy();
            self.settle_roughly(&mut greedy);
            if self.watch.is_cancelled() || exchange(self.scene, &mut self.regions, Some(&mut greedy)) == 0 {
                break;
            }
            self.record();
            if before - self.regions.energy() < LEAST_GAIN * before {
                break;
            }
        }
        self.settle_with(&mut greedy);
    }
}

fn record(regions: &Labeling, energies: &mut Vec<f64>, watch: &Watch<'_>, attempt: usize) -> bool {
    let energy = regions.energy();
    energies.push(energy);
    watch.tell(Pass { attempt, regions: regions.count(), energy });
    !watch.is_cancelled()
}

/// The regions that moves start from: as many as asked for where the surface has such, every closed component cut.
pub fn start(scene: &Scene<'_>, count: usize, seed: u64) -> Labeling {
    if count >= scene.face_count() {
        return Labeling::each_face(scene);
    }
    let mut regions = grow(scene, count, seed);
    complete(scene, &mut regions, count);
    while regions.count() < count {
        let missing = count - regions.count();
        if add(scene, &mut regions, missing) == 0 {
            break;
        }
    }
    regions
}

/// Gives every face a region and every closed component two, with `count` regions where that many are enough.
pub fn complete(scene: &Scene<'_>, regions: &mut Labeling, count: usize) {
    fill(scene, regions);
    let counts = regions.by_component(scene);
    let is_whole = |region: &u32| {
        let component = regions.sums[*region as usize].component as usize;
        scene.is_closed[component] && counts[component] == 1
    };
    let whole: Vec<u32> = (0..regions.count() as u32).filter(is_whole).collect();
    split_all(scene, regions, &whole);
    merge_down(scene, regions, count, f64::INFINITY);
}
