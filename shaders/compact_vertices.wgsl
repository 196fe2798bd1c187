// Moves live vertices to their new numbers, with the starts of their rings, and tells which are hubs. Twin:
// src/kernel/compact_vertices.rs

fn with_hub(flags: u32, faces: u32) -> u32 {
    return select(flags & ~HUB, flags | HUB, faces > HUB_FACES);
}

fn run(i: u32) {
    let vertex = load_new_vertex(i);
    if i == params.count {
        store_starts_out(vertex, load_new_starts(i));
        return;
    }
    if load_new_vertex(i + 1u) != vertex {
        let faces = load_new_starts(i + 1u) - load_new_starts(i);
        let position = load_positions(i);
        let flags = with_hub(position.flags, faces);
        store_positions_out(vertex, Position(position.x, position.y, position.z, flags));
        store_starts_out(vertex, load_new_starts(i));
    }
}
