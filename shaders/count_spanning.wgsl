// How many faces of every block have their corners in three cells. Twin: src/kernel/count_spanning.rs

fn spans(a: vec2u, b: vec2u, c: vec2u) -> bool {
    return any(a != b) && any(b != c) && any(c != a);
}

fn run(block: u32) {
    var spanning = 0u;
    for (var i = block * SPAN_BLOCK; i < min((block + 1u) * SPAN_BLOCK, params.count); i++) {
        let face = load_faces(i);
        spanning += select(0u, 1u, spans(load_keys(face.a), load_keys(face.b), load_keys(face.c)));
    }
    store_counts(block, spanning);
}
