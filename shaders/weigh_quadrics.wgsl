// Multiplies the quadric of every vertex by its weight. Twin: src/kernel/weigh_quadrics.rs

fn weighed(q: PlaneQuadric, weight: f32) -> PlaneQuadric {
    let w = flush(weight, LEAST);
    return PlaneQuadric(
        flush(mul(q.xx, w), LEAST),
        flush(mul(q.xy, w), LEAST),
        flush(mul(q.xz, w), LEAST),
        flush(mul(q.yy, w), LEAST),
        flush(mul(q.yz, w), LEAST),
        flush(mul(q.zz, w), LEAST),
        flush(mul(q.bx, w), LEAST),
        flush(mul(q.by, w), LEAST),
        flush(mul(q.bz, w), LEAST),
        flush(mul(q.c, w), LEAST),
        flush(mul(q.weight, w), LEAST),
    );
}

fn run(i: u32) {
    store_weighed_quadrics(i, weighed(load_quadrics(i), load_weights(i)));
}
