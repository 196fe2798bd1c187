// The face of the result nearest to every sample of the original. Twin: src/kernel/nearest_faces.rs

// Where the nearest is not around the vertex, the nearest that is, APART.
fn nearest_face(vertex: u32, sample: vec4f) -> u32 {
    let point = sample.xyz;
    let nearest = nearest_from(vertex, point);
    if nearest.face == NO_FACE {
        return nearest.face;
    }
    let face = load_faces(nearest.face);
    if face.a == vertex || face.b == vertex || face.c == vertex {
        return nearest.face;
    }
    return nearer_around(vertex, point, Nearest(NO_FACE, vec3f(0.0, 0.0, 0.0), FAR)).face | APART;
}

fn run(vertex: u32) {
    let end = load_sample_starts(vertex + 1u);
    for (var i = load_sample_starts(vertex); i < end; i++) {
        store_nearest_faces(i, nearest_face(vertex, load_samples(i)));
    }
}
