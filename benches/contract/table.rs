//! The table of ratios: every contender once, then all again, so that drift of the machine cancels.

use std::time::Instant;

use crate::KEEP_PERCENT;
use crate::contender::{BASELINE, Contender};
use crate::input::Case;
use crate::peak::Stored;

/// One contender on one case: the median time and the least.
struct Row {
    contender: &'static str,
    percent: usize,
    faces_in: usize,
    faces_out: usize,
    secs: f64,
    least_secs: f64,
}

/// Measures and prints: one line a case, target and contender, then how time grows with size.
pub fn print(cases: &[Case], contenders: &[Contender], repeats: usize) {
    println!("medians of {repeats} interleaved repeats; B/face is the peak a face of the input, the input included\n");
    println!("statue  keep  contender       ms  least ms  x {BASELINE}  Mfaces/s  B/face  faces out");
    let mut rows = Vec::new();
    for case in cases {
        let stored = Stored::new(case);
        for percent in KEEP_PERCENT {
            let measured = interleaved(case, percent, contenders, repeats);
            let baseline = measured.iter().find(|row| row.contender == BASELINE).map_or(f64::NAN, |row| row.secs);
            for row in &measured {
                let peak = stored.peak_bytes(row.contender, case.target(percent));
                println!(
                    "{:>6}  {:>3}%  {:<9} {:>8.1}  {:>8.1}  {:>9.2}  {:>8.2}  {:>6}  {:>9}",
                    case.name,
                    percent,
                    row.contender,
                    1e3 * row.secs,
                    1e3 * row.least_secs,
                    row.secs / baseline,
                    row.faces_in as f64 / row.secs / 1e6,
                    peak.map_or_else(|| "-".into(), |bytes| (bytes / row.faces_in as u64).to_string()),
                    row.faces_out,
                );
            }
            rows.extend(measured);
        }
    }
    println!("\ngrowth of time from one size to the next, and what it would be if it were proportional");
    for (small, large) in cases.iter().zip(cases.iter().skip(1)) {
        for row in rows.iter().filter(|row| row.faces_in == small.mesh.faces.len()) {
            let same = |other: &&Row| {
                other.faces_in == large.mesh.faces.len()
                    && (other.contender, other.percent) == (row.contender, row.percent)
            };
            let Some(next) = rows.iter().find(same) else { continue };
            println!(
                "{:>6} to {:<4} {:>3}%  {:<9} x {:>5.2} of {:.2}",
                small.name,
                large.name,
                row.percent,
                row.contender,
                next.secs / row.secs,
                next.faces_in as f64 / row.faces_in as f64
            );
        }
    }
    println!();
}

fn interleaved(case: &Case, percent: usize, contenders: &[Contender], repeats: usize) -> Vec<Row> {
    let target = case.target(percent);
    let mut secs = vec![Vec::with_capacity(repeats); contenders.len()];
    let mut faces_out = vec![0; contenders.len()];
    // The first repeat warms caches, threads and pipelines, and is not counted.
    for repeat in 0..=repeats {
        for (i, contender) in contenders.iter().enumerate() {
            let clock = Instant::now();
            faces_out[i] = contender.simplify(case, target);
            if repeat > 0 {
                secs[i].push(clock.elapsed().as_secs_f64());
            }
        }
    }
    let rows = contenders.iter().zip(secs).zip(faces_out);
    rows.map(|((contender, mut secs), faces_out)| {
        secs.sort_by(f64::total_cmp);
        Row {
            contender: contender.name,
            percent,
            faces_in: case.mesh.faces.len(),
            faces_out,
            secs: secs[secs.len() / 2],
            least_secs: secs[0],
        }
    })
    .collect()
}
