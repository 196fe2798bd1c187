//! Scans, the histogram of keys, and the pairs that pass the gate.

use coarsen::Result;
use coarsen::backend::{Buffer, Queue};
use coarsen::kernel::cost_histogram::{BUCKET_SHIFT, BUCKETS, CostHistogram};
use coarsen::kernel::count_candidates::{CountCandidates, GATE_BLOCK};
use coarsen::kernel::find_threshold::{FindThreshold, Gate};
use coarsen::kernel::gather_candidates::GatherCandidates;
use coarsen::kernel::pair_quadric::cost_key;
use coarsen::kernel::rows::{Edge, Threshold};
use coarsen::kernel::scan_add::ScanAdd;
use coarsen::kernel::scan_blocks::{SCAN_BLOCK, ScanBlocks};

use super::inputs::{Random, scanned};
use super::{Seen, Trial};
use crate::gpu;

pub const TRIALS: [Trial; 6] = [
    Trial { name: "scan_blocks", run: scan_blocks },
    Trial { name: "scan_add", run: scan_add },
    Trial { name: "cost_histogram", run: cost_histogram },
    Trial { name: "find_threshold", run: find_threshold },
    Trial { name: "count_candidates", run: count_candidates },
    Trial { name: "gather_candidates", run: gather_candidates },
];

/// Lengths about the bounds of blocks; the last is of several small pages.
const SCANNED: [usize; 8] = [1023, 0, 1, 63, 64, 65, 4096, (1 << 16) + 3];

fn values(len: usize) -> Vec<u32> {
    let mut random = Random::new();
    (0..len).map(|_| random.below(1000)).collect()
}

fn scan_blocks(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, len) in SCANNED.into_iter().enumerate() {
        seen.input("values about the bounds of blocks");
        let mut rows = values(len);
        if perturbed && case == 0 {
            rows[0] ^= 1;
        }
        let mut values = queue.buffer_from(rows)?;
        let count = len as u32;
        let mut sums = queue.buffer(len.div_ceil(SCAN_BLOCK as usize))?;
        seen.run(queue, ScanBlocks { values: &mut values, count, sums: &mut sums })?;
        seen.output(queue, "values", &values)?;
        seen.output(queue, "sums", &sums)?;
    }
    Ok(())
}

fn scan_add(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, len) in SCANNED.into_iter().enumerate() {
        seen.input("values about the bounds of blocks");
        let mut sums = values(len.div_ceil(SCAN_BLOCK as usize));
        if perturbed && case == 0 {
            sums[0] ^= 1;
        }
        let mut values = queue.buffer_from(values(len))?;
        let sums = &queue.buffer_from(sums)?;
        seen.run(queue, ScanAdd { sums, values: &mut values, count: len as u32 })?;
        seen.output(queue, "values", &values)?;
    }
    Ok(())
}

/// Keys of costs of all magnitudes, of one bucket, of none, and about the bounds of blocks and of an invocation's share.
fn keys() -> Vec<(&'static str, Vec<u32>)> {
    let mut random = Random::new();
    let mut spread: Vec<u32> = (0..70_000).map(|_| cost_key(f32::from_bits(random.bits() >> 1))).collect();
    spread[..4].copy_from_slice(&[0.0, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE].map(cost_key));
    // Bounds of buckets and the keys next to them.
    let bounds = (0..20_000).map(|i| ((i / 3 % BUCKETS) << BUCKET_SHIFT) + i % 3).collect();
    vec![
        ("spread keys", spread.clone()),
        ("keys about the bounds of buckets", bounds),
        ("keys of one bucket", vec![cost_key(1.0); 40_000]),
        ("no keys", vec![]),
        ("one key", vec![cost_key(3.0)]),
        ("a block less one", spread[..GATE_BLOCK as usize - 1].to_vec()),
        ("a block", spread[..GATE_BLOCK as usize].to_vec()),
        ("a block and one", spread[..=GATE_BLOCK as usize].to_vec()),
    ]
}

/// Gates that nothing, some and everything passes, some at the very key.
const THRESHOLDS: [u32; 5] = [0x4000_0000, 0, 1, 0x3f80_0000, BUCKETS << BUCKET_SHIFT];

fn cost_histogram(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, (name, mut keys)) in keys().into_iter().enumerate() {
        seen.input(name);
        if perturbed && case == 0 {
            keys[5] ^= 1 << BUCKET_SHIFT;
        }
        // The last keys are of no pairs.
        let (most_keys, block_count) = (keys.len() as u32, 2);
        let pair_starts = &queue.buffer_from(vec![0, 7, most_keys - most_keys / 5])?;
        let keys = &queue.buffer_from(keys)?;
        // It adds to what is there.
        let buckets = &mut queue.buffer_from((0..BUCKETS).collect())?;
        seen.run(queue, CostHistogram { keys, pair_starts, block_count, most_keys, buckets })?;
        seen.output(queue, "buckets", buckets)?;
    }
    Ok(())
}

