// Which region every face would rather belong to. Twin: src/kernel/boundary_gains.rs

// The edge of a face that ends at this vertex.
fn edge_to(face: Face, vertex: u32) -> u32 {
    if face.b == vertex {
        return 0u;
    }
    return select(2u, 1u, face.c == vertex);
}

// The face across an edge.
fn across(row: Face, edge: u32) -> u32 {
    if edge == 0u {
        return row.a;
    }
    return select(row.c, row.b, edge == 1u);
}

// Whether one goes from the face `start` around `vertex` to the face `end` and meets only faces with this label, a few
// hundred at most.
fn goes_around(vertex: u32, start: u32, end: u32, label: u32) -> bool {
    var at = start;
    for (var step = 0u; step < HUB_FACES; step++) {
        if at == end {
            return true;
        }
        at = across(load_neighbors(at), edge_to(load_faces(at), vertex));
        if at == NONE {
            return false;
        }
        if load_labels(at) != label {
            return false;
        }
    }
    return false;
}

// Whether the faces around `face` that have its label hang together without it; not if there is none. A face with one such
// neighbor is a leaf; two share the vertex that the face has with both.
fn stays_connected(face: u32, label: u32) -> bool {
    let corners = load_faces(face);
    let row = load_neighbors(face);
    let over_ab = row.a != NONE && load_labels(select(row.a, face, row.a == NONE)) == label;
    let over_bc = row.b != NONE && load_labels(select(row.b, face, row.b == NONE)) == label;
    let over_ca = row.c != NONE && load_labels(select(row.c, face, row.c == NONE)) == label;
    let count = u32(over_ab) + u32(over_bc) + u32(over_ca);
    if count != 2u {
        return count == 1u;
    }
    if !over_ca {
        return goes_around(corners.b, row.a, row.b, label);
    }
    if !over_ab {
        return goes_around(corners.c, row.b, row.c, label);
    }
    return goes_around(corners.a, row.c, row.a, label);
}

// A region, and how near its direction is to a normal.
struct Choice { label: u32, nearness: f32 }

// The nearer of a choice and the region across an edge; the lower of two that are as near.
fn nearer(best: Choice, across: u32, own: u32, normal: vec3f) -> Choice {
    if across == NONE {
        return best;
    }
    let label = load_labels(across);
    if label == own {
        return best;
    }
    let nearness = dot3(normal, load_directions(label).xyz);
    if nearness > best.nearness || (nearness == best.nearness && label < best.label) {
        return Choice(label, nearness);
    }
    return best;
}

fn target_of(face: u32) -> u32 {
    let own = load_labels(face);
    let row = load_neighbors(face);
    let normal = load_normals(face).xyz;
    var best = Choice(NONE, -2.0);
    best = nearer(best, row.a, own, normal);
    best = nearer(best, row.b, own, normal);
    best = nearer(best, row.c, own, normal);
    if best.label == NONE {
        return NONE;
    }
    let gain = sub(best.nearness, dot3(normal, load_directions(own).xyz));
    return select(NONE, best.label, gain > LEAST_GAIN && stays_connected(face, own));
}

fn run(i: u32) {
    store_targets(i, target_of(i));
}
