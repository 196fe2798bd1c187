// The cost of every pair by the volume metric. Twin: src/kernel/volume_costs.rs

// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
fn volume_cost(ends: Ends, h: vec3f, freedom: Freedom) -> f32 {
    let t = trace(sym_add(ends.first, ends.second));
    if t <= NO_WEIGHT {
        return 0.0;
    }
    let half = half_exponent(t);
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let cost = pair_cost(ends_quadric(ends, s_sq, h), h, freedom);
    return mul(mul(cost, scale_up(half)), scale_up(half));
}

// What the key of a pair is computed from, off the border.
struct Pair {
    pu: Position,
    pw: Position,
    sum_u: VolumeSum,
    sum_w: VolumeSum,
    left: Normal,
    right: Normal,
}

// The pair of the half-edge from u to w between the faces f and g.
fn pair_between(f: u32, g: u32, u: u32, w: u32) -> Pair {
    var right = Normal(0.0, 0.0, 0.0, 0.0);
    if g != NO_FACE {
        right = load_normals(g);
    }
    return Pair(load_positions(u), load_positions(w), load_sums(u), load_sums(w), load_normals(f), right);
}

// What the ends of a pair sum to.
fn ends_of(pair: Pair) -> Ends {
    return volume_ends(pair.sum_u, pair.sum_w, pair.left, pair.right);
}

// The key of a pair whose ends sum to `ends`.
fn ends_key(ends: Ends, pair: Pair) -> u32 {
    let h = scale3(sub3(xyz(pair.pw), xyz(pair.pu)), 0.5);
    let freedom = Freedom(
        stays(pair.pu.flags, pair.pw.flags),
        stays(pair.pw.flags, pair.pu.flags),
        params.placement,
        params.regularization,
    );
    return cost_key(volume_cost(ends, h, freedom));
}

// Whether a pair of ends with these flags runs across the surface from border to border: contracting it would pinch the surface, which
// the link condition forbids. Behind a locked end a border may hide; where parts met the condition may not be asked.
fn is_across(first: u32, second: u32, across: u32) -> bool {
    let joins_borders = ((first & BORDER) != 0u && (second & (BORDER | LOCKED)) != 0u)
        || ((second & BORDER) != 0u && (first & (BORDER | LOCKED)) != 0u);
    return across != NO_FACE && joins_borders && ((first | second) & JOINED) == 0u;
}

fn run(i: u32) {
    let edge = load_pairs(i);
    let corners = half_edge_corners(edge.half_edge);
    let u = corners.x;
    let w = corners.y;
    if HAS_BORDER && is_across(load_positions(u).flags, load_positions(w).flags, edge.across) {
        store_keys(i, NO_KEY);
        return;
    }
    let pair = pair_between(edge.half_edge / 3u, edge.across, u, w);
    var ends = ends_of(pair);
    if HAS_BORDER && ((pair.pu.flags | pair.pw.flags) & BORDER) != 0u {
        let e = sub3(xyz(pair.pw), xyz(pair.pu));
        var on_border = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        if edge.across == NO_FACE {
            on_border = border_term(e);
        }
        ends = with_border(ends, load_borders(u), load_borders(w), on_border, params.border_weight);
    }
    store_keys(i, ends_key(ends, pair));
}
