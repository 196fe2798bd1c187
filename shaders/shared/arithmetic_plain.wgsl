// Arithmetic on a device that rounds every operation correctly and in order. Twin: src/math/exact.rs

fn keep(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ params.zero);
}

fn divide(a: f32, b: f32) -> f32 {
    if abs(a) < LEAST || abs(b) < LEAST {
        return 0.0;
    }
    return flush(clamp(keep(a / b), -0x1.fffffep+127f, 0x1.fffffep+127f), LEAST);
}

fn root(x: f32) -> f32 {
    if x < LEAST {
        return 0.0;
    }
    return keep(sqrt(x));
}
