// How many pairs the vertices of every block list. Twin: src/kernel/count_pairs.rs

fn run(block: u32) {
    var count = 0u;
    for (var u = block * PAIR_BLOCK; u < min((block + 1u) * PAIR_BLOCK, params.count); u++) {
        if (load_positions(u).flags & HUB) != 0u {
            continue;
        }
        let end = load_ring_starts(u + 1u);
        for (var i = load_ring_starts(u); i < end; i++) {
            let own = spoke(load_faces(load_ring_faces(i)), u);
            count += select(0u, 1u, lists(u, own.next));
            count += select(0u, 1u, lists_border(u, own.last));
        }
    }
    store_counts(block, count);
}
