//! What --verbose prints besides: tables of rounds and of kernels.

use coarsen::backend::KernelTime;
use coarsen::simplify::RoundRecord;

/// The table of the rounds, where there were any.
pub fn round_table(rounds: &[RoundRecord]) -> Option<String> {
    if rounds.is_empty() {
        return None;
    }
    let mut table = format!(
        "{:>5} {:>11} {:>11} {:>11} {:>11} {:>11} {:>9}  device",
        "round", "faces", "pairs", "candidates", "contracted", "refused", "cost"
    );
    for (i, round) in rounds.iter().enumerate() {
        let b = round.blocked;
        let refused = b.border + b.lock + b.seam + b.link + b.flip + b.aspect + b.texture + b.crossing + b.error;
        table += &format!(
            "\n{:>5} {:>11} {:>11} {:>11} {:>11} {:>11} {:>9.2e}  {}",
            i + 1,
            round.faces,
            round.pairs,
            round.candidates,
            round.contracted,
            refused,
            round.greatest_cost,
            if round.on_gpu { "GPU" } else { "CPU" }
        );
    }
    Some(table)
}

/// The table of the kernels, where they were timed.
pub fn kernel_table(kernels: &[KernelTime]) -> Option<String> {
    if kernels.is_empty() {
        return None;
    }
    let mut table = format!("{:<20} {:>5} {:>11}", "kernel", "runs", "ms");
    for KernelTime { name, runs, ms } in kernels {
        table += &format!("\n{name:<20} {runs:>5} {ms:>11.3}");
    }
    Some(table)
}
