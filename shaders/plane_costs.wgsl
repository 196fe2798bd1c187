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

fn plane_key(u: u32, w: u32) -> u32 {
    let pu = load_positions(u);
    let pw = load_positions(w);
    let h = scale3(sub3(xyz(pw), xyz(pu)), 0.5);
    let freedom = Freedom(
        (pu.flags & LOCKED) != 0u,
        (pw.flags & LOCKED) != 0u,
        params.at_endpoints != 0u,
        params.regularization,
    );
    return cost_key(plane_cost(load_quadrics(u), load_quadrics(w), h, freedom));
}

fn run(i: u32) {
    let corners = half_edge_corners(load_pairs(i));
    store_keys(i, plane_key(corners.x, corners.y));
}
