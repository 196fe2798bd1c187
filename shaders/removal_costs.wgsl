// How far every vertex lies from what its removal would leave: the plane or the line of its neighborhood. Twin:
// src/kernel/removal_costs.rs

// Whether the edge between two faces is a feature.
fn is_crease(first: Normal, second: Normal, crease_cos: f32) -> bool {
    return dot3(weighted(first), weighted(second)) < mul(crease_cos, mul(first.root, second.root));
}

// How often the edges at a vertex are borders or features, and the far ends of the first two of each.
struct Lines { borders: u32, creases: u32, border_ends: vec2u, crease_ends: vec2u }

// With one more; the third and later ones are only counted.
fn with_end(ends: vec2u, count: u32, end: u32) -> vec2u {
    return vec2u(select(ends.x, end, count == 0u), select(ends.y, end, count == 1u));
}

fn lines_at(vertex: u32, crease_cos: f32) -> Lines {
    var lines = Lines(0u, 0u, vec2u(0u, 0u), vec2u(0u, 0u));
    let start = load_ring_starts(vertex);
    let end = load_ring_starts(vertex + 1u);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        let seen = spoke(load_faces(f), vertex);
        var goes_on = false;
        var is_entered = false;
        for (var j = start; j < end; j++) {
            let g = load_ring_faces(j);
            let other = spoke(load_faces(g), vertex);
            if other.last == seen.next {
                goes_on = true;
                if is_crease(load_normals(f), load_normals(g), crease_cos) {
                    lines.crease_ends = with_end(lines.crease_ends, lines.creases, seen.next);
                    lines.creases++;
                }
            }
            is_entered = is_entered || other.next == seen.last;
        }
        if !goes_on {
            lines.border_ends = with_end(lines.border_ends, lines.borders, seen.next);
            lines.borders++;
        }
        if !is_entered {
            lines.border_ends = with_end(lines.border_ends, lines.borders, seen.last);
            lines.borders++;
        }
    }
    return lines;
}

// The distance of `p` to the line through `a` and `b`; to the point where they are one.
fn line_distance(p: vec3f, a: vec3f, b: vec3f) -> f32 {
    let along = flush3(sub3(b, a), LEAST_FACTOR);
    let from_a = flush3(sub3(p, a), LEAST_FACTOR);
    let length = root(dot3(along, along));
    if length == 0.0 {
        return root(dot3(from_a, from_a));
    }
    let doubled_area = flush3(cross3(from_a, along), LEAST_FACTOR);
    return divide(root(dot3(doubled_area, doubled_area)), length);
}

// The distance of a vertex to the plane of its faces: through the mean of their middles, along the mean of their
// normals, both weighted by area.
fn plane_distance(vertex: u32, p: vec3f) -> f32 {
    var normal = vec3f(0.0, 0.0, 0.0);
    var offset = vec3f(0.0, 0.0, 0.0);
    var weight = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        let seen = spoke(load_faces(f), vertex);
        let row = load_normals(f);
        let area = mul(row.root, row.root);
        let next = sub3(xyz(load_positions(seen.next)), p);
        let last = sub3(xyz(load_positions(seen.last)), p);
        normal = add3(normal, doubled_area(row));
        offset = add3(offset, scale3(add3(next, last), area));
        weight = add(weight, area);
    }
    weight = flush(weight, LEAST_SUM);
    // Three times the way from the vertex to the mean of the middles.
    offset = flush3(scale3(flush3(offset, LEAST_FACTOR), divide(1.0, weight)), LEAST_FACTOR);
    normal = flush3(normal, LEAST_FACTOR);
    let length = root(dot3(normal, normal));
    if length <= mul(FOLDED, weight) {
        return divide(root(dot3(offset, offset)), 3.0);
    }
    return divide(abs(dot3(normal, offset)), mul(3.0, length));
}

// The greatest distance of what the faces around a vertex stand for.
fn deviation_at(vertex: u32) -> f32 {
    var greatest = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        greatest = max(greatest, load_deviations(load_ring_faces(i)));
    }
    return greatest;
}

fn removal_key(vertex: u32) -> u32 {
    let row = load_positions(vertex);
    if (row.flags & (LOCKED | HUB)) != 0u {
        return STAYS;
    }
    let p = xyz(row);
    let on_border = (row.flags & BORDER) != 0u;
    var lines = Lines(0u, 0u, vec2u(0u, 0u), vec2u(0u, 0u));
    if on_border || params.crease_cos >= -1.0 {
        lines = lines_at(vertex, params.crease_cos);
    }
    let is_corner = lines.creases != 0u && (on_border || lines.creases != 2u);
    if is_corner && params.keeps_corners != 0u {
        return STAYS;
    }
    var distance = 0.0;
    if on_border {
        if lines.borders != 2u {
            return STAYS;
        }
        distance = line_distance(p, xyz(load_positions(lines.border_ends.x)), xyz(load_positions(lines.border_ends.y)));
    } else if lines.creases == 2u {
        distance = line_distance(p, xyz(load_positions(lines.crease_ends.x)), xyz(load_positions(lines.crease_ends.y)));
    } else {
        distance = plane_distance(vertex, p);
    }
    return bitcast<u32>(flush(min(add(distance, deviation_at(vertex)), FARTHEST), LEAST));
}

fn run(i: u32) {
    store_keys(i, removal_key(i));
}
