// Moves live vertices to their new numbers, with the starts of their rings. Twin: src/kernel/compact_vertices.rs

fn run(i: u32) {
    let vertex = load_new_vertex(i);
    if i == params.count {
        store_starts_out(vertex, load_new_starts(i));
        return;
    }
    if load_new_vertex(i + 1u) != vertex {
        store_positions_out(vertex, load_positions(i));
        store_starts_out(vertex, load_new_starts(i));
    }
}
