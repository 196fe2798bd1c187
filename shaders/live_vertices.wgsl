// Tells which vertices still live after a round's contractions, and the length of their rings. Twin:
// src/kernel/live_vertices.rs

fn live_faces(vertex: u32) -> u32 {
    var sum = 0u;
    for (var i = load_ring_starts(vertex); i < load_ring_starts(vertex + 1u); i++) {
        sum += load_face_live(load_ring_faces(i));
    }
    return sum;
}

fn run(i: u32) {
    if i == params.count {
        store_live(i, 0u);
        store_ring_lengths(i, 0u);
        return;
    }
    let role = load_roles(i);
    if (role & GONE) != 0u {
        store_live(i, 0u);
        store_ring_lengths(i, 0u);
        return;
    }
    var sum = live_faces(i);
    if (role & KEEPS) != 0u {
        sum += live_faces(role & VERTEX);
    }
    store_live(i, 1u);
    store_ring_lengths(i, sum);
}
