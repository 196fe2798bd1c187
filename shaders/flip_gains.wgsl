// What turning an edge to the other diagonal of its two faces gains. Twin: src/kernel/flip_gains.rs

// (b − a)×(c − a).
fn doubled_area_of(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
}

fn length_sq(a: vec3f) -> f32 {
    let flushed = flush3(a, LEAST_FACTOR);
    return dot3(flushed, flushed);
}

// Whether a new face with this normal keeps its side and is no sliver.
fn is_sound(n: vec3f, old: vec3f, a: vec3f, b: vec3f, c: vec3f) -> bool {
    let length = root(dot3(n, n));
    let keeps_side = dot3(n, old) > mul(LEAST_COS, mul(length, root(dot3(old, old))));
    let sides_sq = add(add(length_sq(sub3(b, a)), length_sq(sub3(c, b))), length_sq(sub3(a, c)));
    return keeps_side && length > mul(LEAST_HEIGHT, sides_sq);
}

// The squared distance of `p` to a triangle.
fn distance_sq(p: vec3f, a: vec3f, b: vec3f, c: vec3f) -> f32 {
    let from_a = sub3(a, p);
    let from_b = sub3(b, p);
    let from_c = sub3(c, p);
    return length_sq(point_at(nearest_weights(from_a, from_b, from_c), from_a, from_b, from_c));
}

// The corners of an edge's two faces: the ends, the one across, and that on the other side.
struct Diamond { u: vec3f, v: vec3f, k: vec3f, l: vec3f }

// What the samples of a face are off, before and after.
struct Change { before: f32, after: f32 }

fn with_samples(before: Change, f: u32, at: Diamond) -> Change {
    var change = before;
    let end = load_sample_starts(f + 1u);
    for (var i = load_sample_starts(f); i < end; i++) {
        let row = load_samples(i);
        let p = row.xyz;
        let old = min(distance_sq(p, at.u, at.v, at.k), distance_sq(p, at.v, at.u, at.l));
        let new_sq = min(distance_sq(p, at.u, at.l, at.k), distance_sq(p, at.l, at.v, at.k));
        change.before = add(change.before, flush(mul(row.w, flush(old, LEAST_FACTOR)), LEAST_SUM));
        change.after = add(change.after, flush(mul(row.w, flush(new_sq, LEAST_FACTOR)), LEAST_SUM));
    }
    return change;
}

// The length of an edge times one less the cosine between its faces.
fn bend(first: vec3f, second: vec3f, along: vec3f) -> f32 {
    let lengths = mul(root(dot3(first, first)), root(dot3(second, second)));
    return mul(root(length_sq(along)), sub(1.0, divide(flush(dot3(first, second), LEAST_FACTOR), flush(lengths, LEAST_FACTOR))));
}

// With the edge between two vertices, beyond which a face may lie other than `own`.
fn with_side(before: Change, own: u32, start: u32, to: u32, old: vec3f, new_normal: vec3f) -> Change {
    var change = before;
    let end = load_ring_starts(start + 1u);
    for (var i = load_ring_starts(start); i < end; i++) {
        let f = load_ring_faces(i);
        let face = load_faces(f);
        if f != own && has(face, to) {
            let normal = doubled_area_of(xyz(load_positions(face.a)), xyz(load_positions(face.b)), xyz(load_positions(face.c)));
            let along = sub3(xyz(load_positions(to)), xyz(load_positions(start)));
            change.before = add(change.before, bend(old, normal, along));
            change.after = add(change.after, bend(new_normal, normal, along));
        }
    }
    return change;
}

// The cotangent of the angle at a corner, from the normal of the face.
fn cotangent(tip: vec3f, a: vec3f, b: vec3f, normal: vec3f) -> f32 {
    return divide(flush(dot3(sub3(a, tip), sub3(b, tip)), LEAST_FACTOR), root(dot3(normal, normal)));
}

fn flip_gain(pair: Edge) -> f32 {
    if pair.across == NO_FACE {
        return 0.0;
    }
    let f = pair.half_edge / 3u;
    let g = pair.across;
    let ends = half_edge_corners(pair.half_edge);
    let u = ends.x;
    let v = ends.y;
    let k = ends.z;
    let seen = spoke(load_faces(g), u);
    let l = seen.next;
    if seen.last != v || k == l || faces_with(l, k) > 0u {
        return 0.0;
    }
    let at = Diamond(xyz(load_positions(u)), xyz(load_positions(v)), xyz(load_positions(k)), xyz(load_positions(l)));
    let normal_f = doubled_area_of(at.u, at.v, at.k);
    let normal_g = doubled_area_of(at.v, at.u, at.l);
    let normal_a = doubled_area_of(at.u, at.l, at.k);
    let normal_b = doubled_area_of(at.l, at.v, at.k);
    let old = flush3(add3(normal_f, normal_g), LEAST_FACTOR);
    if !is_sound(normal_a, old, at.u, at.l, at.k) || !is_sound(normal_b, old, at.l, at.v, at.k) {
        return 0.0;
    }
    if params.objective == BY_SHAPE {
        let lengths = mul(root(dot3(normal_f, normal_f)), root(dot3(normal_g, normal_g)));
        if dot3(normal_f, normal_g) < mul(FLAT_COS, lengths) {
            return 0.0;
        }
        let cotangents = add(cotangent(at.k, at.u, at.v, normal_f), cotangent(at.l, at.u, at.v, normal_g));
        return select(0.0, -cotangents, cotangents < -LEAST_SHARE);
    }
    var change = Change(0.0, 0.0);
    if params.objective == BY_BEND {
        change.before = bend(normal_f, normal_g, sub3(at.v, at.u));
        change.after = bend(normal_a, normal_b, sub3(at.l, at.k));
        change = with_side(change, f, v, k, normal_f, normal_b);
        change = with_side(change, f, k, u, normal_f, normal_a);
        change = with_side(change, g, u, l, normal_g, normal_a);
        change = with_side(change, g, l, v, normal_g, normal_b);
    } else {
        change = with_samples(change, f, at);
        change = with_samples(change, g, at);
    }
    let least = select(LEAST_GAIN, LEAST_BEND, params.objective == BY_BEND);
    let gain = flush(sub(change.before, change.after), LEAST_SUM);
    return select(0.0, gain, gain > mul(LEAST_SHARE, change.before) && gain > least);
}

fn run(i: u32) {
    store_gains(i, flip_gain(load_pairs(i)));
}
