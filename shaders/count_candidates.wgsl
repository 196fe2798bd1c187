// How many keys of every block pass the gate. Twin: src/kernel/count_candidates.rs

fn run(block: u32) {
    var passing = 0u;
    for (var i = block * GATE_BLOCK; i < min((block + 1u) * GATE_BLOCK, params.count); i++) {
        passing += select(0u, 1u, load_keys(i) < params.threshold);
    }
    store_counts(block, passing);
}
