// The corner of every piece nearest to its cell's representative, the lowest vertex among the equally near. Twin:
// src/kernel/nearest_corners.rs

// The nearer of what is nearest so far and the vertex at `p`.
fn nearer(nearest: vec2u, vertex: u32, p: vec3f, x: vec3f) -> vec2u {
    let away = flush3(sub3(p, x), LEAST_FACTOR);
    let key = bitcast<u32>(dot3(away, away));
    if key < nearest.x || (key == nearest.x && vertex < nearest.y) {
        return vec2u(key, vertex);
    }
    return nearest;
}

fn run(piece: u32) {
    let row = load_pieces(piece);
    let origin = load_origins(row.x);
    let cell = cell_box(origin, params.steps, params.unit);
    let x = load_representatives(row.x).xyz;
    var nearest = vec2u(0xffffffffu, 0xffffffffu);
    let end = load_pieces(piece + 1u).y;
    for (var i = row.y; i < end; i++) {
        let face = load_faces(load_piece_faces(i));
        let a = about(load_sites(face.a), origin, params.unit);
        let b = about(load_sites(face.b), origin, params.unit);
        let c = about(load_sites(face.c), origin, params.unit);
        if is_in(a, cell) {
            nearest = nearer(nearest, face.a, a, x);
        }
        if is_in(b, cell) {
            nearest = nearer(nearest, face.b, b, x);
        }
        if is_in(c, cell) {
            nearest = nearer(nearest, face.c, c, x);
        }
    }
    store_nearest(piece, nearest);
}
