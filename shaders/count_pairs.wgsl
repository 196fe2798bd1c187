// How many pairs the half-edges of every block of faces own. Twin: src/kernel/count_pairs.rs

fn run(block: u32) {
    var owned = 0u;
    for (var f = block * PAIR_BLOCK; f < min((block + 1u) * PAIR_BLOCK, params.count); f++) {
        let face = load_faces(f);
        owned += select(0u, 1u, owns_pair(face.a, face.b));
        owned += select(0u, 1u, owns_pair(face.b, face.c));
        owned += select(0u, 1u, owns_pair(face.c, face.a));
    }
    store_counts(block, owned);
}
