// The faces around a vertex. Twin: src/kernel/stars.rs

// A face seen from one of its corners.
struct Spoke { corner: u32, next: u32, last: u32 }

fn spoke(face: Face, vertex: u32) -> Spoke {
    if face.a == vertex {
        return Spoke(0u, face.b, face.c);
    }
    if face.b == vertex {
        return Spoke(1u, face.c, face.a);
    }
    return Spoke(2u, face.a, face.b);
}

// A vector by its length; zero where that is.
fn unit(n: vec3f, length: f32) -> vec3f {
    return flush3(scale3(n, divide(1.0, length)), LEAST_FACTOR);
}

fn has(face: Face, vertex: u32) -> bool {
    return face.a == vertex || face.b == vertex || face.c == vertex;
}

// How many faces of the ring of `around` have this vertex as a corner.
fn faces_with(vertex: u32, around: u32) -> u32 {
    var count = 0u;
    let end = load_ring_starts(around + 1u);
    for (var i = load_ring_starts(around); i < end; i++) {
        if has(load_faces(load_ring_faces(i)), vertex) {
            count++;
        }
    }
    return count;
}
