// Writes the half-edges that own a pair, ascending. Twin: src/kernel/gather_pairs.rs

fn run(block: u32) {
    var out = load_starts(block);
    for (var f = block * PAIR_BLOCK; f < min((block + 1u) * PAIR_BLOCK, params.count); f++) {
        let face = load_faces(f);
        let corners = array<u32, 4>(face.a, face.b, face.c, face.a);
        for (var corner = 0u; corner < 3u; corner++) {
            if owns_pair(corners[corner], corners[corner + 1u]) {
                store_pairs(out, 3u * f + corner);
                out++;
            }
        }
    }
}
