// What the volume metric needs of every vertex: sums over its star of n nᵀ/|n| and n, and the border term. Twin:
// src/kernel/volume_sums.rs
//
// Gathers the ring in ascending face order.

fn volume_sum(vertex: u32) -> VolumeSum {
    var matrix = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    var normal = vec3f(0.0, 0.0, 0.0);
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let n = load_normals(load_ring_faces(i));
        matrix = sym_add(matrix, outer(weighted(n)));
        normal = add3(normal, doubled_area(n));
    }
    return VolumeSum(
        matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz, normal.x, normal.y, normal.z,
    );
}

fn border_sum(vertex: u32) -> BorderSum {
    var matrix = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let face = load_faces(load_ring_faces(i));
        let corners = array<u32, 3>(face.a, face.b, face.c);
        for (var k = 0u; k < 3u; k++) {
            let other = corners[k];
            if other != vertex && faces_with(other, vertex) == 1u {
                let e = sub3(xyz(load_positions(other)), xyz(load_positions(vertex)));
                matrix = sym_add(matrix, border_term(e));
            }
        }
    }
    return BorderSum(matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz);
}

fn run(i: u32) {
    var sum = VolumeSum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let flags = load_positions(i).flags;
    if (flags & HUB) == 0u {
        sum = volume_sum(i);
    }
    store_sums(i, sum);
    if HAS_BORDER {
        var border = BorderSum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        if (flags & (BORDER | HUB)) == BORDER {
            border = border_sum(i);
        }
        store_borders(i, border);
    }
}
