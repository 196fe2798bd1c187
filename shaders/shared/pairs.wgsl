// Which edges are pairs, and the half-edge and the face that stand for each. Twin: src/kernel/pairs.rs

// A face seen from one of its corners, by the half-edge that starts there.
struct Side { half_edge: u32, next: u32, last: u32 }

fn side(f: u32, vertex: u32) -> Side {
    let seen = spoke(load_faces(f), vertex);
    return Side(3u * f + seen.corner, seen.next, seen.last);
}

// The flags of a vertex, as far as it is of any kind that there is.
fn flags_at(vertex: u32) -> u32 {
    if HAS_BORDER || HAS_HELD {
        return load_positions(vertex).flags;
    }
    return 0u;
}

// Whether an edge is no pair, by the flags of its ends.
fn is_held(at_u: u32, at_w: u32) -> bool {
    return HAS_HELD && ((at_u & at_w & LOCKED) != 0u || ((at_u | at_w) & HUB) != 0u);
}

// Whether the edge of u, with these flags, and w is a pair that u lists.
fn lists(u: u32, at_u: u32, w: u32) -> bool {
    if HAS_HELD && is_held(at_u, flags_at(w)) {
        return false;
    }
    return u < w;
}

// The faces around a vertex, eight at most, in registers; NO_FACE where there is none.
struct Window { half_edges: array<vec4u, 2>, next: array<vec4u, 2>, last: array<vec4u, 2> }

fn side_before(at: u32, end: u32, vertex: u32) -> Side {
    if at >= end {
        return Side(NO_FACE, NO_FACE, NO_FACE);
    }
    return side(load_ring_faces(at), vertex);
}

fn window(u: u32, start: u32, end: u32) -> Window {
    let a = side_before(start, end, u);
    let b = side_before(start + 1u, end, u);
    let c = side_before(start + 2u, end, u);
    let d = side_before(start + 3u, end, u);
    let e = side_before(start + 4u, end, u);
    let f = side_before(start + 5u, end, u);
    let g = side_before(start + 6u, end, u);
    let h = side_before(start + 7u, end, u);
    return Window(
        array(
            vec4u(a.half_edge, b.half_edge, c.half_edge, d.half_edge),
            vec4u(e.half_edge, f.half_edge, g.half_edge, h.half_edge),
        ),
        array(vec4u(a.next, b.next, c.next, d.next), vec4u(e.next, f.next, g.next, h.next)),
        array(vec4u(a.last, b.last, c.last, d.last), vec4u(e.last, f.last, g.last, h.last)),
    );
}

// The first face of the window whose corner before its vertex is w, or NO_FACE.
fn face_in_window(around: Window, w: u32) -> u32 {
    let none = vec4u(NO_FACE, NO_FACE, NO_FACE, NO_FACE);
    let last = vec4u(w, w, w, w);
    let least = min(
        select(none, around.half_edges[0], around.last[0] == last),
        select(none, around.half_edges[1], around.last[1] == last),
    );
    let half_edge = min(min(least.x, least.y), min(least.z, least.w));
    return select(half_edge / 3u, NO_FACE, half_edge == NO_FACE);
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
