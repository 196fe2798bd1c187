// How many pairs the vertices of every block list. Twin: src/kernel/count_pairs.rs, by contract.
//
// By faces, each of which knows the pairs of its half-edges but for those of borders: additions of integers, whose order
// cannot be seen. Which half-edges lead up cannot be guessed, so nothing branches on it.

// 1 if the half-edge from p to q is a pair that p lists.
fn listed(p: u32, at_p: u32, q: u32, at_q: u32) -> u32 {
    return select(0u, 1u, p < q && !is_held(at_p, at_q));
}

// Counts the pair of the half-edge from p to q at q, which lists it if no half-edge leads back.
fn count_border(p: u32, at_p: u32, q: u32, at_q: u32) {
    if q < p && (at_q & BORDER) != 0u && !is_held(at_p, at_q) && face_to(p, q) == NO_FACE {
        add_counts(q / PAIR_BLOCK, 1u);
    }
}

fn run(i: u32) {
    // From its lowest corner on: the half-edge there leads up, the one before it down.
    let face = load_faces(i);
    let lowest = min(face.a, min(face.b, face.c));
    let own = spoke(face, lowest);
    let at_lowest = flags_at(lowest);
    let at_next = flags_at(own.next);
    let at_last = flags_at(own.last);
    add_counts(lowest / PAIR_BLOCK, listed(lowest, at_lowest, own.next, at_next));
    add_counts(own.next / PAIR_BLOCK, listed(own.next, at_next, own.last, at_last));
    if HAS_BORDER {
        count_border(own.next, at_next, own.last, at_last);
        count_border(own.last, at_last, lowest, at_lowest);
    }
}
