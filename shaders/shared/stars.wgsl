// The faces around a vertex and their normals. Twin: src/kernel/stars.rs

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

// n = (p1−p0)×(p2−p0): twice the area, along the normal. p0 is the position of `vertex`, a corner of the face.
fn normal_from(vertex: u32, p0: vec3f, face: Face) -> vec3f {
    let seen = spoke(face, vertex);
    let p1 = xyz(load_positions(seen.next));
    let p2 = xyz(load_positions(seen.last));
    return flush3(cross3(sub3(p1, p0), sub3(p2, p0)), LEAST_FACTOR);
}

// n by its length; zero where that is.
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
