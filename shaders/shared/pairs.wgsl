// Which half-edges own a pair, and what is across. Twin: src/kernel/pairs.rs

// The first face of the ring of `around` that has the half-edge from a to b, or NO_FACE.
fn face_with(a: u32, b: u32, around: u32) -> u32 {
    let end = load_ring_starts(around + 1u);
    for (var i = load_ring_starts(around); i < end; i++) {
        let f = load_ring_faces(i);
        let face = load_faces(f);
        if (face.a == a && face.b == b) || (face.b == a && face.c == b) || (face.c == a && face.a == b) {
            return f;
        }
    }
    return NO_FACE;
}

// The first face around both u and w but f, or NO_FACE.
fn across(f: u32, u: u32, w: u32) -> u32 {
    let end = load_ring_starts(u + 1u);
    for (var i = load_ring_starts(u); i < end; i++) {
        let face = load_ring_faces(i);
        if face != f && has(load_faces(face), w) {
            return face;
        }
    }
    return NO_FACE;
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
    return face_with(w, u, u) == NO_FACE;
}
