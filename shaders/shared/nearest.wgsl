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

// Of the faces around `vertex`, and where the nearest point lies on the rim of one, of those beyond.
fn nearest_from(vertex: u32, point: vec3f) -> Nearest {
    let first = nearer_around(vertex, point, Nearest(NO_FACE, vec3f(0.0, 0.0, 0.0), FAR));
    let inside = first.weights.x > 0.0 && first.weights.y > 0.0 && first.weights.z > 0.0;
    if first.face == NO_FACE || inside {
        return first;
    }
    let corners = load_faces(first.face);
    var nearest = first;
    if first.weights.x > 0.0 && corners.a != vertex {
        nearest = nearer_around(corners.a, point, nearest);
    }
    if first.weights.y > 0.0 && corners.b != vertex {
        nearest = nearer_around(corners.b, point, nearest);
    }
    if first.weights.z > 0.0 && corners.c != vertex {
        nearest = nearer_around(corners.c, point, nearest);
    }
    return nearest;
}
