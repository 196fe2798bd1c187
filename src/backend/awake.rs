//! Threads that look for more work a while before they sleep: waking one takes as long as thousands of rows, and a run has a
//! hundred stretches of work with less than that between them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use std::{hint, thread};

use rayon::Yield;

/// How long a thread looks in vain before it sleeps: longer than most stretches that one thread works alone, and a fraction of a
/// scheduler's slice, if others want the core.
const PATIENCE: Duration = Duration::from_micros(500);
/// Pauses between two looks: a look takes its share of what working threads write to.
const PAUSES: usize = 32;
/// Threads that are kept awake at most; the work between sleeps is too short for more.
const MOST: usize = 8;

/// Keeps the other threads of the calling thread's pool from falling asleep between stretches of work, as long as it lives and
/// there is a core for each. Changes how long work takes and nothing else.
#[derive(Debug)]
pub struct Awake {
    watch: Arc<Watch>,
}

#[derive(Debug)]
struct Watch {
    /// Which threads look.
    looking: Vec<AtomicBool>,
    is_over: AtomicBool,
}

impl Awake {
    /// For the pool of the calling thread, and so without a default; keeps nobody awake until it is roused.
    pub fn new() -> Self {
        let threads = rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads());
        let kept = if threads <= cores() { threads.min(MOST) } else { 1 };
        let looking = (0..kept).map(|_| AtomicBool::new(false)).collect();
        Self { watch: Arc::new(Watch { looking, is_over: AtomicBool::new(false) }) }
    }

    /// Has the others look for work, those that found none for too long and sleep.
    pub fn rouse(&self) {
        let this = rayon::current_thread_index();
        let sleeps = |(index, looks): (usize, &AtomicBool)| Some(index) != this && !looks.load(Ordering::Relaxed);
        if self.watch.looking.len() > 1 && self.watch.looking.iter().enumerate().any(sleeps) {
            let watch = Arc::clone(&self.watch);
            rayon::spawn_broadcast(move |thread| {
                if Some(thread.index()) != this {
                    watch.look(thread.index());
                }
            });
        }
    }
}

impl Drop for Awake {
    fn drop(&mut self) {
        self.watch.is_over.store(true, Ordering::Relaxed);
    }
}

impl Watch {
    /// Works as long as there is something to do, and looks for more a while after.
    fn look(&self, index: usize) {
        let Some(looks) = self.looking.get(index) else { return };
        if looks.swap(true, Ordering::Relaxed) {
            return;
        }
        let mut idle_since = Instant::now();
        while !self.is_over.load(Ordering::Relaxed) && idle_since.elapsed() < PATIENCE {
            if rayon::yield_now() == Some(Yield::Executed) {
                idle_since = Instant::now();
            } else {
                (0..PAUSES).for_each(|_| hint::spin_loop());
                thread::yield_now();
            }
        }
        looks.store(false, Ordering::Relaxed);
    }
}

/// How many threads can run at once.
fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    *CORES.get_or_init(|| thread::available_parallelism().map_or(1, usize::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pool(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
    }

    /// Whether as many threads look as expected, now or soon; `meanwhile` is done again and again.
    fn come_to_look(watch: &Watch, expected: usize, meanwhile: impl Fn()) -> bool {
        let since = Instant::now();
        let count = || watch.looking.iter().filter(|looks| looks.load(Ordering::Relaxed)).count();
        while count() != expected && since.elapsed() < Duration::from_secs(10) {
            meanwhile();
        }
        count() == expected
    }

    #[test]
    fn others_look_for_work_until_they_lose_patience_or_it_is_over() {
        let threads = cores().min(3);
        pool(threads).install(|| {
            let awake = Awake::new();
            let watch = Arc::clone(&awake.watch);
            assert_eq!(watch.looking.len(), threads);
            assert!(come_to_look(&watch, threads - 1, || awake.rouse()));
            assert_eq!(rayon::join(|| 1, || 2), (1, 2));
            assert!(come_to_look(&watch, 0, thread::yield_now));
            drop(awake);
            let look = |_| {
                let since = Instant::now();
                watch.look(0);
                since.elapsed()
            };
            // A machine that is busy may hold up any of them.
            assert!((0..9).map(look).min() < Some(PATIENCE));
            assert!(come_to_look(&watch, 0, thread::yield_now));
        });
    }

    #[test]
    fn nobody_is_kept_awake_where_cores_are_fewer_or_there_is_no_pool() {
        assert_eq!(Awake::new().watch.looking.len(), 1);
        pool(cores() + 1).install(|| assert_eq!(Awake::new().watch.looking.len(), 1));
        pool(1).install(|| Awake::new().rouse());
    }
}
