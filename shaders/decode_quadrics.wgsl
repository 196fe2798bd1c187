// Quadrics about their vertices from the codes of average ones. Twin: src/kernel/decode_quadrics.rs

fn entries_of(vertex: u32) -> array<f32, 10> {
    let codes = code_count(params.format);
    let width = code_width(params.format);
    let per_word = 32u / width;
    let mask = 0xffffffffu >> (32u - width);
    let first = vertex / 2u * (2u * codes / per_word);
    var entries = array<f32, 10>();
    for (var k = 0u; k < codes; k++) {
        let entry = code_entry(params.format, k);
        let at = vertex % 2u * codes + k;
        let code = (load_words(first + at / per_word) >> (width * (at % per_word))) & mask;
        entries[entry] = from_code(params.format, entry, code);
    }
    return entries;
}

fn decoded(vertex: u32) -> PlaneQuadric {
    let entries = entries_of(vertex);
    let by = divisor(params.format, load_bound(0u));
    let x = in_format(xyz(load_positions(vertex)));
    let a = Sym3(
        whole(entries[0], by), whole(entries[1], by), whole(entries[2], by),
        whole(entries[4], by), whole(entries[5], by), whole(entries[7], by),
    );
    // The trace of unit normals' outer products: the weight of the planes.
    let weight = max(trace(a), 0.0);
    if is_local(params.format) {
        return PlaneQuadric(a.xx, a.xy, a.xz, a.yy, a.yz, a.zz, 0.0, 0.0, 0.0, 0.0, weight);
    }
    let b = vec3f(whole(entries[3], by), whole(entries[6], by), whole(entries[8], by));
    let m = moved(PlaneQuadric(a.xx, a.xy, a.xz, a.yy, a.yz, a.zz, b.x, b.y, b.z, whole(entries[9], by), weight), x);
    let linear = flush3(m.b, LEAST_SUM);
    let c = divide(divide(flush(m.c, LEAST_SUM), params.unit), params.unit);
    return PlaneQuadric(
        a.xx, a.xy, a.xz, a.yy, a.yz, a.zz,
        divide(linear.x, params.unit), divide(linear.y, params.unit), divide(linear.z, params.unit),
        c,
        weight,
    );
}

fn whole(x: f32, by: f32) -> f32 {
    return flush(mul(x, by), LEAST_SUM);
}

fn run(i: u32) {
    store_quadrics(i, decoded(i));
}
