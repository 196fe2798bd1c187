// The cotangent at every corner of every face, and its area. Twin: src/kernel/face_cotangents.rs

fn cotangents(a: vec3f, b: vec3f, c: vec3f) -> Cotangents {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let bc = flush3(sub3(c, b), LEAST_FACTOR);
    let n = flush3(cross3(ab, ac), LEAST_FACTOR);
    let doubled = root(dot3(n, n));
    let longest_sq = max(dot3(ab, ab), max(dot3(ac, ac), dot3(bc, bc)));
    if doubled <= mul(NEEDLE, longest_sq) {
        return Cotangents(0.0, 0.0, 0.0, 0.0);
    }
    let inverse = divide(1.0, doubled);
    return Cotangents(
        flush(mul(dot3(ab, ac), inverse), LEAST_FACTOR),
        flush(mul(-dot3(ab, bc), inverse), LEAST_FACTOR),
        flush(mul(dot3(ac, bc), inverse), LEAST_FACTOR),
        mul(0.5, doubled),
    );
}

fn run(i: u32) {
    let face = load_faces(i);
    store_cotangents(i, cotangents(xyz(load_positions(face.a)), xyz(load_positions(face.b)), xyz(load_positions(face.c))));
}
