// What every vertex counts by its feature degree. Twin: src/kernel/feature_weights.rs

// What is added to every curvature.
fn floor_of(curvature_sum: f32) -> f32 {
    return mul(params.floor_share, max(curvature_sum, params.least_sum));
}

// With rᵢ = kᵢ/max k: Σr and Σ r log r. The entropy of the shares is log Σr − Σ r log r / Σr, for equal shares without
// any error.
struct Shares { sum: f32, logs: f32 }

fn with_share(before: Shares, value: f32, greatest: f32) -> Shares {
    let r = divide(value, greatest);
    return Shares(add(before.sum, r), add(before.logs, mul(r, log2(r))));
}

// One less the entropy over that of as many equal shares.
fn degree_of(shares: Shares, neighbors: u32) -> f32 {
    let entropy = sub(log2(shares.sum), divide(shares.logs, shares.sum));
    return max(sub(1.0, divide(entropy, log2(f32(neighbors + 1u)))), 0.0);
}

fn lifted(vertex: u32, floor: f32) -> f32 {
    return add(load_curvatures(vertex), floor);
}

// The neighbor before the first face of an open fan, which comes after this vertex in no face; else the vertex itself.
fn last_neighbor(vertex: u32) -> u32 {
    let start = load_ring_starts(vertex);
    let end = load_ring_starts(vertex + 1u);
    for (var i = start; i < end; i++) {
        let last = spoke(load_faces(load_ring_faces(i)), vertex).last;
        var is_next = false;
        for (var j = start; j < end; j++) {
            is_next = is_next || spoke(load_faces(load_ring_faces(j)), vertex).next == last;
        }
        if !is_next {
            return last;
        }
    }
    return vertex;
}

fn feature_degree(vertex: u32, floor: f32) -> f32 {
    let own = lifted(vertex, floor);
    var greatest = own;
    let start = load_ring_starts(vertex);
    let end = load_ring_starts(vertex + 1u);
    for (var i = start; i < end; i++) {
        greatest = max(greatest, lifted(spoke(load_faces(load_ring_faces(i)), vertex).next, floor));
    }
    var last = vertex;
    if (load_positions(vertex).flags & BORDER) != 0u {
        last = last_neighbor(vertex);
        greatest = max(greatest, lifted(last, floor));
    }
    if greatest < LEAST {
        return 0.0;
    }
    var shares = with_share(Shares(0.0, 0.0), own, greatest);
    for (var i = start; i < end; i++) {
        shares = with_share(shares, lifted(spoke(load_faces(load_ring_faces(i)), vertex).next, floor), greatest);
    }
    if last == vertex {
        return degree_of(shares, end - start);
    }
    return degree_of(with_share(shares, lifted(last, floor), greatest), end - start + 1u);
}

// The weight of a free vertex, by its degree and its own curvature.
fn weight_of(degree: f32, own: f32, floor: f32) -> f32 {
    var gate = 1.0;
    if params.gated != 0u {
        gate = divide(own, add(own, floor));
    }
    return max(add(params.base, mul(params.slope, mul(degree, gate))), params.least);
}

fn feature_weight(vertex: u32, floor: f32) -> f32 {
    if (load_positions(vertex).flags & (LOCKED | HUB)) != 0u {
        return params.of_fixed;
    }
    return weight_of(feature_degree(vertex, floor), load_curvatures(vertex), floor);
}

fn run(i: u32) {
    store_weights(i, feature_weight(i, floor_of(load_curvature_sum(0u))));
}
