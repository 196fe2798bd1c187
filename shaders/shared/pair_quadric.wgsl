// The quadric of a pair about its midpoint, its least point and its cost. Twin: src/kernel/pair_quadric.rs

// xᵀA x − 2 b·x + c, and the plane n·x = d on which the volume is kept (none when n is 0).
struct PairQuadric { a: Sym3, b: vec3f, c: f32, n: vec3f, d: f32 }
struct Freedom { first_locked: bool, second_locked: bool, placement: u32, regularization: f32 }

// Whether an end of these flags stays beside another of those: one on a seam may only move along it, and one where seams
// meet only to another such.
fn stays(own: u32, other: u32) -> bool {
    return (own & LOCKED) != 0u || (own & ~other & (SEAM | CORNER)) != 0u;
}

fn value(q: PairQuadric, x: vec3f) -> f32 {
    return add(sub(dot3(x, sym_mul(q.a, x)), mul(2.0, dot3(q.b, x))), q.c);
}

// k + 64 for a positive normal number in [2²ᵏ⁻¹, 2²ᵏ⁺¹).
fn half_exponent(x: f32) -> u32 {
    return (((bitcast<u32>(x) >> 23u) & 0xffu) + 2u) >> 1u;
}

fn scale_down(half: u32) -> f32 {
    return bitcast<f32>((191u - half) << 23u);
}

fn scale_up(half: u32) -> f32 {
    return bitcast<f32>((63u + half) << 23u);
}

fn scaled(q: PairQuadric, s: f32) -> PairQuadric {
    let s_sq = mul(s, s);
    return PairQuadric(sym_scale(q.a, s_sq), scale3(q.b, s_sq), mul(q.c, s_sq), scale3(q.n, s), mul(q.d, s));
}

// On the constraint where there is one: L D Lᵀ of the regularized matrix, which needs no pivots.
fn least(q: PairQuadric, regularization: f32) -> vec3f {
    let t = trace(q.a);
    let r = mul(regularization, t);
    let r0 = divide(1.0, add(q.a.xx, r));
    let l1 = mul(q.a.xy, r0);
    let l2 = mul(q.a.xz, r0);
    let r1 = divide(1.0, sub(add(q.a.yy, r), mul(l1, q.a.xy)));
    let m = sub(q.a.yz, mul(l2, q.a.xy));
    let l3 = mul(m, r1);
    let r2 = divide(1.0, sub(sub(add(q.a.zz, r), mul(l2, q.a.xz)), mul(l3, m)));

    // A y = b.
    let b1 = sub(q.b.y, mul(l1, q.b.x));
    let b2 = sub(sub(q.b.z, mul(l2, q.b.x)), mul(l3, b1));
    let yz = mul(b2, r2);
    let yy = sub(mul(b1, r1), mul(l3, yz));
    let yx = sub(sub(mul(q.b.x, r0), mul(l1, yy)), mul(l2, yz));
    let y = vec3f(yx, yy, yz);
    if dot3(q.n, q.n) <= mul(CONSTRAINT, mul(t, t)) {
        return y;
    }

    // A z = n; x = y + z (d − n·y)/(n·z).
    let n1 = sub(q.n.y, mul(l1, q.n.x));
    let n2 = sub(sub(q.n.z, mul(l2, q.n.x)), mul(l3, n1));
    let zz = mul(n2, r2);
    let zy = sub(mul(n1, r1), mul(l3, zz));
    let zx = sub(sub(mul(q.n.x, r0), mul(l1, zy)), mul(l2, zz));
    let z = vec3f(zx, zy, zz);
    return add3(y, scale3(z, divide(sub(q.d, dot3(q.n, y)), dot3(q.n, z))));
}

fn pair_cost(q: PairQuadric, h: vec3f, freedom: Freedom) -> f32 {
    let at_first = value(q, scale3(h, -1.0));
    let at_second = value(q, h);
    let at_ends = min(at_first, at_second);
    let x = least(q, freedom.regularization);
    let near = dot3(x, x) <= mul(mul(REACH, REACH), dot3(h, h));
    let at_three = min(q.c, at_ends);
    let along = clamp(divide(dot3(q.b, h), dot3(h, sym_mul(q.a, h))), -1.0, 1.0);
    let on_segment = min(value(q, scale3(h, along)), at_three);
    var cost = select(at_three, value(q, x), near);
    cost = select(cost, on_segment, freedom.placement == ON_SEGMENT);
    cost = select(cost, at_three, freedom.placement == AT_THREE);
    cost = select(cost, at_ends, freedom.placement == AT_ENDS);
    cost = select(cost, at_first, freedom.first_locked);
    cost = select(cost, at_second, freedom.second_locked);
    return select(0.0, cost, cost > NOISE);
}

fn cost_key(cost: f32) -> u32 {
    return bitcast<u32>(flush(min(cost, GREATEST), LEAST));
}

fn end_matrices(first: Sym3, second: Sym3, mutual: Sym3, h: vec3f) -> PairQuadric {
    let both = sym_add(first, second);
    return PairQuadric(
        sym_sub(both, mutual),
        sym_mul(sym_sub(second, first), h),
        dot3(h, sym_mul(both, h)),
        vec3f(0.0, 0.0, 0.0),
        0.0,
    );
}
