// What the attributes need of every wedge: sums over its faces of |n| g gᵀ, |n| and |n| g. Twin:
// src/kernel/attribute_sums.rs
//
// Gathers the ring in ascending face order.

// Whether a face's corner at a vertex has this wedge.
fn has_wedge(f: u32, vertex: u32, wedge: u32) -> bool {
    let face = load_faces(f);
    let corners = load_corners(f);
    let at_b = select(corners.a, corners.b, face.b == vertex);
    return select(at_b, corners.c, face.c == vertex) == wedge;
}

fn attribute_sum(start: u32, end: u32, vertex: u32, wedge: u32) -> AttributeSum {
    var matrix = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    var weight = 0.0;
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, vertex, wedge) {
            let root = load_normals(f).root;
            weight = add(weight, mul(root, root));
            for (var j = 0u; j < params.costed; j++) {
                let g = load_gradients(f * params.costed + j);
                matrix = sym_add(matrix, outer(vec3f(g.x, g.y, g.z)));
            }
        }
    }
    return AttributeSum(matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz, weight);
}

fn slope(start: u32, end: u32, vertex: u32, wedge: u32, j: u32) -> Gradient {
    var sum = vec3f(0.0, 0.0, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, vertex, wedge) {
            let root = load_normals(f).root;
            let g = load_gradients(f * params.costed + j);
            sum = add3(sum, scale3(vec3f(g.x, g.y, g.z), root));
        }
    }
    return Gradient(sum.x, sum.y, sum.z);
}

fn run(i: u32) {
    let start = load_ring_starts(i);
    var end = load_ring_starts(i + 1u);
    if (load_positions(i).flags & HUB) != 0u {
        end = start;
    }
    let last = load_wedge_starts(i + 1u);
    for (var wedge = load_wedge_starts(i); wedge < last; wedge++) {
        store_sums(wedge, attribute_sum(start, end, i, wedge));
        for (var j = 0u; j < params.costed; j++) {
            store_slopes(wedge * params.costed + j, slope(start, end, i, wedge, j));
        }
    }
}
