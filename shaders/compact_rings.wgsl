// Writes the new ring of every live vertex: the live faces of its own ring and of the one it took in, under their new
// numbers, ascending. Twin: src/kernel/compact_rings.rs

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
    while i < i_end || j < j_end {
        var face = 0u;
        var from_own = j == j_end;
        if !from_own && i < i_end {
            from_own = load_ring_faces(i) < load_ring_faces(j);
        }
        if from_own {
            face = load_ring_faces(i);
            i++;
        } else {
            face = load_ring_faces(j);
            j++;
        }
        let now = load_new_face(face);
        if load_new_face(face + 1u) != now {
            store_rings_out(out, now);
            out++;
        }
    }
}
