// The point of a triangle nearest to another. Twin: src/kernel/nearest_point.rs

// Corner weights of the point of the triangle nearest to the origin: the corners are given about it.
fn nearest_weights(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let ac = flush3(sub3(c, a), LEAST_FACTOR);
    let a1 = flush(-dot3(ab, a), LEAST_FACTOR);
    let a2 = flush(-dot3(ac, a), LEAST_FACTOR);
    if a1 <= 0.0 && a2 <= 0.0 {
        return vec3f(1.0, 0.0, 0.0);
    }
    let b1 = flush(-dot3(ab, b), LEAST_FACTOR);
    let b2 = flush(-dot3(ac, b), LEAST_FACTOR);
    if b1 >= 0.0 && b2 <= b1 {
        return vec3f(0.0, 1.0, 0.0);
    }
    let wc = sub(mul(a1, b2), mul(b1, a2));
    if wc <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        let t = divide(a1, sub(a1, b1));
        return vec3f(sub(1.0, t), t, 0.0);
    }
    let c1 = flush(-dot3(ab, c), LEAST_FACTOR);
    let c2 = flush(-dot3(ac, c), LEAST_FACTOR);
    if c2 >= 0.0 && c1 <= c2 {
        return vec3f(0.0, 0.0, 1.0);
    }
    let wb = sub(mul(c1, a2), mul(a1, c2));
    if wb <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        let t = divide(a2, sub(a2, c2));
        return vec3f(sub(1.0, t), 0.0, t);
    }
    let wa = sub(mul(b1, c2), mul(c1, b2));
    let b_to_c = sub(b2, b1);
    let c_to_b = sub(c1, c2);
    if wa <= 0.0 && b_to_c >= 0.0 && c_to_b >= 0.0 {
        let t = divide(b_to_c, add(b_to_c, c_to_b));
        return vec3f(0.0, sub(1.0, t), t);
    }
    let sum = add(add(wa, wb), wc);
    let u = divide(wb, sum);
    let v = divide(wc, sum);
    return vec3f(sub(sub(1.0, u), v), u, v);
}

fn point_at(weights: vec3f, a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return add3(add3(scale3(a, weights.x), scale3(b, weights.y)), scale3(c, weights.z));
}
