// The cost of every pair by the volume metric. Twin: src/kernel/volume_costs.rs

struct Ends {
    first: Sym3,
    second: Sym3,
    mutual: Sym3,
    first_normal: vec3f,
    second_normal: vec3f,
    mutual_normal: vec3f,
}

fn volume_matrix(sum: VolumeSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

fn border_matrix(sum: BorderSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

// Adds the border terms, weighted by the pair's length, and drops the volume constraint.
fn with_border(ends: Ends, first: BorderSum, second: BorderSum, mutual: Sym3, weight: f32) -> Ends {
    let none = vec3f(0.0, 0.0, 0.0);
    return Ends(
        sym_add(ends.first, sym_scale(border_matrix(first), weight)),
        sym_add(ends.second, sym_scale(border_matrix(second), weight)),
        sym_add(ends.mutual, sym_scale(mutual, weight)),
        none,
        none,
        none,
    );
}

// The cost of a pair from −h to h, solved at a scale where the trace is about 1.
fn volume_cost(ends: Ends, h: vec3f, freedom: Freedom) -> f32 {
    let t = trace(sym_add(ends.first, ends.second));
    if t <= NO_AREA {
        return 0.0;
    }
    let half = half_exponent(t);
    let s = scale_down(half);
    let s_sq = mul(s, s);
    let first = sym_scale(ends.first, s_sq);
    let second = sym_scale(ends.second, s_sq);
    let mutual = sym_scale(ends.mutual, s_sq);
    var q = end_matrices(first, second, mutual, h);
    q.n = scale3(sub3(add3(ends.first_normal, ends.second_normal), ends.mutual_normal), s);
    q.d = dot3(scale3(sub3(ends.second_normal, ends.first_normal), s), h);
    let cost = pair_cost(q, h, freedom);
    return mul(mul(cost, scale_up(half)), scale_up(half));
}

fn volume_key(u: u32, w: u32, l: u32) -> u32 {
    let r = opposite(w, u, u);
    let pu = load_positions(u);
    let pw = load_positions(w);
    let a = xyz(pu);
    let e = sub3(xyz(pw), a);
    let h = scale3(e, 0.5);
    let left = flush3(cross3(e, sub3(xyz(load_positions(l)), a)), LEAST_FACTOR);
    var mutual = outer(left);
    var mutual_normal = left;
    if r != NO_VERTEX {
        let right = flush3(cross3(sub3(xyz(load_positions(r)), a), e), LEAST_FACTOR);
        mutual = sym_add(mutual, outer(right));
        mutual_normal = add3(mutual_normal, right);
    }
    let sum_u = load_sums(u);
    let sum_w = load_sums(w);
    var ends = Ends(
        volume_matrix(sum_u),
        volume_matrix(sum_w),
        mutual,
        vec3f(sum_u.nx, sum_u.ny, sum_u.nz),
        vec3f(sum_w.nx, sum_w.ny, sum_w.nz),
        mutual_normal,
    );
    if ((pu.flags | pw.flags) & BORDER) != 0u {
        var on_border = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        if r == NO_VERTEX {
            on_border = border_term(e);
        }
        let weight = mul(params.border_weight, dot3(e, e));
        ends = with_border(ends, load_borders(u), load_borders(w), on_border, weight);
    }
    let freedom = Freedom(
        (pu.flags & LOCKED) != 0u,
        (pw.flags & LOCKED) != 0u,
        params.at_endpoints != 0u,
        params.regularization,
    );
    return cost_key(volume_cost(ends, h, freedom));
}

fn run(i: u32) {
    let corners = half_edge_corners(load_pairs(i));
    store_keys(i, volume_key(corners.x, corners.y, corners.z));
}
