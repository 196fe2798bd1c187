// The normal of every face, and the root of its length. Twin: src/kernel/face_normals.rs

fn face_normal(a: vec3f, b: vec3f, c: vec3f) -> Normal {
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let root = root(root(dot3(n, n)));
    let weighted = flush3(scale3(n, divide(1.0, root)), LEAST_FACTOR);
    return Normal(weighted.x, weighted.y, weighted.z, root);
}

fn run(i: u32) {
    let face = load_faces(i);
    store_normals(i, face_normal(xyz(load_positions(face.a)), xyz(load_positions(face.b)), xyz(load_positions(face.c))));
}
