// The coordinates that stored quadrics are about. Twin: src/kernel/format_frame.rs

fn in_format(p: vec3f) -> vec3f {
    let origin = vec3f(params.origin_x, params.origin_y, params.origin_z);
    return flush3(scale3(sub3(p, origin), params.unit), LEAST_FACTOR);
}
