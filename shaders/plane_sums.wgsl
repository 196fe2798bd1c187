// The quadric of every vertex at the start: squared distances to the planes of its faces, and to planes through its border
// edges. Twin: src/kernel/plane_sums.rs

fn plane_sum(vertex: u32) -> PlaneQuadric {
    var matrix = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    var weight = 0.0;
    let on_border = (load_positions(vertex).flags & (BORDER | HUB)) == BORDER;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        let n = load_normals(f);
        let length = mul(n.root, n.root);
        if mul(length, length) > NO_AREA {
            if params.by_area == 1u {
                // |n| is twice the area: area·(n/|n|)(n/|n|)ᵀ = n nᵀ/(2|n|).
                matrix = sym_add(matrix, sym_scale(outer(weighted(n)), 0.5));
                weight = add(weight, mul(0.5, length));
            } else {
                matrix = sym_add(matrix, outer(unit(weighted(n), n.root)));
                weight = add(weight, 1.0);
            }
            if on_border {
                let face = load_faces(f);
                let corners = array<u32, 3>(face.a, face.b, face.c);
                for (var k = 0u; k < 3u; k++) {
                    let other = corners[k];
                    if other != vertex && faces_with(other, vertex) == 1u {
                        let e = sub3(xyz(load_positions(other)), xyz(load_positions(vertex)));
                        let e_sq = dot3(e, e);
                        // The plane holds the edge and the normal; |e×n/|n|| = |e| since they are perpendicular.
                        let across = unit(cross3(e, weighted(n)), n.root);
                        if params.by_area == 1u {
                            matrix = sym_add(matrix, sym_scale(outer(across), params.border_weight));
                            weight = add(weight, mul(params.border_weight, e_sq));
                        } else {
                            let normal = unit(across, root(e_sq));
                            matrix = sym_add(matrix, sym_scale(outer(normal), params.border_weight));
                            weight = add(weight, params.border_weight);
                        }
                    }
                }
            }
        }
    }
    return PlaneQuadric(
        matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz, 0.0, 0.0, 0.0, 0.0, weight,
    );
}

fn run(i: u32) {
    store_quadrics(i, plane_sum(i));
}
