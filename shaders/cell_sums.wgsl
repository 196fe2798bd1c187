// What the faces of every piece tell its cell: their quadrics and the corners inside. Twin: src/kernel/cell_sums.rs

// The sum with a face that has a corner in the cell.
fn with_face(sum: CellSum, cell: CellBox, a: vec3f, b: vec3f, c: vec3f) -> CellSum {
    var next = sum;
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    if n_sq > NO_PLANE {
        let length = root(n_sq);
        let u = flush3(scale3(n, divide(1.0, length)), LEAST_COMPONENT);
        let weight = mul(0.5, length);
        // From a corner in the cell: it is near, and the distance to the plane loses no digits.
        let inside = select(select(c, b, is_in(b, cell)), a, is_in(a, cell));
        let d = flush(dot3(u, inside), LEAST_COMPONENT);
        let matrix = sym_add(Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz), sym_scale(outer(u), weight));
        let linear = add3(vec3f(sum.bx, sum.by, sum.bz), scale3(u, mul(weight, d)));
        next.xx = matrix.xx;
        next.xy = matrix.xy;
        next.xz = matrix.xz;
        next.yy = matrix.yy;
        next.yz = matrix.yz;
        next.zz = matrix.zz;
        next.bx = linear.x;
        next.by = linear.y;
        next.bz = linear.z;
        next.c = add(sum.c, mul(weight, mul(d, d)));
        next.weight = add(sum.weight, weight);
    }
    var position = vec3f(sum.x, sum.y, sum.z);
    if is_in(a, cell) {
        position = add3(position, a);
        next.corners = add(next.corners, 1.0);
    }
    if is_in(b, cell) {
        position = add3(position, b);
        next.corners = add(next.corners, 1.0);
    }
    if is_in(c, cell) {
        position = add3(position, c);
        next.corners = add(next.corners, 1.0);
    }
    next.x = position.x;
    next.y = position.y;
    next.z = position.z;
    return next;
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
        sum = with_face(sum, cell, a, b, c);
    }
    store_sums(piece, sum);
}
