// How many keys of every block pass the gate. Twin: src/kernel/count_candidates.rs

fn run(block: u32) {
    let threshold = load_threshold(0u);
    var passing = 0u;
    for (var i = block * GATE_BLOCK; i < min((block + 1u) * GATE_BLOCK, threshold.pairs); i++) {
        passing += select(0u, 1u, load_keys(i) < threshold.key);
    }
    store_counts(block, passing);
}
