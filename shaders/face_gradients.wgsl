// How the attributes change over every face. Twin: src/kernel/face_gradients.rs

struct EdgeFactors { first: vec3f, second: vec3f }

// What the differences of a number along the edges from the first corner are multiplied by.
fn edge_factors(a: vec3f, b: vec3f, c: vec3f, normal: Normal) -> EdgeFactors {
    let e1 = sub3(b, a);
    let e2 = sub3(c, a);
    let weight = mul(normal.root, normal.root);
    let sides_sq = add(dot3(e1, e1), dot3(e2, e2));
    if weight <= mul(LEAST_HEIGHT, sides_sq) {
        return EdgeFactors(vec3f(0.0, 0.0, 0.0), vec3f(0.0, 0.0, 0.0));
    }
    let inverse = divide(1.0, weight);
    let n = weighted(normal);
    return EdgeFactors(scale3(cross3(e2, n), inverse), scale3(cross3(n, e1), inverse));
}

// The component of a gradient along an axis, of a number at the three corners.
fn slope(first: f32, second: f32, a: f32, b: f32, c: f32) -> f32 {
    return flush(add(mul(first, sub(b, a)), mul(second, sub(c, a))), LEAST_FACTOR);
}

fn run(i: u32) {
    let face = load_faces(i);
    let normal = load_normals(i);
    let factors = edge_factors(
        xyz(load_positions(face.a)), xyz(load_positions(face.b)), xyz(load_positions(face.c)), normal,
    );
    let corners = load_corners(i);
    for (var j = 0u; j < params.costed; j++) {
        let a = load_values(corners.a * params.costed + j);
        let b = load_values(corners.b * params.costed + j);
        let c = load_values(corners.c * params.costed + j);
        let x = 3u * i * params.costed + j;
        let y = x + params.costed;
        store_gradients(x, slope(factors.first.x, factors.second.x, a, b, c));
        store_gradients(y, slope(factors.first.y, factors.second.y, a, b, c));
        store_gradients(y + params.costed, slope(factors.first.z, factors.second.z, a, b, c));
    }
}
