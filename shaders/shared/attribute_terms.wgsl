// What attributes add to the cost of a pair, number by number. Twin: src/kernel/attribute_terms.rs

// What the attributes add about the midpoint.
struct Joint {
    // With the means of the ends' numbers.
    b: vec3f,
    c: f32,
    // What the least numbers save.
    saved: Sym3,
    saved_b: vec3f,
    saved_c: f32,
    // What the numbers of either end cost at its place more than the means.
    at_first: f32,
    at_second: f32,
}

// Of the wedges of both ends, and of the faces of a side; one over the last.
struct SideWeights { first: f32, second: f32, all: f32, inverse: f32 }

fn side_weights(first: f32, second: f32) -> SideWeights {
    let all = add(first, second);
    var inverse = 0.0;
    if all > NO_WEIGHT {
        inverse = divide(1.0, all);
    }
    return SideWeights(first, second, all, inverse);
}

// One number of a side: the sums of |n| g of both wedges, half the ends' difference.
struct Term { first: vec3f, second: vec3f, half: f32 }

// The term of a number, its sums times `scale`.
fn term_of(first: Slope, second: Slope, scale: f32) -> Term {
    return Term(
        scale3(vec3f(first.x, first.y, first.z), scale),
        scale3(vec3f(second.x, second.y, second.z), scale),
        mul(sub(second.at, first.at), 0.5),
    );
}

fn with_term(joint: Joint, term: Term, weights: SideWeights, h: vec3f) -> Joint {
    let q = term.half;
    let g = add3(term.first, term.second);
    let first_h = dot3(term.first, h);
    let second_h = dot3(term.second, h);
    let e = sub(sub(first_h, mul(q, weights.first)), sub(second_h, mul(q, weights.second)));
    let q_sq = mul(q, q);
    let across = mul(mul(2.0, q), add(first_h, second_h));
    let scaled_g = scale3(g, weights.inverse);
    let gh = dot3(g, h);
    let own = mul(q_sq, weights.all);
    let twice = mul(2.0, q);
    return Joint(
        add3(joint.b, scale3(sub3(term.first, term.second), q)),
        add(joint.c, sub(own, across)),
        sym_add(joint.saved, sym_scale(outer(g), weights.inverse)),
        add3(joint.saved_b, scale3(scaled_g, e)),
        add(joint.saved_c, mul(mul(e, e), weights.inverse)),
        add(joint.at_first, add(mul(twice, sub(e, gh)), own)),
        add(joint.at_second, sub(own, mul(twice, add(gh, e)))),
    );
}

fn ends_half_exponent(ends: Ends) -> u32 {
    return half_exponent(trace(sym_add(ends.first, ends.second)));
}

// The cost of a pair from −h to h; the attributes are scaled by the square of the scale, the geometry is not yet.
fn joint_cost(ends: Ends, joint: Joint, half: u32, h: vec3f, freedom: Freedom) -> f32 {
    let s = scale_down(half);
    let s_sq = mul(s, s);
    var q = ends_quadric(ends, s_sq, h);
    q.b = add3(q.b, joint.b);
    q.c = add(q.c, joint.c);
    let at_first = add(value(q, scale3(h, -1.0)), joint.at_first);
    let at_second = add(value(q, h), joint.at_second);

    let pull = mul(ROUNDING, trace(joint.saved));
    let pulled = Sym3(pull, 0.0, 0.0, pull, 0.0, pull);
    let least = PairQuadric(
        sym_add(sym_sub(q.a, joint.saved), pulled),
        add3(q.b, joint.saved_b),
        sub(q.c, joint.saved_c),
        q.n,
        q.d,
    );
    let free = Freedom(false, false, freedom.placement, freedom.regularization);
    var cost = pair_cost(least, h, free);
    cost = select(cost, min(at_first, at_second), freedom.placement == AT_ENDS);
    cost = select(cost, at_first, freedom.first_locked);
    cost = select(cost, at_second, freedom.second_locked);
    cost = select(0.0, cost, cost > NOISE);
    return mul(mul(cost, scale_up(half)), scale_up(half));
}

fn attribute_matrix(sum: AttributeSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

// Geometry of both ends, with the outer products of the attributes of one side.
fn with_side(ends: Ends, first: AttributeSum, second: AttributeSum) -> Ends {
    return Ends(
        sym_add(ends.first, attribute_matrix(first)),
        sym_add(ends.second, attribute_matrix(second)),
        ends.mutual,
        ends.first_normal,
        ends.second_normal,
        ends.mutual_normal,
    );
}
