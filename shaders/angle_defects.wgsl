// What is missing to a full turn around every vertex: its Gaussian curvature times its area. Twin:
// src/kernel/angle_defects.rs

// The angle at this corner of a face; none of a face without area.
fn angle_at(vertex: u32, face: Face, row: Corners) -> f32 {
    let seen = spoke(face, vertex);
    let cot = select(select(row.cot_a, row.cot_b, seen.corner == 1u), row.cot_c, seen.corner == 2u);
    let has_area = row.area_a > 0.0 || row.area_b > 0.0 || row.area_c > 0.0;
    return select(0.0, arccot(cot), has_area);
}

fn angle_defect(vertex: u32) -> f32 {
    var sum = 0.0;
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        sum = add(sum, angle_at(vertex, load_faces(f), load_corners(f)));
    }
    let on_border = (load_positions(vertex).flags & BORDER) != 0u;
    return flush(sub(select(FULL_TURN, HALF_TURN, on_border), sum), LEAST_SUM);
}

fn run(i: u32) {
    store_defects(i, angle_defect(i));
}
