// The cost of every pair by the volume metric and the attributes. Twin: src/kernel/attribute_costs.rs

// The wedges at both ends of a pair on one of its sides, and the faces there that both share.
struct PairSide { first: u32, second: u32, left: u32, right: u32 }

fn normal_of(f: u32) -> Normal {
    var normal = Normal(0.0, 0.0, 0.0, 0.0);
    if f != NO_FACE {
        normal = load_normals(f);
    }
    return normal;
}

fn slope(wedge: u32, j: u32) -> vec3f {
    let row = load_slopes(wedge * params.costed + j);
    return vec3f(row.x, row.y, row.z);
}

fn gradient(f: u32, j: u32) -> vec3f {
    var g = vec3f(0.0, 0.0, 0.0);
    if f != NO_FACE {
        let row = load_gradients(f * params.costed + j);
        g = vec3f(row.x, row.y, row.z);
    }
    return g;
}

// Adds the terms of a side.
fn with_terms(before: Joint, side: PairSide, half: u32, h: vec3f) -> Joint {
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let left_root = mul(normal_of(side.left).root, s);
    let right_root = mul(normal_of(side.right).root, s);
    let first_weight = mul(load_wedge_sums(side.first).weight, s_sq);
    let second_weight = mul(load_wedge_sums(side.second).weight, s_sq);
    let weights = side_weights(first_weight, second_weight, left_root, right_root);
    var joint = before;
    for (var j = 0u; j < params.costed; j++) {
        let a = load_values(side.first * params.costed + j);
        let b = load_values(side.second * params.costed + j);
        let term = Term(
            scale3(slope(side.first, j), s_sq),
            scale3(slope(side.second, j), s_sq),
            scale3(gradient(side.left, j), s),
            scale3(gradient(side.right, j), s),
            left_root,
            right_root,
            mul(sub(b, a), 0.5),
        );
        joint = with_term(joint, term, weights, h);
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
    var side = PairSide(own.x, own.y, f, edge.across);
    if tears {
        side.right = NO_FACE;
    }
    var joint = Joint(
        Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), vec3f(0.0, 0.0, 0.0), 0.0,
        Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), vec3f(0.0, 0.0, 0.0), 0.0, 0.0, 0.0,
    );
    joint = with_terms(joint, side, half, h);
    if tears {
        joint = with_terms(joint, PairSide(other.x, other.y, NO_FACE, edge.across), half, h);
    }
    let freedom =
        Freedom(stays(pu.flags, pw.flags), stays(pw.flags, pu.flags), params.placement, params.regularization);
    store_keys(i, cost_key(joint_cost(ends, joint, half, h, freedom)));
}
