//! Who works on what when: large files first, within the memory allowed, no more solving than there are cores.
//!
//! A lane takes a file through reading, solving and writing. There are more lanes than cores, so that one reads or waits for
//! the disk while others solve. None of this reaches the bytes that are written.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use super::estimate;
use super::plan::Job;
use crate::contract::auto_faces;

/// Faces from which a mesh gets all cores, one after the other: two threads are 1.7 times as fast as one, so that smaller
/// ones are better off side by side.
const WIDE_FACES: u64 = 2_000_000;
/// The same for the last meshes of a run, where cores would be idle.
const LAST_WIDE_FACES: u64 = 50_000;

/// Bytes that an allocator may keep of what a lane gave back.
const KEPT_BYTES: u64 = 128 << 20;

/// Hands out files, memory and cores.
pub(super) struct Schedule {
    order: Vec<usize>,
    cores: usize,
    has_gpu: bool,
    memory: Option<u64>,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    /// Files handed out.
    started: usize,
    /// Faces of the files that are not finished.
    faces_left: u64,
    memory_used: u64,
    running: usize,
    cores_free: usize,
    /// Who asks for cores is served in turn: the next number to give, and the one whose turn it is.
    next_turn: u64,
    turn: u64,
    is_over: bool,
}

/// A file handed out, with memory kept free for it.
pub(super) struct Lease<'a> {
    schedule: &'a Schedule,
    /// The number of the job.
    pub job: usize,
    faces: u64,
    bytes: u64,
}

/// Cores to work on, until it is dropped.
pub(super) struct Cores<'a> {
    schedule: &'a Schedule,
    count: usize,
}

impl Schedule {
    /// For `jobs`, the largest first, on `cores`, within `memory` bytes of which [`estimate::BYTES_ALWAYS`] are the program's.
    pub fn new(jobs: &[Job], cores: usize, has_gpu: bool, memory: Option<u64>) -> Self {
        let mut order: Vec<usize> = (0..jobs.len()).collect();
        order.sort_by_key(|&job| (std::cmp::Reverse(jobs[job].faces), job));
        let state = State {
            started: 0,
            faces_left: jobs.iter().map(|job| job.faces).sum(),
            memory_used: estimate::BYTES_ALWAYS,
            running: 0,
            cores_free: cores,
            next_turn: 0,
            turn: 0,
            is_over: false,
        };
        Self { order, cores, has_gpu, memory, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// How many lanes go on: half as many again as there are cores and one more, for some wait for the disk while others solve,
    /// and more than that take the caches from those; fewer where memory is short.
    pub fn lanes(&self, jobs: &[Job]) -> usize {
        let most = jobs.iter().map(|job| self.bytes_before(job)).max().unwrap_or(0);
        let spare = self.memory.map_or(u64::MAX, |memory| memory.saturating_sub(estimate::BYTES_ALWAYS + most));
        let wanted = (self.cores + self.cores / 2 + 1).min(jobs.len());
        wanted.min(usize::try_from(spare / KEPT_BYTES).unwrap_or(wanted).saturating_add(1))
    }

    /// The next file, as soon as there is memory for it; one that needs more than there is goes alone.
    pub fn next(&self, jobs: &[Job]) -> Option<Lease<'_>> {
        let mut state = self.state();
        loop {
            let job = *self.order.get(state.started).filter(|_| !state.is_over)?;
            let faces = jobs[job].faces;
            let bytes = self.bytes_before(&jobs[job]);
            if state.running == 0 || self.memory.is_none_or(|memory| state.memory_used + bytes <= memory) {
                state.started += 1;
                state.running += 1;
                state.memory_used += bytes;
                return Some(Lease { schedule: self, job, faces, bytes });
            }
            state = self.wait(state);
        }
    }

    /// Hands out nothing more.
    pub fn end(&self) {
        self.state().is_over = true;
        self.changed.notify_all();
    }

    /// Whether a mesh of `faces` faces goes to the GPU, if there is one: as large as one that `auto` takes it for.
    pub fn is_for_gpu(&self, faces: u64) -> bool {
        self.has_gpu && faces >= auto_faces(self.cores) as u64
    }

    /// Whether a mesh of `faces` faces is to have all cores.
    pub fn is_wide(&self, faces: u64) -> bool {
        let is_all_that_is_left = || faces.saturating_mul(self.cores as u64) > self.state().faces_left;
        faces >= WIDE_FACES || self.is_for_gpu(faces) || (faces >= LAST_WIDE_FACES && is_all_that_is_left())
    }

    /// One core, or all of them, when it is this caller's turn.
    pub fn cores(&self, all: bool) -> Cores<'_> {
        let count = if all { self.cores } else { 1 };
        let mut state = self.state();
        let turn = state.next_turn;
        state.next_turn += 1;
        while state.turn != turn || state.cores_free < count {
            state = self.wait(state);
        }
        state.turn += 1;
        state.cores_free -= count;
        self.changed.notify_all();
        Cores { schedule: self, count }
    }

    /// Memory for a file before its faces are known.
    fn bytes_before(&self, job: &Job) -> u64 {
        let faces = estimate::most_faces(&job.input);
        job.input.size.stored + estimate::bytes_needed(faces, self.is_for_gpu(faces)) + job.bytes_kept
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock; should it ever, the numbers are still whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }
}

impl Lease<'_> {
    /// Puts the number of faces and the bytes that were found in the place of the estimates.
    pub fn correct(&mut self, faces: u64, bytes: u64) {
        let mut state = self.schedule.state();
        state.faces_left = state.faces_left.saturating_sub(self.faces) + faces;
        state.memory_used = state.memory_used.saturating_sub(self.bytes) + bytes;
        (self.faces, self.bytes) = (faces, bytes);
        self.schedule.changed.notify_all();
    }
}

