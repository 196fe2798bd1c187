//! `simplify` of the statue by size, target and device, beside meshoptimizer on the same mesh in the same run.
//!
//! First a table of ratios from interleaved repeats, so that a machine that slows down slows everything; then criterion's
//! groups. A filter (`cargo bench --bench contract -- 1m`) skips the table, `-- --quick` shortens both, and
//! `COARSEN_BENCH_LARGE=1` adds ten million faces.
//!
//! Geometry only: colors are dropped, since meshoptimizer carries none. Coarsen's time includes welding and adjacency,
//! its input is in double precision; meshoptimizer gets single-precision positions and indices prepared off the clock,
//! no limit on its error, and one thread, for it has no more.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark prints what it measured")]

mod contender;
mod input;
mod peak;
mod table;

use std::hint::black_box;
use std::time::Duration;

use contender::{Contender, contenders};
use criterion::{Criterion, SamplingMode, Throughput};
use input::{Case, sizes};

/// Percentages of the faces to keep.
const KEEP_PERCENT: [usize; 2] = [10, 1];

fn groups(criterion: &mut Criterion, cases: &[Case], contenders: &[Contender]) {
    for case in cases {
        for percent in KEEP_PERCENT {
            let mut group = criterion.benchmark_group(format!("contract/statue-{}-to-{percent}", case.name));
            group.sampling_mode(SamplingMode::Flat).sample_size(10);
            group.warm_up_time(Duration::from_millis(1)).measurement_time(Duration::from_secs(1));
            group.throughput(Throughput::Elements(case.mesh.faces.len() as u64));
            for contender in contenders {
                group.bench_function(contender.name, |bencher| {
                    bencher.iter(|| contender.simplify(black_box(case), case.target(percent)));
                });
            }
            group.finish();
        }
    }
}

fn main() {
    if peak::measures_this_process() {
        return;
    }
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let quick = arguments.iter().any(|argument| argument == "--quick");
    let contenders = contenders();
    let cases: Vec<Case> = sizes().into_iter().map(Case::new).collect();
    if arguments.iter().all(|argument| argument == "--quick") {
        table::print(&cases, &contenders, if quick { 3 } else { 5 });
    }
    let mut criterion = Criterion::default().configure_from_args();
    groups(&mut criterion, &cases, &contenders);
    criterion.final_summary();
}
