// The face of the original nearest to every point of the result's faces. Twin: src/kernel/opposite_faces.rs

struct NearSample { sample: u32, distance_sq: f32 }

fn nearer_sample(corner: u32, point: vec3f, best: NearSample) -> NearSample {
    var near = best;
    let end = load_sample_starts(corner + 1u);
    for (var i = load_sample_starts(corner); i < end; i++) {
        let away = flush3(sub3(load_samples(i).xyz, point), LEAST_FACTOR);
        let distance_sq = dot3(away, away);
        if distance_sq < near.distance_sq {
            near = NearSample(i, distance_sq);
        }
    }
    return near;
}

// From the nearest sample that became one of the face's corners.
fn opposite_face(face: Face, k: u32) -> u32 {
    let a = xyz(load_own_positions(face.a));
    let b = xyz(load_own_positions(face.b));
    let c = xyz(load_own_positions(face.c));
    let point = point_at(face_point(k), a, b, c);
    var near = NearSample(NO_FACE, FAR);
    near = nearer_sample(face.a, point, near);
    near = nearer_sample(face.b, point, near);
    near = nearer_sample(face.c, point, near);
    if near.sample == NO_FACE {
        return NO_FACE;
    }
    return nearest_from(load_sample_vertices(near.sample), point).face;
}

fn run(i: u32) {
    let face = load_own_faces(i);
    for (var k = 0u; k < FACE_POINTS; k++) {
        store_opposite_faces(FACE_POINTS * i + k, opposite_face(face, k));
    }
}
