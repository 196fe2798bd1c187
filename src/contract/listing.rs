//! The pairs of a round on the host: what the kernels of [`super::evaluate`] list, cost and count, in one pass.
//!
//! A task lists the pairs of its vertices, costs and counts them while their rows are in its cache. It keeps what it lists,
//! so that nobody has to count pairs first to know where they go.

use std::ops::Range;

use rayon::prelude::*;

use crate::kernel::cost_histogram::{BUCKET_SHIFT, BUCKETS};
use crate::kernel::pairs::Lister;
use crate::kernel::rows::{Candidate, Edge};
use crate::kernel::split::{CHUNK, rows_each};
use crate::kernel::stars::Stars;

/// Vertices of a task, at least and at most: the pairs of these and the rows of those fit a core's second cache.
const VERTICES_EACH: [usize; 2] = [1 << 8, 1 << 11];

/// Pairs with their keys, in the order of the kernels.
#[derive(Debug, Default)]
pub struct Listing {
    tasks: Vec<Vec<Candidate>>,
}

impl Listing {
    /// Lists the pairs at `vertices` vertices. `costing` makes a function that writes the keys of pairs, one for each thread;
    /// `warm_up` reads what it needs around the vertices of a task. Returns how many pairs have keys in each bucket of the
    /// histogram.
    pub fn list<K: FnMut(&[Edge], &mut [u32]) + Send>(
        &mut self,
        vertices: usize,
        stars: &Stars<'_>,
        costing: impl Fn() -> K + Sync + Send,
        warm_up: impl Fn(Range<usize>) + Sync + Send,
    ) -> Vec<u32> {
        let each = rows_each(vertices, VERTICES_EACH);
        self.tasks.resize_with(vertices.div_ceil(each), Vec::new);
        let worker = || Worker {
            lister: Lister::default(),
            keys_of: costing(),
            pairs: Vec::new(),
            keys: Vec::new(),
            histogram: no_pairs(),
        };
        let workers = self.tasks.par_iter_mut().enumerate().fold(worker, |mut worker, (task, listed)| {
            let own = task * each..vertices.min((task + 1) * each);
            warm_up(own.clone());
            worker.list(own.start as u32..own.end as u32, stars, listed);
            worker
        });
        workers.map(|worker| worker.histogram).reduce(no_pairs, |mut sums, counts| {
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            sums
        })
    }

    /// Lists pairs without an edge after the others: they stand for the half-edges from `first` on.
    /// Those without a key are left out.
    pub fn list_apart(
        &mut self,
        joins: &[[u32; 2]],
        first: u32,
        histogram: &mut [u32],
        key: impl Fn([u32; 2]) -> Option<u32> + Sync,
    ) {
        let numbered = joins.par_iter().with_min_len(CHUNK).zip(first..first + joins.len() as u32);
        let listed = numbered.filter_map(|(&pair, half_edge)| Some(Candidate { key: key(pair)?, half_edge }));
        let listed: Vec<Candidate> = listed.collect();
        listed.iter().for_each(|listed| histogram[(listed.key >> BUCKET_SHIFT) as usize] += 1);
        self.tasks.push(listed);
    }

    /// How many pairs there are.
    pub fn len(&self) -> usize {
        self.tasks.iter().map(Vec::len).sum()
    }

    /// Appends the pairs with keys below `threshold`.
    pub fn gate(&self, threshold: u32, candidates: &mut Vec<Candidate>) {
        let passes = |pair: &Candidate| pair.key < threshold;
        let passing = |listed: &Vec<Candidate>| listed.iter().filter(|pair| passes(pair)).count();
        let counts: Vec<usize> = self.tasks.par_iter().map(passing).collect();
        let before = candidates.len();
        candidates.resize(before + counts.iter().sum::<usize>(), Candidate::default());
        let mut rest = &mut candidates[before..];
        let mut rows = Vec::with_capacity(counts.len());
        for count in counts {
            let row;
            (row, rest) = rest.split_at_mut(count);
            rows.push(row);
        }
        self.tasks.par_iter().zip(rows).for_each(|(listed, row)| {
            // Every pair is written, until the next takes its place: a branch would be misjudged.
            let mut found = 0;
            for pair in listed {
                let Some(place) = row.get_mut(found) else { break };
                *place = *pair;
                found += usize::from(passes(pair));
            }
        });
    }
}

/// The scratch of a thread.
struct Worker<K> {
    lister: Lister,
    keys_of: K,
    pairs: Vec<Edge>,
    keys: Vec<u32>,
    histogram: Vec<u32>,
}

impl<K: FnMut(&[Edge], &mut [u32])> Worker<K> {
    fn list(&mut self, vertices: Range<u32>, stars: &Stars<'_>, listed: &mut Vec<Candidate>) {
        let Self { lister, keys_of, pairs, keys, histogram } = self;
        pairs.clear();
        vertices.for_each(|vertex| lister.append(vertex, stars, pairs));
        keys.resize(pairs.len(), 0);
        keys_of(pairs, keys);
        keys.iter().for_each(|key| histogram[(key >> BUCKET_SHIFT) as usize] += 1);
        listed.clear();
        listed.reserve_exact(pairs.len());
        listed.extend(pairs.iter().zip(&*keys).map(|(&Edge { half_edge, .. }, &key)| Candidate { key, half_edge }));
    }
}

/// A histogram of nothing.
fn no_pairs() -> Vec<u32> {
    vec![0; BUCKETS as usize]
}
