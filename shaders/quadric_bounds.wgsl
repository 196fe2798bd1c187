// What bounds the average quadric of every vertex: the weight of its planes, and how far off one of them is at most.
// Twin: src/kernel/quadric_bounds.rs

fn quadric_bound(vertex: u32) -> QuadricBound {
    let position = load_positions(vertex);
    let p0 = xyz(position);
    let on_border = (position.flags & (BORDER | HUB)) == BORDER;
    let x = in_format(p0);
    var offset_sq = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        let n = load_normals(f);
        let length = mul(n.root, n.root);
        if mul(length, length) > NO_AREA {
            offset_sq = max(offset_sq, distance_sq(unit(weighted(n), n.root), x));
            if on_border {
                let face = load_faces(f);
                let corners = array<u32, 3>(face.a, face.b, face.c);
                for (var k = 0u; k < 3u; k++) {
                    let other = corners[k];
                    if other != vertex && faces_with(other, vertex) == 1u {
                        let e = sub3(xyz(load_positions(other)), p0);
                        let across = unit(cross3(e, weighted(n)), n.root);
                        offset_sq = max(offset_sq, distance_sq(unit(across, root(dot3(e, e))), x));
                    }
                }
            }
        }
    }
    return QuadricBound(load_quadrics(vertex).weight, offset_sq);
}

// Of a plane through x from the origin.
fn distance_sq(n: vec3f, x: vec3f) -> f32 {
    let d = flush(dot3(n, x), LEAST_FACTOR);
    return mul(d, d);
}

fn run(i: u32) {
    store_bounds(i, quadric_bound(i));
}
