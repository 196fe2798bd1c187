// Adds the quadrics of both ends of every accepted contraction, about the new position. Twin:
// src/kernel/contract_quadrics.rs

fn contracted(first: PlaneQuadric, second: PlaneQuadric, a: vec3f, b: vec3f, x: vec3f) -> PlaneQuadric {
    let q = sum_moved(moved(first, sub3(x, a)), moved(second, sub3(x, b)));
    let linear = flush3(q.b, LEAST_SUM);
    let weight = add(first.weight, second.weight);
    return PlaneQuadric(
        q.a.xx, q.a.xy, q.a.xz, q.a.yy, q.a.yz, q.a.zz, linear.x, linear.y, linear.z, flush(q.c, LEAST_SUM), weight,
    );
}

fn run(i: u32) {
    let c = load_contractions(i);
    let a = xyz(load_positions(c.keep));
    let b = xyz(load_positions(c.gone));
    let x = vec3f(c.x, c.y, c.z);
    store_quadrics(c.keep, contracted(load_quadrics(c.keep), load_quadrics(c.gone), a, b, x));
}
