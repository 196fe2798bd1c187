// What the attributes add to the sums of every vertex: how far their gradients over its faces spread. Twin:
// src/kernel/attribute_spreads.rs
//
// Gathers the ring in ascending face order.

// Whether a face is one of a wedge's.
fn has_wedge(corners: Face, wedge: u32) -> bool {
    return corners.a == wedge || corners.b == wedge || corners.c == wedge;
}

// Four numbers of a wedge side by side, from `first` on. Those past the last that decides hold anything.
fn numbers_at(wedge: u32, first: u32) -> vec4f {
    let row = wedge * params.width;
    let last = params.costed - 1u;
    return vec4f(
        load_values(row + first),
        load_values(row + min(first + 1u, last)),
        load_values(row + min(first + 2u, last)),
        load_values(row + min(first + 3u, last)),
    );
}

fn add4(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(add(a.x, b.x), add(a.y, b.y), add(a.z, b.z), add(a.w, b.w));
}

fn sub4(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(sub(a.x, b.x), sub(a.y, b.y), sub(a.z, b.z), sub(a.w, b.w));
}

fn mul4(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(mul(a.x, b.x), mul(a.y, b.y), mul(a.z, b.z), mul(a.w, b.w));
}

fn scale4(a: vec4f, s: f32) -> vec4f {
    return vec4f(mul(a.x, s), mul(a.y, s), mul(a.z, s), mul(a.w, s));
}

fn flush4(a: vec4f) -> vec4f {
    return vec4f(
        flush(a.x, LEAST_FACTOR),
        flush(a.y, LEAST_FACTOR),
        flush(a.z, LEAST_FACTOR),
        flush(a.w, LEAST_FACTOR),
    );
}

// √|n| times the gradients of the numbers of a face, along each axis, and √|n|.
struct Gradients {
    x: vec4f,
    y: vec4f,
    z: vec4f,
    root: f32,
}

fn gradients_of(f: u32, corners: Face, first: u32) -> Gradients {
    let row = load_operators(f);
    let a = numbers_at(corners.a, first);
    let b = sub4(numbers_at(corners.b, first), a);
    let c = sub4(numbers_at(corners.c, first), a);
    return Gradients(
        flush4(add4(scale4(b, row.bx), scale4(c, row.cx))),
        flush4(add4(scale4(b, row.by), scale4(c, row.cy))),
        flush4(add4(scale4(b, row.bz), scale4(c, row.cz))),
        row.root,
    );
}

fn mean_of(sum: vec4f, inverse: f32) -> vec4f {
    return flush4(scale4(sum, inverse));
}

fn off_mean(g: vec4f, mean: vec4f, root: f32) -> vec4f {
    return flush4(sub4(g, scale4(mean, root)));
}

// Adds the spread of numbers from `first` on over the faces of a wedge, which is none over one. Each is summed by itself,
// and added before the next.
fn add_numbers(spread: Sym3, start: u32, end: u32, wedge: u32, first: u32) -> Sym3 {
    var count = 0u;
    var weight = 0.0;
    var x_sum = vec4f(0.0);
    var y_sum = vec4f(0.0);
    var z_sum = vec4f(0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        let corners = load_corners(f);
        if has_wedge(corners, wedge) {
            let g = gradients_of(f, corners, first);
            count++;
            weight = add(weight, mul(g.root, g.root));
            x_sum = add4(x_sum, scale4(g.x, g.root));
            y_sum = add4(y_sum, scale4(g.y, g.root));
            z_sum = add4(z_sum, scale4(g.z, g.root));
        }
    }
    if count < 2u {
        return spread;
    }
    var inverse = 0.0;
    if weight > NO_AREA {
        inverse = divide(1.0, weight);
    }
    let x_mean = mean_of(x_sum, inverse);
    let y_mean = mean_of(y_sum, inverse);
    let z_mean = mean_of(z_sum, inverse);
    var xx = vec4f(0.0);
    var xy = vec4f(0.0);
    var xz = vec4f(0.0);
    var yy = vec4f(0.0);
    var yz = vec4f(0.0);
    var zz = vec4f(0.0);
    for (var i = start; i < end; i++) {
        let f = load_ring_faces(i);
        let corners = load_corners(f);
        if has_wedge(corners, wedge) {
            let g = gradients_of(f, corners, first);
            let x = off_mean(g.x, x_mean, g.root);
            let y = off_mean(g.y, y_mean, g.root);
            let z = off_mean(g.z, z_mean, g.root);
            xx = add4(xx, mul4(x, x));
            xy = add4(xy, mul4(x, y));
            xz = add4(xz, mul4(x, z));
            yy = add4(yy, mul4(y, y));
            yz = add4(yz, mul4(y, z));
            zz = add4(zz, mul4(z, z));
        }
    }
    var sum = sym_add(spread, Sym3(xx.x, xy.x, xz.x, yy.x, yz.x, zz.x));
    if first + 1u < params.costed {
        sum = sym_add(sum, Sym3(xx.y, xy.y, xz.y, yy.y, yz.y, zz.y));
    }
    if first + 2u < params.costed {
        sum = sym_add(sum, Sym3(xx.z, xy.z, xz.z, yy.z, yz.z, zz.z));
    }
    if first + 3u < params.costed {
        sum = sym_add(sum, Sym3(xx.w, xy.w, xz.w, yy.w, yz.w, zz.w));
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
        for (var first = 0u; first < params.costed; first += 4u) {
            spread = add_numbers(spread, start, end, wedge, first);
        }
    }
    let sum = load_sums(i);
    let matrix = sym_add(volume_matrix(sum), sym_scale(spread, SPREAD_FACTOR));
    store_sums(
        i,
        VolumeSum(matrix.xx, matrix.xy, matrix.xz, matrix.yy, matrix.yz, matrix.zz, sum.nx, sum.ny, sum.nz),
    );
}
