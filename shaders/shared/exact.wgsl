// Arithmetic whose bits do not depend on the device. Twin: src/math/exact.rs
//
// Vulkan rounds +, - and * correctly, but a driver may fuse and reorder them, and its division and square root may be
// some units in the last place off. `keep`, `divide` and `root` stand in arithmetic_guarded.wgsl, for any device, and in
// arithmetic_plain.wgsl, for software that the self-test has found to do neither.
// Numbers below LEAST may be flushed by a device: a kernel calls `flush` where an underflow could come up.

const LEAST: f32 = 0x1p-125f;
const LEAST_FACTOR: f32 = 0x1p-48f;
const LEAST_SUM: f32 = 0x1p-96f;
const GREATEST_BITS: u32 = 0x7f7fffffu;
const IMPLICIT_BIT: u32 = 0x800000u;
const FRACTION: u32 = 0x7fffffu;
const SIGN: u32 = 0x80000000u;
const ROOT_HALF: i32 = 0x3f3504f3;
const PI: f32 = 0x1.921fb6p+1f;
const HALF_PI: f32 = 0x1.921fb6p+0f;

fn add(a: f32, b: f32) -> f32 {
    return keep(a + b);
}

fn sub(a: f32, b: f32) -> f32 {
    return keep(a - b);
}

fn mul(a: f32, b: f32) -> f32 {
    return keep(a * b);
}

fn flush(x: f32, least: f32) -> f32 {
    return select(x, 0.0, abs(x) < least);
}

fn biased_exponent(x: f32) -> i32 {
    return i32((bitcast<u32>(x) >> 23u) & 0xffu);
}

fn significand(x: f32) -> u32 {
    return (bitcast<u32>(x) & FRACTION) | IMPLICIT_BIT;
}

// `digits` is in 2^23 ..= 2^24, the upper end by a carry out of rounding.
fn assemble(sign: u32, exponent: i32, digits: u32) -> f32 {
    let biased = exponent + i32(digits >> 24u);
    if biased < 2 {
        return 0.0;
    }
    if biased > 254 {
        return bitcast<f32>(sign | GREATEST_BITS);
    }
    return bitcast<f32>(sign | (u32(biased) << 23u) | (digits & FRACTION));
}

// n·2²³ / y to 24 digits, correctly rounded, for n / y in [1, 2). The guess at n / y may be dozens of units off: the
// remainder is still far below 2³¹ and comes out of wrapping arithmetic exactly.
fn quotient_digits(n: u32, y: u32, guess: f32) -> u32 {
    var q = u32(guess * 8388608.0);
    var r = bitcast<i32>((n << 23u) - q * y);
    let step = i32(floor(f32(r) / f32(y)));
    q = q + bitcast<u32>(step);
    r = r - step * i32(y);
    if r < 0 {
        q = q - 1u;
        r = r + i32(y);
    }
    if r >= i32(y) {
        q = q + 1u;
        r = r - i32(y);
    }
    // A quotient of 24-bit numbers is never half-way between two.
    if 2 * r > i32(y) {
        q = q + 1u;
    }
    return q;
}

// √(n·2²³) to 24 digits, correctly rounded, for n in 2²³ .. 2²⁵, from a guess that may be dozens of units off.
fn root_digits(n: u32, guess: f32) -> u32 {
    var s = u32(guess);
    var r = bitcast<i32>((n << 23u) - s * s);
    let step = i32(floor(f32(r) / f32(2u * s)));
    r = r - step * (2 * i32(s) + step);
    s = s + bitcast<u32>(step);
    if r < 0 {
        s = s - 1u;
        r = r + 2 * i32(s) + 1;
    }
    if r > 2 * i32(s) {
        r = r - 2 * i32(s) - 1;
        s = s + 1u;
    }
    // (s + ½)² is no integer, so the root is never half-way either.
    if r > i32(s) {
        s = s + 1u;
    }
    return s;
}

fn log2(x: f32) -> f32 {
    // x = 2ᵏ(1 + f).
    let above = bitcast<i32>(x) - ROOT_HALF;
    let k = f32(above >> 23u);
    let f = sub(bitcast<f32>((above & 0x7fffff) + ROOT_HALF), 1.0);
    var p = 0.12583701f;
    p = add(mul(p, f), -0.20726973);
    p = add(mul(p, f), 0.2157156);
    p = add(mul(p, f), -0.23894483);
    p = add(mul(p, f), 0.28791624);
    p = add(mul(p, f), -0.36070368);
    p = add(mul(p, f), 0.48091063);
    p = add(mul(p, f), -0.72134733);
    p = add(mul(p, f), 1.442695);
    let logarithm = add(k, mul(p, f));
    return select(logarithm, 0.0, x < LEAST);
}

