// How many pairs the vertices of every block list. Twin: src/kernel/count_pairs.rs, by contract.
//
// By faces, each of which knows the pairs of its half-edges but for those of borders: additions of integers, whose order
// cannot be seen.

// Counts the pair of the half-edge from p to q, unless the half-edge from q to p stands for it.
fn count(p: u32, at_p: u32, q: u32, at_q: u32) {
    if is_held(at_p, at_q) {
        return;
    }
    if p < q || (HAS_BORDER && (at_q & BORDER) != 0u && face_to(p, q) == NO_FACE) {
        add_counts(min(p, q) / PAIR_BLOCK, 1u);
    }
}

fn run(i: u32) {
    let face = load_faces(i);
    let at_a = flags_at(face.a);
    let at_b = flags_at(face.b);
    let at_c = flags_at(face.c);
    count(face.a, at_a, face.b, at_b);
    count(face.b, at_b, face.c, at_c);
    count(face.c, at_c, face.a, at_a);
}
