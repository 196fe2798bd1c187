// Writes the pairs that the vertices of every block list. Twin: src/kernel/gather_pairs.rs

fn put(u: u32, at_u: u32, half_edge: u32, next: u32, around: Window, out: u32) -> u32 {
    // Where there is no face, this is above every vertex.
    if next == NO_FACE || !lists(u, at_u, next) {
        return out;
    }
    store_pairs(out, Edge(half_edge, face_in_window(around, next)));
    return out + 1u;
}

fn gather_window(u: u32, at_u: u32, start: u32, end: u32, first: u32) -> u32 {
    let around = window(u, start, end);
    var out = first;
    out = put(u, at_u, around.half_edges[0].x, around.next[0].x, around, out);
    out = put(u, at_u, around.half_edges[0].y, around.next[0].y, around, out);
    out = put(u, at_u, around.half_edges[0].z, around.next[0].z, around, out);
    out = put(u, at_u, around.half_edges[0].w, around.next[0].w, around, out);
    out = put(u, at_u, around.half_edges[1].x, around.next[1].x, around, out);
    out = put(u, at_u, around.half_edges[1].y, around.next[1].y, around, out);
    out = put(u, at_u, around.half_edges[1].z, around.next[1].z, around, out);
    out = put(u, at_u, around.half_edges[1].w, around.next[1].w, around, out);
    return out;
}

fn gather_walking(u: u32, at_u: u32, start: u32, end: u32, first: u32) -> u32 {
    var out = first;
    for (var i = start; i < end; i++) {
        let own = side(load_ring_faces(i), u);
        if lists(u, at_u, own.next) {
            store_pairs(out, Edge(own.half_edge, face_from(own.next, u)));
            out++;
        }
        if HAS_BORDER && (at_u & BORDER) != 0u && lists(u, at_u, own.last) && face_to(own.last, u) == NO_FACE {
            let face = own.half_edge / 3u;
            store_pairs(out, Edge(3u * face + (own.half_edge - 3u * face + 2u) % 3u, NO_FACE));
            out++;
        }
    }
    return out;
}

fn run(block: u32) {
    var out = load_starts(block);
    var start = load_ring_starts(block * PAIR_BLOCK);
    for (var u = block * PAIR_BLOCK; u < min((block + 1u) * PAIR_BLOCK, params.count); u++) {
        let end = load_ring_starts(u + 1u);
        let at_u = flags_at(u);
        if !HAS_HELD || (at_u & HUB) == 0u {
            if end - start <= WINDOW && (!HAS_BORDER || (at_u & BORDER) == 0u) {
                out = gather_window(u, at_u, start, end, out);
            } else {
                out = gather_walking(u, at_u, start, end, out);
            }
        }
        start = end;
    }
}
