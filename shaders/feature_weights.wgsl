// What every vertex counts by its feature degree. Twin: src/kernel/feature_weights.rs

// The curvature of a vertex above the floor that noise drowns in.
fn lifted(vertex: u32, floor: f32) -> f32 {
    return add(load_curvatures(vertex), floor);
}

// The neighbor before the first face of an open fan, which no face here has as its next corner; else the vertex itself.
fn last_neighbor(vertex: u32) -> u32 {
    let start = load_ring_starts(vertex);
    let end = load_ring_starts(vertex + 1u);
    for (var i = start; i < end; i++) {
        let candidate = spoke(load_faces(load_ring_faces(i)), vertex).last;
        var is_next = false;
        for (var j = start; j < end; j++) {
            is_next = is_next || spoke(load_faces(load_ring_faces(j)), vertex).next == candidate;
        }
        if !is_next {
            return candidate;
        }
    }
    return vertex;
}

// One less the entropy of the shares of the curvature about a vertex, over the entropy of equal shares.
fn feature_degree(vertex: u32, floor: f32) -> f32 {
    let own = lifted(vertex, floor);
    var greatest = own;
    let start = load_ring_starts(vertex);
    let end = load_ring_starts(vertex + 1u);
    for (var i = start; i < end; i++) {
        let next = spoke(load_faces(load_ring_faces(i)), vertex).next;
        greatest = max(greatest, lifted(next, floor));
    }
    var last = vertex;
    if (load_positions(vertex).flags & BORDER) != 0u {
        last = last_neighbor(vertex);
        greatest = max(greatest, lifted(last, floor));
    }
    if greatest < LEAST {
        return 0.0;
    }

    // With rᵢ = kᵢ/max k the entropy is log Σr − Σ r log r / Σr: without any error for equal shares.
    let r = divide(own, greatest);
    var sum = r;
    var logs = mul(r, log2(r));
    var count = 1.0;
    for (var i = start; i < end; i++) {
        let next = spoke(load_faces(load_ring_faces(i)), vertex).next;
        let r = divide(lifted(next, floor), greatest);
        sum = add(sum, r);
        logs = add(logs, mul(r, log2(r)));
        count = add(count, 1.0);
    }
    if last != vertex {
        let r = divide(lifted(last, floor), greatest);
        sum = add(sum, r);
        logs = add(logs, mul(r, log2(r)));
        count = add(count, 1.0);
    }
    let entropy = sub(log2(sum), divide(logs, sum));
    return max(sub(1.0, divide(entropy, log2(count))), 0.0);
}

fn feature_weight(vertex: u32) -> f32 {
    if (load_positions(vertex).flags & (LOCKED | HUB)) != 0u {
        return params.of_fixed;
    }
    let floor = mul(params.floor_share, max(load_curvature_sum(0u), params.least_sum));
    var degree = feature_degree(vertex, floor);
    if params.gated != 0u {
        let own = load_curvatures(vertex);
        degree = mul(degree, divide(own, add(own, floor)));
    }
    return max(add(params.base, mul(params.slope, degree)), params.least);
}

fn run(i: u32) {
    store_weights(i, feature_weight(i));
}
