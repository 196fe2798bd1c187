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
    let cell = row.x;
    let origin = load_origins(cell);
    let x = load_representatives(cell).xyz;
    var nearest = vec2u(0xffffffffu, 0xffffffffu);
    let end = load_pieces(piece + 1u).y;
    for (var i = row.y; i < end; i++) {
        let f = load_piece_faces(i);
        let face = load_faces(f);
        let cells = load_cell_faces(f);
        if cells.a == cell {
            nearest = nearer(nearest, face.a, about(load_sites(face.a), origin, params.unit), x);
        }
        if cells.b == cell {
            nearest = nearer(nearest, face.b, about(load_sites(face.b), origin, params.unit), x);
        }
        if cells.c == cell {
            nearest = nearer(nearest, face.c, about(load_sites(face.c), origin, params.unit), x);
        }
    }
    store_nearest(piece, nearest);
}
