// Moves the quadrics of live vertices to their new numbers. Twin: src/kernel/compact_quadrics.rs

fn run(i: u32) {
    let now = load_new_vertex(i);
    if load_new_vertex(i + 1u) != now {
        store_quadrics_out(now, load_quadrics(i));
    }
}
