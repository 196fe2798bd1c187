// The mean curvature and the mixed area of every vertex. Twin: src/kernel/curvatures.rs

// The row of a face as this corner sees it: its own cotangent first, then those of the corners after it.
fn seen_from(corner: u32, row: Cotangents) -> Cotangents {
    if corner == 0u {
        return row;
    }
    if corner == 1u {
        return Cotangents(row.b, row.c, row.a, row.area);
    }
    return Cotangents(row.c, row.a, row.b, row.area);
}

// The share of a face's area that is nearer to this corner than to the others; parts of it where the face is obtuse.
fn mixed_area(at: Cotangents, first: vec3f, second: vec3f) -> f32 {
    if at.a < 0.0 {
        return mul(0.5, at.area);
    }
    if at.b < 0.0 || at.c < 0.0 {
        return mul(0.25, at.area);
    }
    return mul(0.125, add(mul(dot3(first, first), at.c), mul(dot3(second, second), at.b)));
}

struct Star { turn: vec3f, area: f32 }

fn star_of(vertex: u32) -> Star {
    let p = xyz(load_positions(vertex));
    var turn = vec3f(0.0, 0.0, 0.0);
    var area = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        let seen = spoke(load_faces(f), vertex);
        let at = seen_from(seen.corner, load_cotangents(f));
        let first = flush3(sub3(p, xyz(load_positions(seen.next))), LEAST_FACTOR);
        let second = flush3(sub3(p, xyz(load_positions(seen.last))), LEAST_FACTOR);
        turn = add3(turn, add3(scale3(first, at.c), scale3(second, at.b)));
        area = add(area, mixed_area(at, first, second));
    }
    return Star(flush3(turn, LEAST_FACTOR), flush(area, LEAST_SUM));
}

fn curvature(star: Star) -> f32 {
    if star.area <= NO_STAR {
        return 0.0;
    }
    return min(divide(root(dot3(star.turn, star.turn)), mul(4.0, star.area)), SHARPEST);
}

fn run(i: u32) {
    let star = star_of(i);
    store_areas(i, star.area);
    store_curvatures(i, select(0.0, curvature(star), (load_positions(i).flags & BORDER) == 0u));
}
