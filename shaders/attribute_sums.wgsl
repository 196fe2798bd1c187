// What the attributes need of every wedge: sums over its faces of |n| g gᵀ, |n| and |n| g, the last beside its numbers.
// Twin: src/kernel/attribute_sums.rs
//
// Gathers the ring in ascending face order.

// Whether a face's corner at a vertex has this wedge.
fn has_wedge(f: u32, vertex: u32, wedge: u32) -> bool {
    let face = load_faces(f);
    let corners = load_corners(f);
    let at_b = select(corners.a, corners.b, face.b == vertex);
    return select(at_b, corners.c, face.c == vertex) == wedge;
}

fn with_face(sum: AttributeSum, face: AttributeSum) -> AttributeSum {
    return AttributeSum(
        add(sum.xx, face.xx),
        add(sum.xy, face.xy),
        add(sum.xz, face.xz),
        add(sum.yy, face.yy),
        add(sum.yz, face.yz),
        add(sum.zz, face.zz),
        add(sum.weight, face.weight),
    );
}

fn wedge_sum(start: u32, end: u32, vertex: u32, wedge: u32) -> AttributeSum {
    var sum = AttributeSum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, vertex, wedge) {
            sum = with_face(sum, load_face_sums(f));
        }
    }
    return sum;
}

fn slope(start: u32, end: u32, vertex: u32, wedge: u32, j: u32) -> Slope {
    var sum = vec3f(0.0, 0.0, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, vertex, wedge) {
            let g = load_gradients(f * params.costed + j);
            sum = add3(sum, vec3f(g.x, g.y, g.z));
        }
    }
    return Slope(sum.x, sum.y, sum.z, load_values(wedge * params.costed + j));
}

fn run(i: u32) {
    let start = load_ring_starts(i);
    var end = load_ring_starts(i + 1u);
    if (load_positions(i).flags & HUB) != 0u {
        end = start;
    }
    let last = load_wedge_starts(i + 1u);
    for (var wedge = load_wedge_starts(i); wedge < last; wedge++) {
        store_sums(wedge, wedge_sum(start, end, i, wedge));
        for (var j = 0u; j < params.costed; j++) {
            store_slopes(wedge * params.costed + j, slope(start, end, i, wedge, j));
        }
    }
}
