// The cotangent at every corner of every face, and the corner's share of its area. Twin: src/kernel/face_corners.rs

// The area nearer to a corner than to the others, by the edges from it and the cotangents across them; where the face is
// obtuse, half of it at the wide corner and a quarter at the others.
fn share(own: f32, least: f32, doubled: f32, nearer: f32) -> f32 {
    let of_obtuse = mul(select(0.125, 0.25, own < 0.0), doubled);
    return select(mul(0.125, nearer), of_obtuse, least < 0.0);
}

fn corners_of(a: vec3f, b: vec3f, c: vec3f) -> Corners {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let bc = flush3(sub3(c, b), LEAST_FACTOR);
    let ab_sq = dot3(ab, ab);
    let ac_sq = dot3(ac, ac);
    let bc_sq = dot3(bc, bc);
    let n = flush3(cross3(ab, ac), LEAST_FACTOR);
    let doubled = root(dot3(n, n));
    if doubled <= mul(NEEDLE, max(ab_sq, max(ac_sq, bc_sq))) {
        return Corners(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    }
    let inverse = divide(1.0, doubled);
    let cot_a = flush(mul(dot3(ab, ac), inverse), LEAST_FACTOR);
    let cot_b = flush(mul(-dot3(ab, bc), inverse), LEAST_FACTOR);
    let cot_c = flush(mul(dot3(ac, bc), inverse), LEAST_FACTOR);
    let least = min(cot_a, min(cot_b, cot_c));
    return Corners(
        cot_a,
        cot_b,
        cot_c,
        share(cot_a, least, doubled, add(mul(ab_sq, cot_c), mul(ac_sq, cot_b))),
        share(cot_b, least, doubled, add(mul(bc_sq, cot_a), mul(ab_sq, cot_c))),
        share(cot_c, least, doubled, add(mul(ac_sq, cot_b), mul(bc_sq, cot_a))),
    );
}

fn run(i: u32) {
    let face = load_faces(i);
    store_corners(i, corners_of(xyz(load_positions(face.a)), xyz(load_positions(face.b)), xyz(load_positions(face.c))));
}