/// Pairs in few buckets, in the first and the last, in all, and in none.
fn histograms() -> [(&'static str, Vec<u32>); 4] {
    let mut random = Random::new();
    let in_bucket = |pairs: &[(usize, u32)]| {
        let mut buckets = vec![0; BUCKETS as usize];
        pairs.iter().for_each(|&(bucket, count)| buckets[bucket] = count);
        buckets
    };
    [
        ("pairs in all buckets", (0..BUCKETS).map(|_| random.below(1000)).collect()),
        ("pairs in few buckets", in_bucket(&[(15, 3), (16, 1 << 20), (17, 1), (2000, 1 << 31)])),
        ("pairs at the ends", in_bucket(&[(0, 5), (BUCKETS as usize - 1, 9)])),
        ("no pairs", in_bucket(&[])),
    ]
}

/// Shares and counts that want nothing, something and everything, some at the very bound of a bucket.
const GATES: [(u32, u32); 9] = [
    (1 << 31, u32::MAX),
    (u32::MAX, u32::MAX),
    (0, u32::MAX),
    (u32::MAX, 0),
    (u32::MAX, 1),
    (u32::MAX, 3),
    (u32::MAX, 4),
    (u32::MAX, 3 + (1 << 20)),
    (0x1234_5678, 1_000_000),
];

fn find_threshold(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, (name, mut rows)) in histograms().into_iter().enumerate() {
        seen.input(name);
        let pairs = rows.iter().sum();
        if perturbed && case == 0 {
            rows[100] ^= 1;
        }
        let (pair_starts, block_count) = (&queue.buffer_from(vec![0, 7, pairs])?, 2);
        let buckets = &queue.buffer_from(rows)?;
        for (share, most) in GATES {
            for (wide_share, wide_most) in GATES {
                let gate = Gate { share, most, wide_share, wide_most };
                let threshold = &mut queue.buffer(1)?;
                seen.run(queue, FindThreshold { pair_starts, block_count, buckets, gate, threshold })?;
                seen.output(queue, "threshold", threshold)?;
            }
        }
    }
    Ok(())
}

/// How many keys of every block pass.
fn passing(keys: &[u32], threshold: u32) -> Vec<u32> {
    keys.chunks(GATE_BLOCK as usize).map(|block| block.iter().map(|&key| u32::from(key < threshold)).sum()).collect()
}

/// A threshold for these keys, of which the last are of no pairs.
fn threshold(queue: &mut Queue, keys: u32, key: u32) -> Result<Buffer<Threshold>> {
    queue.buffer_from(vec![Threshold { pairs: keys - keys / 5, key, passing: 0 }])
}

fn count_candidates(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, (name, mut keys)) in keys().into_iter().enumerate() {
        seen.input(name);
        if perturbed && case == 0 {
            keys[5] ^= 0x4000_0000;
        }
        let most_keys = keys.len() as u32;
        let keys = &queue.buffer_from(keys)?;
        for key in THRESHOLDS {
            let threshold = &threshold(queue, most_keys, key)?;
            let counts = &mut queue.buffer_from(vec![9; most_keys.div_ceil(GATE_BLOCK) as usize + 1])?;
            seen.run(queue, CountCandidates { keys, threshold, most_keys, counts })?;
            seen.output(queue, "counts", counts)?;
        }
    }
    Ok(())
}

fn gather_candidates(queue: &mut Queue, perturbed: bool, seen: &mut Seen) -> Result<()> {
    for (case, (name, rows)) in keys().into_iter().enumerate() {
        seen.input(name);
        let pair = |i: u32| Edge { half_edge: i * 3 + i % 3, across: i ^ 1 };
        let mut pairs: Vec<Edge> = (0..rows.len() as u32).map(pair).collect();
        if perturbed && case == 0 {
            // Everything passes the last gate.
            pairs[5].half_edge ^= 1;
        }
        let most_keys = rows.len() as u32;
        let keys = &queue.buffer_from(rows.clone())?;
        let pairs = &queue.buffer_from(pairs)?;
        for key in THRESHOLDS {
            let threshold = &threshold(queue, most_keys, key)?;
            let starts = &queue.buffer_from(scanned(&passing(&rows[..rows.len() - rows.len() / 5], key)))?;
            let candidates = &mut queue.buffer(rows.len())?;
            seen.run(queue, GatherCandidates { keys, pairs, threshold, most_keys, starts, candidates })?;
            seen.output(queue, "candidates", candidates)?;
        }
    }
    Ok(())
}

/// Scans in place, level by level.
fn scan(queue: &mut Queue, values: &mut Buffer<u32>) -> Result<()> {
    let count = values.len() as u32;
    let mut sums = queue.buffer(count.div_ceil(SCAN_BLOCK) as usize)?;
    queue.run(ScanBlocks { values, count, sums: &mut sums })?;
    if count > SCAN_BLOCK {
        scan(queue, &mut sums)?;
        queue.run(ScanAdd { sums: &sums, values, count })?;
    }
    Ok(())
}

#[test]
fn levels_scan_a_million() {
    let Some(device) = gpu() else { return };
    let values = values((1 << 20) + 3);
    let mut queue = device.gpu_queue().expect("an open GPU");
    let mut buffer = queue.buffer_from(values.clone()).unwrap();
    scan(&mut queue, &mut buffer).unwrap();
    let mut read = Vec::new();
    queue.read(&buffer, 0..buffer.len(), &mut read).unwrap();
    assert!(read == scanned(&values)[..values.len()]);
}
