// Writes the pairs that pass the gate, in the order of the list. Twin: src/kernel/gather_candidates.rs

fn run(block: u32) {
    var out = load_starts(block);
    for (var i = block * GATE_BLOCK; i < min((block + 1u) * GATE_BLOCK, params.count); i++) {
        let key = load_keys(i);
        if key < params.threshold {
            store_candidates(out, Candidate(key, load_pairs(i).half_edge));
            out++;
        }
    }
}
