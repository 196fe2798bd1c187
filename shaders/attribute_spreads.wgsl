// What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
// src/kernel/attribute_spreads.rs
//
// Gathers the ring in ascending face order.

// Whether a face is one of a wedge's.
fn has_wedge(f: u32, wedge: u32) -> bool {
    let corners = load_corners(f);
    return corners.a == wedge || corners.b == wedge || corners.c == wedge;
}

// √|n| times the gradient of a number of a face.
fn gradient_of(f: u32, row: GradientOperator, j: u32) -> vec3f {
    let corners = load_corners(f);
    let a = load_values(corners.a * params.width + j);
    let b = sub(load_values(corners.b * params.width + j), a);
    let c = sub(load_values(corners.c * params.width + j), a);
    let along_b = vec3f(row.bx, row.by, row.bz);
    let along_c = vec3f(row.cx, row.cy, row.cz);
    return flush3(add3(scale3(along_b, b), scale3(along_c, c)), LEAST_FACTOR);
}

// How many faces a wedge has, and what they weigh.
struct WedgeFaces {
    count: u32,
    weight: f32,
}

fn wedge_faces(start: u32, end: u32, wedge: u32) -> WedgeFaces {
    var faces = WedgeFaces(0u, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, wedge) {
            let root = load_operators(f).root;
            faces = WedgeFaces(faces.count + 1u, add(faces.weight, mul(root, root)));
        }
    }
    return faces;
}

// The spread of one number over the faces of a wedge.
fn number_spread(start: u32, end: u32, wedge: u32, inverse: f32, j: u32) -> Sym3 {
    var mean = vec3f(0.0, 0.0, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, wedge) {
            let row = load_operators(f);
            mean = add3(mean, scale3(gradient_of(f, row, j), row.root));
        }
    }
    mean = flush3(scale3(mean, inverse), LEAST_FACTOR);
    var sum = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        if has_wedge(f, wedge) {
            let row = load_operators(f);
            let off = flush3(sub3(gradient_of(f, row, j), scale3(mean, row.root)), LEAST_FACTOR);
            sum = sym_add(sum, outer(off));
        }
    }
    return sum;
}

fn run(i: u32) {
    let start = load_ring_starts(i);
    var end = load_ring_starts(i + 1u);
    if end - start > HUB_FACES {
        end = start;
    }
    var spread = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let last = load_wedge_starts(i + 1u);
    for (var wedge = load_wedge_starts(i); wedge < last; wedge++) {
        let faces = wedge_faces(start, end, wedge);
        if faces.count < 2u {
            continue;
        }
        var inverse = 0.0;
        if faces.weight > NO_AREA {
            inverse = divide(1.0, faces.weight);
        }
        for (var j = 0u; j < params.costed; j++) {
            spread = sym_add(spread, number_spread(start, end, wedge, inverse, j));
        }
    }
    let sum = load_sums(i);
    let matrix = sym_add(volume_matrix(sum), sym_scale(spread, SPREAD_FACTOR));
    store_sums(
        i,
        VolumeSum(matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz, sum.nx, sum.ny, sum.nz),
    );
}
