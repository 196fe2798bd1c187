// The cost of every pair by the volume metric and the attributes. Twin: src/kernel/attribute_costs.rs

fn normal_of(f: u32) -> Normal {
    var normal = Normal(0.0, 0.0, 0.0, 0.0);
    if f != NO_FACE {
        normal = load_normals(f);
    }
    return normal;
}

// Adds the terms of a side, whose wedges at both ends these are.
fn with_terms(before: Joint, side: vec2u, half: u32, h: vec3f) -> Joint {
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let first_weight = mul(load_wedge_sums(side.x).weight, s_sq);
    let second_weight = mul(load_wedge_sums(side.y).weight, s_sq);
    let weights = side_weights(first_weight, second_weight);
    var joint = before;
    for (var j = 0u; j < params.costed; j++) {
        let a = load_slopes(side.x * params.costed + j);
        let b = load_slopes(side.y * params.costed + j);
        joint = with_term(joint, term_of(a, b, s_sq), weights, h);
    }
    return joint;
}

// The wedges of both ends in a face.
fn wedges_in(f: u32, u: u32, w: u32) -> vec2u {
    let face = load_faces(f);
    let corners = load_corners(f);
    let at_u = select(select(corners.a, corners.c, face.c == u), corners.b, face.b == u);
    let at_w = select(select(corners.a, corners.c, face.c == w), corners.b, face.b == w);
    return vec2u(at_u, at_w);
}

fn run(i: u32) {
    let edge = load_pairs(i);
    let ends_at = half_edge_corners(edge.half_edge);
    let u = ends_at.x;
    let w = ends_at.y;
    let f = edge.half_edge / 3u;
    let pu = load_positions(u);
    let pw = load_positions(w);
    let own = wedges_in(f, u, w);
    var other = own;
    if edge.across != NO_FACE {
        other = wedges_in(edge.across, u, w);
    }
    let tears = any(own != other);

    var ends = volume_ends(load_sums(u), load_sums(w), load_normals(f), normal_of(edge.across));
    if HAS_BORDER && ((pu.flags | pw.flags) & BORDER) != 0u {
        var on_border = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        if edge.across == NO_FACE {
            on_border = border_term(sub3(xyz(pw), xyz(pu)));
        }
        ends = with_border(ends, load_borders(u), load_borders(w), on_border, params.border_weight);
    }
    ends = with_side(ends, load_wedge_sums(own.x), load_wedge_sums(own.y));
    if tears {
        ends = with_side(ends, load_wedge_sums(other.x), load_wedge_sums(other.y));
    }
    if trace(sym_add(ends.first, ends.second)) <= NO_WEIGHT {
        store_keys(i, 0u);
        return;
    }
    let h = scale3(sub3(xyz(pw), xyz(pu)), 0.5);
    let half = ends_half_exponent(ends);
    var joint = Joint(
        vec3f(0.0, 0.0, 0.0), 0.0,
        Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), vec3f(0.0, 0.0, 0.0), 0.0, 0.0, 0.0,
    );
    joint = with_terms(joint, own, half, h);
    if tears {
        joint = with_terms(joint, other, half, h);
    }
    let freedom =
        Freedom(stays(pu.flags, pw.flags), stays(pw.flags, pu.flags), params.placement, params.regularization);
    store_keys(i, cost_key(joint_cost(ends, joint, half, h, freedom)));
}
