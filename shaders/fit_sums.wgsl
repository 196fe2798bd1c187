// What the samples ask of every face of the result, and their squared distances. Twin: src/kernel/fit_sums.rs

struct Triangle { a: vec3f, b: vec3f, c: vec3f }

fn about(point: vec3f, t: Triangle) -> Triangle {
    return Triangle(
        flush3(sub3(t.a, point), LEAST_FACTOR),
        flush3(sub3(t.b, point), LEAST_FACTOR),
        flush3(sub3(t.c, point), LEAST_FACTOR),
    );
}

// No sums yet, and the unit normal; none for a face without area.
fn empty_fit(t: Triangle) -> FaceFit {
    let n = flush3(cross3(sub3(t.b, t.a), sub3(t.c, t.a)), LEAST_FACTOR);
    let n_sq = dot3(n, n);
    var unit = vec3f(0.0, 0.0, 0.0);
    if n_sq > NO_NORMAL {
        unit = flush3(scale3(n, divide(1.0, root(n_sq))), LEAST_COMPONENT);
    }
    return FaceFit(unit.x, unit.y, unit.z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

fn with_samples(corner: u32, face: u32, corners: Triangle, before: FaceFit) -> FaceFit {
    var fit = before;
    let end = load_sample_starts(corner + 1u);
    for (var i = load_sample_starts(corner); i < end; i++) {
        let nearest = load_nearest_faces(i);
        if (nearest & ~APART) == face {
            let sample = load_samples(i);
            let t = about(sample.xyz, corners);
            let weights = nearest_weights(t.a, t.b, t.c);
            let away = scale3(point_at(weights, t.a, t.b, t.c), -1.0);
            let with_sample = with_point(fit, weights, away, sample.w);
            if nearest == face {
                fit = with_sample;
            } else {
                fit.error = with_sample.error;
            }
        }
    }
    return fit;
}

fn fit_sum(face: u32) -> FaceFit {
    let row = load_faces(face);
    let corners = Triangle(xyz(load_positions(row.a)), xyz(load_positions(row.b)), xyz(load_positions(row.c)));
    var fit = empty_fit(corners);
    fit = with_samples(row.a, face, corners, fit);
    fit = with_samples(row.b, face, corners, fit);
    fit = with_samples(row.c, face, corners, fit);
    for (var k = 0u; k < FACE_POINTS; k++) {
        let opposite = load_opposite_faces(FACE_POINTS * face + k);
        if opposite != NO_FACE {
            let weights = face_point(k);
            let point = point_at(weights, corners.a, corners.b, corners.c);
            let original = load_original_faces(opposite);
            let t = about(point, Triangle(
                xyz(load_original_positions(original.a)),
                xyz(load_original_positions(original.b)),
                xyz(load_original_positions(original.c)),
            ));
            let away = point_at(nearest_weights(t.a, t.b, t.c), t.a, t.b, t.c);
            fit = with_point(fit, weights, away, load_face_weights(face));
        }
    }
    fit.aa = flush(fit.aa, LEAST_FACTOR);
    fit.ab = flush(fit.ab, LEAST_FACTOR);
    fit.ac = flush(fit.ac, LEAST_FACTOR);
    fit.bb = flush(fit.bb, LEAST_FACTOR);
    fit.bc = flush(fit.bc, LEAST_FACTOR);
    fit.cc = flush(fit.cc, LEAST_FACTOR);
    fit.a = flush(fit.a, LEAST_FACTOR);
    fit.b = flush(fit.b, LEAST_FACTOR);
    fit.c = flush(fit.c, LEAST_FACTOR);
    return fit;
}

fn run(i: u32) {
    store_sums(i, fit_sum(i));
}
