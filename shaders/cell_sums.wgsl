// What the faces of every piece tell its cell: their quadrics and the corners inside. Twin: src/kernel/cell_sums.rs

// What a face that has a corner in the cell tells it.
fn face_sum(a: vec3f, b: vec3f, c: vec3f, cell: CellBox) -> CellSum {
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    let length = root(n_sq);
    let u = flush3(scale3(n, divide(1.0, length)), LEAST_COMPONENT);
    let weight = select(0.0, mul(0.5, length), n_sq > NO_PLANE);
    let a_in = is_in(a, cell);
    let b_in = is_in(b, cell);
    let c_in = is_in(c, cell);
    // From a corner in the cell: it is near, and the distance to the plane loses no digits.
    let inside = select(select(c, b, b_in), a, a_in);
    let d = flush(dot3(u, inside), LEAST_COMPONENT);
    let m = sym_scale(outer(u), weight);
    let l = scale3(u, mul(weight, d));
    let none = vec3f(0.0, 0.0, 0.0);
    let p = add3(add3(select(none, a, a_in), select(none, b, b_in)), select(none, c, c_in));
    let corners = f32(select(0u, 1u, a_in) + select(0u, 1u, b_in) + select(0u, 1u, c_in));
    return CellSum(
        m.xx, m.xy, m.xz, m.yy, m.yz, m.zz, l.x, l.y, l.z, mul(weight, mul(d, d)), weight, p.x, p.y, p.z, corners,
    );
}

fn run(piece: u32) {
    let row = load_pieces(piece);
    let origin = load_origins(row.x);
    let cell = cell_box(origin, params.steps, params.unit);
    var sum = CellSum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let end = load_pieces(piece + 1u).y;
    for (var i = row.y; i < end; i++) {
        let face = load_faces(load_piece_faces(i));
        let a = about(load_sites(face.a), origin, params.unit);
        let b = about(load_sites(face.b), origin, params.unit);
        let c = about(load_sites(face.c), origin, params.unit);
        sum = sum_add(sum, face_sum(a, b, c, cell));
    }
    store_sums(piece, sum);
}
