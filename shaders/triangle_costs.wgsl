// The cost of every face as a triangle that becomes one vertex, by the plane metric. Twin: src/kernel/triangle_costs.rs

struct Corner { position: Position, quadric: PlaneQuadric }

// The cost of the best allowed placement about the center, for corners at a, b and c.
fn best_cost(q: PairQuadric, a: vec3f, b: vec3f, c: vec3f, locked: vec3<bool>) -> f32 {
    let at_a = value(q, a);
    let at_b = value(q, b);
    let at_c = value(q, c);
    let at_corners = min(min(at_a, at_b), at_c);
    let at_four = min(q.c, at_corners);
    let x = least(q, params.regularization);
    let radius_sq = max(max(dot3(a, a), dot3(b, b)), dot3(c, c));
    let near = dot3(x, x) <= mul(mul(REACH, REACH), radius_sq);
    var cost = select(at_four, value(q, x), near);
    cost = select(cost, at_four, params.placement == AT_THREE);
    cost = select(cost, at_corners, params.placement == AT_ENDS);
    cost = select(cost, at_a, locked.x);
    cost = select(cost, at_b, locked.y);
    cost = select(cost, at_c, locked.z);
    return select(0.0, cost, cost > NOISE);
}

// Solved at a scale where the trace is about 1.
fn triangle_cost(first: Corner, second: Corner, third: Corner) -> f32 {
    let sum = add3(add3(xyz(first.position), xyz(second.position)), xyz(third.position));
    let center = scale3(sum, THIRD);
    let a = sub3(xyz(first.position), center);
    let b = sub3(xyz(second.position), center);
    let c = sub3(xyz(third.position), center);
    let two = sum_moved(moved(first.quadric, scale3(a, -1.0)), moved(second.quadric, scale3(b, -1.0)));
    let all = sum_moved(two, moved(third.quadric, scale3(c, -1.0)));
    let q = PairQuadric(all.a, scale3(all.b, -1.0), all.c, vec3f(0.0, 0.0, 0.0), 0.0);
    let t = trace(q.a);
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let locked = vec3<bool>(
        (first.position.flags & (LOCKED | SEAM)) != 0u,
        (second.position.flags & (LOCKED | SEAM)) != 0u,
        (third.position.flags & (LOCKED | SEAM)) != 0u,
    );
    let cost = best_cost(scaled(q, scale_down(half)), a, b, c, locked);
    return mul(mul(cost, scale_up(half)), scale_up(half));
}

// Two corners that stay, or a hub, are no candidate.
fn triangle_key(first: Corner, second: Corner, third: Corner) -> u32 {
    let a = first.position.flags;
    let b = second.position.flags;
    let c = third.position.flags;
    let held = LOCKED | SEAM;
    let staying = u32((a & held) != 0u) + u32((b & held) != 0u) + u32((c & held) != 0u);
    if staying > 1u || ((a | b | c) & HUB) != 0u {
        return NO_KEY;
    }
    return cost_key(triangle_cost(first, second, third));
}

fn corner(v: u32) -> Corner {
    return Corner(load_positions(v), load_quadrics(v));
}

fn run(i: u32) {
    let face = load_faces(i);
    store_triangles(i, Edge(3u * i, NO_FACE));
    store_keys(i, triangle_key(corner(face.a), corner(face.b), corner(face.c)));
}
