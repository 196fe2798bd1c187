// Which half-edges own a pair. Twin: src/kernel/pairs.rs

struct Pair { owned: bool, right: u32 }

// The vertex opposite the half-edge from a to b in the first face of the ring of `around` that has it, or NO_PAIR.
fn opposite(a: u32, b: u32, around: u32) -> u32 {
    for (var i = load_ring_starts(around); i < load_ring_starts(around + 1u); i++) {
        let face = load_faces(load_ring_faces(i));
        if face.a == a && face.b == b {
            return face.c;
        }
        if face.b == a && face.c == b {
            return face.a;
        }
        if face.c == a && face.a == b {
            return face.b;
        }
    }
    return NO_PAIR;
}

fn pair_of(u: u32, w: u32) -> Pair {
    let both = load_positions(u).flags & load_positions(w).flags;
    if (both & LOCKED) != 0u || (u > w && (both & BORDER) == 0u) {
        return Pair(false, NO_PAIR);
    }
    if ring_length(u) > HUB || ring_length(w) > HUB {
        return Pair(false, NO_PAIR);
    }
    let right = opposite(w, u, u);
    return Pair(u < w || right == NO_PAIR, right);
}

// The corners of a half-edge's face, its start first.
fn half_edge_corners(half_edge: u32) -> vec3u {
    let face = load_faces(half_edge / 3u);
    switch half_edge % 3u {
        case 0u: { return vec3u(face.a, face.b, face.c); }
        case 1u: { return vec3u(face.b, face.c, face.a); }
        default: { return vec3u(face.c, face.a, face.b); }
    }
}
