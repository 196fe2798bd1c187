// Average quadrics as codes, those of two vertices together. Twin: src/kernel/encode_quadrics.rs

fn averaged(vertex: u32) -> array<f32, 10> {
    let by = divisor(params.format, load_bound(0u));
    let q = load_quadrics(vertex);
    let x = in_format(xyz(load_positions(vertex)));
    let unit_sq = mul(params.unit, params.unit);
    let linear = scale3(vec3f(q.bx, q.by, q.bz), params.unit);
    let own = PlaneQuadric(
        q.xx, q.xy, q.xz, q.yy, q.yz, q.zz, linear.x, linear.y, linear.z, mul(q.c, unit_sq), q.weight,
    );
    let m = moved(own, scale3(x, -1.0));
    return array<f32, 10>(
        part(m.a.xx, by), part(m.a.xy, by), part(m.a.xz, by), part(m.b.x, by),
        part(m.a.yy, by), part(m.a.yz, by), part(m.b.y, by),
        part(m.a.zz, by), part(m.b.z, by),
        part(m.c, by),
    );
}

fn part(x: f32, by: f32) -> f32 {
    return clamp(divide(flush(x, LEAST_SUM), by), -1.0, 1.0);
}

fn run(i: u32) {
    let codes = code_count(params.format);
    let width = code_width(params.format);
    let per_word = 32u / width;
    var words = array<u32, PAIR_WORDS>();
    for (var side = 0u; side < 2u; side++) {
        let vertex = 2u * i + side;
        if vertex < params.vertex_count {
            var entries = averaged(vertex);
            for (var k = 0u; k < codes; k++) {
                let entry = code_entry(params.format, k);
                let at = side * codes + k;
                words[at / per_word] |= to_code(params.format, entry, entries[entry]) << (width * (at % per_word));
            }
        }
    }
    let count = 2u * codes / per_word;
    for (var k = 0u; k < count; k++) {
        store_words(count * i + k, words[k]);
    }
}
