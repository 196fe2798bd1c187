// The faces of a round that change their region: of those around a vertex that would, one. Twin:
// src/kernel/label_moves.rs

// A bijective mix of 32 bits, another in every round.
fn tie_hash(index: u32, round: u32) -> u32 {
    var x = index ^ (round * 0x9e3779b9u);
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

// Whether no other face around a vertex that would move has a greater hash.
fn is_first_at(vertex: u32, hash: u32) -> bool {
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let other = load_ring_faces(i);
        if load_targets(other) != NONE && tie_hash(other, params.round) > hash {
            return false;
        }
    }
    return true;
}

fn moves(face: u32) -> bool {
    if load_targets(face) == NONE {
        return false;
    }
    let corners = load_faces(face);
    let hash = tie_hash(face, params.round);
    return is_first_at(corners.a, hash) && is_first_at(corners.b, hash) && is_first_at(corners.c, hash);
}

fn run(i: u32) {
    if moves(i) {
        store_labels(i, load_targets(i));
    }
}
