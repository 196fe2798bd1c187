// The point of a mesh nearest to a given one, from a vertex outward. Twin: src/kernel/nearest.rs

struct Nearest { face: u32, weights: vec3f, distance_sq: f32 }

fn nearer_around(vertex: u32, point: vec3f, best: Nearest) -> Nearest {
    var nearest = best;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let face = load_ring_faces(i);
        let row = load_faces(face);
        let a = flush3(sub3(xyz(load_positions(row.a)), point), LEAST_FACTOR);
        let b = flush3(sub3(xyz(load_positions(row.b)), point), LEAST_FACTOR);
        let c = flush3(sub3(xyz(load_positions(row.c)), point), LEAST_FACTOR);
        let weights = nearest_weights(a, b, c);
        let away = flush3(point_at(weights, a, b, c), LEAST_FACTOR);
        let distance_sq = dot3(away, away);
        if distance_sq < nearest.distance_sq {
            nearest = Nearest(face, weights, distance_sq);
        }
    }
    return nearest;
}

// Of the faces around `vertex`, then of those beyond it while it lies on a rim and gets nearer.
fn nearest_from(vertex: u32, point: vec3f) -> Nearest {
    var nearest = nearer_around(vertex, point, Nearest(NO_FACE, vec3f(0.0, 0.0, 0.0), FAR));
    for (var step = 0u; step < MOST_STEPS; step++) {
        let w = nearest.weights;
        if nearest.face == NO_FACE || (w.x > 0.0 && w.y > 0.0 && w.z > 0.0) {
            break;
        }
        let last = nearest.face;
        let corners = load_faces(last);
        if w.x > 0.0 && corners.a != vertex {
            nearest = nearer_around(corners.a, point, nearest);
        }
        if w.y > 0.0 && corners.b != vertex {
            nearest = nearer_around(corners.b, point, nearest);
        }
        if w.z > 0.0 && corners.c != vertex {
            nearest = nearer_around(corners.c, point, nearest);
        }
        if nearest.face == last {
            break;
        }
    }
    return nearest;
}
