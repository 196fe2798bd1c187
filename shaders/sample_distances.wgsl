// The nearest triangle of every sample. Twin: src/kernel/sample_distances.rs

fn box_distance_sq(p: vec3f, node: TreeNode) -> f32 {
    let below = sub3(vec3f(node.low_x, node.low_y, node.low_z), p);
    let above = sub3(p, vec3f(node.high_x, node.high_y, node.high_z));
    let outside = flush3(max(max(below, above), vec3f(0.0, 0.0, 0.0)), LEAST_FACTOR);
    return dot3(outside, outside);
}

fn flushed_dot(a: vec3f, b: vec3f) -> f32 {
    return flush(dot3(a, b), LEAST_FACTOR);
}

// Where the closest point is, in shares of the edges e and f from the first corner, by the region of the point.
fn nearest_shares(e: vec3f, f: vec3f, from_a: vec3f) -> vec2f {
    let e_a = flushed_dot(e, from_a);
    let f_a = flushed_dot(f, from_a);
    if e_a <= 0.0 && f_a <= 0.0 {
        return vec2f(0.0, 0.0);
    }
    let from_b = flush3(sub3(from_a, e), LEAST_FACTOR);
    let e_b = flushed_dot(e, from_b);
    let f_b = flushed_dot(f, from_b);
    if e_b >= 0.0 && f_b <= e_b {
        return vec2f(1.0, 0.0);
    }
    let from_c = flush3(sub3(from_a, f), LEAST_FACTOR);
    let e_c = flushed_dot(e, from_c);
    let f_c = flushed_dot(f, from_c);
    if f_c >= 0.0 && e_c <= f_c {
        return vec2f(0.0, 1.0);
    }
    let at_c = sub(mul(e_a, f_b), mul(e_b, f_a));
    if at_c <= 0.0 && e_a >= 0.0 && e_b <= 0.0 {
        return vec2f(divide(e_a, sub(e_a, e_b)), 0.0);
    }
    let at_b = sub(mul(e_c, f_a), mul(e_a, f_c));
    if at_b <= 0.0 && f_a >= 0.0 && f_c <= 0.0 {
        return vec2f(0.0, divide(f_a, sub(f_a, f_c)));
    }
    let at_a = sub(mul(e_b, f_c), mul(e_c, f_b));
    let toward_c = sub(f_b, e_b);
    let toward_b = sub(e_c, f_c);
    if at_a <= 0.0 && toward_c >= 0.0 && toward_b >= 0.0 {
        let t = divide(toward_c, add(toward_c, toward_b));
        return vec2f(sub(1.0, t), t);
    }
    let total = add(add(at_a, at_b), at_c);
    return vec2f(divide(at_b, total), divide(at_c, total));
}

fn triangle_distance_sq(p: vec3f, face: Face) -> f32 {
    let a = xyz(load_positions(face.a));
    let e = flush3(sub3(xyz(load_positions(face.b)), a), LEAST_FACTOR);
    let f = flush3(sub3(xyz(load_positions(face.c)), a), LEAST_FACTOR);
    let from_a = flush3(sub3(p, a), LEAST_FACTOR);
    let shares = nearest_shares(e, f, from_a);
    let along_e = scale3(e, flush(shares.x, LEAST_FACTOR));
    let along_f = scale3(f, flush(shares.y, LEAST_FACTOR));
    let offset = flush3(sub3(sub3(from_a, along_e), along_f), LEAST_FACTOR);
    return dot3(offset, offset);
}

// The triangle and the bits of its squared distance.
fn nearest_triangle(p: vec3f) -> vec2u {
    var stack: array<u32, STACK>;
    var distances: array<f32, STACK>;
    var top = 0u;
    var node = load_nodes(0u);
    var nearest = 0u;
    var least = FARTHEST;
    for (var visit = 0u; visit < MOST_VISITS; visit++) {
        for (var i = node.first; i < node.first + node.count; i++) {
            let distance = triangle_distance_sq(p, load_faces(i));
            if distance < least {
                least = distance;
                nearest = i;
            }
        }
        var next = NO_NODE;
        if node.count == 0u {
            let left = node.first;
            let right = node.first + 1u;
            let to_left = box_distance_sq(p, load_nodes(left));
            let to_right = box_distance_sq(p, load_nodes(right));
            let is_right = to_right < to_left;
            if max(to_left, to_right) < least && top < STACK {
                stack[top] = select(right, left, is_right);
                distances[top] = max(to_left, to_right);
                top++;
            }
            if min(to_left, to_right) < least {
                next = select(left, right, is_right);
            }
        }
        while next == NO_NODE && top > 0u {
            top--;
            if distances[top] < least {
                next = stack[top];
            }
        }
        if next == NO_NODE {
            break;
        }
        node = load_nodes(next);
    }
    return vec2u(nearest, bitcast<u32>(least));
}

fn run(i: u32) {
    store_nearest(i, nearest_triangle(xyz(load_samples(i))));
}
