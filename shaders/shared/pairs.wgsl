// Which half-edges own a pair, and what is opposite. Twin: src/kernel/pairs.rs

// The vertex opposite the half-edge from a to b in the first face of the ring of `around` that has it, or NO_VERTEX.
fn opposite(a: u32, b: u32, around: u32) -> u32 {
    let end = load_ring_starts(around + 1u);
    for (var i = load_ring_starts(around); i < end; i++) {
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
    let at_u = load_positions(u).flags;
    let at_w = load_positions(w).flags;
    if (at_u & at_w & LOCKED) != 0u || ((at_u | at_w) & HUB) != 0u {
        return false;
    }
    if u > w && (at_u & at_w & BORDER) == 0u {
        return false;
    }
    if u < w {
        return true;
    }
    return opposite(w, u, u) == NO_VERTEX;
}
