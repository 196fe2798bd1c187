// One step of every vertex of the result towards the least of the fit's sums. Twin: src/kernel/fit_steps.rs

// The offset of a vertex after its step from `ahead`.
fn stepped(vertex: u32) -> vec3f {
    let start = load_ahead(vertex).xyz;
    var matrix = Sym3(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    var pull = vec3f(0.0, 0.0, 0.0);
    let end = load_ring_starts(vertex + 1u);
    for (var i = load_ring_starts(vertex); i < end; i++) {
        let f = load_ring_faces(i);
        let face = load_faces(f);
        let fit = load_sums(f);
        let n = vec3f(fit.nx, fit.ny, fit.nz);
        // The vertex's row of the face's sums.
        var row = vec3f(fit.ac, fit.bc, fit.cc);
        var height = fit.c;
        if face.a == vertex {
            row = vec3f(fit.aa, fit.ab, fit.ac);
            height = fit.a;
        } else if face.b == vertex {
            row = vec3f(fit.ab, fit.bb, fit.bc);
            height = fit.b;
        }
        let risen = flush3(
            vec3f(
                dot3(n, load_ahead(face.a).xyz),
                dot3(n, load_ahead(face.b).xyz),
                dot3(n, load_ahead(face.c).xyz),
            ),
            LEAST_FACTOR,
        );
        let left = flush(sub(height, dot3(row, risen)), LEAST_FACTOR);
        let weight = flush(add(add(row.x, row.y), row.z), LEAST_FACTOR);
        matrix = sym_add(matrix, sym_scale(outer(n), weight));
        pull = add3(pull, scale3(n, left));
    }
    let t = trace(matrix);
    if t <= NO_WEIGHT {
        return start;
    }
    // Held to where the vertex was, not to where the step starts.
    let held = flush3(scale3(start, flush(mul(params.regularization, t), LEAST_FACTOR)), LEAST_FACTOR);
    let q = PairQuadric(matrix, sub3(pull, held), 0.0, vec3f(0.0, 0.0, 0.0), 0.0);
    let step = least(scaled(q, scale_down(half_exponent(t))), params.regularization);
    return flush3(add3(start, step), LEAST_FACTOR);
}

fn run(i: u32) {
    if (load_positions(i).flags & (BORDER | LOCKED | SEAM | HUB)) != 0u {
        store_offsets(i, vec4f(0.0, 0.0, 0.0, 0.0));
        store_next_ahead(i, vec4f(0.0, 0.0, 0.0, 0.0));
        return;
    }
    let offset = stepped(i);
    let beyond = scale3(flush3(sub3(offset, load_offsets(i).xyz), LEAST_FACTOR), params.momentum);
    store_offsets(i, vec4f(offset, 0.0));
    store_next_ahead(i, vec4f(flush3(add3(offset, beyond), LEAST_FACTOR), 0.0));
}
