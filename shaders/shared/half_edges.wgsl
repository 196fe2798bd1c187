// Twin: src/kernel/pairs.rs

// The corners of a half-edge's face, its start first.
fn half_edge_corners(half_edge: u32) -> vec3u {
    let face = load_faces(half_edge / 3u);
    switch half_edge % 3u {
        case 0u: { return vec3u(face.a, face.b, face.c); }
        case 1u: { return vec3u(face.b, face.c, face.a); }
        default: { return vec3u(face.c, face.a, face.b); }
    }
}