fn arccot(x: f32) -> f32 {
    let is_wide = abs(x) <= 1.0;
    let y = select(divide(1.0, x), x, is_wide);
    let s = mul(y, y);
    var p = 0.0028498883f;
    p = add(mul(p, s), -0.016068624);
    p = add(mul(p, s), 0.04269151);
    p = add(mul(p, s), -0.07504294);
    p = add(mul(p, s), 0.10640933);
    p = add(mul(p, s), -0.14203644);
    p = add(mul(p, s), 0.1999262);
    p = add(mul(p, s), -0.33333072);
    p = add(mul(p, s), 1.0);
    let arc = mul(y, p);
    let of_narrow = select(arc, add(PI, arc), x < 0.0);
    return select(of_narrow, sub(HALF_PI, arc), is_wide);
}

fn add3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(add(a.x, b.x), add(a.y, b.y), add(a.z, b.z));
}

fn sub3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(sub(a.x, b.x), sub(a.y, b.y), sub(a.z, b.z));
}

fn mul3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(mul(a.x, b.x), mul(a.y, b.y), mul(a.z, b.z));
}

fn scale3(a: vec3f, s: f32) -> vec3f {
    return vec3f(mul(a.x, s), mul(a.y, s), mul(a.z, s));
}

fn flush3(a: vec3f, least: f32) -> vec3f {
    return vec3f(flush(a.x, least), flush(a.y, least), flush(a.z, least));
}

fn dot3(a: vec3f, b: vec3f) -> f32 {
    return add(add(mul(a.x, b.x), mul(a.y, b.y)), mul(a.z, b.z));
}

fn cross3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(
        sub(mul(a.y, b.z), mul(a.z, b.y)),
        sub(mul(a.z, b.x), mul(a.x, b.z)),
        sub(mul(a.x, b.y), mul(a.y, b.x)),
    );
}

struct Sym3 {
    xx: f32,
    xy: f32,
    xz: f32,
    yy: f32,
    yz: f32,
    zz: f32,
}

fn outer(n: vec3f) -> Sym3 {
    return Sym3(mul(n.x, n.x), mul(n.x, n.y), mul(n.x, n.z), mul(n.y, n.y), mul(n.y, n.z), mul(n.z, n.z));
}

fn sym_add(a: Sym3, b: Sym3) -> Sym3 {
    return Sym3(
        add(a.xx, b.xx), add(a.xy, b.xy), add(a.xz, b.xz), add(a.yy, b.yy), add(a.yz, b.yz), add(a.zz, b.zz),
    );
}

fn sym_sub(a: Sym3, b: Sym3) -> Sym3 {
    return Sym3(
        sub(a.xx, b.xx), sub(a.xy, b.xy), sub(a.xz, b.xz), sub(a.yy, b.yy), sub(a.yz, b.yz), sub(a.zz, b.zz),
    );
}

fn sym_scale(a: Sym3, s: f32) -> Sym3 {
    return Sym3(mul(a.xx, s), mul(a.xy, s), mul(a.xz, s), mul(a.yy, s), mul(a.yz, s), mul(a.zz, s));
}

fn sym_mul(m: Sym3, v: vec3f) -> vec3f {
    return vec3f(
        dot3(vec3f(m.xx, m.xy, m.xz), v),
        dot3(vec3f(m.xy, m.yy, m.yz), v),
        dot3(vec3f(m.xz, m.yz, m.zz), v),
    );
}

fn trace(m: Sym3) -> f32 {
    return add(add(m.xx, m.yy), m.zz);
}

fn cofactors(m: Sym3) -> Sym3 {
    return Sym3(
        sub(mul(m.yy, m.zz), mul(m.yz, m.yz)),
        sub(mul(m.xz, m.yz), mul(m.xy, m.zz)),
        sub(mul(m.xy, m.yz), mul(m.xz, m.yy)),
        sub(mul(m.xx, m.zz), mul(m.xz, m.xz)),
        sub(mul(m.xy, m.xz), mul(m.xx, m.yz)),
        sub(mul(m.xx, m.yy), mul(m.xy, m.xy)),
    );
}

fn sym_det(m: Sym3, c: Sym3) -> f32 {
    return add(add(mul(m.xx, c.xx), mul(m.xy, c.xy)), mul(m.xz, c.xz));
}
