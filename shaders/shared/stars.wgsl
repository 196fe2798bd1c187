// The faces around a vertex and their normals. Twin: src/kernel/stars.rs

// n = (p1−p0)×(p2−p0): twice the area, along the normal.
fn face_normal(face: Face) -> vec3f {
    let p0 = xyz(load_positions(face.a));
    let p1 = xyz(load_positions(face.b));
    let p2 = xyz(load_positions(face.c));
    return cross3(sub3(p1, p0), sub3(p2, p0));
}

fn has(face: Face, vertex: u32) -> bool {
    return face.a == vertex || face.b == vertex || face.c == vertex;
}

// How many faces of the ring of `around` have this vertex as a corner.
fn faces_with(vertex: u32, around: u32) -> u32 {
    var count = 0u;
    for (var i = load_ring_starts(around); i < load_ring_starts(around + 1u); i++) {
        if has(load_faces(load_ring_faces(i)), vertex) {
            count++;
        }
    }
    return count;
}

fn ring_length(vertex: u32) -> u32 {
    return load_ring_starts(vertex + 1u) - load_ring_starts(vertex);
}
