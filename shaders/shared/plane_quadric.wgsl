// Accumulated quadrics, moved and added. Twin: src/kernel/plane_quadric.rs

struct MovedQuadric { a: Sym3, b: vec3f, c: f32 }

// A quadric about the point `at` away from its own: q(y) with y = x + at, as xᵀA x + 2 b·x + c.
fn moved(quadric: PlaneQuadric, at: vec3f) -> MovedQuadric {
    let a = Sym3(quadric.xx, quadric.xy, quadric.xz, quadric.yy, quadric.yz, quadric.zz);
    let linear = vec3f(quadric.bx, quadric.by, quadric.bz);
    let a_at = sym_mul(a, at);
    return MovedQuadric(
        a,
        add3(linear, a_at),
        add(add(quadric.c, mul(2.0, dot3(linear, at))), dot3(at, a_at)),
    );
}

fn sum_moved(first: MovedQuadric, second: MovedQuadric) -> MovedQuadric {
    return MovedQuadric(sym_add(first.a, second.a), add3(first.b, second.b), add(first.c, second.c));
}