impl Drop for Lease<'_> {
    fn drop(&mut self) {
        let mut state = self.schedule.state();
        state.faces_left = state.faces_left.saturating_sub(self.faces);
        state.memory_used = state.memory_used.saturating_sub(self.bytes);
        state.running -= 1;
        self.schedule.changed.notify_all();
    }
}

impl Drop for Cores<'_> {
    fn drop(&mut self) {
        self.schedule.state().cores_free += self.count;
        self.schedule.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;
    use std::time::Duration;

    use super::super::input::{Input, Origin};
    use super::*;
    use crate::formats::FileSize;

    /// Binary STL, whose size tells its faces exactly.
    fn jobs(faces: &[u64]) -> Vec<Job> {
        let job = |(i, &faces): (usize, &u64)| Job {
            input: Input {
                origin: Origin::File(format!("{i}.stl").into()),
                name: format!("{i}.stl"),
                size: FileSize { stored: faces * 50, unpacked: None },
                recipe: 0,
            },
            outputs: vec![format!("{i}.stl")],
            faces,
            bytes_kept: 0,
        };
        faces.iter().enumerate().map(job).collect()
    }

    fn bytes(faces: u64) -> u64 {
        faces * 50 + estimate::bytes_needed(faces, false)
    }

    #[test]
    fn the_largest_goes_first_and_ends_end_it() {
        let jobs = jobs(&[5, 9, 7, 9]);
        let schedule = Schedule::new(&jobs, 2, false, None);
        let leases: Vec<Lease> = (0..3).filter_map(|_| schedule.next(&jobs)).collect();
        assert_eq!(leases.iter().map(|lease| lease.job).collect::<Vec<_>>(), [1, 3, 2]);
        schedule.end();
        assert!(schedule.next(&jobs).is_none());
    }

    #[test]
    fn a_file_waits_for_memory_and_one_too_large_goes_alone() {
        let jobs = jobs(&[1000, 100, 100, 100]);
        let limit = estimate::BYTES_ALWAYS + bytes(200);
        let schedule = Schedule::new(&jobs, 2, false, Some(limit));
        let (running, most, done) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    while let Some(lease) = schedule.next(&jobs) {
                        let now = running.fetch_add(1, Ordering::SeqCst) + 1;
                        assert!(now <= if lease.job == 0 { 1 } else { 2 }, "{now} with {}", lease.job);
                        most.fetch_max(now, Ordering::SeqCst);
                        thread::sleep(Duration::from_millis(30));
                        running.fetch_sub(1, Ordering::SeqCst);
                        done.fetch_add(1, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!((most.into_inner(), done.into_inner()), (2, 4));
        assert_eq!(schedule.state().memory_used, estimate::BYTES_ALWAYS);
    }

    #[test]
    fn lanes_are_as_many_as_memory_allows() {
        let jobs = jobs(&[1000; 20]);
        let lanes = |memory| Schedule::new(&jobs, 2, false, memory).lanes(&jobs);
        let one = estimate::BYTES_ALWAYS + bytes(1000);
        assert_eq!((lanes(None), lanes(Some(one)), lanes(Some(0)), lanes(Some(one + 2 * KEPT_BYTES))), (4, 1, 1, 3));
        assert_eq!(Schedule::new(&jobs[..1], 2, false, None).lanes(&jobs[..1]), 1);
    }

    #[test]
    fn what_was_found_takes_the_place_of_estimates() {
        let jobs = jobs(&[100, 100]);
        let schedule = Schedule::new(&jobs, 2, false, Some(estimate::BYTES_ALWAYS + bytes(100)));
        let mut lease = schedule.next(&jobs).expect("a file");
        let used = || {
            let state = schedule.state();
            (state.memory_used - estimate::BYTES_ALWAYS, state.faces_left)
        };
        lease.correct(10, 99);
        assert_eq!(used(), (99, 110));
        drop(lease);
        assert_eq!(used(), (0, 100));
    }

    #[test]
    fn large_meshes_get_all_cores_and_so_does_the_last() {
        let schedule = Schedule::new(&jobs(&[WIDE_FACES, 300_000, 10]), 2, false, None);
        assert!(schedule.is_wide(WIDE_FACES) && !schedule.is_wide(300_000));
        let schedule = Schedule::new(&jobs(&[300_000, 10]), 2, false, None);
        assert!(schedule.is_wide(300_000) && !schedule.is_wide(10) && !schedule.is_for_gpu(300_000));
        let schedule = Schedule::new(&jobs(&[300_000, 300_000, 10]), 2, true, None);
        assert!(schedule.is_wide(300_000) && schedule.is_for_gpu(300_000) && !schedule.is_wide(10));
    }

    #[test]
    fn who_asks_for_all_cores_is_not_passed_by() {
        let schedule = Schedule::new(&[], 2, false, None);
        let one = schedule.cores(false);
        let order = Mutex::new(Vec::new());
        thread::scope(|scope| {
            scope.spawn(|| {
                let _all = schedule.cores(true);
                order.lock().expect("a lock").push("all");
            });
            while schedule.state().next_turn < 2 {
                thread::yield_now();
            }
            scope.spawn(|| {
                let _one = schedule.cores(false);
                order.lock().expect("a lock").push("one");
            });
            while schedule.state().next_turn < 3 {
                thread::yield_now();
            }
            drop(one);
        });
        assert_eq!(order.into_inner().expect("a list"), ["all", "one"]);
    }
}
