// Which half-edges own a pair, and what is opposite. Twin: src/kernel/pairs.rs

// The vertex opposite the half-edge from a to b in the first face of the ring of `around` that has it, or NO_VERTEX.
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
    return NO_VERTEX;
}

fn owns_pair(u: u32, w: u32) -> bool {
    let both = load_positions(u).flags & load_positions(w).flags;
    if (both & LOCKED) != 0u || (u > w && (both & BORDER) == 0u) {
        return false;
    }
    if ring_length(u) > HUB || ring_length(w) > HUB {
        return false;
    }
    if u < w {
        return true;
    }
    return opposite(w, u, u) == NO_VERTEX;
}
