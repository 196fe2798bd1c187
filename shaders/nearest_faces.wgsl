// The face of the result nearest to every sample of the original. Twin: src/kernel/nearest_faces.rs

fn nearest_face(vertex: u32, sample: vec4f) -> u32 {
    let nearest = nearest_from(vertex, sample.xyz);
    if nearest.face == NO_FACE {
        return NO_FACE;
    }
    let face = load_faces(nearest.face);
    if face.a != vertex && face.b != vertex && face.c != vertex {
        return NO_FACE;
    }
    return nearest.face;
}

fn run(vertex: u32) {
    let end = load_sample_starts(vertex + 1u);
    for (var i = load_sample_starts(vertex); i < end; i++) {
        store_nearest_faces(i, nearest_face(vertex, load_samples(i)));
    }
}
