// Writes the pairs that the vertices of every block list. Twin: src/kernel/gather_pairs.rs

fn run(block: u32) {
    var out = load_starts(block);
    for (var u = block * PAIR_BLOCK; u < min((block + 1u) * PAIR_BLOCK, params.count); u++) {
        if (load_positions(u).flags & HUB) != 0u {
            continue;
        }
        let end = load_ring_starts(u + 1u);
        for (var i = load_ring_starts(u); i < end; i++) {
            let f = load_ring_faces(i);
            let own = spoke(load_faces(f), u);
            if lists(u, own.next) {
                store_pairs(out, Edge(3u * f + own.corner, face_from(own.next, u)));
                out++;
            }
            if lists_border(u, own.last) {
                store_pairs(out, Edge(3u * f + (own.corner + 2u) % 3u, NO_FACE));
                out++;
            }
        }
    }
}
