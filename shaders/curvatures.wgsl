// The mean curvature and the mixed area of every vertex. Twin: src/kernel/curvatures.rs

// Σ (cot α + cot β)(p − q) over the edges at a vertex: four times its mean curvature and area, along the normal.
struct Star { turn: vec3f, area: f32 }

// Adds a face of which this vertex is a corner.
fn with_face(star: Star, vertex: u32, p: vec3f, face: Face, row: Corners) -> Star {
    let seen = spoke(face, vertex);
    let is_b = seen.corner == 1u;
    let is_c = seen.corner == 2u;
    let area = select(select(row.area_a, row.area_b, is_b), row.area_c, is_c);
    let cot_next = select(select(row.cot_b, row.cot_c, is_b), row.cot_a, is_c);
    let cot_last = select(select(row.cot_c, row.cot_a, is_b), row.cot_b, is_c);
    let from_next = sub3(p, xyz(load_positions(seen.next)));
    let from_last = sub3(p, xyz(load_positions(seen.last)));
    return Star(
        add3(star.turn, add3(scale3(from_next, cot_last), scale3(from_last, cot_next))),
        add(star.area, area),
    );
}

fn star_of(vertex: u32) -> Star {
    let p = xyz(load_positions(vertex));
    var star = Star(vec3f(0.0, 0.0, 0.0), 0.0);
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        star = with_face(star, vertex, p, load_faces(f), load_corners(f));
    }
    return Star(flush3(star.turn, LEAST_FACTOR), flush(star.area, LEAST_SUM));
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
