// Writes the pairs that pass the gate, in the order of the list. Twin: src/kernel/gather_candidates.rs

fn run(block: u32) {
    let threshold = load_threshold(0u);
    var out = load_starts(block);
    for (var i = block * GATE_BLOCK; i < min((block + 1u) * GATE_BLOCK, threshold.pairs); i++) {
        let key = load_keys(i);
        let half_edge = load_pairs(i).half_edge;
        if key < threshold.key {
            store_candidates(out, Candidate(key, half_edge));
            out++;
        }
    }
}
