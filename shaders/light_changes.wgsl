// How much the light changes from a face to those around it, by channel. Twin: src/kernel/light_changes.rs

// The step between two lights as a share of the darker; dark ones count as `floor`.
fn contrast(x: f32, y: f32) -> f32 {
    return divide(abs(sub(x, y)), max(min(x, y), params.floor));
}

// The greatest of `so_far` and the steps to the face across an edge, each for its own channel.
fn with_step(so_far: vec4f, own: vec4f, across: u32) -> vec4f {
    if across == NO_FACE {
        return so_far;
    }
    let other = load_lights(across);
    let step = vec3f(contrast(own.x, other.x), contrast(own.y, other.y), contrast(own.z, other.z));
    let area = select(1.0, add(own.w, other.w), params.by_area != 0u);
    let red = max(so_far.x, divide(step.x, area));
    let green = max(so_far.y, divide(step.y, area));
    let blue = max(so_far.z, divide(step.z, area));
    return vec4f(red, green, blue, max(max(red, green), blue));
}

fn light_change(own: vec4f, across: Face) -> vec4f {
    let none = vec4f(0.0, 0.0, 0.0, 0.0);
    return with_step(with_step(with_step(none, own, across.a), own, across.b), own, across.c);
}

fn run(i: u32) {
    store_changes(i, light_change(load_lights(i), load_neighbors(i)));
}
