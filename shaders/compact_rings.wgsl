// Writes the new ring of every live vertex: the live faces of its own ring and of the one it took in, under their new
// numbers, ascending. Twin: src/kernel/compact_rings.rs

// END past the end of a ring.
fn head(at: u32, end: u32) -> u32 {
    if at < end {
        return load_ring_faces(at);
    }
    return END;
}

fn run(vertex: u32) {
    if load_new_vertex(vertex + 1u) == load_new_vertex(vertex) {
        return;
    }
    var out = load_new_starts(vertex);
    let role = load_roles(vertex);
    var i = load_ring_starts(vertex);
    let i_end = load_ring_starts(vertex + 1u);
    var j = 0u;
    var j_end = 0u;
    if (role & KEEPS) != 0u {
        let other = role & VERTEX;
        j = load_ring_starts(other);
        j_end = load_ring_starts(other + 1u);
    }
    var own = head(i, i_end);
    var taken = head(j, j_end);
    while min(own, taken) != END {
        let face = min(own, taken);
        if own < taken {
            i++;
            own = head(i, i_end);
        } else {
            j++;
            taken = head(j, j_end);
        }
        let now = load_new_face(face);
        if load_new_face(face + 1u) != now {
            store_rings_out(out, now);
            out++;
        }
    }
}
