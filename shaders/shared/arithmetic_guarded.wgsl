// Arithmetic on a device that may fuse, reorder, and divide inexactly. Twin: src/math/exact.rs
//
// Every result passes `keep`, through which no compiler sees; `divide` and `root` take the device's result as a guess and
// put it right in wrapping integers, which are exact everywhere.

fn keep(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ params.zero);
}

fn divide(a: f32, b: f32) -> f32 {
    if abs(a) < LEAST || abs(b) < LEAST {
        return 0.0;
    }
    let x = significand(a);
    let y = significand(b);
    let less = select(0u, 1u, x < y);
    let n = x << less;
    let q = quotient_digits(n, y, f32(n) / f32(y));
    let sign = (bitcast<u32>(a) ^ bitcast<u32>(b)) & SIGN;
    return assemble(sign, biased_exponent(a) - biased_exponent(b) + 127 - i32(less), q);
}

fn root(x: f32) -> f32 {
    if x < LEAST {
        return 0.0;
    }
    let exponent = biased_exponent(x);
    let odd = 1u - (u32(exponent) & 1u);
    let n = significand(x) << odd;
    let s = root_digits(n, sqrt(f32(n) * 8388608.0));
    return assemble(0u, 127 + (exponent - 127 - i32(odd)) / 2, s);
}
