// How far the vertices of chains are from the segments that may take their place, in space and in color. Twin:
// src/kernel/chain_deviations.rs

// Where between its ends, 0 … 1, a segment is nearest to the origin; the ends are given about it.
fn nearest_on(a: vec3f, b: vec3f) -> f32 {
    let ab = flush3(sub3(b, a), LEAST_FACTOR);
    let along = flush(-dot3(ab, a), LEAST_FACTOR);
    let length_sq = dot3(ab, ab);
    if along <= 0.0 {
        return 0.0;
    }
    if along >= length_sq {
        return 1.0;
    }
    return divide(along, length_sq);
}

fn between(a: f32, b: f32, t: f32) -> f32 {
    return add(a, mul(sub(b, a), t));
}

fn color_deviation(own: vec4f, first: vec4f, last: vec4f, t: f32) -> f32 {
    let red = abs(sub(between(first.x, last.x, t), own.x));
    let green = abs(sub(between(first.y, last.y, t), own.y));
    let blue = abs(sub(between(first.z, last.z, t), own.z));
    return max(max(red, green), blue);
}

fn chain_deviation(span: vec4u) -> vec2f {
    let own = xyz(load_positions(span.x));
    let a = flush3(sub3(xyz(load_positions(span.y)), own), LEAST_FACTOR);
    let b = flush3(sub3(xyz(load_positions(span.z)), own), LEAST_FACTOR);
    let t = nearest_on(a, b);
    let away = flush3(add3(a, scale3(sub3(b, a), t)), LEAST_FACTOR);
    var color = 0.0;
    if params.has_colors != 0u {
        color = color_deviation(load_colors(span.x), load_colors(span.y), load_colors(span.z), t);
    }
    return vec2f(root(dot3(away, away)), color);
}

fn run(i: u32) {
    store_deviations(i, chain_deviation(load_spans(i)));
}
