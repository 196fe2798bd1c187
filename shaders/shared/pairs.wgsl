// Which edges are pairs, and the half-edge and the face that stand for each. Twin: src/kernel/pairs.rs

// Whether the edge of u and w is a pair that u lists.
fn lists(u: u32, w: u32) -> bool {
    if u > w {
        return false;
    }
    let at_u = load_positions(u).flags;
    let at_w = load_positions(w).flags;
    return (at_u & at_w & LOCKED) == 0u && ((at_u | at_w) & HUB) == 0u;
}

// The first face around u whose corner before u is w, or NO_FACE.
fn face_from(w: u32, u: u32) -> u32 {
    let end = load_ring_starts(u + 1u);
    for (var i = load_ring_starts(u); i < end; i++) {
        let f = load_ring_faces(i);
        if spoke(load_faces(f), u).last == w {
            return f;
        }
    }
    return NO_FACE;
}

// The first face around u whose corner after u is w, or NO_FACE.
fn face_to(w: u32, u: u32) -> u32 {
    let end = load_ring_starts(u + 1u);
    for (var i = load_ring_starts(u); i < end; i++) {
        let f = load_ring_faces(i);
        if spoke(load_faces(f), u).next == w {
            return f;
        }
    }
    return NO_FACE;
}

// Whether u lists the pair with the corner before it in one of its faces, for want of a half-edge that starts at u.
fn lists_border(u: u32, last: u32) -> bool {
    return (load_positions(u).flags & BORDER) != 0u && lists(u, last) && face_to(last, u) == NO_FACE;
}
