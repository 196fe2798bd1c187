// What turns the numbers at the corners of a face into their gradient. Twin: src/kernel/gradient_operators.rs

// Of a face with these corners, times √|n|; zero where it has none.
fn gradient_operator(a: vec3f, b: vec3f, c: vec3f, normal: Normal) -> GradientOperator {
    let e1 = sub3(b, a);
    let e2 = sub3(c, a);
    let weight = mul(normal.root, normal.root);
    let sides_sq = add(dot3(e1, e1), dot3(e2, e2));
    if weight <= mul(LEAST_HEIGHT, sides_sq) {
        return GradientOperator(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, normal.root);
    }
    let inverse = divide(1.0, weight);
    let n = weighted(normal);
    let along_b = flush3(scale3(flush3(cross3(e2, n), LEAST_SUM), inverse), LEAST);
    let along_c = flush3(scale3(flush3(cross3(n, e1), LEAST_SUM), inverse), LEAST);
    return GradientOperator(along_b.x, along_b.y, along_b.z, along_c.x, along_c.y, along_c.z, normal.root);
}

fn run(i: u32) {
    let face = load_faces(i);
    let a = xyz(load_positions(face.a));
    let b = xyz(load_positions(face.b));
    let c = xyz(load_positions(face.c));
    store_operators(i, gradient_operator(a, b, c, load_normals(i)));
}
