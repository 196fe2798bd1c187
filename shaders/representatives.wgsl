// Where the vertices of every cell go: to the least of the cell's quadric, or to the mean of its corners. Twin:
// src/kernel/representatives.rs

fn sym_flush(m: Sym3, least: f32) -> Sym3 {
    return Sym3(
        flush(m.xx, least), flush(m.xy, least), flush(m.xz, least), flush(m.yy, least), flush(m.yz, least), flush(m.zz, least),
    );
}

fn step_along(v: vec3f, value: f32, greatest: f32, pull: vec3f) -> vec3f {
    if value > mul(DROPPED, greatest) {
        return scale3(v, divide(dot3(v, pull), value));
    }
    return vec3f(0.0, 0.0, 0.0);
}

fn held(x: vec3f, cell: CellBox) -> vec3f {
    return min(max(x, cell.low), cell.high);
}

// Where the quadric is least along an axis, between `low` and `high`.
fn least_along(x: f32, curvature: f32, pull: f32, low: f32, high: f32) -> f32 {
    if curvature < FLAT {
        return x;
    }
    return min(max(flush(divide(pull, curvature), LEAST_COMPONENT), low), high);
}

// The best point of a cell, from one near it.
fn best_held(a: Sym3, b: vec3f, start: vec3f, cell: CellBox) -> vec3f {
    var x = start;
    for (var sweep = 0u; sweep < HELD_SWEEPS; sweep++) {
        x.x = least_along(x.x, a.xx, sub(b.x, add(mul(a.xy, x.y), mul(a.xz, x.z))), cell.low.x, cell.high.x);
        x.y = least_along(x.y, a.yy, sub(b.y, add(mul(a.xy, x.x), mul(a.yz, x.z))), cell.low.y, cell.high.y);
        x.z = least_along(x.z, a.zz, sub(b.z, add(mul(a.xz, x.x), mul(a.yz, x.y))), cell.low.z, cell.high.z);
    }
    return x;
}

// The point of a cell, and its mean squared distance to the planes.
fn representative(sum: CellSum, cell: CellBox, at_mean: bool) -> vec4f {
    let mean = flush3(scale3(position(sum), divide(1.0, sum.corners)), LEAST_COMPONENT);
    if sum.weight < NO_WEIGHT {
        return vec4f(held(mean, cell), 0.0);
    }
    let share = divide(1.0, sum.weight);
    let a = sym_flush(sym_scale(matrix(sum), share), LEAST_FACTOR);
    let b = flush3(scale3(linear(sum), share), LEAST_FACTOR);
    var x = mean;
    if !at_mean {
        let pull = flush3(sub3(b, sym_mul(a, mean)), LEAST_FACTOR);
        let e = eigen(a);
        let greatest = max(max(e.values.x, e.values.y), e.values.z);
        x = add3(x, step_along(e.x, e.values.x, greatest, pull));
        x = add3(x, step_along(e.y, e.values.y, greatest, pull));
        x = add3(x, step_along(e.z, e.values.z, greatest, pull));
        x = flush3(x, LEAST_COMPONENT);
    }
    let inside = held(x, cell);
    if at_mean || all(inside == x) {
        x = inside;
    } else {
        x = best_held(a, b, inside, cell);
    }
    let square = add(sub(dot3(x, sym_mul(a, x)), mul(2.0, dot3(b, x))), flush(mul(sum.c, share), LEAST_FACTOR));
    return vec4f(x, flush(max(square, 0.0), LEAST_FACTOR));
}

fn run(cell: u32) {
    var sum = CellSum(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let end = load_cell_pieces(cell + 1u);
    for (var i = load_cell_pieces(cell); i < end; i++) {
        sum = sum_add(sum, load_sums(i));
    }
    let bounds = cell_box(load_origins(cell), params.steps, params.unit);
    store_representatives(cell, representative(sum, bounds, params.at_mean != 0u));
}
