// Eigenvalues and eigenvectors of a symmetric 3×3 matrix by Jacobi's rotations. Twin: src/kernel/eigen.rs

struct Eigen { values: vec3f, x: vec3f, y: vec3f, z: vec3f }
struct Turn { pp: f32, pq: f32, qq: f32, rp: f32, rq: f32, p: vec3f, q: vec3f }

// The rotation by at most an eighth of a turn that makes `pq` zero.
fn turned(t: Turn) -> Turn {
    let cot = divide(sub(t.qq, t.pp), mul(2.0, t.pq));
    let tangent_abs = divide(1.0, add(abs(cot), root(add(mul(cot, cot), 1.0))));
    // Without an entry there is no rotation.
    let signed = select(tangent_abs, -tangent_abs, cot < 0.0);
    let tangent = select(signed, 0.0, t.pq == 0.0);
    let cosine = divide(1.0, root(add(mul(tangent, tangent), 1.0)));
    let sine = mul(tangent, cosine);
    let shift = mul(tangent, t.pq);
    return Turn(
        sub(t.pp, shift),
        0.0,
        add(t.qq, shift),
        flush(sub(mul(cosine, t.rp), mul(sine, t.rq)), NEGLIGIBLE),
        flush(add(mul(sine, t.rp), mul(cosine, t.rq)), NEGLIGIBLE),
        flush3(sub3(scale3(t.p, cosine), scale3(t.q, sine)), NEGLIGIBLE),
        flush3(add3(scale3(t.p, sine), scale3(t.q, cosine)), NEGLIGIBLE),
    );
}

// Of a matrix of trace about 1.
fn eigen(m: Sym3) -> Eigen {
    var xx = m.xx;
    var yy = m.yy;
    var zz = m.zz;
    var xy = flush(m.xy, NEGLIGIBLE);
    var xz = flush(m.xz, NEGLIGIBLE);
    var yz = flush(m.yz, NEGLIGIBLE);
    var x = vec3f(1.0, 0.0, 0.0);
    var y = vec3f(0.0, 1.0, 0.0);
    var z = vec3f(0.0, 0.0, 1.0);
    for (var sweep = 0u; sweep < SWEEPS; sweep++) {
        let xy_turn = turned(Turn(xx, xy, yy, xz, yz, x, y));
        xx = xy_turn.pp;
        xy = xy_turn.pq;
        yy = xy_turn.qq;
        xz = xy_turn.rp;
        yz = xy_turn.rq;
        x = xy_turn.p;
        y = xy_turn.q;
        let xz_turn = turned(Turn(xx, xz, zz, xy, yz, x, z));
        xx = xz_turn.pp;
        xz = xz_turn.pq;
        zz = xz_turn.qq;
        xy = xz_turn.rp;
        yz = xz_turn.rq;
        x = xz_turn.p;
        z = xz_turn.q;
        let yz_turn = turned(Turn(yy, yz, zz, xy, xz, y, z));
        yy = yz_turn.pp;
        yz = yz_turn.pq;
        zz = yz_turn.qq;
        xy = yz_turn.rp;
        xz = yz_turn.rq;
        y = yz_turn.p;
        z = yz_turn.q;
    }
    return Eigen(vec3f(xx, yy, zz), x, y, z);
}
