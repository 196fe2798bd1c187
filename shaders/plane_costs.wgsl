// The cost of every pair by the plane metric. Twin: src/kernel/plane_costs.rs

// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
fn plane_cost(first: PlaneQuadric, second: PlaneQuadric, h: vec3f, freedom: Freedom) -> f32 {
    let both = sum_moved(moved(first, h), moved(second, scale3(h, -1.0)));
    let q = PairQuadric(both.a, scale3(both.b, -1.0), both.c, vec3f(0.0, 0.0, 0.0), 0.0);
    let t = trace(q.a);
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let cost = pair_cost(scaled(q, scale_down(half)), h, freedom);
    return mul(mul(cost, scale_up(half)), scale_up(half));
}

// What the key of a pair is computed from.
struct Pair {
    pu: Position,
    pw: Position,
    first: PlaneQuadric,
    second: PlaneQuadric,
}

fn plane_key(pair: Pair) -> u32 {
    let h = scale3(sub3(xyz(pair.pw), xyz(pair.pu)), 0.5);
    let freedom = Freedom(
        stays(pair.pu.flags, pair.pw.flags),
        stays(pair.pw.flags, pair.pu.flags),
        params.placement,
        params.regularization,
    );
    return cost_key(plane_cost(pair.first, pair.second, h, freedom));
}

fn run(i: u32) {
    let corners = half_edge_corners(load_pairs(i).half_edge);
    let u = corners.x;
    let w = corners.y;
    store_keys(i, plane_key(Pair(load_positions(u), load_positions(w), load_quadrics(u), load_quadrics(w))));
}
