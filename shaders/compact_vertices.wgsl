// Moves live vertices to their new numbers, with the starts of their rings, and tells which are hubs. Twin:
// src/kernel/compact_vertices.rs

fn with_hub(flags: u32, faces: u32) -> u32 {
    return select(flags & ~HUB, flags | HUB, faces > HUB_FACES);
}

fn run(vertex: u32) {
    let now = load_new_vertex(vertex);
    if vertex == params.count {
        store_starts_out(now, load_new_starts(vertex));
        return;
    }
    if load_new_vertex(vertex + 1u) != now {
        let faces = load_new_starts(vertex + 1u) - load_new_starts(vertex);
        let position = load_positions(vertex);
        let flags = with_hub(position.flags, faces);
        store_positions_out(now, Position(position.x, position.y, position.z, flags));
        store_starts_out(now, load_new_starts(vertex));
    }
}
